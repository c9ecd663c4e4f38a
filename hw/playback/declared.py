"""A recording drives nothing: no torque of its comes late."""

from __future__ import annotations

from hw.interface import ForceSensor, Options, Rig, Timing


def timing(options: Options, rig: Rig) -> list[Timing]:
    """No delay: nothing answers."""
    return [Timing()] * rig.n_axes


def force(options: Options, rig: Rig) -> ForceSensor:
    """No filter: nothing answers it."""
    return ForceSensor()
