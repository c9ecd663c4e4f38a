"""Columns of a regression that describe friction around a turn: by speed, late speed, acceleration, stop
operator, LuGre's bristle.

Each is (rows, 2 + number of Stribeck peaks): the direction forwards, backwards, and times each peak,
low-passed; by acceleration has each peak once more."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from rtctl.control.jit import compiled
from rtctl.friction.logs.turns import SHORTEST_RAD, STRIBECK_RAD_S, TurningPart, stop_operator


@compiled
def lugre_bristle(path_rad: np.ndarray, length_rad: float) -> np.ndarray:
    """LuGre's bristle over a path (n,), as a share of its end: s <- e + (s - e) exp(-|dx|/L), e = sgn dx."""
    found = np.zeros(len(path_rad))
    for row in range(1, len(path_rad)):
        dx = path_rad[row] - path_rad[row - 1]
        end = np.sign(dx)
        # the exact step of ds/dx, however long: Euler's would overshoot the end in a quick stroke
        found[row] = end + (found[row - 1] - end) * np.exp(-abs(dx) / length_rad)
    return found


Columns = Callable[[TurningPart, float], np.ndarray]
"""Columns of friction (rows, k) in the kept rows of a part, by the rung's parameter."""


def _of_direction(part: TurningPart, direction: np.ndarray, peaks: Sequence[np.ndarray]) -> np.ndarray:
    columns = [np.maximum(direction, 0.0), np.minimum(direction, 0.0), *(direction * peak for peak in peaks)]
    return part.smoothed(columns)


def by_speed(part: TurningPart, which: float, lag_s: float = 0.0) -> np.ndarray:
    """Friction by speed; its direction that of the filtered speed (`which` 0) or of the last movement seen
    (1).

    The filter moves a turn between two unlike strokes by some milliseconds, a coarse encoder shows it late:
    the log tells."""
    late = round(lag_s * part.rate_hz)
    speed = np.abs(part.motion[:, 1])
    # the speed of before alone: the direction turns over at once in all of these
    shifted = np.concatenate([np.full(late, speed[0]), speed[: len(speed) - late]])
    direction = (
        stop_operator(part.path_rad, SHORTEST_RAD * part.radian) if which else np.sign(part.motion[:, 1])
    )
    return _of_direction(
        part, direction, [np.exp(-((shifted / v) ** 2)) for v in np.multiply(STRIBECK_RAD_S, part.radian)]
    )


def by_late_speed(which: float, part: TurningPart, lag_s: float) -> np.ndarray:
    """Friction by speed, its Stribeck peaks late by `lag_s`, s."""
    return by_speed(part, which, lag_s)


def by_acceleration(which: float, part: TurningPart, _none: float = 0.0) -> np.ndarray:
    """Friction by speed and, near rest, in proportion to how fast the speed changes: other when it rises than
    when it falls.

    A regression over (|v|, a) with the kernel k(v, v')(1 + lambda a a') is a curve of speed plus a times
    another; here the peaks' shapes are the other. A part of it that does not depend on speed is inertia."""
    plain = by_speed(part, which)
    direction = (
        stop_operator(part.path_rad, SHORTEST_RAD * part.radian) if which else np.sign(part.motion[:, 1])
    )
    # the acceleration along the motion: above 0 while the speed rises, whichever way it goes
    change = direction * part.motion[:, 0]  # of abs(v), rad/s^2
    beside = [direction * change * peak for peak in part.peaks]
    return np.hstack([plain, part.smoothed(beside)])


def by_stop(part: TurningPart, length_rad: float) -> np.ndarray:
    """Friction whose direction is that of a stop operator."""
    return _of_direction(part, stop_operator(part.path_rad, length_rad), part.peaks)


def by_lugre(part: TurningPart, length_rad: float) -> np.ndarray:
    """Friction whose direction is that of LuGre's bristle."""
    return _of_direction(part, lugre_bristle(part.path_rad, length_rad), part.peaks)
