"""A proxy that a renderer moves, by its position and velocity; the law is in `targets`."""

from rtctl.control.environments.kind import Kind

ABOUT = Kind(
    meaning="A renderer moves the proxy.",
    force="the coupling's",
    solution="the renderer moves p itself, section 3.3",
    parameters={},
    active=True,
)
