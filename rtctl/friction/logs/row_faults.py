"""Faults of single rows of a log: spikes, jumps, an angle that starts over, rows that repeat; found first.

A spike leaves the position for a few rows and comes back; a jump does not come back. Both are outliers of the
velocity from row to row against its running median, which motion, however brisk, is not: whatever moves keeps
its velocity for a few rows, or changes it for good."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from hw.playback.quantum import quantum
from rtctl.errors import DataError
from rtctl.friction.logs.lost_rows import MOST_LOST, lost, require_every_row
from rtctl.friction.logs.quick_motion import brisk_change, clusters, comes_gradually, is_turn
from rtctl.friction.logs.rows_in_turn import drawn, hold, require_one_axis

WINDOW_S, WINDOW_MIN, WINDOW_MAX = 0.04, 5, 21
"""Length of the running median, s and rows."""

SLOW_S = 0.02
"""Time between two rows, s, from which on the running median is of a stroke or a turn and more."""

OUTLIER_SCALES = 12.0
"""An outlier is further from the running median than so many robust standard deviations,"""

OUTLIER_COUNTS = 4.0
"""and than so many steps of the encoder,"""

OUTLIER_SHARE = 0.25
"""and than this share of the usual largest speed."""

SLOWEST_BUS_S = 0.1
"""Longest time between two torques of a slower bus."""

HEIGHT_LEAST = 2e-3
"""Least height of a spike or jump, share of the range of the position."""

RETURNS = 0.25
"""Largest share of its height by which a spike may fail to come back."""

MOST_SPIKES = 0.02
"""Largest share of rows in spikes that is mended; beyond it the column is refused."""

LOST_LEAST, LOST_MOST = 0.6, 20.0
"""Rows that seem to be lost in one place, by the velocity there; whole numbers where they truly are."""

MOST_JUMPS = 10
"""Most jumps of the position that are bridged."""

REPEATS_MIN, REPEATS_MOST = 5, 0.1
"""Fewest repeated rows worth a word, and the largest share that is mended."""

TURN_TOLERANCE = 0.02
"""How far from a turn, or from the whole range, a jump is that starts over."""


@dataclass
class Rows:
    """Columns of a log, shape (n,), mended: s (None without stamps), rad; `beside` the position torques, N m,
    and a velocity; `notes` say what was done."""

    where: str
    time_s: np.ndarray | None
    position_rad: np.ndarray
    beside: dict[str, np.ndarray]
    notes: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        n = len(self.position_rad)
        self.step = np.ones(n - 1) if self.time_s is None else np.diff(self.time_s)
        self.usual = float(np.median(self.step))
        slow = self.time_s is not None and self.usual > SLOW_S
        few = f"or brisk motion (at {1 / self.usual:.3g} rows a second they look alike: record 50 and more)"
        self.alike = f" {few}" if slow else ""
        self.of = few if slow else "that no motion makes"
        # some late rows are lost time; where every twentieth step is off, stamps are no clock of the sensor
        self.jitters = float(np.mean(np.abs(self.step / self.usual - 1) > 0.1)) > 0.05


def mended(rows: Rows) -> Rows:
    """The rows without what is told in `notes`.

    Raises
    ------
    DataError
        More spikes, lost or repeated rows than can be mended, with column, row, how many and the remedy."""
    # no running median of so few rows; the fit refuses them for their length
    if len(rows.position_rad) < 4 * WINDOW_MIN:
        return rows
    require_one_axis(rows.where, rows.position_rad)
    rows.notes.extend(require_every_row(rows.where, rows.position_rad, rows.step))
    # first: a held column jumps at each new value, and repeats between, and would be taken for both faults
    _mend_held(rows)
    _mend_repeats(rows)
    _mend_position(rows)
    return rows


def _mend_held(rows: Rows) -> None:
    """Columns of slower devices whose values were held: a curve through them as they were taken."""
    columns = {"column position": rows.position_rad, **rows.beside}
    at = np.cumsum(np.concatenate([[0.0], rows.step])) / rows.usual
    told = {name: hold(column, at) or drawn(column, at) for name, column in columns.items()}
    for name, one in told.items():  # a torque in steps, as it was commanded, is the torque that acted
        if (
            one
            and not one.drawn
            and "torque" in name
            and rows.time_s is not None
            and one.times * rows.usual > SLOWEST_BUS_S
        ):
            told[name] = None
    first = next((one for one in told.values() if one is not None), None)
    if first is None:
        return
    found = {name: one or first.with_it(columns[name], at) for name, one in told.items()}
    holds = {name: one for name, one in found.items() if one is not None}
    for name, one in holds.items():
        columns[name][:] = one.between(columns[name], at)
    times = {f"{one.times:.3g}" for one in holds.values()}
    rows_held = len(holds) == len(columns) and not any(one.drawn for one in holds.values())
    if rows_held and rows.beside and len(times) == 1:
        rows.notes.append(
            f"{rows.where}: nearly every row stands {times.pop()} times, in every column: a slower log whose "
            "rows were held: a curve through the first of each; give the log with one row of each"
        )
        return
    for name, one in holds.items():
        rate = "" if rows.time_s is None else f" ({1 / one.times / rows.usual:.3g} Hz)"
        told_of = f"{one.told(rate)}; it may be late; record it at the rate of the log"
        rows.notes.append(f"{rows.where}: {name}: {told_of}")


def _interpolate(rows: Rows, bad: np.ndarray, *, beside: bool) -> None:
    """Straight lines across the bad rows."""
    at = np.cumsum(np.concatenate([[0.0], rows.step]))
    for column in [rows.position_rad, *(rows.beside.values() if beside else ())]:
        column[bad] = np.interp(at[bad], at[~bad], column[~bad])


def _window(rows: Rows) -> int:
    seconds = rows.usual if rows.time_s is not None else WINDOW_S / WINDOW_MAX
    return min(max(round(WINDOW_S / seconds), WINDOW_MIN), WINDOW_MAX) // 2 * 2 + 1


def _deviation(rows: Rows) -> tuple[np.ndarray, np.ndarray, float]:
    """Velocity of every step, its running median, how far an outlier is; per s, or per row without stamps."""
    from scipy.ndimage import median_filter

    velocity = np.diff(rows.position_rad) / rows.step
    # mirrored: a first row that were repeated beyond the end would be the median of itself
    middle = median_filter(velocity, size=_window(rows), mode="mirror")
    scale = 1.4826 * float(np.median(np.abs(velocity - middle)))
    usual_most = float(np.quantile(np.abs(middle), 0.95))
    bound = max(
        OUTLIER_SCALES * scale,
        OUTLIER_COUNTS * quantum(rows.position_rad) / rows.usual,
        OUTLIER_SHARE * usual_most,
    )
    if rows.jitters:  # stamps that are off by a part of a step change the velocity as much
        bound = max(bound, 6 * usual_most)
    return velocity, middle, bound


def _mend_repeats(rows: Rows) -> None:
    """Rows equal to the one before in every column, though the joint moved."""
    velocity, middle, _ = _deviation(rows)
    steps = np.abs(np.diff(rows.position_rad))  # no minimum: that may be a step of rounding
    count = float(np.quantile(steps[steps > 0], 0.02)) if steps.any() else 0.0
    moves = np.abs(middle) * rows.usual > OUTLIER_COUNTS * count
    same = (velocity == 0) & moves
    for torque in rows.beside.values():
        same &= np.diff(torque) == 0
    same &= _goes_on(same, velocity, middle)
    count = int(same.sum())
    if count < REPEATS_MIN or not rows.beside:
        return
    first = int(np.flatnonzero(same)[0])
    after = np.flatnonzero(same[:-1] & ~same[1:] & moves[1:]) + 1
    # a joint that moved on meanwhile goes two rows' way at once behind them; rows written twice cost no time
    catches_up = float(np.median(velocity[after] / middle[after])) if len(after) else 2.0
    told = f"{count} rows repeat the row before them in every column though the joint moves"
    what = f"{rows.where}: {told}, the first row {first + 2}"
    if catches_up < 1.5:
        raise DataError(
            f"{what}; the motion goes on after them as if no time had passed, so the time is wrong: remove "
            "the repeated rows, or record with the stamps of the device"
        )
    if count > REPEATS_MOST * len(same):
        raise DataError(f"{what}; record every row once it is new, or thin the log to the rate of the device")
    _interpolate(rows, np.concatenate([[False], same]), beside=True)
    rows.notes.append(f"{what}: interpolated")


def _goes_on(same: np.ndarray, velocity: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Marks of steps whose neighbours, that are not `same`, move; a joint that stops does not."""
    at, others = np.arange(len(same)), np.flatnonzero(~same)
    if not len(others):
        return np.zeros(len(same), bool)
    behind = np.searchsorted(others, at).clip(1, len(others) - 1)
    moving = np.abs(velocity) > 0.5 * np.abs(middle)
    return np.asarray(moving[others[behind - 1]] & moving[others[behind]])


