"""Folds of a cross-validation in blocks: what belongs together is held out together.

Shuffled folds put a point's neighbour, or its repeat, in the training set, and then reward over-fitting.
Points that are means of many measurements are held out by speed. Samples of a log are held out by time: what
was measured just before and after one shares its temperature, its place and its noise, whatever the speed.
"""

from __future__ import annotations

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.points.measured import FrictionPoints

FOLDS = 5
TRAINS = -1
"""Fold of points that always train."""

WAYS = ("speed", "time")
"""What may be held out together."""


def way_for(points: FrictionPoints, wanted: str = "auto") -> str:
    """Way of `WAYS` to hold these points out: the wanted one, or the one they ask for ("auto").

    Raises
    ------
    DataError
        "time" is wanted, and not every point has a time.
    """
    timed = points.time_s is not None and bool(np.isfinite(points.time_s).all())
    if wanted == "time" and not timed:
        raise DataError(
            f"{points.source}: folds by time need the column time_s with a number in every row; "
            "add it, or use --folds speed"
        )
    if wanted != "auto":
        return wanted
    single = bool((np.isnan(points.count) | (points.count <= 1)).all())
    return "time" if timed and single else "speed"


def describe(points: FrictionPoints, way: str) -> str:
    """Say in a sentence how the points were held out, and what for."""
    if way == "time":
        return f"Held out in {FOLDS} stretches of time: neighbours in time are alike, whatever their speed."
    known = "" if points.time_s is None else " (time_s is there; --folds time holds out by it)"
    return f"Held out in {FOLDS} folds by speed, all points of one speed together{known}."


def folds_of(points: FrictionPoints, directions: tuple[int, ...], way: str) -> np.ndarray:
    """Fold of each point of one direction, or of both one after the other, in the order of `branch`.

    By time, the lowest and the highest speed train always too: the model is never used beyond them.
    """
    rows = np.concatenate([points.rows_of(direction) for direction in directions])
    speed = np.abs(points.velocity_rad_s[rows])
    if way != "time" or points.time_s is None:
        return folds_by_speed(speed)
    ends = (speed == speed.min()) | (speed == speed.max())
    fold: np.ndarray = np.where(ends, TRAINS, folds_by_time(points.time_s[rows]))
    return fold


def folds_by_speed(speed: np.ndarray, n_folds: int = FOLDS) -> np.ndarray:
    """Fold of each point, shape (n,): all points of one speed share it; `TRAINS` at both ends.

    The lowest and highest speed always train: the model is never used beyond them, and break-away at v = 0
    cannot be guessed from motion.

    Raises
    ------
    DataError
        Fewer than 4 different speeds.
    """
    levels, block = np.unique(speed, return_inverse=True)
    if len(levels) < 4:
        raise DataError(f"{len(levels)} different speeds, at least 4 are needed; measure more speeds")
    end = (block == 0) | (block == len(levels) - 1)
    fold: np.ndarray = np.where(end, TRAINS, block % min(n_folds, len(levels) - 2))
    return fold


def folds_by_time(time_s: np.ndarray, n_folds: int = FOLDS) -> np.ndarray:
    """Fold of each sample of a log, shape (n,): `n_folds` stretches of equal duration.

    Raises
    ------
    DataError
        Times that are not finite, or that leave a stretch empty.
    """
    time_s = np.asarray(time_s, dtype=float)
    if not np.isfinite(time_s).all() or not np.ptp(time_s) > 0:
        raise DataError("the times of the log are not finite or all the same; correct the time column")
    share = (time_s - time_s.min()) / np.ptp(time_s)
    fold: np.ndarray = np.minimum((share * n_folds).astype(int), n_folds - 1)
    if len(np.unique(fold)) < n_folds:
        raise DataError(f"a gap leaves one of {n_folds} stretches of the log empty; use a longer log")
    return fold
