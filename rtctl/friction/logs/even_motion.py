"""What a motion at even speeds tells of a joint: its friction at these speeds, and of everything else how
large it may be.

To and fro at constant speeds the joint accelerates at the turns alone, where its bristles bend. So inertia,
and with one speed the share of viscous friction, are not in the rows that slide: no least squares makes them
of noise. Friction at the speeds is (docs/theory.md 9.8)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.logs.intervals import Estimate
from rtctl.friction.logs.regressors import Regressors

DROWNED = 0.9
"""Share of the acceleration, by power, that is noise of the position, from which on it tells no inertia."""

SPEEDS_APART = 1.5
"""Ratio of the speeds, the ninth tenth over the first, from which on Coulomb and viscous friction are told
apart."""


class TooEvenError(DataError):
    """A motion that does not tell its parameters apart."""


def require_acceleration(signals: Regressors) -> None:
    """Refuse a motion whose acceleration is that of the steps of its position.

    Raises
    ------
    TooEvenError
        Says how much of it."""
    if signals.inertia_short > DROWNED:
        raise TooEvenError(
            f"{signals.source}: {100 * min(1.0, signals.inertia_short):.0f} % of the acceleration, by "
            "power, is noise of the position; record brisker motion, or more digits"
        )


def told_apart(signals: Regressors, columns: Mapping[str, np.ndarray]) -> tuple[dict[str, np.ndarray], ...]:
    """The columns that a motion at even speeds may tell, richest first: without the inertia, and without
    viscous friction."""
    speed = np.abs(signals.velocity_rad_s[signals.sliding])
    low, high = np.quantile(speed, [0.1, 0.9])
    # richest first: who can be told is not taken for unknown
    steady = {name: column for name, column in columns.items() if name != "inertia_kgm2"}
    plain = {name: column for name, column in steady.items() if not name.startswith("viscous")}
    return (steady, plain) if high > SPEEDS_APART * low else (plain,)


def largest_inertia(signals: Regressors, friction: float) -> float:
    """The most an inertia can be: the torque that there was, and `friction` (N m), moved it at its turns,
    (largest torque + friction)/largest acceleration."""
    # about the median, since a zero that is off moves nothing; all rows, since it is the turns that
    # accelerate
    torque = np.abs(signals.torque_nm - np.median(signals.torque_nm))
    acceleration = np.abs(signals.acceleration_rad_s2)
    # friction adds to the motor where the joint brakes, so that both may have moved it
    # quantiles: one spike of the acceleration would bound the inertia far below what it is
    return (float(np.quantile(torque, 0.99)) + friction) / max(float(np.quantile(acceleration, 0.99)), 1e-12)


def completed(
    found: Mapping[str, Estimate], names: tuple[str, ...], signals: Regressors
) -> dict[str, Estimate]:
    """The parameters `names` in their order; what was not `found` is 0 with an interval up to the most it can
    be.

    All of the friction may be viscous."""
    # the far ends: what is not told may be all that these intervals allow
    levels = [abs(each.high) for name, each in found.items() if name.startswith(("coulomb", "level"))]
    friction, speed = max(levels), float(np.median(np.abs(signals.velocity_rad_s[signals.sliding])))
    most = {"inertia": largest_inertia(signals, friction), "viscous": friction / speed}
    filled = {}
    for name in names:
        kind = name.split("_")[0]
        filled[name] = (
            found[name] if name in found else Estimate(0.0, most[kind], 0.0, most[kind], most[kind])
        )
        if kind in ("coulomb", "level") and not any(each.startswith("viscous") for each in found):
            filled[name] = replace(found[name], **_down_to_zero(found[name]))
    return filled


def _down_to_zero(friction: Estimate) -> dict[str, float]:
    """The interval of a friction of which all may be viscous."""
    return {"low": min(friction.low, 0.0), "high": max(friction.high, 0.0)}


def said(signals: Regressors, found: Mapping[str, Estimate]) -> str:
    """The warning: what this motion tells, and what to record for the rest."""
    speed = np.abs(signals.velocity_rad_s[signals.sliding])
    viscous = any(name.startswith("viscous") for name in found)
    unknown = "the inertia" if viscous else "the inertia, and how much of the friction is viscous, are"
    rest = "is not told by it: 0 stands for it" if viscous else "not told by it: 0 stands for both"
    return (
        f"{signals.source}: motion at even speeds: the friction at {speed.min():.3g} to {speed.max():.3g} "
        f"rad/s is in this log, and its points are as good as any; {unknown} {rest}, and the interval is "
        "all that it can be; record brisk motion of changing speed, and strokes of several speeds, besides"
    )
