"""A damper against the proxy's motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rtctl.control.environments.kind import DAMPING, Kind

if TYPE_CHECKING:
    from hw.record_fields import Record

ABOUT = Kind(
    meaning="A damper: resists speed.",
    force="b u, u the proxy's backward difference",
    solution="p = (w + (b/t) p_before)/(A + b/t)",
    parameters={DAMPING: "b"},
    linear=True,
)


def proxy(s: Record, axis: int, drive: float, stiffness: float, before: float, dt: float) -> float:
    """Where damper and coupling are in balance."""
    damping = s.world_damping_nms_rad[axis] / dt
    return (drive + damping * before) / (stiffness + damping)
