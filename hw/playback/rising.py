"""Stamps that are none: they stand still, repeat themselves, go back or differ too much."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from hw.interface import BackendError

# slower than once a second nobody samples a joint, nor above a megahertz
SLOWEST_AND_FASTEST_HZ = (1.0, 1e6)
"""Rates beyond which the time is in another unit than it is read in."""

MAX_STEP_ERROR = 0.25
"""Largest deviation of one sampling step from the mean step, as a share of it."""


# two rows that were written the wrong way round differ by a step or two, a new run by all of it
RUN_STEPS = 100
"""Usual steps by which a clock goes back where another run begins."""

TICKS = (
    ("the year 1 (ticks of .NET)", 6.2e17, 6.7e17),
    ("the year 1601 (FILETIME of Windows)", 1.2e17, 1.4e17),
)
"""Stamps that count 100 ns since then, between 1966 and 2123, or 1981 and 2044."""

UNIX_S = (9.4e8, 2.3e9)
"""Seconds since 1970 of the years from 1999 to 2042."""

HOUR_S = 3600.0

SMOOTHER = 0.5
"""Share of the roughness of a position over its stamps that it has over even steps, where the stamps are
wrong: of an encoder's coarse steps alone it has about as much over both."""

LONGEST_S = 1e11
"""Three thousand years."""


MAX_RATE_ERROR = 0.01
"""Share by which a rate that somebody gives may differ from the file's own."""


def require_rate(path: Path, given_hz: float, step_s: float) -> float:
    """The rate of a log without a time column, unless the file says another one: `step_s` from row to row, or
    0."""
    if step_s > 0 and abs(given_hz * step_s - 1) > MAX_RATE_ERROR:
        raise BackendError(
            f"{path}: read at {given_hz:.6g} Hz, and the file says that its rows are {step_s:.6g} s apart "
            f"({1 / step_s:.6g} Hz); map the time of a channel (CHANNEL/time), or give that rate"
        )
    return given_hz


def require_epoch(path: Path, name: str, first: float, unit: str, units: Mapping[str, float]) -> None:
    """Refuse stamps (their first, as it was written, and the unit in which it is read) that are of another
    unit by the date that they would say.

    Raises
    ------
    BackendError
        With the unit, or the scale, to give."""
    for since, low, high in TICKS:
        if low <= first <= high:
            raise BackendError(
                f"{path}: column {name!r}: {first:.0f} looks like a count of 100 ns since {since}, and is "
                f"read in {unit}; give the scale: {name}:s:1e-7"
            )
    if first * units[unit] > LONGEST_S:
        like = [one for one, factor in units.items() if UNIX_S[0] <= first * factor <= UNIX_S[1]]
        hint = f" (as {like[0]} it is since 1970: give that unit)" if like else ""
        raise BackendError(
            f"{path}: column {name!r}: {first:.17g} {unit} is {first * units[unit] / 3.16e7:.2g} years; "
            f"correct the unit of the time{hint}"
        )


_ROWS = re.compile(
    r"#|n|k|i|no\.?|nr\.?|(sample|row|record|point|data)s?[ _.]*(no|nr|number|index|idx|id)?\.?|index|idx|"
    r"count(er)?|unnamed: 0",
    re.IGNORECASE,
)
"""Names of columns that count rows."""


def counts_rows(path: Path, name: str, stamps: np.ndarray, unit: str) -> tuple[str, ...]:
    """What is said of a time that only counts rows, by its name and its steps: its rate is a guess."""
    if not _ROWS.fullmatch(name.strip()) or not bool((np.diff(stamps) == 1).all()):
        return ()
    return (
        f"{path}: column {name!r} counts rows, and is taken for a time of 1 {unit} a row: if that is not "
        "the rate, inertia and viscous friction are wrong; give the rate instead of the column "
        f"(--rate-hz), or the step as its scale ({name}:s:0.001)",
    )


