"""Reads a recorded log into SI arrays, and refuses what a loop must not be fed with.

Every fault of a file is found here, when the backend is opened, before anything moves. `BackendError`
names the file, the column, the row and what to do.
"""

from __future__ import annotations

import gzip
import io
import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hw.interface import BackendError, Options, Rig
from hw.outside import read_bounded
from hw.playback.stamps import Grid, Stretch, grid_of, resolution

# Factors to SI of the units that hw.playback.options admits (pydantic stays out of the loop process).
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
ANGLE_UNITS = {"rad": 1.0, "deg": math.pi / 180, "rev": 2 * math.pi}  # and counts, by the rig's encoder
VELOCITY_UNITS = {"rad/s": 1.0, "deg/s": math.pi / 180, "rev/s": 2 * math.pi, "rpm": 2 * math.pi / 60}
CURRENT_UNITS = {"A": 1.0, "mA": 1e-3}
TORQUE_UNITS = {"N m": 1.0, "mN m": 1e-3, "Nm": 1.0, "mNm": 1e-3}
FORCE_UNITS = {"N": 1.0, "mN": 1e-3}

MAX_BYTES = 1 << 30
"""Largest log, after decompression too."""

MOST_RATIO, LEAST_UNPACKED = 100, 1 << 20
"""How many times its size a .gz may unpack to, and what it always may: logs reach 5 to 20, a bomb 1,000."""

MAX_STEP_ERROR = 0.25
"""Largest deviation of one sampling step from the mean step, as a share of it."""

MIN_SAMPLES = 2


@dataclass(frozen=True)
class Recording:
    """A log in SI units on an even time grid, or a stretch of it between gaps. Arrays have `n` rows; absent signals are None.

    `position_rad`, `velocity_rad_s`, `current_a` (motor side), `hand_torque_nm` (link side) have one column per
    axis, `force_n` three.
    """

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
    """What was done to the log to get here, for people."""

    def __len__(self) -> int:
        return len(self.position_rad)


def _text(path: Path) -> str:
    try:
        raw = read_bounded(path, MAX_BYTES)
        packed = path.suffix == ".gz" or raw[:2] == b"\x1f\x8b"
        text = (_unpacked(path, raw) if packed else raw).decode("utf-8-sig")
    except EOFError as error:
        raise BackendError(f"{path}: the gzip file is cut off; copy it again") from error
    except (gzip.BadGzipFile, zlib.error) as error:
        raise BackendError(f"{path}: not a sound gzip file ({error}); copy it again") from error
    except UnicodeDecodeError as error:
        raise BackendError(f"{path}: not a text file ({error.reason} at byte {error.start})") from error
    except OSError as error:
        raise BackendError(f"{path}: cannot read the log: {error.strerror or error}") from error
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _unpacked(path: Path, raw: bytes) -> bytes:
    """The content of a gzip file, if it is no larger than a log's could be."""
    most = min(MAX_BYTES, LEAST_UNPACKED + MOST_RATIO * len(raw))
    with gzip.open(io.BytesIO(raw)) as stream:
        text = stream.read(most + 1)
    if len(text) > most:
        raise BackendError(
            f"{path}: its {len(raw)} bytes unpack to more than {most}, which no log does; unpack it yourself, or cut it into parts"
        )
    return text


def read_columns(path: Path, names: tuple[str, ...], delimiter: str = ",") -> dict[str, np.ndarray]:
    """Read the named columns of a CSV file with a header line, gzipped or not.

    Returns
    -------
    dict
        Column name -> float array, all of equal length, all finite.

    Raises
    ------
    BackendError
        Unreadable or truncated file, missing or ambiguous column, a cell that is no finite number
        (with its row, counted from 1 below the header), fewer than two rows.
    """
    text = _text(path)
    if not text.strip():
        raise BackendError(f"{path}: the file is empty; a header line and rows are needed")
    header, _, body = text.partition("\n")
    found = [name.strip().strip('"') for name in header.rstrip("\r").split(delimiter)]
    for name in names:
        if found.count(name) != 1:
            cause = "no column" if name not in found else "more than one column"
            raise BackendError(f"{path}: {cause} {name!r}; the header has: {', '.join(found)[:500]}")
    order = tuple(dict.fromkeys(names))
    if not body.strip():
        raise BackendError(f"{path}: no rows below the header")
    try:
        table = np.loadtxt(
            io.StringIO(body),
            delimiter=delimiter,
            usecols=[found.index(name) for name in order],
            ndmin=2,
            comments=None,
        )
    except ValueError as error:
        raise BackendError(
            f"{path}: {error} (rows from 0 below the header); every cell of a mapped column must be a number"
        ) from error
    if len(table) < MIN_SAMPLES:
        raise BackendError(f"{path}: {len(table)} row(s); at least {MIN_SAMPLES} are needed")
    bad = np.argwhere(~np.isfinite(table))
    if len(bad):
        row, column = bad[0]
        raise BackendError(
            f"{path}: column {order[column]!r} row {row + 1}: {table[row, column]} is not a finite number "
            f"({len(bad)} such cells); cut or repair the log"
        )
    return {name: table[:, k] for k, name in enumerate(order)}


