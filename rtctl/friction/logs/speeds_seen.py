"""Which speeds a log holds, and what is said where slow ones are missing to part two kinds of friction."""

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
    # each way by itself: strokes may be quick one way and slow the other
    for speed in (v[v > 0], -v[v < 0]):
        below = int((speed < STRIBECK_RAD_S * signals.radian).sum())
        found.append(Speeds(len(speed), float(speed.min()), float(speed.max()), below))
    return found[0], found[1]


def below_the_slowest(signals: Regressors) -> tuple[str, ...]:
    """What a log with hardly a row in the range of the Stribeck peak cannot tell.

    No warning: logs of one joint with a peak and without look alike there (decision 0138)."""
    v = signals.velocity_rad_s[signals.sliding]
    if min(int((v > 0).sum()), int((v < 0).sum())) < SAMPLES_MIN:
        return ()  # the fit itself says what is missing
    lacking = [
        f"{each.lowest_rad_s:.3g} rad/s {name}"
        for name, each in zip(("forwards", "backwards"), speeds(signals), strict=True)
        if each.low_speed_rows < LOW_SPEED_ROWS
    ]
    if not lacking:
        return ()
    peak = f"{STRIBECK_RAD_S * signals.radian:.3g} rad/s"
    return (
        f"friction below the slowest sliding of the log ({', '.join(lacking)}): break-away and a Stribeck "
        f"peak, which is mostly below {peak}, are not in it, Coulomb friction is what faster motion "
        "extrapolates to, and a model of these points says nothing about lower speeds; for those record "
        "slow, steady strokes, or run `rtctl identify CONFIG`",
    )
