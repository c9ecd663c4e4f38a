"""Columns of JSON: an object a line, a list of objects, or an object of lists; a value within an object goes
by its path, `motor.tau`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hw.interface import BackendError

DEEPEST = 4


def read_json(path: Path, raw: bytes, _names: tuple[str, ...]) -> Mapping[str, Any]:
    """Arrays by name; a column that some rows lack, or that is not of numbers, is left out.

    Raises
    ------
    BackendError
        No JSON, or no rows in it.
    """
    text = raw.decode("utf-8-sig")
    try:
        whole = json.loads(text)
    except ValueError:
        whole = _lines(path, text)
    if isinstance(whole, dict):
        arrays = {name: value for name, value in _paths("", whole).items() if isinstance(value, list)}
        found = {name: np.asarray(value) for name, value in arrays.items() if _even(value)}
    elif isinstance(whole, list) and whole and all(isinstance(row, dict) for row in whole):
        rows = [_paths("", row) for row in whole]
        common = set.intersection(*(set(row) for row in rows))
        columns = {name: [row[name] for row in rows] for name in rows[0] if name in common}
        found = {name: np.asarray(values) for name, values in columns.items() if _even(values)}
    else:
        raise BackendError(
            f"{path}: no rows: an object a line, a list of objects or an object of lists is read"
        )
    return {name: array for name, array in found.items() if array.dtype.kind in "fiub"}


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
            found |= _paths(f"{before}{name}.", each, depth - 1)
        else:
            found[f"{before}{name}"] = each
    return found


def _even(values: list[Any]) -> bool:
    """Whether numbers or rows of equally many of them make an array."""
    lengths = {len(each) if isinstance(each, list) else -1 for each in values}
    return len(lengths) == 1
