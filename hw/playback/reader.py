"""Reads a recorded log into SI arrays, and refuses what a loop must not be fed with.

Every fault of a file is found here, when the backend is opened, before anything moves. `BackendError`
names the file, the column, the row and what to do."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hw.interface import BackendError, Options, Rig
from hw.motion import LENGTH_UNITS, SPEED_UNITS, coordinate_units, effort_units
from hw.playback import other_clocks, rising
from hw.playback.columns import MIN_SAMPLES, read_table
from hw.playback.quantum import quantum
from hw.playback.stamps import Grid, Stretch, grid_of, resolution, unwrapped
from hw.playback.text_table import NoColumnError
from hw.playback.units import require_unit, says_unit

# Factors to SI of the units that hw.playback.options admits (pydantic stays out of the loop process).
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "days": 86400.0}
ANGLE_UNITS = {"rad": 1.0, "deg": math.pi / 180, "rev": 2 * math.pi}  # and counts, by the rig's encoder
VELOCITY_UNITS = {"rad/s": 1.0, "deg/s": math.pi / 180, "rev/s": 2 * math.pi, "rpm": 2 * math.pi / 60}
CURRENT_UNITS = {"A": 1.0, "mA": 1e-3}
TORQUE_UNITS = {"N m": 1.0, "mN m": 1e-3, "N cm": 1e-2, "Nm": 1.0, "mNm": 1e-3, "Ncm": 1e-2}
FORCE_UNITS = {"N": 1.0, "mN": 1e-3}

Mend = Callable[[Path, np.ndarray | None, np.ndarray, dict[str, np.ndarray]], tuple[str, ...]]
"""Mends rows in place before resampling: file, stamps (s), position, torques and velocity by name (n, axes);
says what."""


@dataclass(frozen=True)
class Recording:
    """A log in SI units on an even time grid, or a stretch of it between gaps; absent signals are None.

    `position_rad`, `velocity_rad_s`, `current_a` (motor side), `hand_torque_nm` (link side) have one column
    per axis, `force_n` three. `notes` is what was done to the log to get here, for people; `steps_rad` the
    step of each axis' position as it was recorded."""

    path: Path
    rate_hz: float
    position_rad: np.ndarray
    current_a: np.ndarray | None
    hand_torque_nm: np.ndarray | None
    force_n: np.ndarray | None
    velocity_rad_s: np.ndarray | None = None
    start_s: float = 0.0
    """When it begins, s after the log's first row; above 0 for what comes after a gap."""
    notes: tuple[str, ...] = ()
    steps_rad: tuple[float, ...] = ()
    unsaid: tuple[str, ...] = ()
    """Columns of whose unit the file says nothing."""

    def __len__(self) -> int:
        return len(self.position_rad)


def _window(path: Path, n: int, rate_hz: float, start_s: float, end_s: float | None) -> slice:
    # 1e-6 of a sample: 2.01 * 1000 is 2009.9999999999998, and would lose the row at its end
    first = math.ceil(start_s * rate_hz - 1e-6)
    last = n if end_s is None else min(n, math.floor(end_s * rate_hz + 1e-6) + 1)
    if last - first < MIN_SAMPLES:
        raise BackendError(
            f"{path}: start_s {start_s} to end_s {end_s} leaves {max(0, last - first)} samples "
            f"of a log of {n / rate_hz:.3f} s"
        )
    return slice(first, last)


