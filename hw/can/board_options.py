"""Options of kind `can`: a board by its field map, written by hand or taken from a DBC file. Host side only."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field, ValidationInfo, model_validator

from hw.can import board
from hw.can.board import CHANNELS, COMMANDS
from hw.can.load import FD_LENGTHS, Traffic
from hw.can.options import BusUser, Table, number
from hw.interface import BackendError

Unit = Literal[
    "rad", "deg", "turn", "count", "rad/s", "deg/s", "turn/s", "rpm", "count/s", "A", "mA", "N", "mN", "Nm", "mNm", "degC", "1"
]  # fmt: skip
_UNITS = {
    "position": ("rad", "deg", "turn", "count"), "velocity": ("rad/s", "deg/s", "turn/s", "rpm", "count/s"), "current": ("A", "mA"), "force": ("N", "mN"), "temperature": ("degC",),
    "current_command": ("A", "mA"), "torque": ("Nm", "mNm"),
}  # fmt: skip


class BitsOptions(Table):
    """Where a number lies in its frame."""

    start_bit: int = Field(
        ge=0, le=511, description="as a DBC counts: lowest bit (little endian) or highest (big endian)"
    )
    bits: int = Field(ge=1, le=64)
    order: Literal["little", "big"] = "little"
    type: Literal["uint", "int", "float"] = "uint"
    scale: float = number(-1e12, 1e12, "physical = scale * raw + offset", 1.0)
    offset: float = number(-1e12, 1e12, "in the unit of the field", 0.0)

    @model_validator(mode="before")
    @classmethod
    def _byte(cls, data: Any) -> Any:  # noqa: ANN401
        """`byte = 2` in place of start_bit: a field of whole bytes beginning there, in either order."""
        if isinstance(data, dict) and "byte" in data and "start_bit" not in data:
            rest = {key: value for key, value in data.items() if key != "byte"}
            if isinstance(data["byte"], int):
                return {**rest, "start_bit": 8 * data["byte"] + (7 if data.get("order") == "big" else 0)}
        return data


class ReceivedField(BitsOptions):
    """[[device.options.receive.field]]"""

    channel: Literal["position", "velocity", "current", "force", "temperature", "estop", "fault", "enabled"]
    axis: int = Field(0, ge=0, le=7, description="axis of the rig; force: 0, 1, 2 are x, y, z")
    unit: Unit = Field("1", description="of the physical value; counts: encoder_counts_per_rev of the axis")
    wrap: bool = Field(False, description="an encoder counter that wraps: followed through its wraps")

    @model_validator(mode="after")
    def _sensible(self) -> Self:
        _unit_of(self.channel, self.unit)
        if self.wrap and (self.channel != "position" or self.type == "float"):
            msg = "wrap is for a position of type uint or int"
            raise ValueError(msg)
        return self


class SentField(BitsOptions):
    """[[device.options.send.field]]"""

    channel: Literal["current_command", "torque", "enable", "counter", "constant"]
    axis: int = Field(0, ge=0, le=7)
    unit: Unit = "1"
    limit: float = number(1e-6, 1e6, "command: cut to this, in SI units, before it is encoded", 1e6)
    value: float = number(-1e12, 1e12, "constant: what is sent", 0.0)

    @model_validator(mode="after")
    def _sensible(self) -> Self:
        _unit_of(self.channel, self.unit)
        return self


def _unit_of(channel: str, unit: str) -> None:
    allowed = _UNITS.get(channel, ("1",))
    if unit not in allowed:
        msg = f"unit {unit!r} of {channel}: one of {', '.join(allowed)}"
        raise ValueError(msg)


class ChecksumOptions(Table):
    """Checksum of a frame, over its other bytes."""

    kind: Literal["xor8", "sum8", "crc8_j1850", "crc8_autosar"]
    byte: int = Field(ge=0, le=63)


class FrameOptions(Table):
    """What received and sent frames have in common."""

    id: int = Field(ge=0, le=0x1FFF_FFFF)
    extended: bool = False
    length: int = Field(8, ge=1, le=64)
    checksum: ChecksumOptions | None = None

    def _check(self, fields: list[BitsOptions]) -> None:
        if not self.extended and self.id > 0x7FF:
            msg = f"id 0x{self.id:x} needs extended = true"
            raise ValueError(msg)
        if self.length not in FD_LENGTHS:
            msg = f"length {self.length}: a frame has one of {FD_LENGTHS}"
            raise ValueError(msg)
        if self.checksum is not None and self.checksum.byte >= self.length:
            msg = f"checksum.byte {self.checksum.byte} lies outside the frame of {self.length} bytes"
            raise ValueError(msg)
        try:
            for field in fields:
                board.make_field(field.model_dump(), self.length)
        except BackendError as error:
            raise ValueError(str(error)) from error


class ReceivedFrameOptions(FrameOptions):
    """[[device.options.receive]]: a frame from the board."""

    required: bool = Field(True, description="a sample is fresh only with a new frame of this kind")
    period_ms: float | None = Field(
        None, ge=0.05, le=1e5, description="how often it comes; default: every period"
    )
    counter: BitsOptions | None = Field(None, description="counts up with every frame: no older one is taken")
    field: tuple[ReceivedField, ...] = Field(min_length=1, max_length=32, strict=False)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check([*self.field, *([self.counter] if self.counter else [])])
        return self


class SentFrameOptions(FrameOptions):
    """[[device.options.send]]: a frame to the board, sent in every cycle."""

    field: tuple[SentField, ...] = Field(min_length=1, max_length=32, strict=False)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check(list(self.field))
        return self


class BoardOptions(BusUser):
    """[device.options] of kind can."""

    dbc: str | None = Field(None, max_length=1000, description="DBC file, relative to the rig file")
    signal: tuple[dict[str, Any], ...] = Field(
        (),
        max_length=64,
        strict=False,
        description="with dbc: channel, axis, message, signal, and what a field has",
    )
    receive: tuple[ReceivedFrameOptions, ...] = Field((), max_length=32, strict=False)
    send: tuple[SentFrameOptions, ...] = Field((), max_length=16, strict=False)

    def frames(self, rate_hz: float) -> list[Traffic]:
        """See BusUser."""
        return board.traffic(self.model_dump(), rate_hz)

    def identifiers(self) -> frozenset[int]:
        """See BusUser."""
        return frozenset(board.identifier(frame.model_dump()) for frame in (*self.receive, *self.send))

    @model_validator(mode="before")
    @classmethod
    def _from_dbc(cls, data: Any, info: ValidationInfo) -> Any:  # noqa: ANN401
        """Turn `dbc` and `signal` into frames; what results no longer needs the file."""
        if not isinstance(data, dict) or not data.get("dbc"):
            return data
        from hw.can import dbc

        path = Path((info.context or {}).get("folder", Path()), str(data["dbc"])).expanduser()
        try:
            receive, send = dbc.frames(path, data.get("signal", []), CHANNELS, COMMANDS)
        except BackendError as error:
            raise ValueError(str(error)) from error
        rest = {key: value for key, value in data.items() if key not in ("dbc", "signal")}
        return {
            **rest,
            "receive": [*rest.get("receive", ()), *receive],
            "send": [*rest.get("send", ()), *send],
        }

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        given = [(f.channel, f.axis) for frame in self.receive for f in frame.field]
        twice = sorted({pair for pair in given if given.count(pair) > 1})
        if twice:
            msg = f"given twice: {', '.join(f'{channel} of axis {axis}' for channel, axis in twice)}"
            raise ValueError(msg)
        if not any(frame.required for frame in self.receive):
            msg = "at least one received frame must be required: nothing else can make a sample fresh"
            raise ValueError(msg)
        if self.send and not any(f.channel == "enable" for frame in self.send for f in frame.field):
            names = {f.channel for frame in self.send for f in frame.field}
            if not names & {"current_command", "torque"}:
                msg = "a board that is sent frames needs a command field (current_command, torque) or enable"
                raise ValueError(msg)
        if not self.bus.fd and any(frame.length > 8 for frame in (*self.receive, *self.send)):
            msg = "frames longer than 8 bytes need bus.fd = true"
            raise ValueError(msg)
        return self
