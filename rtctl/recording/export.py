"""Recordings as npz, Parquet or CSV: every field, every tick, written whole or not at all."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import numpy as np

from rtctl.errors import ConfigError, RtctlError
from rtctl.recording.reader import RecordingReader
from rtctl.recording.tick_text import RECORDED

Kind = Literal["npz", "parquet", "csv"]
Progress = Callable[[int], None]

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
        Names of tick fields; empty for all of them.
    progress
        Called with the ticks written so far.

    Raises
    ------
    ConfigError
        A field that does not exist.
    RtctlError
        Parquet without pyarrow.
    """
    names = _names(fields)
    write = {"npz": _npz, "parquet": _parquet, "csv": _csv}[kind]
    with _whole(path) as part:
        return write(reader, part, names, progress or (lambda _ticks: None))


def columns(rows: np.ndarray, names: list[str], axes: list[str]) -> dict[str, np.ndarray]:
    """Flat columns: per-axis fields become `field.axis`, vectors `field.x`; each of shape (n,)."""
    flat: dict[str, np.ndarray] = {}
    for field in RECORDED:
        if field.name not in names:
            continue
        values = rows[field.name]
        if field.shape == "scalar":
            flat[field.name] = np.ascontiguousarray(values)
        else:
            labels = _XYZ if field.shape == "xyz" else axes
            flat |= {
                f"{field.name}.{label}": np.ascontiguousarray(values[:, k]) for k, label in enumerate(labels)
            }
    return flat


def _names(fields: tuple[str, ...]) -> list[str]:
    known = [field.name for field in RECORDED]
    unknown = [name for name in fields if name not in known]
    if unknown:
        raise ConfigError(f"no tick field is called {', '.join(unknown)}; docs/tick.md lists them")
    return list(fields) or known


@contextmanager
def _whole(path: Path) -> Iterator[Path]:
    """A name to write under; becomes `path` at the end, and nothing when anything fails."""
    part = path.with_name(path.name + ".part")
    try:
        yield part
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _npz(reader: RecordingReader, path: Path, names: list[str], progress: Progress) -> int:
    found: dict[str, list[np.ndarray]] = {name: [] for name in names}
    ticks = 0
    for batch in reader.batches():
        for name, kept in found.items():
            kept.append(batch.rows[name])
        ticks += len(batch.rows)
        progress(ticks)
    arrays: dict[str, Any] = {name: np.concatenate(kept or [np.zeros(0)]) for name, kept in found.items()}
    with path.open("wb") as file:
        np.savez_compressed(file, about=np.array(json.dumps(reader.about)), **arrays)
    return ticks


def _csv(reader: RecordingReader, path: Path, names: list[str], progress: Progress) -> int:
    ticks = 0
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        for batch in reader.batches():
            flat = columns(batch.rows, names, reader.axes)
            if ticks == 0:
                writer.writerow(flat)
            writer.writerows(zip(*(column.tolist() for column in flat.values()), strict=True))
            ticks += len(batch.rows)
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
        for batch in reader.batches():
            table = pa.table(columns(batch.rows, names, reader.axes)).replace_schema_metadata(metadata)
            if writer is None:
                writer = parquet.ParquetWriter(path, table.schema, compression="zstd")
            writer.write_table(table)
            ticks += len(batch.rows)
            progress(ticks)
    finally:
        if writer is not None:
            writer.close()
    if writer is None:
        path.touch()
    return ticks
