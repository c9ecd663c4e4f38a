"""Seeded bugs of a third reading of the house: what devices say of themselves, and files nobody had read."""

from __future__ import annotations

from seed import Seed

REGISTRY = ("tests/unit/hw/test_registry.py",)

SEEDS = (
    Seed(
        "a joint that a package declares is believed as it is",
        "hw/registry.py",
        "_rows(target, Joint, options, rig)",
        "list(_resolve(target)(options, rig))",
        REGISTRY,
    ),
    Seed(
        "a number that is none passes as one of a joint",
        "hw/registry.py",
        "isinstance(value, Real) and math.isfinite(value) and float(value) >= 0",
        "isinstance(value, Real) and not float(value) < 0",
        REGISTRY,
    ),
)
