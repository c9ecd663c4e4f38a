"""Columns of a text table as programs write them: delimiter, decimal comma, comments, unit rows and lines
above the header are found.

The header is the first line that has every wanted name, whatever it is delimited by, so that nothing need be
guessed. `#2` is the second column by its place, for a column without a name and for a table without a header.
"""

from __future__ import annotations

import io
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hw.interface import BackendError
from hw.playback import other_clocks
from hw.playback.cells import marks_of, number, read_cells, read_words
from hw.playback.message_lines import of_messages
from hw.playback.text_rows import (
    cells_of,
    is_number,
    of_these_columns,
    some_lines,
    unit_rows,
    unlabelled,
    unstamped,
)
from hw.playback.wrong_cells import first_wrong, in_rows, no_number

DELIMITERS = (",", ";", "\t", "|", None)
"""Tried in this order; None is any white space."""

HEADER_LINES = 200
"""The header is among so many lines."""

ROWS_IN_A_ROW = 5
"""As many lines of numbers are rows, not settings above a table."""

_SAYS_UNITS = re.compile(r"\W*(vertical[ _])?(units?|einheit(en)?|y_unit_label)\W", re.IGNORECASE)
"""A line above the header that gives a unit for each column, as oscilloscopes (`Vertical Units,V,V`) and
LabVIEW (`Y_Unit_Label`) write it."""

COMMENTS = ("#", "%", "//")

PLACE = re.compile(r"#([1-9]\d{0,3})")  # from 1 on: `#0` would be the last column, by -1


class NoColumnError(BackendError):
    """A file without a wanted column; `column` is its name."""

    def __init__(self, column: str, text: str) -> None:
        super().__init__(text)
        self.column = column


@dataclass
class Table:
    """Numbers by name, (n,) each, what unit rows say of them (empty without), the time from row to row, s
    (0: the file does not say), and what else it says of its time."""

    columns: dict[str, np.ndarray]
    units: dict[str, str] = field(default_factory=dict)
    step_s: float = 0.0
    clocks: tuple[other_clocks.Clock, ...] = ()


@dataclass(frozen=True)
class _Layout:
    """Where the names stand: index of the header line (-1: none), delimiter, index of each wanted column."""

    header: int
    delimiter: str | None
    index: tuple[int, ...]
    extra: int = 0
    """Commas at the header's end where commas delimit nothing: a spreadsheet wrote the line into one cell."""

    def line(self, text: str) -> str:
        """The line without what the spreadsheet added."""
        return ",".join(text.split(",")[: -self.extra]) if self.extra else text


def read_text(
    path: Path, text: str, names: tuple[str, ...], delimiter: str | None = None, decimal: str | None = None
) -> Table:
    """Read the named columns of a text table.

    Parameters
    ----------
    delimiter
        Between two cells. None: found.
    decimal
        "." or ",". None: found; a comma only where it delimits nothing.

    Raises
    ------
    BackendError
        No header with these names, no rows, a cell that is no number (with column and row, from 1 below the
        header)."""
    lines = of_messages(unlabelled(unstamped(text.rstrip("\0").split("\n"))))
    layout = _layout(path, lines, names, delimiter)
    head = _uncommented(layout.line(lines[layout.header])) if layout.header >= 0 else None
    body = [
        layout.line(line)
        for line in lines[layout.header + 1 :]
        if line.strip() and not line.lstrip().startswith(COMMENTS)
    ]
    units, body = unit_rows(body, layout.index, layout.delimiter, headed=layout.header >= 0)
    body = of_these_columns(body, layout.index, layout.delimiter)
    units += [
        cells_of(line, layout.delimiter) for line in lines[: max(0, layout.header)] if _SAYS_UNITS.match(line)
    ]
    if not body:
        raise BackendError(f"{path}: no rows below the header")
    _require_names(path, body, layout, head, names)
    marks = marks_of(_sampled(body, layout), decimal, body, layout.delimiter)
    said = {name: _unit_text(units, at) for name, at in zip(names, layout.index, strict=True)}
    try:
        numbers = _fast(body, layout, marks)
    except ValueError:
        numbers, spelt = _cell_by_cell(path, body, layout, names, marks, head)
        said |= spelt
    headed = cells_of(head, layout.delimiter) if head is not None else []
    clocks = other_clocks.above(lines[: max(0, layout.header)], headed, units)
    clocks += other_clocks.beside(headed, body, layout.delimiter, layout.index, marks)
    return Table({name: numbers[:, k] for k, name in enumerate(names)}, said, clocks=clocks)


