"""A frame described in the rig file: `[device.options]` of `kind = "serial-described"`. Host side only."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from hw.option_tables import Table, number
from hw.serial.checksums import SIZE
from hw.serial.described_plan import MEASURED, PER_AXIS, TYPES
from hw.serial.layout import FLOAT, LENGTH_MAX, SIGNED, SYNC_MAX
from hw.serial.number_options import SWITCHES, UNITS, NumberOptions, SampleChannel, require_one_command
from hw.serial.options import AskedOptions, Bytes

Type = Literal["u8", "i8", "u16", "i16", "u24", "i24", "u32", "i32", "f32"]
CommandChannel = Literal["current_command", "torque", "enable", "sequence"]


class FieldOptions(NumberOptions):
    """One number of a frame."""

    type: Type = Field(description="u unsigned, i two's complement, f IEEE 754; bits")
    offset: int = number(0, LENGTH_MAX - 1, "first byte, from the start of the frame")
    wrap_bits: int = number(0, 32, "position: width of the counter, if narrower than its type", 0)

    @property
    def end(self) -> int:
        """First byte after it."""
        return self.offset + TYPES[self.type][1]

    @model_validator(mode="after")
    def _fits_its_channel(self) -> Self:
        name = self.name
        # bits and counts of a float are none: `raw` would be cut off to a whole number without a word
        if self.type == "f32" and name not in UNITS:
            raise ValueError(f"type 'f32' of {name!r}: whole numbers only")
        if (name in SWITCHES) != bool(self.mask) or self.mask >> (8 * (self.end - self.offset)):
            raise ValueError(
                f"mask {self.mask:#x} of {name!r}: estop, fault, enabled and enable need bits within their "
                "type, others none"
            )
        if self.wrap_bits and (name != "position" or self.wrap_bits > 8 * (self.end - self.offset)):
            msg = f"wrap_bits {self.wrap_bits} of {name!r}: for a position, at most the bits of its type"
            raise ValueError(msg)
        # both follow the position through its wraps, by value and by count: one would undo the other
        if self.wrap_at is not None and self.wrap_bits:
            raise ValueError(f"wrap_at {self.wrap_at:g} of {name!r}: in place of wrap_bits, not beside it")
        if name in ("current_command", "torque") and not self._says_zero():
            raise ValueError(
                f"zero {self.zero:g} of {name!r}: no number of type {self.type!r}, so a command of 0 cannot "
                "be sent"
            )
        return self

    def _says_zero(self) -> bool:
        kind, size = TYPES[self.type]
        span = 2.0 ** (8 * size)
        low, high = (-span / 2, span / 2 - 1) if kind == SIGNED else (0.0, span - 1)
        # a half would be cut off: half a step of torque from a motor that is sent 0, and that is stopped
        return kind == FLOAT or (low <= self.zero <= high and self.zero.is_integer())


class SampleField(FieldOptions):
    """[[device.options.sample.field]]"""

    channel: SampleChannel = Field(description="what the number is")


class CommandField(FieldOptions):
    """[[device.options.command.field]]"""

    channel: CommandChannel = Field(description="what the number is")


class ConstantOptions(Table):
    """Bytes that are always the same."""

    offset: int = number(0, LENGTH_MAX - 1, "first byte, from 0")
    bytes: Bytes = Field(min_length=1, max_length=LENGTH_MAX, description="what stands there")


class FrameOptions(Table):
    """A frame of fixed length: sync bytes first; checksum last, or before a tail."""

    sync: Bytes = Field(min_length=1, max_length=SYNC_MAX, description="bytes every frame begins with")
    length: int = number(3, LENGTH_MAX, "of the whole frame, sync and checksum included")
    endian: Literal["little", "big"] = Field("little", description="order of the bytes of a number")
    checksum: Literal["sum8", "xor8", "crc8", "crc16-ccitt", "crc16-xmodem", "crc16-modbus", "crc32"] = Field(
        description="how its last bytes (or those before the tail) are computed"
    )
    checksum_from: int = number(0, LENGTH_MAX - 1, "first byte it covers", 0)
    checksum_endian: Literal["little", "big"] | None = Field(None, description="default: that of the frame")
    tail: Bytes = Field((), max_length=SYNC_MAX, description="bytes behind the checksum, always the same")
    constant: Annotated[tuple[ConstantOptions, ...], Field(strict=False)] = Field((), max_length=16)

    @property
    def fields(self) -> tuple[FieldOptions, ...]:
        """Numbers of the frame."""
        return tuple(getattr(self, "field", ()))

    @model_validator(mode="after")
    def _everything_has_a_place(self) -> Self:
        end = self.length - SIZE[self.checksum] - len(self.tail)
        if self.checksum_from >= end:
            raise ValueError(
                f"checksum_from {self.checksum_from}: the checksum begins at byte {end} and must cover "
                "bytes before it"
            )
        taken = dict.fromkeys(range(len(self.sync)), "sync")
        if len(self.sync) > end:
            raise ValueError(f"length {self.length}: no room for sync and checksum")
        places = [(f"constant at {c.offset}", c.offset, c.offset + len(c.bytes)) for c in self.constant]
        switches = [field for field in self.fields if field.name in SWITCHES]
        numbers = [field for field in self.fields if field.name not in SWITCHES]
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
        f", component {field.component}" if field.name in ("force", "moment") else ""
    )


def _place(taken: dict[int, str], places: Iterable[tuple[str, int, int]], end: int) -> None:
    """Refuse what overlaps or stands beyond `end`, where the checksum begins."""
    for label, first, after in places:
        if after > end:
            raise ValueError(f"{label} ends at byte {after - 1}; the checksum begins at byte {end}")
        for at in range(first, after):
            if at in taken:
                raise ValueError(f"{label} overlaps {taken[at]} at byte {at}")
            taken[at] = label


def _once(fields: tuple[FieldOptions, ...]) -> None:
    seen = set()
    for field in fields:
        key = _label(field)
        if key in seen:
            raise ValueError(f"{key} is given twice")
        seen.add(key)


class SampleOptions(FrameOptions):
    """[device.options.sample]: what the board sends."""

    field: Annotated[tuple[SampleField, ...], Field(strict=False)] = Field(min_length=1, max_length=64)

    @model_validator(mode="after")
    def _complete(self) -> Self:
        _once(self.field)
        if not {field.channel for field in self.field} & set(MEASURED):
            raise ValueError(f"field: nothing is measured: one of {', '.join(MEASURED)} is needed")
        return self


class CommandOptions(FrameOptions):
    """[device.options.command]: what the board is sent, once per cycle."""

    field: Annotated[tuple[CommandField, ...], Field(strict=False)] = Field(min_length=1, max_length=64)
    stop: Bytes = Field(
        (), max_length=LENGTH_MAX, description="bytes that stop the board; default: command 0"
    )
    enter: Bytes = Field(
        (), max_length=LENGTH_MAX, description="sent in place of the first command after arming"
    )
    idle: Bytes = Field((), max_length=LENGTH_MAX, description="sent in place of the command while not armed")

    @model_validator(mode="after")
    def _complete(self) -> Self:
        _once(self.field)
        require_one_command({field.channel for field in self.field}, bool(self.enter), bool(self.idle))
        return self


class DescribedOptions(AskedOptions):
    """[device.options] of `kind = "serial-described"`."""

    sample: SampleOptions
    command: CommandOptions | None = Field(None, description="none: a sensor")
    identity: int | None = number(
        0, 2**32 - 1, "value the identity field must have; default: the first one met", None
    )
