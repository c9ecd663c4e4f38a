"""Rows that are lost while the stamps go on evenly: the position then goes two rows' way, or more, in one."""

from __future__ import annotations

import numpy as np

from hw.playback.quantum import quantum
from rtctl.errors import DataError

MOST_LOST = 10
"""Most places at which rows may be missing."""

STEADY = 0.15
"""How far the two steps before and the two behind may be from their mean, share of it, for a place to be
looked at: motion, however brisk, does not double its velocity for one row of five."""

COUNTS = 8.0
"""Least steps of the encoder in a row there."""

OFF = 0.25
"""How far from the way of two rows, or more, a step may be."""


def lost(where: str, places: int, row: int, further: float) -> DataError:
    """What is said of rows that are missing at so many places, the first after `row`, where the position goes
    on by `further` rows' worth more."""
    return DataError(
        f"{where}: rows are missing at {places} places, the first after row {row} "
        f"(the position goes on by {further:.2g} rows' worth more "
        "there), and the stamps do not say so; record with the stamps of the device"
    )


def require_every_row(where: str, position_rad: np.ndarray, step_s: np.ndarray) -> None:
    """Refuse a position (n,) from which rows are missing again and again; `step_s` (n - 1,) are the
    times between its rows (or rows).

    Found before an outlier is looked for: of every tenth row that is lost the running median knows too
    little, and straight lines between the values of a slower device bend as often.

    Raises
    ------
    DataError
        Says how many, where, and what to do."""
    velocity = np.diff(position_rad) / step_s
    beside = np.stack([velocity[k : len(velocity) - 4 + k] for k in (0, 1, 3, 4)])
    mean = beside.mean(axis=0)
    steady = np.abs(beside - mean).max(axis=0) < STEADY * np.abs(mean)
    steady &= np.abs(mean) * np.median(step_s) > COUNTS * quantum(position_rad)
    times = np.where(steady, velocity[2:-2] / np.where(steady, mean, 1.0), 1.0)
    ways = np.round(times)
    some = np.flatnonzero((ways >= 2) & (np.abs(times - ways) < OFF))
    # noise, stamps that jitter and rows that come late go astray to both sides
    others = int(np.sum(np.abs(times - 1) > OFF)) - len(some)
    if len(some) > MOST_LOST and len(some) > 4 * others:
        raise lost(where, len(some), int(some[0]) + 3, float(times[some[0]]) - 1)
