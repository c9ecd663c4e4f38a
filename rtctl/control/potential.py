"""Energy that the environment in force stores: what its motion may give back, and what changing it costs."""

from __future__ import annotations

from rtctl.control.detents import detent_energy
from rtctl.control.jit import compiled
from rtctl.control.records import Record
from rtctl.control.vocabulary import Environment

_SPRING = int(Environment.SPRING)
_WALL = int(Environment.WALL)
_DETENTS = int(Environment.DETENTS)


@compiled
def environment_energy(s: Record, axis: int, proxy: float) -> float:
    """Potential energy of the environment in force with the proxy at `proxy`, J, >= 0."""
    return potential(s, axis, s.world_stiffness_nm_rad[axis], s.world_center_rad[axis], proxy)


@compiled
def potential(s: Record, axis: int, k: float, center: float, proxy: float) -> float:
    """Potential energy at `proxy` with this stiffness and centre, J, >= 0."""
    kind = s.world_kind[axis]
    offset = proxy - center
    if kind == _SPRING:
        return 0.5 * k * offset * offset
    if kind == _WALL:
        depth = max(offset if s.world_side[axis] >= 0 else -offset, 0.0)
        return 0.5 * k * depth * depth
    if kind == _DETENTS:
        return detent_energy(offset, k, s.world_pitch_rad[axis])
    return 0.0
