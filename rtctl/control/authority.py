"""The authority rises no faster than the renderer's store pays for what that puts into the world felt.

The world that a hand feels is a U: authority a, energy U stored in the coupling and the environment. While
the authority rises by da it grows by U da that no hand brings: U was wound up while little or nothing of it
was felt. This is energy a hand is given like that of a step of the environment, so the same store pays for it
(`environments.changes`), and a rise that costs more than is there is taken in part:

    da <= 1/soft_start_ticks,     (U - FREE_SHARE budget) da <= store, on every axis

The small share lets a rig whose renderer may put in nothing at all (no store, no power) start where nothing
is stretched; with it or without, a port is granted what was paid and no more.

Without this a renderer has a source without end: it falls silent for `target_hold_ticks` and comes back, and
each return (HOLD to ACTIVE, authority from zero) gives out what its proxy or a hand that felt nothing had
wound up, 11.8 J within 8 s on the mock. A store of .1 J with 1 W pays for .6 J within a soft start of .5 s;
beyond, it takes longer."""

from __future__ import annotations

from rtctl.control.jit import compiled
from rtctl.control.records import Record

FREE_SHARE = 0.01
"""Share of the energy budget that the coupling may hold for nothing: an encoder count, a proxy not quite at
rest."""


@compiled
def affordable(s: Record, p: Record, axis: int, rise: float) -> float:
    """`rise` of a share of what is stored, as far as the axis's store pays for it; 0 where a number is
    NaN."""
    stored, left = s.stored_energy_j[axis] - FREE_SHARE * p.energy_budget_j, s.renderer_store_j[axis]
    # not: a product that is NaN is paid by nothing
    if not stored * rise <= left:
        return left / stored if left > 0.0 and stored > 0.0 else 0.0
    return rise


@compiled
def _paid_rise(s: Record, p: Record) -> float:
    """Share by which the authority may rise in this tick, >= 0; 0 where a number is NaN."""
    rise = min(1.0 - s.authority, 1.0 / max(p.soft_start_ticks, 1))
    for axis in range(len(s.stored_energy_j)):
        rise = affordable(s, p, axis, rise)  # one authority for all axes: the poorest store decides
    return rise


@compiled
def raise_authority(s: Record, p: Record) -> None:
    """One tick of the soft start, paid from the store of every axis; writes what each port is granted for
    it."""
    rise = _paid_rise(s, p)
    s.authority = min(1.0, s.authority + rise)
    for axis in range(len(s.stored_energy_j)):
        # min: what rises by the free share beyond the store is neither paid nor granted
        paid = min(rise * s.stored_energy_j[axis], s.renderer_store_j[axis]) if rise > 0.0 else 0.0
        s.renderer_store_j[axis] -= paid
        s.authority_grant_j[axis] = paid
