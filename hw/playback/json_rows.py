"""Columns of JSON: an object a line, a list of objects, an object of lists, or a DataFrame of pandas; a value
within an object goes by its path, `motor.tau`."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hw.interface import BackendError
from hw.playback.text_rows import is_number
from hw.playback.text_table import Table
from hw.playback.units import units_beside

DEEPEST = 4


def read_json(path: Path, raw: bytes, _names: tuple[str, ...]) -> Table:
    """Arrays by name, of words, too, and units that words beside them say; a column that some rows lack is
    left out.

    Raises
    ------
    BackendError
        No JSON, or no rows in it."""
    text = raw.decode("utf-8-sig")
    try:
        whole = json.loads(text)
    except ValueError:
        # several objects are no JSON document: one a line, then
        whole = _lines(path, text)
    if isinstance(whole, dict):
        whole = _of_pandas(whole)
        arrays = {name: value for name, value in _paths("", whole).items() if isinstance(value, list)}
        found = {name: _numbers(value) for name, value in arrays.items() if _even(value)}
    elif isinstance(whole, list) and whole and all(isinstance(row, dict) for row in whole):
        rows = [_paths("", row) for row in whole]
        # in every row: a hole has no place in an array, and a row without it no instant of its own
        common = set.intersection(*(set(row) for row in rows))
        columns = {name: [row[name] for row in rows] for name in rows[0] if name in common}
        found = {name: _numbers(values) for name, values in columns.items() if _even(values)}
    else:
        raise BackendError(
            f"{path}: no rows: an object a line, a list of objects or an object of lists is read"
        )
    texts = {name: column for name, column in found.items() if column.dtype.kind == "U" and column.size}
    # in every row the same word: else it is no unit
    spelt = {name: str(column.flat[0]) for name, column in texts.items() if (column == column.flat[0]).all()}
    return Table(found, units_beside({name: found[name] for name in found.keys() - texts}, spelt))


def _of_pandas(whole: dict[str, Any]) -> dict[str, Any]:
    """`DataFrame.to_json` as an object of lists, its index as `index`: an object of rows for each column (its
    own way), or names and rows apart (`split`)."""
    if set(whole) == {"columns", "index", "data"}:
        columns = list(map(list, zip(*whole["data"], strict=True))) or [[] for _ in whole["columns"]]
        return {"index": whole["index"], **dict(zip(whole["columns"], columns, strict=True))}
    rows = next(iter(whole.values()), None)
    if not (isinstance(rows, dict) and len(rows) > 1 and all(map(is_number, rows))):
        return whole
    # the same rows in the same order: else it is a tree of objects that only looks like a frame
    if any(not isinstance(each, dict) or list(each) != list(rows) for each in whole.values()):
        return whole
    return {"index": list(map(float, rows)), **{name: list(each.values()) for name, each in whole.items()}}


def _lines(path: Path, text: str) -> list[Any]:
    rows = []
    for k, line in enumerate(text.splitlines()):
        if line.strip():
            try:
                rows.append(json.loads(line))
            except ValueError as error:
                raise BackendError(
                    f"{path}: line {k + 1} is no JSON ({error}); cut or repair the log"
                ) from error
    return rows


def _paths(before: str, value: Mapping[str, Any], depth: int = DEEPEST) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, each in value.items():
        if isinstance(each, dict) and depth:
            if (stamp := _stamp(each)) is not None:
                found[f"{before}{name}"] = stamp
            found |= _paths(f"{before}{name}.", each, depth - 1)
        else:
            found[f"{before}{name}"] = each
    return found


def _stamp(value: Mapping[str, Any]) -> float | None:
    """The s of a time that ROS writes in two parts; None of anything else."""
    for s, ns in (("sec", "nanosec"), ("secs", "nsecs")):
        if value.keys() == {s, ns} and all(isinstance(each, int) for each in value.values()):
            return float(value[s]) + 1e-9 * float(value[ns])
    return None


def _numbers(values: list[Any]) -> np.ndarray:
    """The array of a column, NaN where it has null."""
    if None in values:
        # JSON has no NaN, and pandas writes null for it: the row is told, and not that the column is missing
        values = [math.nan if each is None else each for each in values]
    return np.asarray(values)


def _even(values: list[Any]) -> bool:
    """Whether numbers or rows of equally many of them make an array."""
    # -1 and not 1: a number beside a list of one number is no array
    lengths = {len(each) if isinstance(each, list) else -1 for each in values}
    return len(lengths) <= 1
