"""Rows that are not one after the other of one axis: two axes or devices in turn, and a slower log brought to
a higher rate by holding its rows, or by straight lines between them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hw.playback.quantum import quantum
from rtctl.errors import DataError

AXES_MOST = 8
"""Most axes that are looked for in turn."""

NEARER = 10.0
"""Rows of several axes in turn: a row is so many times nearer to the last one of its axis than to the one
before it (medians)."""

HELD_MIN = 1.9
"""Fewest rows for which a value stands that is held."""

# runs of equal length, the rule before, are of 3 and 4 at a ratio of 3.33 (decision 0092)
FAR = 2.5
"""Steps of its column that a value goes at once to be told from the next count of an encoder,"""

FAR_LEAST = 40
"""how many such there are at least,"""

ALONE = 0.95
"""and the share of them beside which the column stands still: whatever moves so far in a row moves on."""

UNEVEN, UNEVEN_SHARE = 1.3, 0.5
"""How far from even, rows or share of the time between two, the values of a slower device may come."""

JUST = 0.01
"""Rows by which a time that was found may be off."""

STRAIGHT = 1e-3
"""Largest change of slope within a straight line, share of the usual one where two meet;"""

DIGITS = 4.0
"""and in steps of the column, whose last digit is rounded in three rows."""

SLOPES = 0.5
"""Least share of the rows within lines in which the column goes on: an encoder between two counts stands."""

OF_ONE = 0.98
"""Share of the changes of a column that are with those of another where both are held together."""


@dataclass(frozen=True)
class Hold:
    """A column whose every value stands for `times` rows: when each was taken, shape (m,), and the row from
    which it stands; `drawn` where straight lines go from each to the next instead. A time is in rows, of an
    even log the row's number (fractions too)."""

    times: float
    taken: np.ndarray
    row: np.ndarray
    drawn: bool = False

    def with_it(self, column: np.ndarray, at: np.ndarray) -> Hold | None:
        """The same hold of another column, if that changes with this one: one of few levels is not told by
        itself."""
        changes = np.flatnonzero(np.diff(column)) + 1
        late = at[changes] - self.taken[np.searchsorted(self.taken, at[changes] + JUST, side="right") - 1]
        if not len(changes) or float(np.mean((late > -JUST) & (late < 1))) < OF_ONE:
            return None
        return replace(self, row=np.searchsorted(at, self.taken - JUST).clip(0, len(at) - 1))

    def told(self, rate: str) -> str:
        """What was found, and done; `rate` is that of the values, in brackets."""
        if self.drawn:
            return (
                f"straight lines between values {self.times:.3g} rows apart{rate}: it is of a slower device, "
                "and was filled in by interpolation: a curve through these values"
            )
        return (
            f"nearly every value stands for {self.times:.3g} rows{rate} while another column changes: it is "
            "of a slower bus, and held: a curve through the first of each"
        )

    def between(self, column: np.ndarray, at: np.ndarray) -> np.ndarray:
        """A smooth curve through the values when they were taken, at the times of the rows."""
        from scipy.interpolate import CubicSpline

        # not beyond the first and the last value: a cubic goes anywhere there
        inside = (at >= self.taken[0]) & (at <= self.taken[-1])
        return np.where(inside, CubicSpline(self.taken, column[self.row])(at), column)


def require_one_axis(where: str, position_rad: np.ndarray) -> None:
    """Refuse a position of several axes in turn.

    Raises
    ------
    DataError
        Says how many, and what to do."""
    # over one row, two rows, and so on: of n axes in turn the n-th is the first of the same axis
    moves = [float(np.median(np.abs(position_rad[n:] - position_rad[:-n]))) for n in range(1, AXES_MOST + 1)]
    # medians: some rows that were lost or doubled hide nothing
    axes = int(np.argmin(moves)) + 1
    # a joint goes further in two rows than in one: only where axes take turns a later row is nearer by far
    if axes > 1 and moves[axes - 1] * NEARER < moves[0]:
        raise DataError(
            f"{where}: column position: every row goes on from the one {axes} rows before it and not from "
            f"the last: rows of {axes} axes or devices in turn; keep the rows of one (and their stamps), or "
            "export a column for each"
        )


