"""Stamps that are none: they stand still, repeat themselves, go back or differ too much."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hw.interface import BackendError

SLOWEST_AND_FASTEST_HZ = (1.0, 1e6)
"""Rates beyond which the time is in another unit than it is read in."""

MAX_STEP_ERROR = 0.25
"""Largest deviation of one sampling step from the mean step, as a share of it."""


def require_rising(path: Path, time_s: np.ndarray) -> None:
    """Refuse stamps that do not rise.

    Raises
    ------
    BackendError
        Time that stands still, repeats itself or goes back, with how often and the first row."""
    steps = np.diff(time_s)
    if not np.ptp(time_s):
        raise BackendError(
            f"{path}: time does not increase: every row has the stamp {time_s[0]:.17g} s; export the time "
            "with more digits, or give the rate instead (--rate-hz)"
        )
    if not time_s[-1] > time_s[0]:
        row = int(np.argmax(steps <= 0)) + 2
        raise BackendError(
            f"{path}: time does not increase ({time_s[0]} s to {time_s[-1]} s), the first time in row "
            f"{row}; cut the rows that are not of the log, or map the column of the time"
        )
    same, back = np.flatnonzero(steps == 0), np.flatnonzero(steps < 0)
    if len(same):
        news = np.flatnonzero(
            steps > 0
        )  # whole steps of the clock: the rows before the first and behind the last are of parts of one
        rate = (
            (news[-1] - news[0]) / (time_s[news[-1] + 1] - time_s[news[0] + 1])
            if len(news) > 1
            else len(steps) / (time_s[-1] - time_s[0])
        )
        low, high = SLOWEST_AND_FASTEST_HZ
        unit = "" if low <= rate <= high else f"correct the unit of the time ({rate:.3g} rows a second now), "
        raise BackendError(
            f"{path}: {len(same)} duplicated timestamps, the first {time_s[same[0]]:.6g} s in rows "
            f"{same[0] + 1} and {same[0] + 2}; {unit}remove the repeated rows, or give the rate instead of "
            "the time column where only the clock is coarse"
            + ("" if unit else f" (--rate-hz {rate:.6g} is the mean)")
        )
    if len(back):
        k = back[0]
        raise BackendError(
            f"{path}: unsorted time: row {k + 2} ({time_s[k + 1]:.6g} s) is {-steps[k]:.6g} s before the "
            f"row above it ({len(back)} such rows); sort the log by time, or cut it where the clock was set "
            "back"
        )


def require_steady(path: Path, time_s: np.ndarray) -> None:
    """Refuse steps that a loop must not be fed with: rows lost, pauses, jitter beyond `MAX_STEP_ERROR`."""
    steps = np.diff(time_s)
    mean = (time_s[-1] - time_s[0]) / len(steps)
    uneven = np.flatnonzero(np.abs(steps - mean) > MAX_STEP_ERROR * mean)
    if len(uneven):
        k = uneven[0]
        raise BackendError(
            f"{path}: uneven sampling: row {k + 2} comes {steps[k]:.6g} s after the one before, "
            f"the mean step is {mean:.6g} s ({len(uneven)} such steps); "
            "the loop needs an even rate: resample the log"
        )
