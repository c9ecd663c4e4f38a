"""A frame described in the rig file: `[device.options]` of `kind = "serial-described"`. Host side only.

    value = scale * unit * (raw - zero)

with `raw` the number on the wire and `unit` the factor to SI. A negative scale turns the sign.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from hw.serial.checksums import SIZE
from hw.serial.described_plan import PER_AXIS, TYPES
from hw.serial.layout import LENGTH_MAX, SYNC_MAX
from hw.serial.options import PortOptions, SerialTable

Byte = Annotated[int, Field(ge=0, le=255)]
Bytes = Annotated[tuple[Byte, ...], Field(strict=False)]
Type = Literal["u8", "i8", "u16", "i16", "u24", "i24", "u32", "i32", "f32"]
Unit = Literal[
    "counts",
    "rad",
    "deg",
    "rev",
    "counts/s",
    "rad/s",
    "deg/s",
    "rev/s",
    "rpm",
    "A",
    "mA",
    "N",
    "mN",
    "N m",
    "mN m",
    "degC",
    "",
]
SampleChannel = Literal[
    "position",
    "velocity",
    "current",
    "force",
    "temperature",
    "estop",
    "sequence",
    "fault",
    "identity",
    "enabled",
]
CommandChannel = Literal["current_command", "torque", "enable", "sequence"]

_UNITS = {
    "position": ("counts", "rad", "deg", "rev"),
    "velocity": ("counts/s", "rad/s", "deg/s", "rev/s", "rpm"),
    "current": ("A", "mA"),
    "current_command": ("A", "mA"),
    "torque": ("N m", "mN m"),
    "force": ("N", "mN"),
    "temperature": ("degC",),
}
_SWITCHES = ("estop", "fault", "enabled", "enable")


class FieldOptions(SerialTable):
    """One number of a frame."""

    type: Type = Field(description="u unsigned, i two's complement, f IEEE 754; bits")
    offset: int = Field(ge=0, le=LENGTH_MAX - 1, description="first byte, from the start of the frame")
    axis: int = Field(0, ge=0, le=7, description="which joint, from 0")
    component: int = Field(0, ge=0, le=2, description="force: 0 x, 1 y, 2 z")
    unit: Unit = Field("", description="what one step of the scale is")
    scale: float = Field(1.0, ge=-1e9, le=1e9, description="units per wire step; negative turns the sign")
    zero: float = Field(0.0, ge=-1e12, le=1e12, description="number on the wire that means 0")
    wrap_bits: int = Field(
        0, ge=0, le=32, description="position: width of the counter, if narrower than its type"
    )
    mask: int = Field(
        0, ge=0, le=2**32 - 1, description="estop, fault, enabled, enable: the bits that say so"
    )
    invert: bool = Field(False, description="estop, fault, enabled, enable: they say so when 0")

    @property
    def name(self) -> str:
        """Its channel."""
        return str(getattr(self, "channel", ""))

    @property
    def end(self) -> int:
        """First byte after it."""
        return self.offset + TYPES[self.type][1]

    @model_validator(mode="after")
    def _fits_its_channel(self) -> Self:
        name, allowed = self.name, _UNITS.get(self.name, ("",))
        if self.unit not in allowed:
            msg = f"unit {self.unit!r} of {name!r}: one of {', '.join(repr(unit) for unit in allowed)}"
            raise ValueError(msg)
        if self.scale == 0:
            msg = f"scale of {name!r} is 0: every value would be 0"
            raise ValueError(msg)
        if self.type == "f32" and name not in _UNITS:
            msg = f"type 'f32' of {name!r}: whole numbers only"
            raise ValueError(msg)
        if (name in _SWITCHES) != bool(self.mask) or self.mask >> (8 * (self.end - self.offset)):
            msg = f"mask {self.mask:#x} of {name!r}: estop, fault, enabled and enable need bits within their type, others none"
            raise ValueError(msg)
        if self.wrap_bits and (name != "position" or self.wrap_bits > 8 * (self.end - self.offset)):
            msg = f"wrap_bits {self.wrap_bits} of {name!r}: for a position, at most the bits of its type"
            raise ValueError(msg)
        return self


class SampleField(FieldOptions):
    """[[device.options.sample.field]]"""

    channel: SampleChannel


class CommandField(FieldOptions):
    """[[device.options.command.field]]"""

    channel: CommandChannel


class ConstantOptions(SerialTable):
    """Bytes that are always the same."""

    offset: int = Field(ge=0, le=LENGTH_MAX - 1)
    bytes: Bytes = Field(min_length=1, max_length=LENGTH_MAX)


class FrameOptions(SerialTable):
    """A frame of fixed length: sync bytes first, checksum last."""

    sync: Bytes = Field(min_length=1, max_length=SYNC_MAX, description="bytes every frame begins with")
    length: int = Field(ge=3, le=LENGTH_MAX, description="of the whole frame, sync and checksum included")
    endian: Literal["little", "big"] = "little"
    checksum: Literal["sum8", "xor8", "crc8", "crc16-ccitt", "crc16-modbus", "crc32"]
    checksum_from: int = Field(0, ge=0, le=LENGTH_MAX - 1, description="first byte it covers")
    checksum_endian: Literal["little", "big"] | None = Field(None, description="default: that of the frame")
    constant: Annotated[tuple[ConstantOptions, ...], Field(strict=False)] = Field((), max_length=16)

    @property
    def fields(self) -> tuple[FieldOptions, ...]:
        """Its numbers."""
        return tuple(getattr(self, "field", ()))

    @model_validator(mode="after")
    def _everything_has_a_place(self) -> Self:
        end = self.length - SIZE[self.checksum]
        if self.checksum_from >= end:
            msg = f"checksum_from {self.checksum_from}: the checksum begins at byte {end} and must cover bytes before it"
            raise ValueError(msg)
        taken = dict.fromkeys(range(len(self.sync)), "sync")
        if len(self.sync) > end:
            msg = f"length {self.length}: no room for sync and checksum"
            raise ValueError(msg)
        places = [(f"constant at {c.offset}", c.offset, c.offset + len(c.bytes)) for c in self.constant]
        switches = [field for field in self.fields if field.name in _SWITCHES]
        numbers = [field for field in self.fields if field.name not in _SWITCHES]
        _place(taken, places, end)
        for field in switches:  # bits: they may share a byte with each other and with constants
            _place(
                dict.fromkeys(range(len(self.sync)), "sync"), [(_label(field), field.offset, field.end)], end
            )
        _place(taken, ((_label(f), f.offset, f.end) for f in numbers), end)
        return self


def _label(field: FieldOptions) -> str:
    which = f" of axis {field.axis}" if field.name in PER_AXIS else ""
    return f"field {field.name!r}{which}" + (
        f", component {field.component}" if field.name == "force" else ""
    )


def _place(taken: dict[int, str], places: Iterable[tuple[str, int, int]], end: int) -> None:
    """Refuse what overlaps or stands beyond `end`, where the checksum begins."""
    for label, first, after in places:
        if after > end:
            msg = f"{label} ends at byte {after - 1}; the checksum begins at byte {end}"
            raise ValueError(msg)
        for at in range(first, after):
            if at in taken:
                msg = f"{label} overlaps {taken[at]} at byte {at}"
                raise ValueError(msg)
            taken[at] = label


def _once(fields: tuple[FieldOptions, ...]) -> None:
    seen = set()
    for field in fields:
        key = _label(field)
        if key in seen:
            msg = f"{key} is given twice"
            raise ValueError(msg)
        seen.add(key)


class SampleOptions(FrameOptions):
    """[device.options.sample]: what the board sends."""

    field: Annotated[tuple[SampleField, ...], Field(strict=False)] = Field(min_length=1, max_length=64)

    @model_validator(mode="after")
    def _complete(self) -> Self:
        _once(self.field)
        names = [field.channel for field in self.field]
        if "position" not in names:
            msg = "field: a position is needed"
            raise ValueError(msg)
        return self


class CommandOptions(FrameOptions):
    """[device.options.command]: what the board is sent, once per cycle."""

    field: Annotated[tuple[CommandField, ...], Field(strict=False)] = Field(min_length=1, max_length=64)
    stop: Bytes = Field(
        (), max_length=LENGTH_MAX, description="bytes that stop the board; default: command 0"
    )

    @model_validator(mode="after")
    def _complete(self) -> Self:
        _once(self.field)
        kinds = {field.channel for field in self.field} & {"torque", "current_command"}
        if len(kinds) != 1:
            msg = "field: either torque or current_command is needed, for every axis"
            raise ValueError(msg)
        return self


class DescribedOptions(PortOptions):
    """[device.options] of `kind = "serial-described"`."""

    sample: SampleOptions
    command: CommandOptions | None = Field(None, description="none: a sensor")
    identity: int | None = Field(
        None, ge=0, le=2**32 - 1, description="value the identity field must have; default: the first one met"
    )
