"""What an admittance that is refused may be instead: numbers of one set, which pass together in hands, on dry
friction and while the joint sticks."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING

from rtctl.check.admittance_figures import heavier, judged
from rtctl.rounded import up

if TYPE_CHECKING:
    from rtctl.control.proofs.admittance_loop import AdmittanceLoop

GAINS = (1.0, 0.6, 0.35)
"""Shares of the velocity gain that are tried: less of it bears more delay, and shows no less mass."""
HELD = (1.0, 0.25, 0.0)
"""Shares of the position gain."""
HEAVIER = (1.0, 2.0, 4.0)
DAMPED = (1.0, 2.5, 6.0)
"""How many times the mass, and the damping over the mass, is what is asked for, or 1/s."""


@dataclass(frozen=True)
class Advice:
    """Keys of [axis.admittance] and what they may be, those alone that change; none where nothing that was
    tried passes."""

    keys: tuple[tuple[str, str], ...] = ()

    def words(self) -> str:
        """They, as they stand in a rig file."""
        return ", ".join(f"{key} = {value}" for key, value in self.keys)


@lru_cache(maxsize=64)
def passing_together(loop: AdmittanceLoop) -> Advice:
    """The set with the least change, by mass and damping first, that passes with every mass that may be asked
    for."""
    # the first that passes is the least change: the search ends with it
    tried = sorted(product(HEAVIER, DAMPED, GAINS, HELD), key=_change)
    # 81 sets at most, of which the quick questions of `_calmed` end most
    for mass, damped, gain, held in tried:
        if held < 1 and loop.position_gain_nm_rad == 0:  # the same set once more
            continue
        one = _changed(loop, mass, damped, gain, held)
        # judged once more as a whole: calming it has changed the loop
        if (found := _calmed(one)) is not None and judged(found).ok:
            return Advice(tuple(_told(loop, found)))
    return Advice()


def _change(shares: tuple[float, float, float, float]) -> float:
    """How much another thing a hand holds: a mass or damping counts what it is larger by, a gain less, a
    servo's spring least."""
    mass, damped, gain, held = shares
    return mass * damped / math.sqrt(gain) + 0.1 * (1 - held)


def _changed(loop: AdmittanceLoop, mass: float, damped: float, gain: float, held: float) -> AdmittanceLoop:
    from rtctl.control.proofs.admittance_margin import with_mass  # names must not load the compiler

    shown = float(up(mass * loop.mass_kgm2)) if mass > 1 else loop.mass_kgm2
    damping = loop.virtual_damping_nms_rad
    if mass * damped > 1:
        # b/m of 1/s at least: 0 could not be raised
        damping = float(up(mass * damped * max(damping, loop.mass_kgm2)))
    return replace(
        with_mass(loop, shown),
        mass_max_kgm2=loop.mass_max_kgm2 if loop.mass_max_kgm2 > shown else 0.0,
        virtual_damping_nms_rad=damping,
        velocity_gain_nms_rad=float(f"{gain * loop.velocity_gain_nms_rad:.3g}")
        if gain < 1
        else loop.velocity_gain_nms_rad,
        position_gain_nm_rad=float(f"{held * gain * loop.position_gain_nm_rad:.3g}")
        if held * gain < 1
        else loop.position_gain_nm_rad,
    )


def _calmed(loop: AdmittanceLoop) -> AdmittanceLoop | None:
    """The loop, with damping at rest where the joint that sticks needs it; None where it does not pass."""
    from rtctl.control.proofs import admittance_margin as margin
    from rtctl.control.proofs.admittance_sticking import calming_rest_damping, judge_stuck

    masses = (loop, *heavier(loop))
    # the quick questions first: most sets end here, and a whole grid takes a second
    if not all(margin.passes_stiffest(one) and margin.judge_rubbing(one, some=True)[0].ok for one in masses):
        return None
    if not margin.judge(loop).ok:
        return None
    if loop.bristle_nm_rad == 0 or all(judge_stuck(one).ok for one in masses):
        return loop
    needed = [calming_rest_damping(one) for one in masses]
    return replace(loop, rest_damping_nms_rad=float(up(max(needed)))) if all(needed) else None


def _told(loop: AdmittanceLoop, found: AdmittanceLoop) -> list[tuple[str, str]]:
    names = (
        ("mass_kgm2", "mass_kgm2"),
        ("damping_nms_rad", "virtual_damping_nms_rad"),
        ("velocity_gain_nms_rad", "velocity_gain_nms_rad"),
        ("position_gain_nm_rad", "position_gain_nm_rad"),
        ("rest_damping_nms_rad", "rest_damping_nms_rad"),
    )
    return [
        (key, f"{getattr(found, name):g}")
        for key, name in names
        if getattr(found, name) != getattr(loop, name)
    ]