def require_rising(path: Path, time_s: np.ndarray) -> None:
    """Refuse stamps that do not rise.

    Raises
    ------
    BackendError
        Time that stands still, repeats itself or goes back, with how often and the first row.
    """
    steps = np.diff(time_s)
    if not time_s[-1] > time_s[0]:
        raise BackendError(f"{path}: time does not increase ({time_s[0]} s to {time_s[-1]} s)")
    same, back = np.flatnonzero(steps == 0), np.flatnonzero(steps < 0)
    if len(same):
        raise BackendError(
            f"{path}: {len(same)} duplicated timestamps, the first {time_s[same[0]]:.6g} s in rows {same[0] + 1} "
            f"and {same[0] + 2}; remove the repeated rows, or give the rate instead of the time column where "
            "only the clock is coarse"
        )
    if len(back):
        k = back[0]
        raise BackendError(
            f"{path}: unsorted time: row {k + 2} ({time_s[k + 1]:.6g} s) is {-steps[k]:.6g} s before the row above "
            f"it ({len(back)} such rows); sort the log by time, or cut it where the clock was set back"
        )


def _require_steady(path: Path, time_s: np.ndarray) -> None:
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


def _window(path: Path, n: int, rate_hz: float, start_s: float, end_s: float | None) -> slice:
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
        self.raw = read_columns(self.path, names, options.get("delimiter", ","))

    def grid(self, options: Options, *, steady: bool) -> Grid:
        """Even grid of the rows; `steady` refuses what a loop must not be fed with."""
        n = len(next(iter(self.raw.values())))
        column = options.get("time")
        if not column:
            return Grid(float(options["rate_hz"]), (Stretch(0, n, np.zeros(0), None),))
        time_s = self.si(column, TIME_UNITS)
        require_rising(self.path, time_s)
        unit_s = abs(column.get("scale", 1.0)) * TIME_UNITS[column.get("unit", "s")]
        even = unit_s * resolution(self.raw[column["column"]])
        if steady:
            _require_steady(self.path, time_s)
        return grid_of(self.path, time_s, even)

    def si(self, column: Mapping[str, Any], units: Mapping[str, float]) -> np.ndarray:
        raw = self.raw[column["column"]]
        factor = column.get("scale", 1.0) * units[column.get("unit", next(iter(units)))]
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
        See `read_columns` and `require_rising`; steps that differ by more than `MAX_STEP_ERROR` (smaller differences are
        resampled on the stamps); also when the number of axes differs.
    """
    (whole,) = _read(options, rig, steady=True)
    kept = _window(whole.path, len(whole), whole.rate_hz, options.get("start_s", 0.0), options.get("end_s"))
    return _cut(whole, kept)


def load_stretches(options: Options, rig: Rig) -> list[Recording]:
    """Read a log for identification: resampled on its stamps where they are uneven, split where it has gaps.

    Options and errors as `load`, but that window (`start_s`, `end_s`) is not applied, and only stamps of which no even
    rate can be made are refused. Stretches are in order, all of one rate.
    """
    return _read(options, rig, steady=False)


def _read(options: Options, rig: Rig, *, steady: bool) -> list[Recording]:
    axes = options["axis"]
    if len(axes) != rig.n_axes:
        raise BackendError(
            f"playback maps {len(axes)} axes, the rig has {rig.n_axes}: one device.options.axis each"
        )
    table = _Table(options)
    grid = table.grid(options, steady=steady)
    angles = [{**ANGLE_UNITS, "counts": 2 * math.pi / counts} for counts in rig.encoder_counts_per_rev]
    position = np.stack(
        [table.si(axis["position"], units) for axis, units in zip(axes, angles, strict=True)], axis=1
    )
    torque_per_amp = rig.gear_ratio * rig.gear_efficiency * rig.torque_constant_nm_a
    current = _per_axis(table, axes, "current", CURRENT_UNITS)
    motor_torque = _per_axis(table, axes, "motor_torque", TORQUE_UNITS)
    if motor_torque is not None:
        current = motor_torque / torque_per_amp
    force = options.get("force")
    hand = _per_axis(table, axes, "hand_torque", TORQUE_UNITS)
    velocity = _per_axis(table, axes, "velocity", VELOCITY_UNITS)
    tip = np.stack([table.si(c, FORCE_UNITS) for c in force], axis=1) if force else None
    begin_s = float(grid.stretches[0].stamps_s[:1].sum())
    return [
        Recording(
            path=table.path,
            rate_hz=grid.rate_hz,
            start_s=float(stretch.stamps_s[:1].sum()) - begin_s,
            notes=grid.notes,
            position_rad=stretch.signal(position),
            current_a=_of(stretch, current),
            hand_torque_nm=_of(stretch, hand),
            force_n=_of(stretch, tip),
            velocity_rad_s=_of(stretch, velocity),
        )
        for stretch in grid.stretches
    ]


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


def _per_axis(table: _Table, axes: Any, name: str, units: Mapping[str, float]) -> np.ndarray | None:  # noqa: ANN401
    if not axes[0].get(name):
        return None
    return np.stack([table.si(axis[name], units) for axis in axes], axis=1)