def require_rising(path: Path, time_s: np.ndarray) -> None:
    """Refuse stamps that do not rise.

    Raises
    ------
    BackendError
        Time that stands still, repeats itself or goes back, with how often and the first row."""
    steps = np.diff(time_s)
    # first: with one stamp everywhere each of the questions below would have a misleading answer
    if not np.ptp(time_s):
        raise BackendError(
            f"{path}: time does not increase: every row has the stamp {time_s[0]:.17g} s; export the time "
            "with more digits, or give the rate instead (--rate-hz)"
        )
    if not time_s[-1] > time_s[0] and int((steps <= 0).sum()) != 1:
        row = int(np.argmax(steps <= 0)) + 2
        raise BackendError(
            f"{path}: time does not increase ({time_s[0]} s to {time_s[-1]} s), the first time in row "
            f"{row}; sort rows that are only in another order, cut those that are not of the log, or map the "
            "column of the time"
        )
    # twice the same before going back: a coarse clock has both, and its remedy is the rate
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
            f"{same[0] + 1} and {same[0] + 2}; {unit}{_of_one_stamp(len(same), len(steps))}"
            + ("" if unit else f" (--rate-hz {rate:.6g} is the mean)")
        )
    if len(back):
        k = back[0]
        summer = " by an hour, as summer time ends" if abs(steps[k] + HOUR_S) < 1.0 else ""
        # by the shortest way back: where one is of a row or two, rows are out of order, whatever else is
        if -float(steps[back].max()) > RUN_STEPS * float(np.median(steps)):
            raise BackendError(
                f"{path}: unsorted time: it starts over in row {k + 2} ({time_s[k + 1]:.6g} s after "
                f"{time_s[k]:.6g} s; {len(back)} such rows): runs one after the other in one file, or a "
                f"clock that was set back{summer}; cut it there, not sorted (rows of two runs would mix), "
                "and give each as a log of its own (--log may be repeated)"
            )
        raise BackendError(
            f"{path}: unsorted time: row {k + 2} ({time_s[k + 1]:.6g} s) is {-steps[k]:.6g} s before the "
            f"row above it ({len(back)} such rows); sort the log by time, or cut it where the clock was set "
            "back"
        )


def _of_one_stamp(same: int, steps: int) -> str:
    """The remedy for rows of one stamp."""
    if same > steps / 2:  # one row of each stamp would be a log of the clock's rate
        return (
            "rows of one stamp come in blocks, or the time has too few digits: give the rate instead of the "
            "time column"
        )
    return (
        "remove the repeated rows, or give the rate instead of the time column where only the clock is coarse"
    )


JITTER_ROWS = 20
"""Fewest rows by which even steps are held against stamps: the quarter that is left out is five of them."""


def jittered(path: Path, time_s: np.ndarray, position: np.ndarray, parts: int = 1) -> tuple[str, ...]:
    """What is said of uneven stamps (n,) of a position (n,), the longest stretch without a gap of so many,
    that runs far more smoothly over even steps: the rows were taken evenly, and stamped by a clock that came
    late.

    Notes
    -----
    Rough is how far a row is off the cubic through two rows before and two behind it, of three rows of four;
    where rows were lost even steps are wrong, and those are few."""
    if len(time_s) < JITTER_ROWS:
        return ()
    even = np.arange(len(time_s), dtype=float)
    over_even, over_stamps = (
        float(np.quantile(np.abs(_off_cubic(t, position)), 0.75)) for t in (even, time_s - time_s[0])
    )
    if not over_even < SMOOTHER * over_stamps:
        return ()
    # of one stretch: over gaps it would be the rate of nothing
    mean_hz = (len(time_s) - 1) / (time_s[-1] - time_s[0])
    # of an even motion of which only rounding is left the ratio says nothing but that it is large
    times = over_stamps / over_even if over_stamps < 1e3 * over_even else math.inf
    # without the column two parts would follow each other with no time between them
    each = "" if parts == 1 else "; each part between gaps as a log of its own"
    return (
        f"{path}: the position is {f'{times:.2g} times' if times < math.inf else 'far'} rougher over its "
        "stamps than over even steps: the rows were taken evenly, and their stamps jitter (a program that "
        "writes when it reads); the inertia comes out too small: give the rate instead of the time column "
        f"(--rate-hz {mean_hz:.6g} is the mean{each})",
    )


def _off_cubic(time_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    """How far each row is off the cubic through the two before and the two behind it, (n - 4,)."""
    n, total = len(values) - 4, np.zeros(len(values) - 4)
    nodes = (0, 1, 3, 4)
    at = time_s[2 : n + 2]
    for i in nodes:
        weight = np.ones(n)
        for j in nodes:
            if j != i:
                weight *= (at - time_s[j : n + j]) / (time_s[i : n + i] - time_s[j : n + j])
        total += weight * values[i : n + i]
    return np.asarray(values[2 : n + 2] - total)


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
