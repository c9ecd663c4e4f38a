"""Lines of a text table: cells, what a serial monitor put before them, rows of units above the numbers, rows
of other topics between them."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence

from hw.playback.cells import number, read_words

UNIT_ROWS = 30
"""Most rows between the header and the first numbers: units, descriptions, settings of each channel."""

MONITORED = 200
"""Lines that are looked at for what a serial monitor put before them."""

_MONITOR = re.compile(r"\s*\d{2}:\d{2}:\d{2}[.,]\d{3}\s*->\s*")
"""`14:02:11.120 -> `: when a serial monitor got the line."""

LABELLED = re.compile(r"([^\W\d][\w./]*)\s*[:=]\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(?![\w.:])")
"""`q:1.25`, as the plotter of Arduino has it, Teleplot (`>q:1.25`), and `q=1.25` of logfmt."""

ENDS = ("EOF", "END")
"""Words of a last line."""


def cells_of(line: str, delimiter: str | None) -> list[str]:
    """Cells of a line without quotes and blanks around them."""
    if delimiter is None:
        # tabs are blanks here, and a quoted name may hold one
        return _quoted(line.replace("\t", " "), " ") if '"' in line else line.split()
    # csv is asked only where it is needed: a split takes a quarter of its time
    if '"' in line:
        return _quoted(line, delimiter)
    return [cell.strip() for cell in line.split(delimiter)]


def _quoted(line: str, delimiter: str) -> list[str]:
    rows = csv.reader([line.strip(" \r")], delimiter=delimiter, skipinitialspace=True)
    return [cell.strip() for cell in next(rows, [])]


def unstamped(lines: list[str]) -> list[str]:
    """Lines without the time of day that a serial monitor put before each."""
    first = [line for line in lines[:MONITORED] if line.strip()]
    # all of them: a table may have times of day in its first column, and some arrows in it
    if not first or not all(_MONITOR.match(line) for line in first):
        return lines
    return [_MONITOR.sub("", line) for line in lines]


def unlabelled(lines: list[str]) -> list[str]:
    """Lines without the name before each value, `q:1.25, tau:0.5` or `q=1.25 tau=0.5`, below one line of
    these names."""
    first = [line for line in lines[:MONITORED] if line.strip()]
    names = _labels(first[0])[0] if first else []
    # all of them, and nothing else: settings above a table have names before their values, too
    # the last of a short log may have been cut off
    if not names or any(_labels(line)[0] != names for line in first[1:-1]):
        return lines
    rows = (_labels(line) for line in lines if line.strip())
    # a line of other names, as the last one that was cut off, keeps its place: its first cell is no number
    return [",".join(names), *(",".join(values if own == names else own) for own, values in rows)]


def _labels(line: str) -> tuple[list[str], list[str]]:
    """Names and values of a line of nothing but these; none without."""
    found = LABELLED.findall(line)
    bare = not LABELLED.sub("", line).strip(" \t,;|>")
    return ([name for name, _ in found], [value for _, value in found]) if bare else ([], [line])


def some_lines(body: Sequence[str]) -> Sequence[str]:
    """Some 200 lines all over the table: a joint at rest at the start has small numbers, which have no mark
    between thousands."""
    return body[:: max(1, len(body) // 200)]


def is_number(cell: str) -> bool:
    """Whether a cell is a number, with a decimal point or comma."""
    return number(cell, ",") is not None


def unit_rows(
    body: list[str], index: Sequence[int], delimiter: str | None, *, headed: bool
) -> tuple[list[list[str]], list[str]]:
    """Rows above the first numbers, and the rest. Without a header of its own a line of words is a fault of
    the rows.

    The first of them has no number; those below it may have some (`Port  501  Port  501`), but a word in a
    wanted cell."""
    rows: list[list[str]] = []
    for line in body[:UNIT_ROWS]:
        cells = cells_of(line, delimiter)
        wanted = [cells[k] for k in index if k < len(cells)]
        numbers = [is_number(cell) or read_words([cell], ".") is not None for cell in wanted]
        words = [bool(cell) and not number for cell, number in zip(wanted, numbers, strict=True)]
        alone = (
            headed and not wanted and not is_number(cells[0])
        )  # `trace_values`: a word that ends the header
        blank = bool(rows) and headed and not any(wanted)  # `;;;;` below the settings of each channel
        if not alone and not blank and (not any(words) or (any(numbers) and not (rows and headed))):
            break
        rows.append(cells)
    return (rows, body[len(rows) :]) if len(body) > len(rows) else ([], body)


def of_these_columns(body: list[str], index: Sequence[int], delimiter: str | None) -> list[str]:
    """Rows without those that have a stamp and nothing else that is wanted (another topic in the same table),
    and without the word at the end."""
    # at the very end only: a word in the middle is a fault that must be told
    if body and body[-1].strip().strip('"') in ENDS:
        body = body[:-1]
    # of two columns a stamp and one value are all that is wanted: a row without the value is a fault
    if len(index) < 3 or delimiter is None:
        return body
    several = delimiter * 2
    if not any(several in line or line.endswith(delimiter) for line in body):
        return body
    kept = []
    for line in body:
        cells = cells_of(line, delimiter)
        given = sum(at < len(cells) and bool(cells[at]) for at in index)
        if given != 1:
            kept.append(line)
    return kept if len(kept) > 1 else body
