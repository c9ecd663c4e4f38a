"""What a field map says, as plain objects: fields, units, identifiers, which frames of an identifier are
meant."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from hw.can.bus import EXTENDED
from hw.can.fields import Buffer, Field, raw_decoder
from hw.interface import Options, Rig

UNITS = {
    "rad": 1.0, "deg": math.pi / 180, "turn": 2 * math.pi, "count": 1.0,
    "rad/s": 1.0, "deg/s": math.pi / 180, "turn/s": 2 * math.pi, "rpm": math.pi / 30, "count/s": 1.0,
    "A": 1.0, "mA": 1e-3, "N": 1.0, "mN": 1e-3, "Nm": 1.0, "mNm": 1e-3, "degC": 1.0, "1": 1.0,
}  # fmt: skip
"""Unit of a field's physical value -> factor to SI. Counts are those of the axis' encoder_counts_per_rev."""


def make_field(table: Options, length: int) -> Field:
    """The `Field` that a dumped table of the options says."""
    return Field(
        length,
        table["start_bit"],
        table["bits"],
        table["order"],
        table["type"],
        table["scale"],
        table["offset"],
    )


def factor(table: Options, rig: Rig) -> float:
    """SI units per unit of the field."""
    if table["unit"] in ("count", "count/s"):
        return 2 * math.pi / float(rig.encoder_counts_per_rev[table["axis"]])
    return UNITS[table["unit"]]


def identifier(table: Options) -> int:
    """Identifier of a frame table, with the flag of an extended one."""
    return int(table["id"]) | (EXTENDED if table["extended"] else 0)


def selector(tables: Sequence[Options], length: int) -> Callable[[Buffer, int], bool]:
    """Whether a frame of `length` bytes is the one meant: every number of `tables` has its value."""
    wanted = [(raw_decoder(make_field(table, length)), table["value"]) for table in tables]
    if len(wanted) == 1:
        ((only, value),) = wanted
        return lambda buffer, at: only(buffer, at) == value
    return lambda buffer, at: all(read(buffer, at) == value for read, value in wanted)
