"""Free space: nothing pushes on the proxy."""

from rtctl.control.environments.kind import Kind

ABOUT = Kind(
    meaning="Free space: nothing but what is left of the friction.",
    force="0",
    solution="p = w/A",
    parameters={},
    linear=True,
)