class _Table:
    """The mapped columns of one file, and how one of them becomes SI."""

    def __init__(self, options: Options) -> None:
        self.path = Path(options["file"])
        columns: list[Mapping[str, Any]] = [c for axis in options["axis"] for c in axis.values() if c]
        columns += list(options.get("force") or ())
        if options.get("time"):
            columns.append(options["time"])
        names = tuple(column["column"] for column in columns)
        roles = [[each["column"] for each in axis.values() if each] for axis in options["axis"]]
        if twice := next((name for each in roles for name in each if each.count(name) > 1), None):
            raise BackendError(
                f"{self.path}: column {twice!r} is mapped twice: map the places (#2) of two rows of names; "
                "of a row for each signal make a column of each first (pivot_table of pandas)"
            )
        try:
            found = read_table(self.path, names, options.get("delimiter"), options.get("decimal"))
        except NoColumnError as error:
            if error.column != (options.get("time") or {}).get("column"):
                raise
            raise BackendError(
                f"{error}; name the column of the time (time=NAME:UNIT), or give the rate of a log without "
                "one (--rate-hz)"
            ) from error
        self.raw, self.said, self.step_s = found.columns, found.units, found.step_s
        self.notes: tuple[str, ...] = ()
        self.unsaid: tuple[str, ...] = ()
        self.time_s = self._stamps(options["time"]) if options.get("time") else None
        self.notes += other_clocks.told(self.path, options, self.time_s, found.clocks)

    def _stamps(self, column: Mapping[str, Any]) -> np.ndarray:
        name, unit = column["column"], column.get("unit", "s")
        self.raw[name], over = unwrapped(self.raw[name])
        if over:
            self.notes = (f"{self.path}: column {name!r}: {over} starts over: continued",)
        if column.get("scale", 1.0) == 1:
            rising.require_epoch(self.path, name, float(self.raw[name][0]), unit, TIME_UNITS)
            self.notes += rising.counts_rows(self.path, name, self.raw[name], unit)
        return self.si(column, TIME_UNITS)

    def grid(self, options: Options, *, steady: bool) -> Grid:
        """Even grid of the rows; `steady` refuses what a loop must not be fed with."""
        n = len(next(iter(self.raw.values())))
        column, time_s = options.get("time"), self.time_s
        if column is None or time_s is None:
            rate_hz = rising.require_rate(self.path, float(options["rate_hz"]), self.step_s)
            return Grid(rate_hz, (Stretch(0, n, np.zeros(0), None),))
        rising.require_rising(self.path, time_s)
        unit_s = abs(column.get("scale", 1.0)) * TIME_UNITS[column.get("unit", "s")]
        even = unit_s * resolution(self.raw[column["column"]])
        if steady:
            rising.require_steady(self.path, time_s)
        return grid_of(self.path, time_s, even)

    def si(self, column: Mapping[str, Any], units: Mapping[str, float]) -> np.ndarray:
        name = column["column"]
        raw = self.raw[name]
        unit = column.get("unit", next(iter(units)))
        if unit not in units:
            raise BackendError(
                f"{self.path}: column {name!r} is read in {unit!r}, which this axis does not have: it has "
                f"{', '.join(units)}; correct the unit, or motion and lead_m of the axis"
            )
        said = self.said.get(name, "")
        require_unit(self.path, name, said, column, tuple(units))
        if not says_unit(name, said, unit):
            self.unsaid += (name,)
        factor = column.get("scale", 1.0) * units[unit]
        return np.asarray(factor * (raw - column.get("offset", 0.0)))


def load(options: Options, rig: Rig) -> Recording:
    """Read the log that validated `PlaybackOptions` describe.

    Parameters
    ----------
    options
        Plain mapping as dumped from `PlaybackOptions`.
    rig
        Number of axes, encoder resolution and gearing (a motor torque becomes a current with them).

    Raises
    ------
    BackendError
        See `hw.playback.columns.read_table` and `hw.playback.rising.require_rising`; more than two ticks of a
        recording missed in a row, in other logs steps that differ by more than `MAX_STEP_ERROR` (smaller
        differences are resampled on the stamps); also when the number of axes differs."""
    # stamps of a recording are exact: a missed tick is a missing row
    recorded = Path(options["file"]).suffix.lower() == ".mcap"
    stretches = _read(options, rig, steady=not recorded)
    start_s, end_s = options.get("start_s", 0.0), options.get("end_s")
    whole = _around(stretches, start_s, end_s)
    until_s = None if end_s is None else end_s - whole.start_s
    kept = _window(whole.path, len(whole), whole.rate_hz, start_s - whole.start_s, until_s)
    return replace(_cut(whole, kept), start_s=0.0)


def _around(stretches: list[Recording], start_s: float, end_s: float | None) -> Recording:
    """The stretch that the window lies in. Raises BackendError with the first gap where it is in none."""
    for one in stretches:
        last = one.start_s + (len(one) - 1) / one.rate_hz
        until = stretches[-1].start_s if end_s is None else end_s  # at the latest where the last one begins
        if one.start_s - 1e-6 <= start_s and (one is stretches[-1] or until <= last + 1e-6):
            return one
    first, after = stretches[0], stretches[1]
    begins = first.start_s + (len(first) - 1) / first.rate_hz
    raise BackendError(
        f"{first.path}: ticks are missing for {after.start_s - begins:.3g} s after {begins:.6g} s "
        f"({len(stretches) - 1} such gaps); a loop needs an even rate: play a part without a gap (start_s, "
        "end_s)"
    )


