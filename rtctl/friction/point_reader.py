"""The reader of the program's own files of friction points: CSV with the columns of
`rtctl.friction.point_columns`, in any order.

Lines that begin with `#` are comments. Files of other programs: `rtctl.friction.logs.other_programs`."""

from __future__ import annotations

import csv
import hashlib
import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from hw.motion import name, rotary_name
from hw.outside import read_bounded
from rtctl.errors import DataError
from rtctl.friction.point_columns import COLUMNS, TORQUE, VELOCITY
from rtctl.friction.points import FrictionPoints, require_enough

MOST_BYTES = 1 << 26
"""Largest file of points: a million rows."""

REPEATS_SHARE = 0.1
"""A larger share of rows that repeat another one to the last digit is a copy, not a measurement."""


OF_OTHERS = "--column velocity=NAME:UNIT --column torque=NAME:UNIT"
"""How `rtctl fit` is told the columns of a file that has other names (docs/logs.md)."""


def read_points(path: str | Path, *, of_speeds: bool = True) -> FrictionPoints:
    """Read a CSV file of friction points, once, with all its columns of numbers; `of_speeds`: enough of them
    for a curve of speed.

    Raises
    ------
    DataError
        Naming the file, the row and column, what is wrong there, and the remedy. Rows may be in any order."""
    path = Path(path)
    try:
        raw = read_bounded(path, MOST_BYTES)
        lines = raw.decode("utf-8-sig").splitlines()  # spreadsheets begin with a byte order mark
    except OSError as error:
        raise DataError(f"{path}: cannot read the points: {error.strerror}; correct the path") from error
    except UnicodeDecodeError as error:
        raise DataError(
            f"{path}: not a text file ({error}); save it as CSV in UTF-8, or name the columns of a log: "
            f"{OF_OTHERS}"
        ) from error
    numbered = [
        (i, line) for i, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("#")
    ]
    header, motion = _header(path, numbered)
    rows = [_row(path, number, line, header) for number, line in numbered[1:]]
    columns = {
        column: np.array([row[k] for row in rows], dtype=float)
        for k, column in enumerate(header)
        # a column with text somewhere is somebody's note, and no column of numbers
        if not any(row[k] is None for row in rows)
    }
    points = FrictionPoints.from_signed(
        columns.pop(VELOCITY.name),
        columns.pop(TORQUE.name),
        str(path),
        hashlib.sha256(raw).hexdigest(),
        columns,
        lambda row: f"{path}: row {numbered[1 + row][0]}",
    )
    # after the rows: a row that cannot be is named before the number of rows is
    if of_speeds:
        require_enough(points)
    # by the text: what is measured twice differs in its last digit
    _require_distinct(path, numbered[1:])
    return replace(points, motion=motion)


def _header(path: Path, numbered: list[tuple[int, str]]) -> tuple[list[str], str]:
    """Names of the columns, those of a linear axis by what they are of a rotary one, and which of the two it
    is."""
    required = [column.name for column in COLUMNS.values() if column.required]
    if not numbered:
        raise DataError(f"{path}: the file is empty; it needs the columns {', '.join(required)}")
    header = [text.strip() for text in next(csv.reader([numbered[0][1]]))]
    motion = "linear" if name(VELOCITY.name, "linear") in header else "rotary"
    header = [rotary_name(one, motion, COLUMNS) for one in header]
    for one in required:
        if one not in header:
            missing = name(one, motion)
            remedy = (
                f"commas are read here; --column velocity={missing} and so on reads other marks"
                if missing in numbered[0][1] and len(header) == 1
                else f"rename or add it, or name those of a file of another program: {OF_OTHERS}"
            )
            raise DataError(f"{path}: row {numbered[0][0]}: column {missing} is missing; {remedy}")
    if len(set(header)) != len(header):
        raise DataError(f"{path}: row {numbered[0][0]}: a column name occurs twice; remove one")
    return header, motion


def _row(path: Path, number: int, line: str, header: list[str]) -> list[float | None]:
    cells = next(csv.reader([line]))
    if len(cells) != len(header):
        raise DataError(
            f"{path}: row {number}: {len(cells)} cells, the header has {len(header)}; complete the row"
        )
    return [
        _number(cell.strip(), column, f"{path}: row {number}")
        for cell, column in zip(cells, header, strict=True)
    ]


def _number(text: str, named: str, where: str) -> float | None:
    """The number of a cell, NaN where it is empty; None for text in a column that nobody knows."""
    column = COLUMNS.get(named)
    if not text and not (column and column.required):
        return math.nan
    try:
        value = float(text)
    except ValueError:
        if column is None:
            return None
        value = math.inf  # beyond every bound: refused below, in the words for it
    if column is None or (column.blank and math.isnan(value)):
        return value
    if not column.low <= value <= column.high:
        raise DataError(
            f"{where}: column {named}: {text!r} is not a finite number within {column.low:g} to "
            f"{column.high:g}"
            f"{' ' + column.unit if column.unit else ''}; correct or drop the row"
        )
    return value


def _require_distinct(path: Path, numbered: list[tuple[int, str]]) -> None:
    """Refuse a file of which a part occurs twice: what is measured again differs in some digit."""
    first: dict[str, int] = {}
    repeats = [(number, first[line]) for number, line in numbered if first.setdefault(line, number) != number]
    if len(repeats) > REPEATS_SHARE * len(numbered):
        number, before = repeats[0]
        raise DataError(
            f"{path}: row {number} repeats row {before} to the last digit, and {len(repeats) - 1} more rows "
            "repeat others; remove the copies, they would be held out and trained on at once"
        )
