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

BESIDE, OFF_RATE, BORDERS_LEAST = 4, 0.12, 2
"""Rows on either side of one from which on the rate is another; how far two velocities may be from a whole
ratio, share of it; fewest such places that are told: of 570 clean logs none had one."""

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


def require_every_row(where: str, position_rad: np.ndarray, step_s: np.ndarray) -> tuple[str, ...]:
    """Refuse a position (n,) from which rows are missing again and again; `step_s` (n - 1,) are the
    times between its rows (or rows). What it gives is the warning of rows that are missing in stretches.

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
    return _of_another_rate(where, position_rad, step_s)


def _of_another_rate(where: str, position_rad: np.ndarray, step_s: np.ndarray) -> tuple[str, ...]:
    """The warning that rows come at half the rate, or less, in some stretches of a position, under stamps
    that go on evenly: there the velocity is twice as large, or half as large, from one row to the next, which
    no joint does again and again; arguments as of `require_every_row`."""
    speed = np.diff(position_rad) / step_s
    if len(speed) <= 2 * BESIDE:
        return ()
    windows = np.lib.stride_tricks.sliding_window_view(speed, BESIDE)
    mean = windows.mean(axis=1)
    steady = np.abs(windows - mean[:, None]).max(axis=1) < STEADY * np.abs(mean)
    steady &= np.abs(mean) * np.median(step_s) > COUNTS * quantum(position_rad)
    # a row between them is of either rate, or of both
    before, after = windows[: -BESIDE - 1, -2:].mean(axis=1), windows[BESIDE + 1 :, :2].mean(axis=1)
    both = steady[: -BESIDE - 1] & steady[BESIDE + 1 :] & (before * after > 0)
    times = np.where(both, after / np.where(both, before, 1.0), 1.0)
    ways = np.maximum(times, 1 / times)
    far = ways > 1 + 2 * OFF
    border = far & (np.abs(ways / np.round(ways) - 1) < OFF_RATE)
    # one place may be seen from two rows, of which the further is beside the ratio
    place = np.cumsum(far & ~np.concatenate([[False], far[:-1]]))
    places = len(np.unique(place[border]))
    others = int(place[-1]) - places
    if places < BORDERS_LEAST or places <= 2 * others:
        return ()
    first = int(np.flatnonzero(border)[0])
    return (
        f"{where}: rows come at 1/{np.median(np.round(ways[border])):.0f} of the rate in some stretches: at "
        f"{places} places, the first about row {first + BESIDE + 2}, the speed is {times[first]:.2g} times "
        "that of before, and the stamps do not say so: inertia and friction are of no joint; record with the "
        "stamps of the device",
    )
