"""Motion that is so quick that few rows are of it, and looks like a fault of them: strokes and turns."""

from __future__ import annotations

import numpy as np

OVERSHOOT = 0.25
"""Share of a change of velocity by which a servo may go beyond it."""

GRADUALLY = 2.0
"""By how much more than in the row before, or than brisk motion elsewhere in the log, the velocity may change
into an outlier, or out of it, and be motion: a stroke or a turn of few rows."""

BRISK = 0.99
"""Quantile of the changes of velocity of the rows beside no outlier that is brisk motion."""


def is_turn(velocity: np.ndarray, begin: int, end: int, reach: int, bound: float) -> bool:
    """Whether the velocity changes for good there: a turn too quick for the running median."""
    before, after = velocity[max(0, begin - 2 * reach) : begin], velocity[end + 1 : end + 1 + 2 * reach]
    # medians: rows of the turn itself are of neither side
    sides = float(np.median(before)), float(np.median(after))
    low, high = min(sides), max(sides)
    over = max(bound, OVERSHOOT * (high - low))
    between = (velocity[begin : end + 1] > low - over) & (velocity[begin : end + 1] < high + over)
    return high - low > bound and bool(between.all())


def brisk_change(velocity: np.ndarray, outlier: np.ndarray) -> float:
    """How much the velocity changes from row to row where motion is brisk, and beside no outlier."""
    # two rows to either side do not count: the jump itself is in their changes
    beside = np.convolve(outlier, np.ones(5), "same")[1:] > 0
    changes = np.abs(np.diff(velocity))[~beside]
    return float(np.quantile(changes, BRISK)) if len(changes) else 0.0


def comes_gradually(velocity: np.ndarray, begin: int, end: int, brisk: float) -> bool:
    """Whether the velocity goes to the outlier and back as motion does: a jump is there from one row to the
    next, and gone."""
    # two changes each way: motion is nearly as quick a row before, a jump comes from nothing
    before = np.abs(np.diff(velocity[begin - 2 : begin + 1]))
    after = np.abs(np.diff(velocity[end : end + 3]))[::-1]
    return all(last <= GRADUALLY * max(first, brisk) for first, last in (before, after))


def clusters(outlier: np.ndarray, reach: int) -> list[tuple[int, int]]:
    """First and last index of outliers that are at most `reach` apart."""
    at = np.flatnonzero(outlier)
    if not len(at):
        return []
    # outliers that are nearer than half a window have spoilt each other's median: they are one event
    breaks = np.flatnonzero(np.diff(at) > reach)
    firsts, lasts = at[np.concatenate([[0], breaks + 1])], at[np.concatenate([breaks, [len(at) - 1]])]
    return [(int(first), int(last)) for first, last in zip(firsts, lasts, strict=True)]
