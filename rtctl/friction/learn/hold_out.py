"""Folds of a cross-validation in blocks: what belongs together is held out together.

Shuffled folds put a point's neighbour, or its repeat, in the training set, and then reward over-fitting.
Points that are means of many measurements are held out by speed. Samples of a log are held out by time: what
was measured just before and after one shares its temperature, its place and its noise, whatever the speed.
Where there are several logs, or a motion that was repeated, whole logs and whole laps are held out: another
session is what a model is for."""

from __future__ import annotations

import math

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.learn.laps import laps_of
from rtctl.friction.points import FrictionPoints, level_starts, levels_of

# ten, or one speed at a time, change no error by a tenth (decision 0037)
FOLDS = 5
TRAINS = -1
"""Fold of points that always train."""

STRETCHES = 4
"""Stretches of time in each fold: as many blocks, whose errors are alike within, has a standard error by
time."""

HELD_OUT = {
    "speed": "speeds",
    "time": "stretches of time",
    "log": "whole logs",
    "lap": "whole laps",
    "turn": "whole turns",
}
"""What may be held out together, in words."""

WAYS = tuple(HELD_OUT)


def way_for(points: FrictionPoints, wanted: str = "auto") -> str:
    """Way of `WAYS` to hold these points out: the wanted one, or the one they ask for ("auto").

    Raises
    ------
    DataError
        What is wanted cannot be told from the points: no times, one log, no laps, less than two turns."""
    if wanted != "auto":
        if wanted != "speed":
            units_of(points, wanted)
        return wanted
    # single samples of a log are alike in time; means of many measurements are alike in speed alone
    single = bool((np.isnan(points.count) | (points.count <= 1)).all())
    if several_logs(points):
        return "log"
    if single and _complete(points, "time_s"):
        # whole laps, since a lap's repeat beside it would vouch for whatever was learned of it
        return "time" if laps_of(points) is None else "lap"
    return "speed"


def describe(points: FrictionPoints, way: str) -> str:
    """Say in a sentence how the points were held out, and what for."""
    if way == "time":
        return f"Held out in {FOLDS} stretches of time: neighbours in time are alike, whatever their speed."
    if way != "speed":
        n = len(np.unique(units_of(points, way)))
        return (
            f"Held out in {min(n, FOLDS)} folds of {HELD_OUT[way]} ({n} of them): a model is for motions it "
            "has not seen."
        )
    known = "" if points.time_s is None else " (time_s is there; --folds time holds out by it)"
    return f"Held out in {FOLDS} folds by speed, all points of one speed together{known}."


def units_of(points: FrictionPoints, way: str) -> np.ndarray:
    """Number of what each point, of both directions, is held out with, shape (n,): its speed, stretch, log,
    lap or turn.

    Raises
    ------
    DataError
        As `way_for`."""
    if way == "speed":
        levels = levels_of(np.abs(points.velocity_rad_s))
        # the same speed the other way is another measurement
        return np.where(points.direction > 0, 2 * levels, 2 * levels + 1)
    need = {
        "time": ("time_s",),
        "log": ("log",),
        "lap": ("time_s", "position_rad"),
        "turn": ("position_rad",),
    }[way]
    for name in need:
        if not _complete(points, name):
            raise DataError(
                f"{points.source}: folds by {way} need the column {name} with a number in every row; "
                "add it, or use --folds speed"
            )
    if way == "time":
        return _stretches(points.columns["time_s"])
    if way == "lap":
        laps = laps_of(points)
        if laps is None:
            raise DataError(f"{points.source}: no motion repeats itself three times; use --folds time")
        return laps
    found = points.columns["log"] if way == "log" else np.floor(points.columns["position_rad"] / (2 * np.pi))
    # numbered from 0 without gaps: logs may be called 3 and 17
    units: np.ndarray = np.unique(found, return_inverse=True)[1]
    if units.max(initial=0) < 1:
        what = "column log: one log only" if way == "log" else "column position_rad: less than two turns"
        raise DataError(f"{points.source}: {what}; use --folds time or speed")
    return units


def _complete(points: FrictionPoints, name: str) -> bool:
    column = points.columns.get(name)
    return column is not None and bool(np.isfinite(column).all())


def several_logs(points: FrictionPoints) -> bool:
    """Whether there are logs to hold out, each with both directions: sessions."""
    # a row of no session would have to train always, and vouch for its own session where that is held out
    if not _complete(points, "log"):
        return False
    # of what is not left out: a log of which no point is used is no session
    numbers = [set(points.columns["log"][points.rows_of(direction)]) for direction in (1, -1)]
    # a log of one direction, held out, would judge a direction that it says nothing of
    return numbers[0] == numbers[1] and len(numbers[0]) > 1


def _stretches(time_s: np.ndarray) -> np.ndarray:
    """`FOLDS` times `STRETCHES` stretches of time, of equally many samples."""
    order = np.argsort(time_s, kind="stable")
    units = np.empty(len(time_s), dtype=int)
    # four to each fold of `folds_by_time`, wholly: a block that two folds share would be no block of either
    units[order] = np.arange(len(time_s)) * FOLDS * STRETCHES // len(time_s)
    return units


