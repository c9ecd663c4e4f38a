"""A groove: a spring as far as its edge, and no stronger beyond."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rtctl.control.environments.kind import CENTER, STIFFNESS, Kind, Parameter, Slider

if TYPE_CHECKING:
    from hw.record_fields import Record

REACH = Parameter("reach_rad", "rad", 1e-3, 100, 0.1, (0.02, 0.3), Slider("reach", 0.02, 0.5, 0.1))

ABOUT = Kind(
    meaning="A groove: pulls to its place, and no stronger than at its edge.",
    force="k (p - c), and k times the reach beyond it",
    solution="of a spring, or a step of constant force",
    parameters={STIFFNESS: "k within the reach", CENTER: "its middle", REACH: "distance of the edges"},
)


def proxy(s: Record, axis: int, drive: float, stiffness: float, before: float, dt: float) -> float:
    """Where groove and coupling are in balance."""
    k, center, reach = s.world_stiffness_nm_rad[axis], s.world_center_rad[axis], s.world_reach_rad[axis]
    offset = (drive - stiffness * center) / (stiffness + k)
    if offset > reach:
        offset = (drive - k * reach) / stiffness - center
    elif offset < -reach:
        offset = (drive + k * reach) / stiffness - center
    return center + offset


def energy(s: Record, axis: int, k: float, center: float, proxy: float) -> float:
    """Energy: k d^2 / 2 within the reach r, k r (d - r / 2) beyond."""
    away, reach = abs(proxy - center), s.world_reach_rad[axis]
    inside = min(away, reach)
    return k * inside * (away - 0.5 * inside)


def stretch(s: Record, axis: int, center: float) -> float:
    """X - c: a spring without edges holds no less."""
    return s.position_rad[axis] - center
