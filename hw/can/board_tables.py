"""Tables inside the options of kind `can`: where numbers lie, what they mean, frames that never change. Host
side only."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from hw.can.board_map import make_field
from hw.can.fields import CHECKSUM_BYTES, to_raw
from hw.can.fields import Field as Bits
from hw.can.load import FD_LENGTHS
from hw.interface import BackendError
from hw.option_tables import Table, number

Unit = Literal[
    "rad", "deg", "turn", "count", "rad/s", "deg/s", "turn/s", "rpm", "count/s", "A", "mA", "N", "mN", "Nm",
    "mNm", "degC", "m", "mm", "um", "m/s", "mm/s", "kN", "1"
]  # fmt: skip
_UNITS = {
    "position": ("rad", "deg", "turn", "count", "m", "mm", "um"),
    "velocity": ("rad/s", "deg/s", "turn/s", "rpm", "count/s", "m/s", "mm/s"),
    "current": ("A", "mA"), "force": ("N", "mN"), "moment": ("Nm", "mNm"), "temperature": ("degC",),
    "current_command": ("A", "mA"), "torque": ("Nm", "mNm", "N", "mN", "kN"),
}  # fmt: skip


Bytes = Annotated[tuple[Annotated[int, Field(ge=0, le=255)], ...], Field(strict=False, max_length=64)]


class BitsOptions(Table):
    """Where a number lies in its frame."""

    start_bit: int = number(0, 511, "as a DBC counts: lowest bit (little endian) or highest (big endian)")
    bits: int = number(1, 64, "width of the number")
    order: Literal["little", "big"] = Field("little", description="order of its bytes")
    type: Literal["uint", "int", "float"] = Field(
        "uint", description="unsigned, two's complement, or IEEE 754 of 32 or 64 bits"
    )
    scale: float = number(-1e12, 1e12, "physical = scale * raw + offset", 1.0)
    offset: float = number(-1e12, 1e12, "in the unit of the field", 0.0)

    @model_validator(mode="before")
    @classmethod
    def _byte(cls, data: object) -> object:
        """`byte = 2` in place of start_bit: a field of whole bytes beginning there, in either order."""
        if isinstance(data, dict) and "byte" in data and "start_bit" not in data:
            rest = {key: value for key, value in data.items() if key != "byte"}
            if isinstance(data["byte"], int):
                # big endian: start_bit is the highest bit, 7 of the first byte
                return {**rest, "start_bit": 8 * data["byte"] + (7 if data.get("order") == "big" else 0)}
        return data


class SelectOptions(BitsOptions):
    """A number that tells one frame of an identifier from the others: a multiplexer, a node, a header."""

    value: int = number(-(2**63), 2**64 - 1, "raw value in the frames that are meant")


class ReceivedField(BitsOptions):
    """[[device.options.receive.field]]"""

    channel: Literal[
        "position", "velocity", "current", "force", "moment", "temperature", "estop", "fault", "enabled"
    ] = Field(description="what the number is")
    axis: int = number(0, 7, "axis of the rig; force and moment: 0, 1, 2 are x, y, z", 0)
    unit: Unit = Field("1", description="of the physical value; counts: encoder_counts_per_rev of the axis")
    wrap: bool = Field(False, description="an encoder counter that wraps: followed through its wraps")
    wrap_at: float | None = Field(
        None, gt=0, le=1e12, description="position that starts over after this much, in its unit: 360 (deg)"
    )
    saturates: bool = Field(
        False, description="the device holds the number at the ends of its range: there it is no measurement"
    )

    @model_validator(mode="after")
    def _sensible(self) -> Self:
        _unit_of(self.channel, self.unit)
        if self.wrap_at is not None and (self.wrap or self.channel != "position"):
            raise ValueError(f"wrap_at {self.wrap_at:g} of {self.channel}: for a position, in place of wrap")
        # a float has no end of its range to start over at
        if self.wrap and (self.channel != "position" or self.type == "float"):
            raise ValueError("wrap is for a position of type uint or int")
        return self


class SentField(BitsOptions):
    """[[device.options.send.field]]"""

    channel: Literal["current_command", "torque", "enable", "counter", "constant"] = Field(
        description="what the number is"
    )
    axis: int = number(0, 7, "axis of the rig", 0)
    unit: Unit = Field("1", description="of the physical value")
    limit: float = number(1e-6, 1e6, "command: cut to this, in SI units, before it is encoded", 1e6)
    value: float = number(-1e12, 1e12, "constant: what is sent", 0.0)

    @model_validator(mode="after")
    def _sensible(self) -> Self:
        _unit_of(self.channel, self.unit)
        # encoding saturates: a count of another kind would stand still at the end of its range
        if self.channel == "counter" and (self.type, self.scale, self.offset) != ("uint", 1.0, 0.0):
            msg = "counter: type uint, scale 1 and offset 0: it counts from 0 to the end of its bits"
            raise ValueError(msg)
        # `to_raw` divides by the scale, and knows no other floats
        if not self.scale or (self.type == "float" and self.bits not in (32, 64)):
            return self  # refused with the frame, whose length is known
        field = Bits(self.bits, 0, self.bits, "little", self.type, self.scale, self.offset)
        if self.channel == "enable" and to_raw(field, 1.0) == to_raw(field, 0.0):
            raise ValueError(
                f"enable: {self.bits} bits of type {self.type} with this scale and offset say the same for "
                "on and off; one bit is of type uint"
            )
        sent = self.scale * to_raw(field, self.value) + self.offset
        # encoding saturates: 300 in 8 bits would be 255 on the wire, and no word of it
        if self.channel == "constant" and abs(sent - self.value) > 0.51 * abs(self.scale):
            raise ValueError(
                f"constant: {self.bits} bits of type {self.type} with this scale and offset cannot say "
                f"{self.value:g}, only {sent:g}"
            )
        if self.channel in ("current_command", "torque"):
            least = self.scale * to_raw(field, 0.0) + self.offset
            # no raw number may be 0 exactly (a range that is offset by half a step): one step off is near
            # enough
            if abs(least) > abs(self.scale):
                raise ValueError(
                    f"{self.channel}: {self.bits} bits of type {self.type} with this scale and offset "
                    f"cannot say 0, only {least:g}"
                )
        return self


def _unit_of(channel: str, unit: str) -> None:
    allowed = _UNITS.get(channel, ("1",))
    if unit not in allowed:
        raise ValueError(f"unit {unit!r} of {channel}: one of {', '.join(allowed)}")


class ChecksumOptions(Table):
    """Checksum of a frame, over its other bytes."""

    kind: Literal["xor8", "sum8", "sum16", "crc8_j1850", "crc8_autosar"] = Field(
        description="how it is computed"
    )
    byte: int = number(0, 63, "where it is; sum16: its high byte, the low one follows")

    @property
    def end(self) -> int:
        """First byte after it."""
        return self.byte + CHECKSUM_BYTES.get(self.kind, 1)


class FixedOptions(Table):
    """A frame that is always the same: [[device.options.start]], poll, stop."""

    id: int = number(0, 0x1FFF_FFFF, "identifier")
    extended: bool = Field(False, description="an identifier of 29 bits")
    data: Bytes = Field((), description="its bytes")
    remote: bool = Field(False, description="a remote frame: asks for the frame of this identifier; no data")

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if self.remote and self.data:
            raise ValueError(f"id 0x{self.id:x}: a remote frame carries no data")
        possible(self.id, (len(self.data),), extended=self.extended)
        return self


def possible(can_id: int, lengths: tuple[int, ...], *, extended: bool) -> None:
    """Refuse an identifier or a length that no CAN frame has."""
    if not extended and can_id > 0x7FF:
        raise ValueError(f"id 0x{can_id:x} needs extended = true")
    for length in lengths:
        if length not in FD_LENGTHS:
            raise ValueError(f"length {length}: a frame has one of {FD_LENGTHS}")


def have_room(fields: Sequence[BitsOptions], length: int) -> None:
    """Refuse fields that do not fit into a frame of `length` bytes."""
    try:
        for field in fields:
            make_field(field.model_dump(), length)
    except BackendError as error:
        raise ValueError(str(error)) from error
