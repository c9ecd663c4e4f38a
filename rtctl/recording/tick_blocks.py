"""Many ticks as one ROS 2 message of columns (`ros2msg`, `cdr`), and back: what a recording of a quick loop
is made of.

A column has one number for each tick, or a single one where all are the same; counters and clocks are told by
their steps, and their sum from the first on is the column. Every bit is kept. All words have 8 bytes, the
lengths before the columns with their padding, too."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

import numpy as np

from hw.record_fields import placed
from rtctl.errors import DataError
from rtctl.recording import mcap_format as fmt
from rtctl.recording.jit import compiled
from rtctl.recording.tick_cdr import ENCAPSULATION, TYPE_OF, file_order, lines_of
from rtctl.tick import FIELD, Field, forget, tick_dtype

SCHEMA_NAME = "rtctl_msgs/msg/TickColumns"

_STEPPED = ("tick", "time_ns", "sample_count", "target_age_ticks")
"""What counts up: its steps repeat, the numbers themselves never do."""
_STEP = "_step"

_LINE = re.compile(r"(int64|uint64|float64)\[\] ([a-z][a-z0-9_]{0,63})")
_BLOCK = 64
"""Ticks that are turned at a time: they fit into the first cache."""


@dataclass(frozen=True)
class Column:
    """A field in a block: its name in the tick, and whether its steps are told."""

    name: str
    stepped: bool


def _written(field: Field) -> str:
    return field.name + _STEP if field.name in _STEPPED else field.name


@cache
def schema_text(n_axes: int) -> str:
    """The `ros2msg` definition of a block of ticks of a rig with `n_axes` axes."""
    lines = []
    for field in _order():
        of = {
            "scalar": "",
            "axis": f"; {n_axes} axes, one after another",
            "xyz": "; x, y, z, one after another",
        }
        meaning = (
            f"{field.meaning} [{field.unit}]{of[field.shape] if n_axes > 1 or field.shape == 'xyz' else ''}"
        )
        summed = "; steps, the first from 0: add them up" if field.name in _STEPPED else ""
        lines.append(f"{TYPE_OF[field.kind]}[] {_written(field)} # {meaning}{summed}\n")
    return "# Each: one number per tick, or a single one where all are the same.\n" + "".join(lines)


def _order() -> tuple[Field, ...]:
    """The ticks' numbers come first, since they say how many ticks there are: never a single one for
    several."""
    return (FIELD["tick"], *(field for field in file_order() if field.name != "tick"))


@cache
def own_columns() -> tuple[Column, ...]:
    """The columns as this version writes them."""
    return columns_of(schema_text(1).encode())


@cache
def columns_of(schema: bytes) -> tuple[Column, ...]:
    """The columns of a definition. Raises DataError for one that is damaged or of another kind."""
    found: list[Column] = []
    for kind, name in lines_of(schema, _LINE, "blocks of ticks"):
        column = Column(name, stepped=False)
        if name.endswith(_STEP) and name.removesuffix(_STEP) in _STEPPED:
            column = Column(name.removesuffix(_STEP), stepped=True)
        if column.name in FIELD and kind != TYPE_OF[FIELD[column.name].kind]:
            raise DataError(f"the schema of the blocks of ticks says that {column.name} is {kind}")
        found.append(column)
    names = [column.name for column in found]
    # the ticks' numbers first, by their steps: `count_of` reads there how many ticks there are
    if len(set(names)) < len(names) or found[:1] != [Column("tick", stepped=True)]:
        raise DataError("the schema of the blocks of ticks is damaged")
    return tuple(found)


def encode(rows: np.ndarray, channel: int, sequence: int, time_ns: int) -> bytes:
    """MCAP message record of successive ticks, shape (n,), n >= 1; `sequence` and `time_ns` (since 1970) of
    the first."""
    n = len(rows)
    words = np.ascontiguousarray(rows).view(np.uint64).reshape(n, -1)
    # as words: a NaN is then equal to itself, and -0 is not 0
    same = (words == words[0]).all(axis=0)
    table, lengths, at = [], [], 0
    for column in own_columns():
        kind, offset = placed(rows.dtype, column.name)
        first, count = offset // 8, kind.itemsize // 8
        # steps stay a number each, though they repeat: by the length of those of `tick` the ticks are counted
        # all words of a vector together: a column has one length
        one = not column.stepped and same[first : first + count].all()
        length = 1 if one else n
        lengths.append((at, count * length))
        table += [(first + k, at + 1 + k * length, int(not one)) for k in range(count)]
        at += 1 + count * length  # its length, then its numbers
    out = np.empty(at, np.uint64)
    places, counts = np.array(lengths).T
    out[places] = counts
    to_columns(words, np.array(table), out)
    for column, (at, _) in zip(own_columns(), lengths, strict=True):
        # the first stays whole: a reader adds up from it
        if column.stepped:
            out[at + 2 : at + 1 + n] = np.diff(out[at + 1 : at + 1 + n])
    return fmt.message(channel, sequence, time_ns, ENCAPSULATION + out.tobytes())


def count_of(records: bytes, start: int) -> int:
    """How many ticks the message that begins at `start` says that it has."""
    return int.from_bytes(records[start + 4 : start + 12], "little")


@dataclass(frozen=True)
class Block:
    """The columns of a message, found to be sound, that become ticks when they are asked for.

    Attributes
    ----------
    words, table
        Its words, and where in them the columns are (`to_columns`).
    steps
        Name of each field that is told by its steps -> where its column is.
    n : int
        How many ticks.
    row
        Dtype of a tick.
    missing
        Fields that the block lacks."""

    words: np.ndarray
    table: np.ndarray
    steps: dict[str, int]
    n: int
    row: np.dtype[np.void]
    missing: tuple[str, ...]

    def column(self, name: str) -> np.ndarray:
        """A field of one number per tick, shape (n,), by itself."""
        kind, offset = placed(self.row, name)
        for word, at, each in self.table.tolist():
            if word == offset // 8:
                found = self.words[at : at + (self.n if each else 1)].view(kind)
                # a view of one number as often as there are ticks: nothing is copied
                return np.cumsum(found) if name in self.steps else np.broadcast_to(found, self.n)
        return np.full(self.n, np.nan if kind.kind == "f" else 0, kind)

    def rows(self, out: np.ndarray | None = None) -> np.ndarray:
        """The ticks, shape (n,), in `out` where one is given. Of fields that the block lacks they say nothing
        (`forget`)."""
        # empty: every word is written below, by a column or as missing
        rows = np.empty(self.n, self.row) if out is None else out
        forget(rows, self.missing)
        to_rows(self.words, self.table, rows.view(np.uint64).reshape(self.n, -1))
        for name, at in self.steps.items():
            # as signed numbers: a counter that began anew steps down, and wraps back right in 64 bits
            rows[name] = np.cumsum(self.words[at : at + self.n].view(np.int64))
        return rows


def decode(records: bytes, start: int, end: int, columns: tuple[Column, ...], n_axes: int) -> Block:
    """The columns of the message that lies in `records` from `start` to `end`; those that are unknown are
    left out.

    Raises
    ------
    DataError
        What is no block with these columns, or is of a rig of another size."""
    # 4 bytes of encapsulation, then words
    if records[start : start + 4] != ENCAPSULATION or (end - start) % 8 != 4:
        raise DataError("a block of ticks is not little-endian CDR")
    words = np.frombuffer(records, np.uint64, (end - start) // 8, start + 4)  # where they lie, aligned or not
    n = count_of(records, start)
    # each tick has a word of `tick` at least, besides the lengths
    if not 0 < n < len(words):
        raise DataError("a block of ticks has no ticks")
    row = tick_dtype(n_axes)
    table, steps, at = [], [], 0
    for column in columns:
        # a length beyond the end is told by the next line, as one that is too long
        length = int(words[at]) if at < len(words) else len(words)
        if length > len(words) - at - 1:
            raise DataError("a block of ticks is shorter than it says")
        if column.name in FIELD:
            kind, offset = placed(row, column.name)
            count = kind.itemsize // 8
            # steps are never a single one for several ticks; nor none: the sum would be of the next column
            if length not in {count * n, count * n if column.stepped else count}:
                raise DataError(f"a block of ticks has {length} numbers of {column.name}")
            # 1, or as many as ticks: how far apart two words of a vector lie
            each = length // count
            table += [(offset // 8 + k, at + 1 + k * each, int(each == n)) for k in range(count)]
            steps += [(column.name, at + 1)] if column.stepped else []
        at += 1 + length
    if at != len(words):
        raise DataError("a block of ticks is longer than it says")
    known = {column.name for column in columns}
    missing = tuple(name for name in row.names or () if name not in known)
    return Block(words, np.array(table), dict(steps), n, row, missing)


@compiled
def to_columns(rows: np.ndarray, table: np.ndarray, out: np.ndarray) -> None:
    """Turn ticks as words, shape (n, words of a tick), into columns.

    Each row of `table`: word of the tick; place in `out`; 1 where the column has a number for every tick, 0
    where it has one for all."""
    for begin in range(0, len(rows), _BLOCK):
        for c in range(len(table)):
            word, at, each = table[c, 0], table[c, 1], table[c, 2]
            for i in range(begin, min(begin + _BLOCK, len(rows)) if each else begin + 1):
                out[at + each * i] = rows[i, word]  # `each` is 0 where one number is for all


@compiled
def to_rows(columns: np.ndarray, table: np.ndarray, out: np.ndarray) -> None:
    """Turn columns back into ticks: the inverse of `to_columns`."""
    for begin in range(0, len(out), _BLOCK):
        for c in range(len(table)):
            word, at, each = table[c, 0], table[c, 1], table[c, 2]
            for i in range(begin, min(begin + _BLOCK, len(out))):
                out[i, word] = columns[at + each * i]
