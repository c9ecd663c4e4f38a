"""From the stamps of a log to an even time grid: stretches without a gap, resampled where the sampling was
uneven.

A derivative of unevenly sampled positions is wrong by as much as the steps differ, so stamps are never
ignored. Stamps that only rounding keeps from being even (whole milliseconds of a 300 Hz log) are even."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from hw.interface import BackendError

# two lost rows make a step of 3; half a step more is jitter (`OFF_SHARE`)
GAP_STEPS = 3.5
"""A step longer than so many usual ones is a gap: what the joint did meanwhile is not known. Up to two lost
rows are interpolated."""

OFF_SHARE, MOST_OFF = 0.5, 0.3
"""A log is refused when more than this share of its steps is further off the usual step than `OFF_SHARE` of
it."""

# a velocity over one such step is wrong by as much
EVEN_SHARE = 1e-3
"""Stamps this close to an even grid, share of a step, are on it."""

ROUNDED_STEP = 1.01
"""Least step, units of the rounding, that rounding explains: what rounds differently from row to row shows a
lost row, which is a step off the line, so more than rounding is; steps of one unit do not."""

JITTER_SHARE = 6**-0.5
"""Largest RMS about a line of rounded stamps that are better taken from the line, share of the unit: rounding
alone makes 12^-1/2, so that the clock jitters by less than that."""

TOLD_APART = 3.0
"""Units in a step from which on every rounded step says how many rows it is long."""

BUNCHES_LEAST = 10
"""Fewest pauses that tell a log that arrived in bunches from one with pauses of its own."""

BUNCH_S = 0.05
"""Longest bunch of such a log: strokes that are as short tell nothing."""

MOST_DECIMALS = 9


@dataclass(frozen=True)
class Stretch:
    """Rows first..last - 1 of a log, without a gap, and the instants (s) of its even grid; `instants` None:
    its own rows."""

    first: int
    last: int
    stamps_s: np.ndarray
    instants_s: np.ndarray | None

    def signal(self, column: np.ndarray) -> np.ndarray:
        """The stretch of a column of the log, shape (n,) or (n, k), at the instants of the grid."""
        rows = column[self.first : self.last]
        return rows if self.instants_s is None else interpolated(self.stamps_s, rows, self.instants_s)


@dataclass(frozen=True)
class Grid:
    """Even grids of one rate, Hz, for every stretch of a log; `notes` say what was done to the log."""

    rate_hz: float
    stretches: tuple[Stretch, ...]
    notes: tuple[str, ...] = ()


def grid_of(path: Path, time_s: np.ndarray, resolution_s: float) -> Grid:
    """Even grid of rising stamps (s), shape (n,), n >= 2, split at gaps.

    Parameters
    ----------
    resolution_s
        Unit that the stamps are rounded to; 0 when unknown.

    Raises
    ------
    BackendError
        Steps so different that no rate is the usual one."""
    steps = np.diff(time_s)
    if is_even(time_s, float(steps.mean()), resolution_s):
        return Grid(1 / float(steps.mean()), (Stretch(0, len(time_s), time_s, None),))
    usual = float(np.median(steps))
    gaps = np.flatnonzero(steps > GAP_STEPS * usual)
    within = np.delete(steps, gaps)
    if len(gaps) > MOST_OFF * len(steps):
        raise BackendError(
            f"{path}: uneven sampling: rows come in bursts, {usual:.6g} s apart with "
            f"{float(np.median(steps[gaps])):.6g} s between: messages or channels of several kinds, a row "
            "each; keep the rows of the slowest, the columns of the others filled in by time (interpolate "
            "of pandas)"
        )
    if _is_of_arrival(time_s, gaps):
        raise BackendError(
            f"{path}: uneven sampling: rows come in bunches of {len(time_s) / (len(gaps) + 1):.3g}, "
            f"{usual:.3g} s apart with {float(np.median(steps[gaps])):.3g} s between: "
            "stamped as a packet arrived, not as each was taken; give the rate instead of the time column "
            f"(--rate-hz {1 / _slope(time_s):.6g} is the mean)"
        )
    off = float(np.mean(np.abs(within / usual - 1) > OFF_SHARE))
    if off > MOST_OFF:
        raise BackendError(
            f"{path}: uneven sampling: {100 * off:.0f} % of the steps differ from the usual {usual:.6g} s "
            f"by more than half of it (at most {100 * MOST_OFF:.0f} %): no even rate can be made of it; "
            "record at a steady rate, or give the rate instead of the time column where only the clock is "
            "coarse"
        )
    edges = [0, *(gaps + 1), len(time_s)]
    first, last = max(pairwise(edges), key=lambda each: each[1] - each[0])
    rounded = _slope(time_s[first:last]) if last - first > 2 else 0.0
    even = rounded > 0 and is_even(time_s[first:last], rounded, resolution_s)
    # of the longest stretch: a line through many rounded stamps knows the step best
    step = rounded if even else _step(within, usual)
    stretches = tuple(
        _stretch(time_s[first:last], first, last, step, resolution_s) for first, last in pairwise(edges)
    )
    return Grid(1 / step, stretches, _notes(path, time_s, within, gaps, stretches, step))


def _is_of_arrival(time_s: np.ndarray, gaps: np.ndarray) -> bool:
    """Whether rows come in bunches, most of the time in the gaps between them, and all the same as many each
    second: within two of the longest gaps about a line."""
    if len(gaps) < BUNCHES_LEAST:
        return False
    lasted, ends = (time_s[gaps + 1] - time_s[gaps]), time_s[gaps]
    longest = float((ends[1:] - time_s[gaps[:-1] + 1]).max())
    off = time_s - time_s[0] - _slope(time_s) * np.arange(len(time_s))
    return bool(
        longest < BUNCH_S and lasted.sum() > 0.5 * (time_s[-1] - time_s[0]) and np.ptp(off) < 2 * lasted.max()
    )


def _step(steps: np.ndarray, usual: float) -> float:
    """Step of the grid, s: where rows are lost from an even log (steps are whole multiples of the usual one)
    that of the log, else the mean."""
    rows = np.round(steps / usual)
    lost = bool((rows >= 1).all()) and float(np.abs(steps - rows * usual).max()) <= EVEN_SHARE * usual
    return float(steps.sum() / rows.sum()) if lost else float(steps.mean())


def _stretch(stamps_s: np.ndarray, first: int, last: int, step: float, resolution_s: float) -> Stretch:
    if len(stamps_s) < 2 or is_even(stamps_s, step, resolution_s):
        return Stretch(first, last, stamps_s, None)
    stamps_s = _unrounded(stamps_s, step, resolution_s)
    count = int((stamps_s[-1] - stamps_s[0]) / step + 1e-6) + 1
    return Stretch(first, last, stamps_s, stamps_s[0] + step * np.arange(count))


def is_even(stamps_s: np.ndarray, step_s: float, resolution_s: float) -> bool:
    """Whether rising stamps are those of an even rate of one per `step_s`, but for rounding to
    `resolution_s`.

    Notes
    -----
    Stamps rounded to q lie within less than q about a straight line, and of a clock that jitters by less than
    that some lie further off, less than half way to where a lost row is; its slope must be the step."""
    n, slope = len(stamps_s), _slope(stamps_s)
    # from the first stamp on: seconds since 1970 leave a float64 a quarter of a microsecond
    off = stamps_s - stamps_s[0] - slope * np.arange(n)
    rest = float(np.ptp(off))
    if resolution_s * ROUNDED_STEP <= step_s and abs(slope - step_s) * n < 2 * resolution_s:
        jitters = rest < 0.5 * (step_s + resolution_s) and _is_rounded(off, resolution_s)
        if rest < resolution_s * (1 - 1e-6) or jitters:
            return True
    return rest <= EVEN_SHARE * step_s and abs(slope - step_s) * n <= EVEN_SHARE * step_s


def _is_rounded(off_s: np.ndarray, resolution_s: float) -> bool:
    """Whether stamps are so far off a line for their rounding more than for a clock that jitters."""
    return float(np.std(off_s)) < JITTER_SHARE * resolution_s


def _unrounded(stamps_s: np.ndarray, step_s: float, resolution_s: float) -> np.ndarray:
    """The stamps on the line they were rounded from, where rows are lost from it; else as they are."""
    if step_s < TOLD_APART * resolution_s:
        return stamps_s
    usual = float(np.median(np.diff(stamps_s)))
    row = np.concatenate([[0.0], np.cumsum(np.maximum(np.round(np.diff(stamps_s) / usual), 1))])
    slope, begin = np.polyfit(row, stamps_s - stamps_s[0], 1)
    line = begin + slope * row
    return stamps_s[0] + line if _is_rounded(stamps_s - stamps_s[0] - line, resolution_s) else stamps_s


def _slope(stamps_s: np.ndarray) -> float:
    """Step of the straight line through the stamps, s."""
    k = np.arange(len(stamps_s)) - 0.5 * (len(stamps_s) - 1)
    return float(k @ (stamps_s - stamps_s[0]) / (k @ k))


def resolution(raw: np.ndarray) -> float:
    """Unit that the numbers are rounded to: a decimal one, 1 to 1e-9, or the coarser one of single precision
    (1 ms after four hours); 0 when there is none."""
    from_first = raw - raw[0]
    decimal = 0.0
    # from coarse to fine: the first that fits is the unit
    for decimals in range(MOST_DECIMALS + 1):
        units = from_first * 10.0**decimals
        if float(np.abs(units - np.round(units)).max()) < 0.01:
            decimal = 10.0**-decimals
            break
    single = raw.astype(np.float32)
    coarsest = float(np.spacing(np.abs(single).max()))
    if coarsest > decimal and float(np.abs(single - raw).max()) <= 0.51 * decimal:
        return coarsest
    return decimal


STARTS_OVER = {
    "a counter of 16 bits": 2.0**16,
    "a counter of 32 bits": 2.0**32,
    **{
        f"the time of the day (midnight is in the log), in {unit},": 86400.0 * 1e3**k
        for k, unit in enumerate(("s", "ms", "us", "ns"))
    },
}
"""What stamps may be that start over at 0, and after how many units."""


def unwrapped(stamps: np.ndarray) -> tuple[np.ndarray, str]:
    """Stamps that started over, as if they had not, and what they are; as they are and nothing where none of
    `STARTS_OVER` explains a step back."""
    steps = np.diff(stamps)
    back = np.flatnonzero(steps < 0)
    usual = float(np.median(steps)) if len(back) else 0.0
    # a counter or a time of the day has no negative stamp
    if not usual > 0 or stamps.min() < 0:
        return stamps, ""
    whole = bool((stamps == np.round(stamps)).all())
    for name, period in STARTS_OVER.items():
        over = steps[back] + period
        counts = name.startswith("a counter")
        longest = GAP_STEPS * (max(usual, 1.0) if counts else usual)
        # a counter of fractions is none, and few rows may be missing where it starts over
        if (whole or not counts) and stamps.max() < period and (over > 0).all() and (over < longest).all():
            return stamps + period * np.cumsum(np.concatenate([[0], steps < 0])), name
    return stamps, ""


def interpolated(time_s: np.ndarray, values: np.ndarray, at_s: np.ndarray) -> np.ndarray:
    """Values at other instants within those of `time_s`, by the cubic through the two rows before and after
    each.

    Parameters
    ----------
    values
        Shape (n,) or (n, k); straight lines for fewer than four rows.

    Notes
    -----
    Of a motion of angular frequency w sampled every h the error is .023 (w h)^4: 1e-5 for 2.3 Hz at 100 Hz.
    """
    if values.ndim == 2:
        return np.stack([interpolated(time_s, column, at_s) for column in values.T], axis=1)
    # a cubic needs four rows
    if len(time_s) < 4:
        return np.asarray(np.interp(at_s, time_s, values))
    first = np.clip(np.searchsorted(time_s, at_s, side="right") - 2, 0, len(time_s) - 4)
    nodes = first + np.arange(4)[:, None]
    t, total = time_s[nodes], np.zeros(len(at_s))
    for i in range(4):
        weight = np.ones(len(at_s))
        for j in range(4):
            if j != i:
                weight *= (at_s - t[j]) / (t[i] - t[j])
        total += weight * values[nodes[i]]
    return total


def _notes(
    path: Path,
    time_s: np.ndarray,
    within: np.ndarray,
    gaps: np.ndarray,
    stretches: tuple[Stretch, ...],
    step: float,
) -> tuple[str, ...]:
    notes = []
    if len(gaps):
        longest = gaps[int(np.argmax(np.diff(time_s)[gaps]))]
        lasted = time_s[longest + 1] - time_s[longest]
        notes.append(
            f"{path}: {len(gaps)} gap(s), the longest {lasted:.4g} s after row {longest + 1}: the log is "
            "split there"
        )
    if any(each.instants_s is not None for each in stretches):
        notes.append(
            f"{path}: the steps last {1e3 * within.min():.4g} to {1e3 * within.max():.4g} ms: resampled on "
            f"the stamps, every {1e3 * step:.4g} ms"
        )
    return tuple(notes)
