"""What a cell of a text table says: a number, a number with its unit, a time of day."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

_WITH_UNIT = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\W\d][\w/·*°%]{0,9}|[°%µ]\w{0,3})")
"""`0.001 sec`, `12.5ms`, `3 °`."""

_TIME_OF_DAY = re.compile(
    r"(?:(\d{1,4}[-/. ](?:\d{1,2}|[^\W\d]{3,9})[-/. ]\d{1,4})[T ,]\s*)?(?:(\d{1,6}) days?,? )?"
    r"(\d{1,2}):(\d{2}):(\d{2})(?:[.,:;](\d{1,9}))?\s*([AaPp][Mm])?(Z|[-+]\d{2}:?\d{2})?"
)
"""`14:02:11.250`, with a date before it (`26-Oct-2025` is MATLAB's) or without, with a zone behind it or
without; `14:02:11;250` as some controllers write it; `0 days 00:00:11.250` is a duration of pandas."""

_WITHOUT_MARKS = re.compile(r"(\d{8}[T ])(\d{2})(\d{2})(\d{2})((?:[.,]\d{1,9})?(?:Z|[-+]\d{2}:?\d{2})?)")
"""`20260302T115950.250`: the short form of ISO 8601, and of names of files."""

# a day on which the clocks change has another length; zones in the cells tell of it
DAY_S = 86400.0


@dataclass
class Words:
    """A column of cells that are no bare numbers: what they are in one unit, (n,), and that unit."""

    numbers: np.ndarray
    unit: str


_THOUSANDS = re.compile(r"[-+]?\d{1,3}(?:(?P<mark>[.,'\u2019 \u00a0\u202f])\d{3})+(?P<decimal>[.,])\d*")
"""`1.234,567`, `1,234.5`, `1'234.5`: a mark between the thousands, another one before the decimals."""


_WHOLE = re.compile(
    r"[-+]?(?:0|[1-9]\d{0,2}(?:(?P<mark>[.,'\u2019 \u00a0\u202f])\d{3}(?P<again>(?P=mark)\d{3})*)?)"
)
"""`7`, `65.536`, `1.761.436.788`: a whole number with a mark between the thousands, where it has any."""

_DECIMAL = re.compile(r"[-+]?\d+(?:(?P<decimal>[.,])\d+)?(?:[eE][-+]?\d+)?")


def thousands_and_decimal(columns: Sequence[Sequence[str]]) -> tuple[str, str] | None:
    """The marks between thousands and before decimals, where some cells have both, or one column has only
    this and another only that; else None."""
    found = {
        (match["mark"], match["decimal"])
        for cells in columns
        for match in map(_THOUSANDS.fullmatch, cells)
        if match and match["mark"] != match["decimal"]
    }
    if not found:
        found = {
            (mark, decimal)
            for mark in filter(None, map(_mark_of_whole, columns))
            for decimal in filter(None, map(_mark_of_decimals, columns))
            if mark != decimal
        }
    # two pairs of marks in one file contradict each other: nothing is guessed
    return found.pop() if len(found) == 1 else None


def _mark_of_whole(cells: Sequence[str]) -> str:
    """The mark between thousands of a column of whole numbers; "" where it may be that before three decimals:
    small numbers must be without it, or large ones have it twice."""
    matches = [_WHOLE.fullmatch(cell) for cell in cells]
    marks = {match["mark"] or "" for match in matches if match}
    sure = "" in marks or not marks & set(".,") or any(match and match["again"] for match in matches)
    return (marks - {""}).pop() if None not in matches and sure and len(marks - {""}) == 1 else ""


def _mark_of_decimals(cells: Sequence[str]) -> str:
    """The mark before decimals of a column of numbers that has no other; "" where there is none."""
    matches = [_DECIMAL.fullmatch(cell) for cell in cells]
    marks = {match["decimal"] for match in matches if match and match["decimal"]}
    return marks.pop() if None not in matches and len(marks) == 1 and not _mark_of_whole(cells) else ""


_COMMA = re.compile(r"\s*[-+]?\d+,\d+(?:[eE][-+]?\d+)?\s*")


def marks_of(
    columns: Sequence[Sequence[str]], given: str | None, texts: Sequence[str], delimiter: str | None = None
) -> str:
    """The mark before decimals, behind that between thousands if there is one, of cells of some columns;
    `given` is what somebody said of the former, `texts` are all that may have the latter."""
    found = thousands_and_decimal(columns)
    if found and given in (None, found[1]):
        return "".join(found)
    if given is None:
        # some numbers have a comma in place of a point, and none has a point
        cells = [cell for column in columns for cell in column if ":" not in cell]  # no times
        commas = any(map(_COMMA.fullmatch, cells)) and not any("." in cell for cell in cells)
        return "," if commas else "."
    # who says which mark is before decimals has said of the other one that it is between thousands: read as a
    # decimal point, `65.536` of a file with commas would be a thousandth of what it is
    other = "." if given == "," else ","
    return (other if other != delimiter and any(other in text for text in texts) else "") + given


_HEXADECIMAL = re.compile(r"(?:0[xX]|16#)([0-9a-fA-F]{1,16})")

MINUS = "\u2212"
"""The sign of typography, which spreadsheets and web pages put for a hyphen."""

_EXPONENT = re.compile(r"(?<=[\d.])[dD](?=[-+]\d{1,3}$)")
"""`1.5D-03` of Fortran; without a sign it may be hexadecimal."""

_GROUPED = re.compile(r"[-+\u2212]?[1-9]\d{0,2}(?:[.,'\u2019 \u00a0\u202f]\d{3})+(?:[.,]\d*)?")


def number(cell: str, marks: str) -> float | None:
    """The number of a cell, None if it is none; `marks`: that before decimals, behind that between thousands
    if there is one. `0x1F` and `16#1F` are hexadecimal."""
    for mark in marks[:-1]:
        if mark in cell and not _GROUPED.fullmatch(cell):
            return None
        cell = cell.replace(mark, "")
    if match := _HEXADECIMAL.fullmatch(cell):
        return float(int(match[1], 16))
    cell = _EXPONENT.sub("e", cell.replace(MINUS, "-"))
    if "_" in cell:  # Python's own notation: a name such as `1_2` would be 12
        return None
    try:
        return float(cell.replace(",", ".") if marks[-1] == "," else cell)
    except ValueError:
        return None


def read_cells(cells: Sequence[str], marks: str) -> Words | None:
    """A column of numbers, or what `read_words` reads; None if it is neither."""
    found = [number(cell, marks) for cell in cells]
    if None not in found:
        return Words(np.array(found, float), "")
    return read_words(cells, marks) if found[0] is None else None


def read_words(cells: Sequence[str], decimal: str) -> Words | None:
    """A column of times of day, as s since the first midnight, or of numbers that all have the same unit
    behind them; None if it is neither."""
    return _times_of_day(cells) or _with_unit(cells, decimal)


def _times_of_day(cells: Sequence[str]) -> Words | None:
    found, zones, dates = np.empty(len(cells)), np.zeros(len(cells)), []
    for row, cell in enumerate(cells):
        match = _TIME_OF_DAY.fullmatch(_WITHOUT_MARKS.sub(_marked, cell.strip(), count=1))
        if match is None:
            return None
        date, days, hour, minute, second, fraction, half, zone = match.groups()
        dates.append(re.findall(r"\d+", date or ""))  # its numbers: a month may be spelt in two ways
        # 12 AM is midnight, 12 PM noon
        hours = int(hour) % 12 + 12 * (half in {"PM", "pm", "Pm", "pM"}) if half else int(hour)
        part = int(fraction) / 10 ** len(fraction) if fraction else 0.0
        found[row] = DAY_S * int(days or 0) + 3600 * hours + 60 * int(minute) + int(second) + part
        if zone and zone != "Z":
            zones[row] = (-1 if zone[0] == "-" else 1) * (3600 * int(zone[1:3]) + 60 * int(zone[-2:]))
    found -= zones - zones[:1]  # clocks are put back in a night of autumn
    past_midnight = np.diff(found, prepend=found[:1]) < -DAY_S / 2  # back by more than half a day: midnight
    # a log that rested over night need not go back by as much; how many days it was makes no odds to a gap
    past_midnight[1:] |= np.array([one != other for one, other in pairwise(dates)], bool)
    return Words(found + DAY_S * np.cumsum(past_midnight), "s")


def _marked(match: re.Match[str]) -> str:
    date, hour, minute, second, rest = match.groups()
    return f"{date[:4]}-{date[4:6]}-{date[6:8]}T{hour}:{minute}:{second}{rest}"


def _with_unit(cells: Sequence[str], decimal: str) -> Words | None:
    found, units = np.empty(len(cells)), set()
    for row, cell in enumerate(cells):
        match = _WITH_UNIT.fullmatch(cell.strip().replace(",", ".") if decimal[-1] == "," else cell.strip())
        if match is None:
            return None
        found[row] = float(match[1])
        units.add(match[2])
    # one unit in all cells: `5 ms` below `3 s` would need a factor a row
    return Words(found, units.pop()) if len(units) == 1 else None
