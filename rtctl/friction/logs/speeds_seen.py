"""Which speeds a log holds, and what it means where slow ones are missing."""

from __future__ import annotations

from dataclasses import dataclass

from rtctl.friction.logs.dynamics import SAMPLES_MIN
from rtctl.friction.logs.regressors import Regressors

STRIBECK_RAD_S = 0.1
"""Friction rises towards rest below such speeds: Stribeck speeds of geared joints are .02 to .2 rad/s."""

LOW_SPEED_ROWS = 20
"""Fewest rows of a direction below it that say something about it."""


@dataclass(frozen=True)
class Speeds:
    """Speeds of the rows of one direction: how many, range, and how many below `STRIBECK_RAD_S`."""

    rows: int
    lowest_rad_s: float
    highest_rad_s: float
    low_speed_rows: int


def few_slow(signals: Regressors) -> tuple[str, ...]:
    """The warning that slow rows are missing, to tell Coulomb from viscous friction by."""
    # half of what a direction needs: slow rows of both together tell the line
    slow, below = signals.slow()
    if slow >= SAMPLES_MIN // 2:
        return ()
    return (
        f"{signals.source}: {slow} samples of slow motion only (below {below:.3g} rad/s): Coulomb and "
        "viscous friction are told apart by the faster motion; record slow motion too, or lower "
        "--speed-min-rad-s",
    )


def speeds(signals: Regressors) -> tuple[Speeds, Speeds]:
    """Speeds of the sliding rows, forwards and backwards."""
    v = signals.velocity_rad_s[signals.sliding]
    found = []
    for speed in (v[v > 0], -v[v < 0]):
        below = int((speed < STRIBECK_RAD_S * signals.radian).sum())
        found.append(Speeds(len(speed), float(speed.min()), float(speed.max()), below))
    return found[0], found[1]


def no_low_speed(signals: Regressors, both: tuple[Speeds, Speeds]) -> tuple[str, ...]:
    """What it means that a log has hardly any row in the range of the Stribeck peak."""
    lacking = [
        (name, each)
        for name, each in zip(("forwards", "backwards"), both, strict=True)
        if each.low_speed_rows < LOW_SPEED_ROWS
    ]
    if not lacking:
        return ()
    named = ", ".join(
        f"{each.low_speed_rows} {name}, slowest {each.lowest_rad_s:.3g} rad/s" for name, each in lacking
    )
    return (
        f"{signals.source}: hardly any sliding below {STRIBECK_RAD_S * signals.radian:.3g} rad/s ({named}): "
        "break-away and a Stribeck peak are not in this log, the Coulomb friction is what faster motion "
        "extrapolates to, and a model of these points says nothing about lower speeds; for those record "
        "slow, steady strokes, or run `rtctl identify CONFIG`",
    )
