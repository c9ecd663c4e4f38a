"""Columns of Parquet and Arrow files, whatever wrote them (pyarrow, pandas, polars, DuckDB)."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from contextlib import suppress
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from hw.interface import BackendError
from hw.playback.text_table import Table
from hw.playback.units import unit_of

STREAM = b"\xff\xff\xff\xff"
"""How a stream begins: polars and the data sets of Hugging Face end its name in `.arrow`, too."""

ChunkedArray: TypeAlias = Any
"""pyarrow's; it is not typed, and not there on every machine."""


def read_arrow(path: Path, raw: bytes, names: tuple[str, ...]) -> Table:
    """Parquet, and Feather, which is Arrow's own file, or a stream of Arrow; a field of a struct is `arm.q`,
    one place of lists `q#1`; units as the metadata of a field say them.

    Raises
    ------
    BackendError
        Without pyarrow; a file that is not sound."""
    kind = "Parquet" if path.suffix.lower() == ".parquet" else "Feather"
    if find_spec("pyarrow") is None:
        raise BackendError(
            f"{path}: {kind} needs pyarrow: install rtctl with its extra `parquet` (pip install "
            "'rtctl[parquet]'), or save the log as CSV"
        )
    try:
        ipc = import_module("pyarrow.ipc")
        table: Any = (
            import_module("pyarrow.parquet").ParquetFile(io.BytesIO(raw))
            if kind == "Parquet"
            else (ipc.open_stream if raw.startswith(STREAM) else ipc.open_file)(io.BytesIO(raw))
        )
        known = (table.schema_arrow if kind == "Parquet" else table.schema).names
        # columns lie apart in Parquet: those that nobody asks for are not even unpacked
        wanted = [own for own in known if any(_is_of(name, own) for name in names)]
        read = table.read(columns=wanted) if kind == "Parquet" else table.read_all().select(wanted)
        # a struct in a struct takes a round more
        while any(map(import_module("pyarrow.types").is_struct, read.schema.types)):
            read = read.flatten()
    except import_module("pyarrow").ArrowException as error:
        raise BackendError(
            f"{path}: not a sound {kind} file ({str(error)[:200]}); copy or save it again"
        ) from error
    # names of the others, without their numbers: a wrong name is answered by those there are
    listed: dict[str, Any] = {own: np.zeros(0) for own in known if own not in wanted}
    units = _of_pandas(read.schema.metadata or {})
    units |= {field.name: told for field in read.schema if (told := unit_of(field.metadata or {}))}
    return Table(listed | {own: _array(read.column(own)) for own in read.column_names}, units)


def _of_pandas(metadata: Mapping[bytes, bytes]) -> dict[str, str]:
    """Units by column that `DataFrame.attrs["units"]` says."""
    with suppress(ValueError):
        attributes = json.loads(metadata.get(b"PANDAS_ATTRS", b"{}"))
        units = attributes.get("units") if isinstance(attributes, dict) else None
        if isinstance(units, dict):
            return {name: told for name, told in units.items() if isinstance(told, str)}
    return {}


def _is_of(name: str, own: str) -> bool:
    """Whether a wanted name is a column, or in it."""
    return name == own or name.startswith((f"{own}.", f"{own}#"))


def _array(column: ChunkedArray) -> np.ndarray:
    """A column as numbers or times, (n,), or (n, k) of lists of one length; as it is where it is neither."""
    arrow, types = import_module("pyarrow"), import_module("pyarrow.types")
    if types.is_dictionary(column.type):  # categories of pandas are written so
        column = column.cast(column.type.value_type)
    kind = column.type
    if types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind):
        rows = column.to_pylist()
        widths = {len(row or ()) for row in rows}
        # rows of several lengths have no column k: they go on as they are, and are refused by name
        return np.array(rows, float) if len(widths) == 1 else np.array(rows, object)
    # as an integer first: NumPy gets times of the day as Python objects, each by itself
    if types.is_time(kind):  # of the day
        column = column.cast(arrow.int32() if types.is_time32(kind) else arrow.int64())
        return np.asarray(column.to_numpy()).astype(f"timedelta64[{kind.unit}]")
    if types.is_decimal(kind):
        column = column.cast(arrow.float64())
    elif types.is_string(kind) or types.is_large_string(kind) or "string_view" in str(kind):
        with suppress(arrow.ArrowInvalid):  # words
            column = column.cast(arrow.string()).cast(arrow.float64())
    return np.asarray(column.to_numpy())
