"""What a field map says, as plain objects: fields, units, identifiers, which frames of an identifier are
meant."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from hw.can.bus import EXTENDED
from hw.can.fields import Buffer, Field, raw_decoder
from hw.channels import WHOLE_RIG_CHANNELS
from hw.interface import BackendError, Options, Rig
from hw.motion import channel_units

UNITS = {
    "position": {"rad": 1.0, "deg": math.pi / 180, "turn": 2 * math.pi},
    "velocity": {"rad/s": 1.0, "deg/s": math.pi / 180, "turn/s": 2 * math.pi, "rpm": math.pi / 30},
    "current": {"A": 1.0, "mA": 1e-3},
    "current_command": {"A": 1.0, "mA": 1e-3},
    "torque": {"Nm": 1.0, "mNm": 1e-3},
    "force": {"N": 1.0, "mN": 1e-3},
    "moment": {"Nm": 1.0, "mNm": 1e-3},
    "temperature": {"degC": 1.0},
}
"""Units of each channel on a rotary axis, factors to SI; besides, counts, which are those of the axis'
encoder_counts_per_rev. A linear axis has others (`hw.motion`)."""


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
    channel, unit = table["channel"], table["unit"]
    if unit in ("count", "count/s"):
        return 2 * math.pi / float(rig.encoder_counts_per_rev[table["axis"]])
    if channel not in UNITS or unit == "1":
        return 1.0
    # of a screw a turn is its lead, not 6 m, and 1 N m on it is 2 pi / lead N
    units = channel_units(
        channel, UNITS[channel], *rig.moves(0 if channel in WHOLE_RIG_CHANNELS else table["axis"])
    )
    if unit not in units:
        raise BackendError(
            f"can: {channel}: unit {unit!r}, which axis {table['axis']} does not have: it has "
            f"{', '.join(units)}; correct the unit, or motion and lead_m of the axis"
        )
    return units[unit]


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