@dataclass(frozen=True)
class _Jump:
    row: int
    """The last row before it."""
    size_rad: float
    """By which the position went further than its velocity said."""
    step_rad: float
    """How far it goes in a row there."""

    def looks_lost(self) -> bool:
        """Whether it is as far as the joint goes in a whole number of rows."""
        count = self.size_rad / self.step_rad if self.step_rad else 0.0
        return LOST_LEAST < count < LOST_MOST and (count > 4 or abs(count - round(count)) < 0.3)


def _mend_position(rows: Rows) -> None:
    velocity, middle, bound = _deviation(rows)
    beyond = (velocity - middle) * rows.step
    steady = rows.step < 3.5 * rows.usual  # over a gap a velocity is a mean
    outlier = (np.abs(velocity - middle) > bound) & steady
    reach, range_rad = _window(rows) // 2, float(np.ptp(rows.position_rad))
    brisk = brisk_change(velocity, outlier)
    bad, jumps, tallest, first = np.zeros(len(rows.position_rad), bool), [], 0.0, -1
    for begin, end in clusters(outlier, reach):
        partial = np.cumsum(beyond[begin : end + 1])
        height = float(np.abs(partial).max())
        inside = begin >= reach and end < len(beyond) - reach
        # of one side only the running median knows enough of an angle that starts over, and no more
        if not inside and (end > begin or not _starts_over(float(partial[-1]), range_rad)):
            continue
        if height < HEIGHT_LEAST * range_rad or (inside and is_turn(velocity, begin, end, reach, bound)):
            continue
        if inside and comes_gradually(velocity, begin, end, brisk):
            continue
        if abs(partial[-1]) <= RETURNS * height:
            bad[begin + 1 : end + 1] = True
            first = first if first >= 0 else begin + 1
            tallest = max(tallest, height)
        elif end - begin <= reach:
            jumps.append(_Jump(begin, float(partial[-1]), float(middle[begin]) * rows.usual))
            if end > begin:
                bad[begin + 1 : end + 1] = True
    if tallest:
        count = int(bad.sum())
        told = f"column position: {count} rows are spikes of up to {tallest:.3g} rad{rows.alike}"
        what = f"{rows.where}: {told}, the first row {first + 1}"
        few = count <= MOST_SPIKES * len(bad)
        if not few and not rows.alike:
            raise DataError(f"{what}; look for the cause (wiring, rows out of order), and record again")
        rows.notes.append(f"{what}: {'interpolated' if few else 'left as they are'}")
        bad &= few
    _bridge(rows, jumps)
    if bad.any():
        _interpolate(rows, bad, beside=False)


