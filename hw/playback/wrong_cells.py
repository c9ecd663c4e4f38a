"""What is said of a cell of a text table that is no number."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from hw.playback.cells import number, read_words
from hw.playback.text_rows import UNIT_ROWS, cells_of

ENDED_ROWS = 10
"""A column that ends by more rows before the others is of another rate."""

MEASURED = (
    "; drop the row if nothing was measured in it (a gap in the stamps is fine): every cell of a mapped "
    "column must be a number"
)

_COMMA = re.compile(r"[-+]?\d+,\d+")
_REMARK = re.compile(r"[-+\d.,eE]+\s*(#|//|%|;|\(\*|\s[^\W\d]).*")
"""A number with words behind it."""

_SHOWN = re.compile(r"(\d{1,4}[./-]\d{1,2}[./-]\d{1,4} )?\d{1,2}:\d{2}(\.\d)?")
"""A time as a spreadsheet shows it: `02:11.1` without the hour, `28.11.2026 15:02` without s."""

_HEXADECIMAL = re.compile(r"[0-9a-fA-F]{4}|[0-9a-fA-F]{8}")


def first_wrong(cells: list[str], decimal: str) -> int:
    """Row of the first cell that does not read as those above it."""
    # by halves: reading a million cells once for each row would take days
    low, high = 1, len(cells)
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if read_words(cells[: middle + 1], decimal) is None else (middle + 1, high)
    return low


def no_number(
    path: Path, body: list[str], delimiter: str | None, name: str, at: int, row: int, header: list[str]
) -> str:
    """What is wrong with the cell of a row (from 0), and the remedy; `header`: the cells of the header, none
    without."""
    cells = cells_of(body[row], delimiter)
    where = f"{path}: column {name!r} row {row + 1}"
    # before anything about the cell itself: a second header has words in every column
    if header and header in [cells_of(line, delimiter) for line in body[row : row + UNIT_ROWS]]:
        return (
            f"{path}: row {row + 1} begins another table, with the header again: two logs or more in one "
            "file (segments, in LabVIEW); cut it there and give each (--log), or write one header only"
        )
    if at >= len(cells):
        return (
            f"{where}: the row has {len(cells)} cells only, the file may be cut off; complete or drop the "
            "row: every cell must be a number"
        )
    if not cells[at]:
        # asked of the whole column: one hole is a fault, a column of holes another topic
        blank = [at >= len(each) or not each[at] for each in (cells_of(line, delimiter) for line in body)]
        empty = sum(blank)
        if ENDED_ROWS < len(body) - row == empty < len(body):
            return (
                f"{where}: the column ends there, {empty} rows before the others: a channel of another rate, "
                "whose rows are not those beside it; bring it to the times of the others by the column of "
                "its own times (interp of numpy)"
            )
        whole = (
            "the column is empty in every row"
            if empty == len(body)
            else f"an empty cell ({empty} of {len(body)} rows; columns that are filled in different rows are "
            "of two topics or rates: keep the rows of the slower one, with the other filled in by time, as "
            "interpolate of pandas does)"
        )
        return (
            f"{where}: {whole}; map another column, or drop the rows (a gap in the stamps is fine): every "
            "cell must be a number"
        )
    below = [cells_of(line, delimiter) for line in body[row:]]
    if (
        header
        and len(below) <= UNIT_ROWS
        and row > len(below)
        and all(at < len(each) and number(each[at], ",") is None for each in below)
    ):
        return (
            f"{where}: {cells[at][:40]!r} is not a number: from there on {len(below)} row(s) are none of "
            "the log (a footer, of statistics?); delete them"
        )
    return f"{where}: {cells[at][:40]!r} is not a number{_instead(cells[at]) or _meant(below, at) + MEASURED}"


def _instead(cell: str) -> str:
    """What a cell is that has a number in it, and the remedy; "" where it is none."""
    if cell.startswith(("[", "(")):
        return " but a list: write each of its elements to a column of its own, and map the joint's"
    if _REMARK.fullmatch(cell) and read_words([cell], ".") is None:
        return ": a remark behind one; delete the remark, or write it to a line of its own with a # first"
    return ""


def _meant(below: list[list[str]], at: int) -> str:
    """What a cell, the first of those from it down, may be meant as."""
    if all(_HEXADECIMAL.fullmatch(each[at]) for each in below if at < len(each)):
        return " (hexadecimal? Write 0x before each)"
    if _SHOWN.fullmatch(below[0][at]):
        return (
            " (a time as a spreadsheet shows it, whose ms are lost: format the column as hh:mm:ss.000 and "
            "save the file anew, or give --rate-hz in its place)"
        )
    if _COMMA.fullmatch(below[0][at]):
        return " (with a decimal comma? Other cells have a point: say which it is, --decimal comma)"
    return ""


def in_rows(name: str, columns: Sequence[str]) -> str:
    """What is said of a wanted column whose name stands in rows of these columns; "" without."""
    if not columns:
        return ""
    if len(columns) == 1:
        return (
            f"; {name!r} stands in one row alone, as in a second row of names: map the places (#1, #2, ...)"
        )
    of = columns[0]
    return (
        f"; {name!r} stands in the rows of {of!r}, a row for each signal: make a column of each first, with "
        f"pandas: table.pivot_table(index=TIME, columns={of!r}, values=VALUE).interpolate('index')"
        ".dropna().to_csv('wide.csv')"
    )