def hold(column: np.ndarray, at: np.ndarray | None = None) -> Hold | None:
    """How a slower device's column was brought to the rows of a log; None where it was not. `at` are the
    times of the rows, in rows; None: of an even log.

    An encoder that turns slowly repeats its counts, too, but it goes on by one of them: a value that goes far
    at once, and stands still before and behind that, is no motion, and comes at even times."""
    step = np.abs(np.diff(column))
    changes = np.flatnonzero(step) + 1
    if len(changes) < FAR_LEAST:
        return None
    at = np.arange(len(column), dtype=float) if at is None else at
    # a change in the very next row is motion: a held value stands for two rows at least
    quick = np.concatenate([[False], np.diff(changes) == 1])
    quick |= np.append(quick[1:], False)
    gaps = np.diff(at[changes])
    far = step[changes - 1] > FAR * quantum(column)
    if int(far.sum()) < FAR_LEAST or float(np.mean(~quick[far])) < ALONE:
        return None
    return _even(changes, at, gaps[far[1:] & far[:-1]])


def drawn(column: np.ndarray, at: np.ndarray) -> Hold | None:
    """The values of a slower device between which a column was interpolated, as pandas and numpy do; None
    where it was not. `at` as in `hold`.

    What is between two values is on a straight line, which no noise and no motion is for long."""
    slope = np.diff(column) / np.diff(at)
    bend = np.abs(np.diff(slope))
    if not bend.any():
        return None
    usual = float(np.quantile(bend, 0.99))
    # by the bends where lines meet, and by the last digit, which bends every line a little
    bent = bend > max(STRAIGHT * usual, DIGITS * quantum(column))
    # a value between two rows bends the line in both of them
    changes = np.flatnonzero(bent & ~np.append(False, bent[:-1])) + 1
    lines = ~bent
    if len(changes) < FAR_LEAST or lines.mean() < 1 / 3 or float(np.mean(slope[1:][lines] != 0)) < SLOPES:
        return None
    found = _even(changes, at, np.diff(at[changes]))
    if found is None:
        return None
    # the row itself: where two lines go on alike, no bend shows that a value was there
    row = np.searchsorted(at, found.taken + 0.5 - JUST).clip(0, len(at) - 1)
    return replace(found, taken=at[row], row=row, drawn=True)


def _even(changes: np.ndarray, at: np.ndarray, onward: np.ndarray) -> Hold | None:
    """The even times at which a column changes in those rows, if they are even; `onward` are the times
    between two that follow each other."""
    gaps = np.diff(at[changes])
    if not len(onward):
        return None
    # not counted by `bincount`, whose table is as long as the longest gap
    lengths, often = np.unique(np.round(onward), return_counts=True)
    times = float(onward[np.abs(onward - lengths[often.argmax()]) <= 1].mean())
    for few in (4, len(at)):  # a long rest is counted once the time between two is well known
        count = np.maximum(np.round(gaps / times), 1)
        times = float(gaps[count <= few].sum() / max(count[count <= few].sum(), 1))
    number = np.concatenate([[0], np.cumsum(count)]).astype(int)
    # by all of them: the mean of gaps rounds to whole rows where the log itself is even
    times = float(np.polyfit(number, at[changes], 1)[0])
    late = at[changes] - times * number
    # one value in a hundred may have been lost, or come late
    first, last = np.quantile(late, [0.01, 0.99])
    if times < HELD_MIN or last - first > max(UNEVEN, UNEVEN_SHARE * times):
        return None
    # values that stand in some row: none in a gap, which may last for days
    every = np.unique(np.floor((at - first) / times).astype(int).clip(-1, number[-1]))
    seen = np.searchsorted(number, every, side="right") - 1
    return Hold(times, first + times * every, np.where(seen < 0, changes[0] - 1, changes[seen]))
