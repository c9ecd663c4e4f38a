"""Recordings as npz, Parquet, CSV, or MCAP with a message per tick: every field, every tick, written whole or
not at all."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

import numpy as np

from hw.motion import name as own_name
from hw.motion import unit
from rtctl.errors import DataError, RtctlError
from rtctl.recording.reader import RecordingReader
from rtctl.recording.tick_cdr import RECORDED
from rtctl.tick import tick_dtype
from rtctl.whole_files import whole

Kind = Literal["npz", "parquet", "csv", "mcap"]
Progress = Callable[[int], None]

TIMES = ("wall_ns", "time_s")
"""Beside the fields of a tick: ns since 1970, and seconds since the first tick of the recording."""

_XYZ = ("x", "y", "z")


def export(
    reader: RecordingReader,
    kind: Kind,
    path: Path,
    fields: tuple[str, ...] = (),
    progress: Progress | None = None,
) -> int:
    """Write the ticks of a recording to `path`; returns how many.

    Parameters
    ----------
    fields
        Names of tick fields and of `TIMES`; empty for all of them.
    progress
        Called with the ticks written so far.

    Raises
    ------
    DataError
        A field that does not exist, some fields only for MCAP, which has whole ticks, a file that cannot be
        written, or one that is to be MCAP and has no tick.
    RtctlError
        Parquet without pyarrow."""
    names = _names(fields)
    # before a file is begun: names are right, and the kind is one
    write = {"npz": _npz, "parquet": _parquet, "csv": _csv, "mcap": _mcap}[kind]
    with whole(path) as part:
        return write(reader, part, names, progress or (lambda _ticks: None))


def columns(rows: np.ndarray, names: list[str], axes: list[str], motions: list[str]) -> dict[str, np.ndarray]:
    """Flat columns: per-axis fields become `field.axis`, vectors `field.x`; each of shape (n,). Those of a
    linear axis end with its units."""
    flat: dict[str, np.ndarray] = {}
    for field in RECORDED:
        if field.name not in names:
            continue
        values = rows[field.name]
        if field.shape == "scalar":
            flat[field.name] = np.ascontiguousarray(values)
        else:
            labels = _XYZ if field.shape == "xyz" else axes  # a vector is of the sensor, no axis
            own = ["rotary"] * 3 if field.shape == "xyz" else motions
            flat |= {
                f"{own_name(field.name, own[k])}.{label}": np.ascontiguousarray(values[:, k])
                for k, label in enumerate(labels)
            }
    return flat


def times(rows: np.ndarray, wall_ns: int, first_ns: int) -> dict[str, np.ndarray]:
    """The columns `TIMES`, shape (n,): int64 and float64.

    Parameters
    ----------
    wall_ns
        What the wall clock showed when the clock of the ticks was 0, ns since 1970.
    first_ns
        `time_ns` of the recording's first tick."""
    # in whole ns: a float64 of the time since 1970 goes by steps of a quarter of a microsecond
    return {"wall_ns": rows["time_ns"] + wall_ns, "time_s": (rows["time_ns"] - first_ns) * 1e-9}


def _tables(
    reader: RecordingReader, names: list[str], *, flat: bool
) -> Iterator[tuple[int, dict[str, np.ndarray]]]:
    """Chunk by chunk: ticks so far, and the columns asked for, times first; `flat`: one per axis."""
    wall_ns, ticks, first_ns = int(reader.about["start_wall_ns"]), 0, 0
    of_ticks = [name for name in names if name not in TIMES]
    for rows in _rows(reader):
        # of the first tick that is there: a first chunk may be damaged, and is left out
        if ticks == 0 and len(rows):
            first_ns = int(rows["time_ns"][0])
        ticks += len(rows)
        # times first, in whatever order they were asked for: they are what a reader looks for
        found = {k: v for k, v in times(rows, wall_ns, first_ns).items() if k in names}
        shaped = columns(rows, names, reader.axes, reader.motions) if flat else {n: rows[n] for n in of_ticks}
        yield ticks, found | shaped


def _rows(reader: RecordingReader) -> Iterator[np.ndarray]:
    """Ticks chunk by chunk, one chunk at least: a recording without a tick becomes a file of all columns."""
    batch = None
    for batch in reader.batches():
        yield batch.rows
    if batch is None:
        yield np.zeros(0, tick_dtype(reader.n_axes))