def load_beside(
    options: Options, column: Mapping[str, Any], units: Mapping[str, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Seconds after the first row of a log, and another column in the first of these units; (n,) each.
    Options and errors as `load`."""
    table = _Table({**options, "axis": [{"beside": column}], "force": None})
    values = table.si(column, units)
    if table.time_s is None:
        return np.arange(len(values)) / float(options["rate_hz"]), values
    return table.time_s - table.time_s[0], values


def load_stretches(options: Options, rig: Rig, mend: Mend | None = None) -> list[Recording]:
    """Read a log for identification: resampled on its stamps where they are uneven, split where it has gaps.

    Options and errors as `load`, but that window (`start_s`, `end_s`) is not applied, and only stamps of
    which no even rate can be made are refused. Stretches are in order, all of one rate. `mend` sees the rows
    as they were recorded."""
    return _read(options, rig, steady=False, mend=mend)


def _read(options: Options, rig: Rig, *, steady: bool, mend: Mend | None = None) -> list[Recording]:
    axes = options["axis"]
    if len(axes) != rig.n_axes:
        raise BackendError(
            f"playback maps {len(axes)} axes, the rig has {rig.n_axes}: one device.options.axis each"
        )
    table = _Table(options)
    grid = table.grid(options, steady=steady)
    moves = [rig.moves(k) for k in range(rig.n_axes)]
    places = [
        {**coordinate_units(ANGLE_UNITS, LENGTH_UNITS, *one), "counts": 2 * math.pi / counts}
        for one, counts in zip(moves, rig.encoder_counts_per_rev, strict=True)
    ]
    position = np.stack(
        [table.si(axis["position"], units) for axis, units in zip(axes, places, strict=True)], axis=1
    )
    efforts = [effort_units(TORQUE_UNITS, *one) for one in moves]
    speeds = [coordinate_units(VELOCITY_UNITS, SPEED_UNITS, *one) for one in moves]
    torque_per_amp = rig.gear_ratio * rig.gear_efficiency * rig.torque_constant_nm_a
    current = _per_axis(table, axes, "current", [CURRENT_UNITS] * rig.n_axes)
    motor_torque = _per_axis(table, axes, "motor_torque", efforts)
    if motor_torque is not None:
        current = motor_torque / torque_per_amp
    force = options.get("force")
    hand = _per_axis(table, axes, "hand_torque", efforts)
    velocity = _per_axis(table, axes, "velocity", speeds)
    tip = np.stack([table.si(c, FORCE_UNITS) for c in force], axis=1) if force else None
    beside = {"motor torque": current, "external torque": hand, "column velocity": velocity}
    given = {name: column for name, column in beside.items() if column is not None}
    steps = tuple(quantum(each) for each in position.T)
    notes: tuple[str, ...] = ()
    if table.time_s is not None and any(one.instants_s is not None for one in grid.stretches):
        longest = slice(*max(((one.first, one.last) for one in grid.stretches), key=np.ptp))
        notes = rising.jittered(table.path, table.time_s[longest], position[longest, 0], len(grid.stretches))
    notes += mend(table.path, _at(grid, table.time_s), position, given) if mend else ()
    return [
        Recording(
            path=table.path,
            rate_hz=grid.rate_hz,
            start_s=float(stretch.stamps_s[:1].sum() - grid.stretches[0].stamps_s[:1].sum()),
            notes=(*table.notes, *grid.notes, *notes),
            position_rad=stretch.signal(position),
            current_a=_of(stretch, current),
            hand_torque_nm=_of(stretch, hand),
            force_n=_of(stretch, tip),
            velocity_rad_s=_of(stretch, velocity),
            steps_rad=steps,
            unsaid=table.unsaid,
        )
        for stretch in grid.stretches
    ]


def _at(grid: Grid, time_s: np.ndarray | None) -> np.ndarray | None:
    """When the rows were taken, s: on an even grid where only rounding keeps their stamps off it."""
    if time_s is None:
        return None
    evened = [
        each.stamps_s[0] + np.arange(len(each.stamps_s)) / grid.rate_hz
        if each.instants_s is None
        else each.stamps_s
        for each in grid.stretches
    ]
    return np.concatenate(evened)


def _of(stretch: Stretch, signal: np.ndarray | None) -> np.ndarray | None:
    return None if signal is None else stretch.signal(signal)


def _cut(whole: Recording, kept: slice) -> Recording:
    def cut(array: np.ndarray | None) -> np.ndarray | None:
        return None if array is None else array[kept]

    return replace(
        whole,
        position_rad=np.ascontiguousarray(whole.position_rad[kept]),
        current_a=cut(whole.current_a),
        hand_torque_nm=cut(whole.hand_torque_nm),
        force_n=cut(whole.force_n),
        velocity_rad_s=cut(whole.velocity_rad_s),
    )


def _per_axis(
    table: _Table, axes: Sequence[Mapping[str, Any]], name: str, units: Sequence[Mapping[str, float]]
) -> np.ndarray | None:
    if not axes[0].get(name):
        return None
    return np.stack([table.si(axis[name], own) for axis, own in zip(axes, units, strict=True)], axis=1)
