"""Why points that speak against a model do: the one reading of them under which the model fits, where there
is one."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from rtctl.friction.learn.warmth import TEMPERATURE_SPAN_K
from rtctl.friction.model import FrictionModel
from rtctl.friction.points import FrictionPoints

EXPLAINS, EXPLAINS_BEST = 0.3, 0.05
"""What a reading may leave of the error, RMS, share of it; and of the friction."""

SCALE_LEAST = 0.04
"""Least distance of a factor from 1 that is told."""

SPEEDS = {"rpm": 30 / math.pi, "deg/s": 180 / math.pi, "mrad/s": 1e3}
"""Unit that is taken for rad/s -> by what the numbers are too large; `words` makes mm/s of mrad/s."""


def cause(model: FrictionModel, points: FrictionPoints) -> str:
    """The reading that leaves least of the error, in words; "" where none explains it."""
    rows = np.concatenate([points.rows_of(way) for way in (1, -1)])
    v, f = points.velocity_rad_s[rows], points.friction_nm[rows] * points.direction[rows]
    # both directions together: a unit, a sign or a zero is one for all rows
    least, text = min(_readings(model, v, f))
    return text if least < EXPLAINS_BEST and least < EXPLAINS * _error(model, v, f) else ""


def warmer(model: FrictionModel, points: FrictionPoints) -> str:
    """How far the points are from the temperatures of the model, in words; "" where nobody measured both, or
    by less than `TEMPERATURE_SPAN_K`."""
    low, high = model.temperature_min_c, model.temperature_max_c
    if low is None or high is None or points.temperature_range_c is None:
        return ""
    mean = float(np.nanmean(points.columns["temperature_c"]))
    over_k = mean - min(max(mean, low), high)
    if abs(over_k) < TEMPERATURE_SPAN_K:
        return ""
    than = "warmer" if over_k > 0 else "colder"
    return (
        f"the points are of {mean:.0f} degC, {abs(over_k):.0f} K {than} than any the model was learned from "
        f"({low:.0f} to {high:.0f} degC), and friction changes with temperature: learn it from points of "
        "both, with the column temperature_c (the report then tells what a kelvin changes)"
    )


def _error(model: FrictionModel, v: np.ndarray, f: np.ndarray, most: float = 0.5) -> float:
    """RMS of model less friction (signed, N m) over the RMS of the friction, within the trained range;
    infinite where hardly a point lies in it."""
    inside = _inside(model, v)
    # a reading that throws most points out of the range fits the rest for nothing
    if inside.mean() < most:
        return math.inf
    wanted = np.sign(v[inside]) * model.magnitude(v[inside])
    return float(np.sqrt(np.mean((wanted - f[inside]) ** 2) / np.mean(f[inside] ** 2)))


def _inside(model: FrictionModel, v: np.ndarray) -> np.ndarray:
    most = [branch.speed_max_rad_s for branch in model.branches]
    return np.asarray((v != 0) & (v <= most[0]) & (v >= -most[1]))


def _readings(model: FrictionModel, v: np.ndarray, f: np.ndarray) -> Iterator[tuple[float, str]]:
    """Error of each reading, and what it is."""
    for unit, factor in SPEEDS.items():
        yield (
            _error(model, v / factor, f),
            f"the velocity looks as if it were in {unit}: read so, the model fits",
        )
    yield (
        _error(model, 2 * math.pi * v, f),
        "the velocity looks as if it were in rev/s: read so, the model fits",
    )
    yield _error(model, -v, -f), "the directions look swapped: with both signs turned the model fits"
    inside = _inside(model, v)
    wanted, given = np.sign(v[inside]) * model.magnitude(v[inside]), f[inside]
    # by least squares through 0: a torque constant has no offset
    factor = float(wanted @ given / max(float(wanted @ wanted), 1e-300))
    if factor > 0 and abs(factor - 1) > SCALE_LEAST:
        what = (
            "is it in mN m?"
            # a thousand within a root of 2: the friction may have changed as well
            if 0.7 < factor / 1000 < 1.4
            else "a unit, a torque constant, a gear, or friction that has changed as a whole (grease, "
            "temperature)"
        )
        yield (
            _error(model, v, f / factor),
            f"the friction is {factor:.3g} times the model's at all speeds: {what}",
        )
    # with the sign of the motion, as dry friction has it; a zero (below) has none
    dry = float(np.mean(np.sign(v[inside]) * (given - wanted))) if len(given) else 0.0
    if len(given) and abs(dry) > SCALE_LEAST * float(np.sqrt(np.mean(given**2))):
        yield (
            _error(model, v, f - np.sign(v) * dry),
            f"the dry friction is {dry:+.3g} N m off at all speeds, and what grows with speed is as it was: "
            "the friction has changed (grease, load, wear), or it is another joint",
        )
    zero = float(np.mean(given - wanted)) if len(given) else 0.0
    yield (
        _error(model, v, f - zero),
        f"the torque is {zero:.3g} N m off at all speeds and in both directions: its zero, a weight or a "
        "slope",
    )