def _names(fields: tuple[str, ...]) -> list[str]:
    known = [*TIMES, *(field.name for field in RECORDED)]
    unknown = [name for name in fields if name not in known]
    if unknown:
        raise DataError(f"no tick field is called {', '.join(unknown)}; docs/tick.md lists them")
    return list(fields) or known  # all of them, where none is named


def _npz(reader: RecordingReader, path: Path, names: list[str], progress: Progress) -> int:
    found: dict[str, list[np.ndarray]] = {name: [] for name in names}
    ticks, motions = 0, reader.motions
    # an array has one name for all axes: of both motions that of rotary ones, and `units` tell the rest
    of_all = "linear" if set(motions) == {"linear"} else "rotary"
    # all of it in memory: npz has the length of an array before its numbers
    for ticks, table in _tables(reader, names, flat=False):
        for name, kept in found.items():
            kept.append(table[name])
        progress(ticks)
    # units are of these alone: a scalar or a vector has the same for every motion
    per_axis = {field.name: field for field in RECORDED if field.shape == "axis"}
    units = {
        own_name(name, of_all): [unit(per_axis[name].unit, motion) for motion in motions]
        for name in names
        if name in per_axis
    }
    arrays: dict[str, Any] = {
        own_name(name, of_all if name in per_axis else "rotary"): np.concatenate(kept)
        for name, kept in found.items()
    }
    with path.open("wb") as file:
        said: dict[str, Any] = {"units": np.array(json.dumps(units))} if "linear" in motions else {}
        np.savez_compressed(file, about=np.array(json.dumps(reader.about)), **said, **arrays)
    return ticks


def _csv(reader: RecordingReader, path: Path, names: list[str], progress: Progress) -> int:
    ticks = 0
    with path.open("w", newline="", encoding="utf-8") as file:  # the csv module ends its lines itself
        writer, headed = csv.writer(file), False
        for ticks, flat in _tables(reader, names, flat=True):
            if not headed:  # names are known with the first chunk
                writer.writerow(flat)
                headed = True
            # as Python numbers: their text reads back to the same bits
            writer.writerows(zip(*(column.tolist() for column in flat.values()), strict=True))
            progress(ticks)
    return ticks


def _parquet(reader: RecordingReader, path: Path, names: list[str], progress: Progress) -> int:
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError as error:
        raise RtctlError(
            "Parquet needs pyarrow: pip install 'rtctl[parquet]', or export --to npz or csv"
        ) from error
    metadata = {key: str(value) for key, value in reader.about.items()}
    ticks, writer = 0, None
    try:
        for ticks, flat in _tables(reader, names, flat=True):
            table = pa.table(flat).replace_schema_metadata(metadata)
            if writer is None:
                # the schema is known with the first chunk only
                writer = parquet.ParquetWriter(path, table.schema, compression="zstd")
            writer.write_table(table)
            progress(ticks)
    finally:
        if writer is not None:
            writer.close()
    return ticks


def _mcap(reader: RecordingReader, path: Path, names: list[str], progress: Progress) -> int:
    """The whole recording again, every tick a row: what plotting tools show at the full rate."""
    from rtctl.recording.limits import Limits
    from rtctl.recording.parts import Parts
    from rtctl.recording.setup import Setup

    if names != _names(()):
        raise DataError("an MCAP file has whole ticks: leave out --fields")
    attachments = {name: ("application/octet-stream", data) for name, data in reader.attachments.items()}
    # beside the result: it is renamed into place, which no other file system takes
    with TemporaryDirectory(prefix=".export", dir=path.parent) as folder:
        # one file, whatever its size: nobody is recording, and a full disk is told
        limits = Limits(file_bytes=1 << 62, file_s=math.inf, free_bytes=0)
        parts = Parts(Path(folder), Setup(reader.about, attachments), limits, rows=True)
        for batch in reader.batches():
            events, commands = batch.events, batch.commands
            # a gap in the numbers is a loss, and a block of its own begins behind it
            for some in np.split(np.arange(len(batch.rows)), np.flatnonzero(np.diff(batch.numbers) != 1) + 1):
                if len(some):
                    parts.add(int(batch.numbers[some[0]]), batch.rows[some], events, commands)
                    events, commands = [], commands[:0]
            progress(parts.written + parts.pending)
        parts.close({"reason": "exported"})
        if not parts.files:
            raise DataError(
                f"{reader.parts[0]}: has no tick, and an MCAP file would have no message; --to npz, parquet "
                "or csv writes its columns without a row"
            )
        parts.files[0].rename(path)
    return parts.written