def folds_of(points: FrictionPoints, directions: tuple[int, ...], way: str) -> np.ndarray:
    """Fold of each point of one direction, or of both one after the other, in the order of `branch`.

    Whatever the way, the lowest and the highest speed train always: the model is never used beyond them. A
    point that is left out (`FrictionPoints.left_out`) keeps its place in the folds of the others."""
    rows = np.concatenate([points.rows_of(direction) for direction in directions])
    speed = np.abs(points.velocity_rad_s[rows])
    if way == "speed":
        # levels of all points, those that are left out, too: leaving one out must not move the folds of the
        # others (decision 0046)
        every = np.abs(points.velocity_rad_s[np.isin(points.direction, directions)])
        return folds_by_speed(speed, levels=level_starts(every))
    units = units_of(points, way)
    shared = folds_by_time(points.columns["time_s"]) if way == "time" else shared_out(units)
    ends = (speed == speed.min()) | (speed == speed.max())
    fold: np.ndarray = np.where(ends, TRAINS, shared[rows])
    return fold


# four pairs of five; with fewer all is as it was (decision 0130)
SAME_LEVELS = 0.8
"""Share of all pairs of a session and a speed that is measured where sessions are at the same speeds."""


def common_levels(speed: np.ndarray, session: np.ndarray) -> np.ndarray | None:
    """Level of each point's speed (`points.levels_of`), shape (n,); None where sessions are not measured at
    the same speeds, so that a session above the others cannot be told from friction that rises."""
    level = levels_of(speed)
    measured = np.unique([session, level], axis=1).shape[1]
    every = len(np.unique(session)) * len(np.unique(level))
    return level if measured >= SAME_LEVELS * every else None


def less_offsets(friction_nm: np.ndarray, level: np.ndarray, session: np.ndarray) -> np.ndarray:
    """Friction (N m) less what each session lies above all of them, over the speeds that all measured, shape
    (n,).

    A session of fewer than half the speeds is as it is, and moves no other: of one that is held out the ends
    train (`folds_of`), and would tell where it lies."""
    of = np.unique(session, return_inverse=True)[1]
    cell, shape = of * (level.max() + 1) + level, (of.max() + 1, level.max() + 1)
    count = np.bincount(cell, minlength=math.prod(shape)).reshape(shape)
    mean = np.bincount(cell, friction_nm, math.prod(shape)).reshape(shape) / np.maximum(count, 1)
    measured = count > 0
    # half of the speeds: less is what `folds_of` lets train of a session that is held out
    whole = 2 * measured.sum(axis=1) >= measured.any(axis=0).sum()
    # over speeds that all have: one of slow speeds lies above the others by friction, not by an offset
    common = measured[whole].all(axis=0)
    if not common.any():
        return friction_nm
    offset = np.where(whole, mean[:, common].mean(axis=1), 0.0)
    offset[whole] -= offset[whole].mean()
    left: np.ndarray = friction_nm - offset[of]
    return left


def shared_out(units: np.ndarray) -> np.ndarray:
    """Fold of each point, shape (n,): whole units, neighbours together, the folds of about equally many
    points."""
    names, unit, count = np.unique(units, return_inverse=True, return_counts=True)
    # by its middle: a large unit goes where most of it lies
    middle = np.cumsum(count) - 0.5 * count
    share = np.arange(len(names)) if len(names) <= FOLDS else (middle * FOLDS / count.sum()).astype(int)
    fold: np.ndarray = np.unique(share, return_inverse=True)[1][unit]
    return fold


def folds_by_speed(speed: np.ndarray, n_folds: int = FOLDS, levels: np.ndarray | None = None) -> np.ndarray:
    """Fold of each point, shape (n,): all points of one speed share it; `TRAINS` at both ends.

    The lowest and highest speed always train: the model is never used beyond them, and break-away at v = 0
    cannot be guessed from motion. `levels` are the lowest speeds of the levels to share out, rising; default
    those there are.

    Raises
    ------
    DataError
        Fewer than 4 different speeds."""
    own = level_starts(speed)
    if len(own) < 4:
        raise DataError(f"{len(own)} different speeds, at least 4 are needed; measure more speeds")
    levels = own if levels is None else levels
    block = levels_of(speed, levels)
    end = (block == block.min()) | (block == block.max())
    # neighbours in different folds: what is held out lies between speeds that train
    fold: np.ndarray = np.where(end, TRAINS, block % min(n_folds, len(levels) - 2))
    return fold


def folds_by_time(time_s: np.ndarray) -> np.ndarray:
    """Fold of each sample of a log, shape (n,): `FOLDS` stretches of equally many samples.

    Raises
    ------
    DataError
        Times that are not finite or all the same, or fewer samples than folds."""
    time_s = np.asarray(time_s, dtype=float)
    if not np.isfinite(time_s).all() or not np.ptp(time_s) > 0:
        raise DataError("the times of the log are not finite or all the same; correct the time column")
    if len(time_s) < FOLDS:
        raise DataError(f"{len(time_s)} samples, {FOLDS} stretches of time are needed; use a longer log")
    order = np.argsort(time_s, kind="stable")
    fold = np.empty(len(time_s), dtype=int)
    fold[order] = np.arange(len(time_s)) * FOLDS // len(time_s)
    return fold
