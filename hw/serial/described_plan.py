"""From validated options of a described board to the arrays its codec runs on. At start, never in the
loop."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from hw.channels import READING
from hw.field_units import si_per_unit, spelled
from hw.interface import BackendError, Options, Rig
from hw.serial.checksums import KINDS, SIZE
from hw.serial.layout import FLOAT, SIGNED, UNSIGNED, field_dtype, layout_dtype


class Target(IntEnum):
    """What a field of a described frame is."""

    POSITION = 0
    CURRENT = 1
    FORCE = 2
    TEMPERATURE = 3
    ESTOP = 4
    SEQUENCE = 5
    FAULT = 6
    IDENTITY = 7
    COMMAND = 8
    ENABLE = 9
    VELOCITY = 10
    ENABLED = 11
    MOMENT = 12


TARGETS = {
    "position": Target.POSITION,
    "velocity": Target.VELOCITY,
    "current": Target.CURRENT,
    "force": Target.FORCE,
    "moment": Target.MOMENT,
    "temperature": Target.TEMPERATURE,
    "estop": Target.ESTOP,
    "sequence": Target.SEQUENCE,
    "fault": Target.FAULT,
    "identity": Target.IDENTITY,
    "enabled": Target.ENABLED,
    "current_command": Target.COMMAND,
    "torque": Target.COMMAND,
    "enable": Target.ENABLE,
}

TYPES = {
    "u8": (UNSIGNED, 1),
    "i8": (SIGNED, 1),
    "u16": (UNSIGNED, 2),
    "i16": (SIGNED, 2),
    "u24": (UNSIGNED, 3),
    "i24": (SIGNED, 3),
    "u32": (UNSIGNED, 4),
    "i32": (SIGNED, 4),
    "f32": (FLOAT, 4),
}

UNITS = spelled("rev", "N m")

MEASURED = tuple(READING)
"""What a board may measure."""

NEEDED = ("position", "current")
"""What is of every axis, if of any: the law takes an axis that nobody tells of for one at 0 that never
moves."""

PER_AXIS = {"position", "velocity", "current", "temperature", "current_command", "torque"}


def layout_of(table: Options) -> np.ndarray:
    """The layout record of a frame table (`[device.options.sample]` or `.command`)."""
    record = np.zeros(1, layout_dtype())
    row = record[0]
    tail = list(table.get("tail") or ())
    end = table["length"] - len(tail)
    row["length"], row["big_endian"] = table["length"], table["endian"] == "big"
    row["n_sync"] = len(table["sync"])
    row["checksum"], row["checksum_size"] = KINDS[table["checksum"]], SIZE[table["checksum"]]
    row["checksum_big"] = (table["checksum_endian"] or table["endian"]) == "big"
    row["checksum_at"], row["checksum_from"] = (end - SIZE[table["checksum"]], table["checksum_from"])
    row["n_tail"] = len(tail)
    # tail and sync before constants: the options have seen to it that no constant is in their place
    row["template"][end : table["length"]] = tail
    row["template"][: len(table["sync"])] = table["sync"]
    for constant in table["constant"]:
        at = constant["offset"]
        row["template"][at : at + len(constant["bytes"])] = constant["bytes"]
    return record


def fields_of(table: Options, rig: Rig, where: str) -> np.ndarray:
    """The field records of a frame table, in its order. Raises BackendError for an axis the rig has not."""
    tables = list(table["field"])
    record = np.zeros(len(tables), field_dtype())
    for row, field in zip(record, tables, strict=True):
        _fill(row, field, rig, where)
    return record


def unit_of(field: Options, rig: Rig) -> float:
    """SI units per unit of a field. Raises BackendError for a unit that its axis does not have."""
    return si_per_unit(field, rig, UNITS)


def _fill(row: np.void, field: Options, rig: Rig, where: str) -> None:
    name = field["channel"]
    row["kind"], row["n_bytes"] = TYPES[field["type"]]
    row["target"], row["at"] = TARGETS[name], field["offset"]
    row["index"] = field["axis"] if name in PER_AXIS else field["component"]
    if name in PER_AXIS and field["axis"] >= rig.n_axes:
        raise BackendError(
            f"{where}: field {name!r} is for axis {field['axis']}, the device has axes 0 to {rig.n_axes - 1}"
        )
    row["zero"], row["mask"], row["invert"] = field["zero"], field["mask"], field["invert"]
    unit = unit_of(field, rig)
    # one factor: each product of the loop is a rounding
    row["scale"] = field["scale"] * unit
    row["period"] = unit * (field.get("wrap_at") or 0.0)
    # only a whole number runs over its end
    # with `wrap_at` an angle is followed by its value: the two would follow each other
    whole = name == "position" and row["kind"] != FLOAT and not row["period"]
    row["bits"] = (field["wrap_bits"] or 8 * int(row["n_bytes"])) if whole else 0


def require_every_axis(fields: np.ndarray, target: Target, n_axes: int, where: str) -> None:
    """Raise BackendError unless each axis has exactly one field of this kind."""
    given = sorted(int(field["index"]) for field in fields if field["target"] == target)
    if given != list(range(n_axes)):
        raise BackendError(
            f"{where}: {target.name.lower()} is given for axes {given}; each of axes 0 to {n_axes - 1} "
            "needs it once"
        )
