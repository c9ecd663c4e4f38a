"""Rows of logs that are others again to the last digit: pasted twice, given in two files, or laps of a
simulation without noise.

They tell nothing new, and counted as measured anew they make every interval too narrow: each is counted
once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rtctl.errors import DataError, of_file
from rtctl.friction.logs.dynamics import AxisLog, Recorded
from rtctl.friction.logs.intervals import BLOCK_PERIODS, BLOCKS_MIN
from rtctl.friction.logs.torque_faults import longest_run

COPIED_S, COPIED_ROWS = 1.0, 100
"""Least length of a copy: s, and rows;"""

CHANGES = 20
"""and in how many of these rows at least a value changes: a joint at rest repeats itself by nature."""

SHARE_LEAST = 0.01
"""Least share of the rows that is worth a word."""

SHIFTED = 1e-3
"""Share of a usual step by which the steps of a copied position may differ: pasted behind the log so that it
goes on, it is rounded anew."""

NEARLY_ALL = 0.9
"""Share of the points of a file from which on they are those of another that holds them."""

PIECE_LEAST = 16
"""Fewest rows between two copies that say anything."""

LEFT_TIMES = 2.0
"""Shortest time left, times what intervals need, from which on the copies are left out."""

_BASE = 0x9E3779B97F4A7C15


@dataclass(frozen=True)
class Copies:
    """Rows of all parts together, (n,): `again` marks those that an earlier row was, `first` is that row."""

    again: np.ndarray
    first: np.ndarray

    def longest(self) -> tuple[int, int]:
        """First and last row of the longest copy in one piece."""
        onward = self.again[1:] & self.again[:-1] & (np.diff(self.first) == 1)
        begin, length = longest_run(onward)
        return begin, begin + length


def copies_in(rows: np.ndarray, place: np.ndarray, part: np.ndarray, length: int) -> Copies:
    """Copies of `length` rows and more among the rows of several parts.

    Parameters
    ----------
    rows
        What must be equal to the last digit, (n, k).
    place
        What may be shifted by a constant, (n,).
    part
        Number of the part of each row, (n,), rising; a copy lies within one."""
    n = len(rows)
    none = Copies(np.zeros(n, bool), np.arange(n))
    if n < 2 * length:
        return none
    # a number for each run in place of comparing all with all: 10^5 rows have 10^10 pairs
    key = _windows(rows, length)
    begins = np.arange(len(key))
    changed = np.append(0, np.cumsum(np.append(True, (np.diff(rows, axis=0) != 0).any(axis=1))))
    whole = (part[begins] == part[begins + length - 1]) & (changed[length:] - changed[:-length] >= CHANGES)
    seen = begins[whole]
    if not len(seen):
        return none
    _, found, which = np.unique(key[seen], return_index=True, return_inverse=True)
    first = np.arange(n)
    first[seen] = seen[found][which]
    step = np.diff(place, append=place[-1])
    step[np.flatnonzero(np.diff(part))] = 0.0  # from part to part
    moved = np.abs(step - step[first]) > SHIFTED * float(np.sqrt(np.mean(step**2)))
    moved = np.append(0, np.cumsum(moved))
    # the last step leads out of the copy
    copied = (first[: len(key)] < begins) & (moved[length - 1 : -1] == moved[: len(key)])
    cover = np.cumsum(np.append(copied, np.zeros(length)) - np.append(np.zeros(length), copied))[:n]
    # the rows of a copy beyond the begin of its last window go on from there
    whence = np.maximum.accumulate(np.where(np.append(copied, np.zeros(n - len(key), bool)), np.arange(n), 0))
    return Copies(cover > 0, np.where(cover > 0, first[whence] + np.arange(n) - whence, np.arange(n)))


def _windows(rows: np.ndarray, length: int) -> np.ndarray:
    """A number for each run of `length` rows, (n - length + 1,): equal runs have the same."""
    # + 0.0: -0 becomes 0, which is equal and has other bits
    bits = np.ascontiguousarray(rows + 0.0).view(np.uint64)
    hashed = np.zeros(len(rows), np.uint64)
    for column in bits.T:
        hashed = (hashed ^ column) * np.uint64(_BASE)
        hashed ^= hashed >> np.uint64(29)
    # the base is odd, so that it has an inverse: every window is brought back to the same power
    factor = np.full(len(rows), _BASE, np.uint64)
    back = np.full(len(rows), pow(_BASE, -1, 1 << 64), np.uint64)
    factor[0] = back[0] = 1
    # a polynomial of the rows, so that sums from the begin give every run
    sums = np.append(np.uint64(0), np.cumsum(hashed * np.cumprod(factor), dtype=np.uint64))
    return np.asarray((sums[length:] - sums[:-length]) * np.cumprod(back)[: len(rows) - length + 1])


def fresh_rows(
    tables: Sequence[np.ndarray], places: Sequence[np.ndarray], sources: Sequence[str], length: int
) -> tuple[list[np.ndarray], str]:
    """Marks of the rows of each table (n, k) that are none again, and what is to be said of the others, where
    they are more than a few; places (n,) and `length` as of `copies_in`.

    Raises
    ------
    DataError
        All rows of a table are in another."""
    part = np.repeat(np.arange(len(tables)), [len(one) for one in tables])
    found = copies_in(np.concatenate(tables), np.concatenate(places), part, length)
    if found.again.mean() < SHARE_LEAST:
        return [np.ones(len(one), bool) for one in tables], ""
    again = found.again.copy()
    for k, source in enumerate(sources):
        mine = part == k
        if (~again[mine]).sum() >= PIECE_LEAST:
            continue
        others = part[found.first[mine & again]]
        if (others == k).mean() > 0.5:  # a run of few values repeats itself: nobody gave it twice
            again[mine] = False
            continue
        other = sources[int(others[others != k][0])]
        with of_file(Path(source)):
            raise DataError(f"{source}: its rows are in {other}, too, to the last digit; give each once")
    if again.mean() < SHARE_LEAST:
        return [np.ones(len(one), bool) for one in tables], ""
    found = Copies(again, found.first)
    fresh = [~again[part == k] for k in range(len(tables))]
    return fresh, _told(found, part, sources)


def require_own_rows(tables: Sequence[np.ndarray], files: Sequence[Path]) -> None:
    """Refuse a table (n, k) nearly all of whose rows are in another, in whatever order.

    Raises
    ------
    DataError
        Names both files."""
    rows = [set(map(tuple, table.tolist())) for table in tables]
    for k, file in enumerate(files):
        for j, other in enumerate(files):
            # of two that are alike the later one is named
            smaller = len(rows[k]) < len(rows[j]) or (len(rows[k]) == len(rows[j]) and j < k)
            if smaller and len(rows[k] & rows[j]) > NEARLY_ALL * len(rows[k]):
                with of_file(file):
                    raise DataError(
                        f"{file}: its rows are in {other}, too, to the last digit; give each once"
                    )


def counted_once(
    logs: Sequence[tuple[AxisLog, ...]], cutoff_hz: float
) -> tuple[tuple[tuple[AxisLog, ...], ...], tuple[str, ...]]:
    """The logs (stretches of each) without the rows that are others again, and what is to be said.

    Raises
    ------
    DataError
        All rows of a log are in another."""
    given = [one for stretches in logs if (one := stretches[0].recorded) is not None]
    if len(given) < len(logs):
        return tuple(logs), ()
    length = max(COPIED_ROWS, *(round(COPIED_S * stretches[0].rate_hz) for stretches in logs))
    names = sorted(set.intersection(*(set(one.beside) for one in given)))
    fresh, told = fresh_rows(
        [np.column_stack([one.beside[name] for name in names]) for one in given],
        [one.place for one in given],
        [stretches[0].source for stretches in logs],
        length,
    )
    if not told:
        return tuple(logs), ()
    left_s = sum(
        float(mine.sum()) / stretches[0].rate_hz for mine, stretches in zip(fresh, logs, strict=True)
    )
    if left_s < LEFT_TIMES * BLOCKS_MIN * BLOCK_PERIODS / cutoff_hz:
        return tuple(logs), (
            f"{told}; the {left_s:.3g} s without them are too short, so that they count as measured anew, "
            "and every interval is too narrow by it; record more",
        )
    kept = tuple(
        tuple(piece for one in stretches for piece in _cut(one, _at(one, written, mine)))
        for stretches, written, mine in zip(logs, given, fresh, strict=True)
    )
    # short pieces of a log are none
    return tuple(each or whole for each, whole in zip(kept, logs, strict=True)), (f"{told}: counted once",)


def _at(log: AxisLog, written: Recorded, fresh: np.ndarray) -> np.ndarray:
    """Marks of the recorded rows on the even rows of a stretch."""
    at_s = log.start_s + np.arange(len(log.position_rad)) / log.rate_hz
    time_s = np.arange(len(fresh)) / log.rate_hz if written.time_s is None else written.time_s
    return np.asarray(fresh[np.searchsorted(time_s, at_s - 0.5 / log.rate_hz).clip(0, len(fresh) - 1)])


def _cut(log: AxisLog, fresh: np.ndarray) -> list[AxisLog]:
    """The marked rows of a stretch, in pieces without a gap."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], fresh, [False]])))
    return [
        replace(
            log,
            position_rad=log.position_rad[begin:end],
            torque_nm=log.torque_nm[begin:end],
            velocity_rad_s=None if log.velocity_rad_s is None else log.velocity_rad_s[begin:end],
            external_nm=None if log.external_nm is None else log.external_nm[begin:end],
            start_s=log.start_s + begin / log.rate_hz,
            # told of the whole stretch, and once
            plateaus=log.plateaus if begin == edges[0] else (),
        )
        for begin, end in zip(edges[::2], edges[1::2], strict=True)
        if end - begin >= PIECE_LEAST
    ]


def _told(found: Copies, part: np.ndarray, sources: Sequence[str]) -> str:
    begin, end = found.longest()
    log, of = int(part[begin]), int(part[found.first[begin]])
    starts = np.searchsorted(part, [log, of])
    other = "" if of == log else f" of {sources[of]}"
    return (
        f"{sources[log]}: {int(found.again.sum())} rows are others again to the last digit, rows "
        f"{begin - starts[0] + 1} to {end - starts[0] + 1} those from row "
        f"{int(found.first[begin]) - starts[1] + 1} on{other} (pasted or given twice, or laps of a "
        "simulation without noise): they tell nothing new"
    )
