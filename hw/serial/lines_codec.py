"""Lines of text to numbers and numbers to lines of text. No I/O; bounded work whatever comes.

A line is taken only whole: from the first end of line on, never longer than `LINE_MAX`, with the prefix, the
number of columns, the decimals and the checksum that it must have. What is no plain decimal number is damage;
`nan`, `inf` and `ovf` (as microcontrollers print them), or a number too large for a float, are a failure of
the device."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from hw.interface import Options

# a board that prints no end of line must not fill the memory of the loop
LINE_MAX = 250
"""Most characters of a line, its end not counted."""

# some 27 us each for four numbers: more in a cycle would take its time, and only the newest is shown
LINES_MAX = 32
"""Most lines read of one chunk, the newest; older ones are counted and passed over."""

NUMBER_MAX = 1e9
"""Largest number written, however small the scale."""

_NUMBER = re.compile(rb"[+-]?(?:[0-9]+(?:\.([0-9]*))?|\.([0-9]+))(?:[eE][+-]?[0-9]{1,3})?")
_WHOLE = re.compile(rb"[0-9]{1,15}")  # 15 digits: exact as a float64
_NOT_FINITE = re.compile(rb"[+-]?(?:nan|inf|infinity|ovf)(?:\([a-z0-9]*\))?", re.IGNORECASE)

DAMAGED = "damaged"
INVALID = "invalid"


def nmea(text: bytes) -> int:
    """Exclusive or of all bytes."""
    total = 0
    for byte in text:
        total ^= byte
    return total


def sealed(text: bytes, checksum: str) -> bytes:
    """A line with its checksum."""
    return text + b"*%02X" % nmea(text.removeprefix(b"$")) if checksum == "nmea" else text


class Lines:
    """Cuts a stream into lines."""

    def __init__(self) -> None:
        self._pending, self._whole = b"", False
        self.skipped = 0
        """Lines passed over because newer ones came with them."""

    def forget(self) -> None:
        """A new stream begins: what comes before its first end of line may be the rest of a line."""
        self._pending, self._whole = b"", False

    def cut(self, data: bytes) -> list[bytes | None]:
        """The lines that end in `data`, oldest first; None in place of one that is too long. Empty ones are
        left out."""
        # \r\n leaves an empty line between, which is passed over
        first, *others = data.replace(b"\r", b"\n").split(b"\n")
        if len(self._pending) <= LINE_MAX:  # else too long already: it grows no more
            self._pending += first
        if not others:
            return []
        lines = [line for line in (self._pending if self._whole else b"", *others[:-1]) if line]
        self._pending, self._whole = others[-1], True
        if len(lines) > LINES_MAX:
            self.skipped += len(lines) - LINES_MAX
        return [line if len(line) <= LINE_MAX else None for line in lines[-LINES_MAX:]]


class LineReader:
    """Reads the numbers of a line.

    Parameters
    ----------
    table
        `[device.options.sample]`, dumped."""

    def __init__(self, table: Options) -> None:
        self._prefix = table["prefix"].encode()
        # None: bytes.split takes any run of blanks
        self._separator = None if table["separator"] == " " else table["separator"].encode()
        self._columns, self._sealed = int(table["columns"]), table["checksum"] == "nmea"
        whole = ("estop", "fault", "enabled", "sequence")
        self._wanted = [
            (field["column"], field["channel"] in whole, field["decimals"]) for field in table["field"]
        ]

    def read(self, line: bytes) -> list[float] | str | None:
        """Numbers of the fields, in their order; `DAMAGED` or `INVALID`; None for a line of another kind."""
        if self._sealed:
            text, star, digits = line.rpartition(b"*")
            try:
                # NMEA 0183 sums up what stands between $ and *
                right = bool(star) and len(digits) == 2 and int(digits, 16) == nmea(text.removeprefix(b"$"))
            except ValueError:
                right = False
            if not right:
                return DAMAGED
            line = text
        # after the checksum: a damaged line may look like one of another kind
        if not line.startswith(self._prefix):
            return None
        cells = line[len(self._prefix) :].split(self._separator)
        # exactly: a lost separator joins two numbers, a lost digit beside it is seen by `decimals` only
        if len(cells) != self._columns:
            return DAMAGED
        numbers = []
        for column, whole, decimals in self._wanted:
            number = _number(cells[column].strip(b" \t"), decimals, whole=whole)
            if isinstance(number, str):
                return number
            numbers.append(number)
        return numbers


def _number(cell: bytes, decimals: int | None, *, whole: bool) -> float | str:
    if whole:
        # no float: 1.5 of a counter is a column that is another one
        return float(cell) if _WHOLE.fullmatch(cell) else DAMAGED
    if _NOT_FINITE.fullmatch(cell):
        return INVALID
    found = _NUMBER.fullmatch(cell)
    if found is None or (decimals is not None and len(found[1] or found[2] or b"") != decimals):
        return DAMAGED
    value = float(cell)
    return value if math.isfinite(value) else INVALID


class LineWriter:
    """Writes the line of a command.

    Parameters
    ----------
    table
        `[device.options.command]`, dumped.
    units
        SI units per unit of each field."""

    def __init__(self, table: Options, units: Sequence[float]) -> None:
        self._checksum, life = table["checksum"], float(table["time_to_live_ms"])
        # in the order of the file
        self._parts = [_Part(field, unit, life) for field, unit in zip(table["field"], units, strict=True)]

    def write(self, values: Sequence[float], *, enabled: bool) -> bytes:
        """The line for `values`, one per axis in SI; zeros when not enabled, or when any of them is not
        finite."""
        # one value that is none disables every axis, as in the other drivers
        on = enabled and all(math.isfinite(value) for value in values)
        return sealed(b"".join(part.write(values, on=on) for part in self._parts), self._checksum)


class _Part:
    """A prefix and a number."""

    def __init__(self, field: Options, unit: float, time_to_live_ms: float) -> None:
        self._prefix: bytes
        self._prefix, self._channel, self._axis = (
            field["prefix"].encode(),
            field["channel"],
            int(field["axis"]),
        )
        self._decimals, self._steps = int(field["decimals"]), 10.0 ** field["decimals"]
        self._limit, self._scale, self._zero = (
            field["limit"] * unit,
            field["scale"] * unit,
            float(field["zero"]),
        )
        self._on, self._off = (b"0", b"1") if field["invert"] else (b"1", b"0")
        self._life = time_to_live_ms

    def write(self, values: Sequence[float], *, on: bool) -> bytes:
        if self._channel == "enable":
            return self._prefix + (self._on if on else self._off)
        if self._channel == "time_to_live":
            return self._prefix + b"%g" % self._life
        number = 0.0
        if on:
            # in SI first: the limit is of the torque, whatever the board's unit and sign are
            value = min(max(values[self._axis], -self._limit), self._limit) / self._scale
            # cut off toward 0
            number = int(min(max(value, -NUMBER_MAX), NUMBER_MAX) * self._steps) / self._steps
        return self._prefix + b"%.*f" % (self._decimals, number + self._zero)