def _require_names(
    path: Path, body: list[str], layout: _Layout, head: str | None, names: tuple[str, ...]
) -> None:
    """Refuse rows that have more cells than the header has names, each of them: which of them is without a
    name nobody says, and one in front moves all others. A column by its place needs none."""
    if head is None or all(map(PLACE.fullmatch, names)):
        return
    header = len(cells_of(head, layout.delimiter))
    # of delimiters alone, which end each row of some programs, come empty cells
    cells = [
        cells_of(line.rstrip(f"{layout.delimiter or ''} \t"), layout.delimiter) for line in some_lines(body)
    ]
    fewest = min(map(len, cells))
    if fewest > header:
        raise BackendError(
            f"{path}: every row has {fewest} cells or more, and the header {header} names: a number of the "
            "row in front (R writes one), a column without a name behind, or a decimal comma where a comma "
            "delimits; give each column a name, or name the columns by their places (#2)"
        )


def _uncommented(line: str) -> str:
    return line.lstrip().lstrip("#%/") if line.lstrip().startswith(COMMENTS) else line


def _layout(path: Path, lines: list[str], names: tuple[str, ...], given: str | None) -> _Layout:
    """The last line with every wanted name above the first numbers: settings may name the columns too
    (`# columns: t q tau`)."""
    tried = DELIMITERS if given is None else (given,)
    named = [name for name in names if not PLACE.fullmatch(name)]
    found: list[str] = []
    between: str | None = None
    layout: _Layout | None = None
    for row, line in enumerate(lines[:HEADER_LINES]):
        if layout and _is_row(line, layout):
            break
        for delimiter in tried:
            bare = line if delimiter == "," else line.rstrip(",")
            cells = _named_cells(bare, delimiter, named)
            if cells and (layout is None or all(cells.count(name) == 1 for name in named)):
                index = tuple(_index(path, cells, name) for name in names)
                if layout is None or index != layout.index:
                    layout = _Layout(row, delimiter, index, len(line) - len(bare))
                break
            words = cells_of(_uncommented(bare), delimiter)
            if delimiter and len(words) > len(found) and not any(map(is_number, words)):
                found, between = words, delimiter
    if layout:
        return layout
    if not named:
        return _by_place(lines, names, tried)
    missing = next((name for name in named if name not in found), named[0])
    # cut as the header is: `vel [rad/s]` cut at blanks is a header with `vel` in it, and no row
    rows = (zip(found, cells_of(line, between), strict=False) for line in lines[:HEADER_LINES])
    raise NoColumnError(
        missing,
        f"{path}: no column {missing!r}; the header has: "
        f"{', '.join(cell or '(no name)' for cell in found)[:500]}"
        + ("; a column is named by its place, too: #1, #2, ..." if "" in found or not found else "")
        + _no_unit(missing, found)
        + in_rows(missing, [own for row in rows for own, cell in row if cell == missing]),
    )


def _no_unit(missing: str, found: list[str]) -> str:
    name, _, unit = missing.rpartition(":")  # of `angle:foo` on a command line
    return f"; {name} is there, and {unit!r} is no unit" if name and name in found else ""


def _named_cells(line: str, delimiter: str | None, named: list[str]) -> list[str]:
    """Cells of a line, a comment or not, that has every one of the names; none else."""
    for text in dict.fromkeys((_uncommented(line), line)):
        cells = cells_of(text, delimiter)
        if named and all(name in cells for name in named):
            return cells
    return []


