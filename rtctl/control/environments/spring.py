"""A spring to both sides of its rest angle."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rtctl.control.environments.kind import CENTER, STIFFNESS, Kind

if TYPE_CHECKING:
    from hw.record_fields import Record

ABOUT = Kind(
    meaning="A spring that pulls to its place.",
    force="k (p - c)",
    solution="p = (w + k c)/(A + k)",
    parameters={STIFFNESS: "k", CENTER: "rest angle"},
    linear=True,
)


def proxy(s: Record, axis: int, drive: float, stiffness: float, before: float, dt: float) -> float:
    """Where spring and coupling are in balance."""
    k = s.world_stiffness_nm_rad[axis]
    return (drive + k * s.world_center_rad[axis]) / (stiffness + k)


def energy(s: Record, axis: int, k: float, center: float, proxy: float) -> float:
    """Energy: k (p - c)^2 / 2."""
    offset = proxy - center
    return 0.5 * k * offset * offset


def stretch(s: Record, axis: int, center: float) -> float:
    """X - c."""
    return s.position_rad[axis] - center