def _bridge(rows: Rows, jumps: list[_Jump]) -> None:
    """Take the jumps out of the position, and say what they look like."""
    if not jumps:
        return
    over = [jump for jump in jumps if _starts_over(jump.size_rad, float(np.ptp(rows.position_rad)))]
    rest = [jump for jump in jumps if jump not in over]
    missing = [jump for jump in rest if jump.looks_lost()]
    if len(missing) > MOST_LOST and len(missing) >= 0.8 * len(rest):
        first = missing[0]
        raise lost(rows.where, len(missing), first.row + 1, abs(first.size_rad / first.step_rad))
    if over:
        rows.notes.append(
            f"{rows.where}: column position: starts over {len(over)} times, by {abs(over[0].size_rad):.4g} "
            f"rad, the first after row {over[0].row + 1}: put together to a continuous angle"
        )
    if len(rest) > MOST_JUMPS:
        rows.notes.append(
            f"{rows.where}: column position: {len(rest)} jumps {rows.of}, the first after row "
            f"{rest[0].row + 1}: too many to bridge, left as they are; is it the angle of this joint?"
        )
        jumps = over
    elif rest:
        largest = max(rest, key=lambda jump: abs(jump.size_rad))
        rows.notes.append(
            f"{rows.where}: column position: {len(rest)} jumps {rows.of}, the largest "
            f"{largest.size_rad:+.3g} rad after row {largest.row + 1} (rows lost, a sensor that was frozen, "
            "an index found, or two logs in one): bridged; cut the log there if more than the zero changed"
        )
    for jump in jumps:
        rows.position_rad[jump.row + 1 :] -= jump.size_rad


def _starts_over(size_rad: float, range_rad: float) -> bool:
    size = abs(size_rad)
    turns = size / (2 * math.pi)
    of_turns = round(turns) >= 1 and abs(turns - round(turns)) <= TURN_TOLERANCE
    return of_turns or abs(size / range_rad - 1) <= TURN_TOLERANCE