def _is_row(line: str, layout: _Layout) -> bool:
    """Whether there is a number in a wanted cell, and it is no comment."""
    if line.lstrip().startswith(COMMENTS):
        return False
    cells = cells_of(layout.line(line), layout.delimiter)
    return any(is_number(cells[k]) for k in layout.index if k < len(cells))


def _by_place(lines: list[str], names: tuple[str, ...], tried: tuple[str | None, ...]) -> _Layout:
    """All columns by place: the rows begin where several lines in a row have numbers there."""
    index = tuple(int(name[1:]) - 1 for name in names)
    for delimiter in tried:
        run = 0
        for row, line in enumerate(lines[:HEADER_LINES]):
            bare = line if delimiter == "," else line.rstrip(",")
            cells = cells_of(bare, delimiter)
            run = run + 1 if max(index) < len(cells) and all(is_number(cells[k]) for k in index) else 0
            if run == ROWS_IN_A_ROW or (run and not any(rest.strip() for rest in lines[row + 1 : row + 2])):
                return _Layout(row - run, delimiter, index, len(line) - len(bare))
    return _Layout(-1, tried[0], index)


def _index(path: Path, cells: list[str], name: str) -> int:
    place = PLACE.fullmatch(name)
    if place and name not in cells:
        index = int(place[1]) - 1
        if not 0 <= index < len(cells):
            raise BackendError(f"{path}: no column {name}; the header has {len(cells)} columns")
        return index
    if cells.count(name) != 1:
        places = [f"#{k + 1}" for k, cell in enumerate(cells) if cell == name]
        raise BackendError(
            f"{path}: more than one column {name!r}: name it by its place, {' or '.join(places[:4])}; the "
            f"header has: {', '.join(cells)[:500]}"
        )
    return cells.index(name)


def _unit_text(rows: list[list[str]], at: int) -> str:
    return next((cells[at] for cells in rows if at < len(cells) and cells[at]), "")


def _sampled(body: list[str], layout: _Layout) -> list[list[str]]:
    """Cells of each wanted column in some 200 lines all over the table."""
    lines = [cells_of(line, layout.delimiter) for line in some_lines(body)]
    return [[cells[k] for cells in lines if k < len(cells)] for k in layout.index]


def _fast(body: list[str], layout: _Layout, marks: str) -> np.ndarray:
    text = "\n".join(body)
    # `loadtxt` would split a quoted cell where the delimiter is in it, and shift what stands behind
    if '"' in text or len(marks) > 1:
        raise ValueError
    if marks == ",":
        if layout.delimiter == ",":
            raise ValueError
        text = text.replace(",", ".")
    return np.loadtxt(  # comments are gone; a # in a cell must not cut its row
        io.StringIO(text), delimiter=layout.delimiter, usecols=layout.index, ndmin=2, comments=None
    )


def _cell_by_cell(
    path: Path, body: list[str], layout: _Layout, names: tuple[str, ...], marks: str, head: str | None
) -> tuple[np.ndarray, dict[str, str]]:
    """Numbers of all rows, slowly: quoted cells, times of day and units behind numbers (which columns say
    which), and the first cell that is no number by its column and row."""
    table = [cells_of(line, layout.delimiter) for line in body]
    header = cells_of(head, layout.delimiter) if head is not None else []
    columns: list[np.ndarray] = []
    said: dict[str, str] = {}
    first = None
    for name, at in zip(names, layout.index, strict=True):
        cells = [row[at] if at < len(row) else "" for row in table]
        if words := read_cells(cells, marks):
            columns.append(words.numbers)
            said |= {name: words.unit} if words.unit else {}
        else:
            found = [number(cell, marks) for cell in cells]
            wrong = (
                found.index(None)
                if found[0] is not None or read_words(cells[:1], marks) is None
                else first_wrong(cells, marks)
            )
            # of one row by its first cell: a footer has its word there, and nothing behind
            first = min(first or (wrong, at, name), (wrong, at, name))
    if first:
        wrong, at, name = first
        raise BackendError(no_number(path, body, layout.delimiter, name, at, wrong, header))
    return np.column_stack(columns), said
