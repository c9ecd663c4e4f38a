"""What a field map says, as plain objects: fields, units, identifiers, which frames of an identifier are
meant."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from hw.can.bus import EXTENDED
from hw.can.fields import Buffer, Field, raw_decoder
from hw.field_units import si_per_unit, spelled
from hw.interface import Options, Rig

UNITS = spelled("turn", "Nm")


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
    """SI units per unit of the field. Raises BackendError for a unit that its axis does not have."""
    return si_per_unit(table, rig, UNITS, "can: ")


def identifier(table: Options) -> int:
    """Identifier of a frame table, with the flag of an extended one."""
    return int(table["id"]) | (EXTENDED if table["extended"] else 0)


def selector(tables: Sequence[Options], length: int) -> Callable[[Buffer, int], bool]:
    """Whether a frame of `length` bytes is the one meant: every number of `tables` has its value."""
    wanted = [(raw_decoder(make_field(table, length)), table["value"]) for table in tables]
    # the usual case without a generator: it runs for every frame of the identifier
    if len(wanted) == 1:
        ((only, value),) = wanted
        return lambda buffer, at: only(buffer, at) == value
    return lambda buffer, at: all(read(buffer, at) == value for read, value in wanted)
