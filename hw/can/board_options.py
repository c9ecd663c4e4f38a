"""Options of kind `can`: a board by its field map, written by hand or taken from a DBC file. Host side
only."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, ValidationInfo, model_validator

from hw.can import board_backend as board
from hw.can.board_backend import CHANNELS, COMMANDS
from hw.can.board_tables import (
    BitsOptions,
    Bytes,
    ChecksumOptions,
    FixedOptions,
    ReceivedField,
    SelectOptions,
    SentField,
    have_room,
    possible,
)
from hw.can.load import Traffic
from hw.can.options import BusUser
from hw.interface import BackendError
from hw.option_tables import Table, number


class FrameOptions(Table):
    """What received and sent frames have in common."""

    id: int = number(0, 0x1FFF_FFFF, "identifier")
    extended: bool = Field(False, description="an identifier of 29 bits")
    length: int = number(1, 64, "bytes of the frame, its parts together", 8)
    checksum: ChecksumOptions | None = Field(None, description="none: only the bus' own")

    @property
    def on_wire(self) -> tuple[int, ...]:
        """Lengths of the CAN frames that make it up."""
        return (self.length,)

    def _check(self, fields: list[BitsOptions]) -> None:
        possible(self.id, self.on_wire, extended=self.extended)
        if self.checksum is not None and self.checksum.end > self.length:
            msg = f"checksum.byte {self.checksum.byte} lies outside the frame of {self.length} bytes"
            raise ValueError(msg)
        have_room(fields, self.length)


class ReceivedFrameOptions(FrameOptions):
    """[[device.options.receive]]: a frame from the board."""

    required: bool = Field(True, description="a sample is fresh only with a new frame of this kind")
    period_ms: float | None = number(
        0.05,
        1e5,
        "how often it comes; default: every period. Given for one that is not required, its silence counts",
        None,
    )
    counter: BitsOptions | None = Field(None, description="counts up with every frame: no older one is taken")
    select: tuple[SelectOptions, ...] = Field(
        (), max_length=4, strict=False, description="which frames of the identifier are meant; default: all"
    )
    parts: tuple[Annotated[int, Field(ge=1, le=64)], ...] = Field(
        (),
        max_length=8,
        strict=False,
        description="lengths of the CAN frames it comes in, one after the other",
    )
    field: tuple[ReceivedField, ...] = Field(min_length=1, max_length=32, strict=False)

    @property
    def on_wire(self) -> tuple[int, ...]:
        """See FrameOptions."""
        return self.parts or (self.length,)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.parts and (sum(self.parts) != self.length or len(self.parts) < 2):
            raise ValueError(
                f"parts {list(self.parts)} of a frame of {self.length} bytes: two or more that add up to "
                "its length"
            )
        # no part says which one it is: only the first is told, and only a checksum sees that one was lost
        if self.parts and not (self.select and self.checksum):
            raise ValueError(
                "a frame in parts needs select (what its first part begins with) and checksum: a lost part "
                "must be noticed"
            )
        if self.counter is not None and self.counter.type == "float":
            raise ValueError(f"counter of id 0x{self.id:x}: type uint or int, a count is a whole number")
        self._check([*self.field, *([self.counter] if self.counter else [])])
        have_room(self.select, self.on_wire[0])
        return self


class SentFrameOptions(FrameOptions):
    """[[device.options.send]]: a frame to the board, sent in every cycle."""

    enter: Bytes = Field(
        (), description="sent in place of the first command after arming: switches the drive on"
    )
    idle: Bytes = Field(
        (), description="sent in place of the command while not armed: switches the drive off"
    )
    field: tuple[SentField, ...] = Field(min_length=1, max_length=32, strict=False)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check(list(self.field))
        for name, data in (("enter", self.enter), ("idle", self.idle)):
            if data and len(data) != self.length:
                raise ValueError(f"{name} has {len(data)} bytes, the frame {self.length}")
        # stopping sends zeros otherwise, which a drive that was switched on by bytes may not take for off
        if self.enter and not self.idle:
            raise ValueError("enter needs idle: what switches a drive on needs what switches it off")
        return self


Fixed = Annotated[tuple[FixedOptions, ...], Field(max_length=16, strict=False)]


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
    start: Fixed = Field((), description="sent when opening, again and again until the board is heard")
    poll: Fixed = Field((), description="sent in every cycle, after the commands: asks for the next sample")
    stop: Fixed = Field((), description="sent when stopping, after commands of zero")

    def frames(self, rate_hz: float) -> list[Traffic]:
        """See BusUser."""
        return board.traffic(self.model_dump(), rate_hz)

    def identifiers(self) -> frozenset[int]:
        """See BusUser."""
        every = (*self.receive, *self.send, *self.start, *self.poll, *self.stop)
        return frozenset(board.identifier(frame.model_dump()) for frame in every)

    @model_validator(mode="before")
    @classmethod
    def _from_dbc(cls, data: object, info: ValidationInfo) -> object:
        """Turn `dbc` and `signal` into frames; what results no longer needs the file."""
        if not isinstance(data, dict) or not data.get("dbc"):
            return data
        from hw.can import dbc

        path = Path((info.context or {}).get("folder", Path()), str(data["dbc"])).expanduser()
        try:
            receive, send = dbc.frames(path, data.get("signal", []), CHANNELS, COMMANDS)
        except BackendError as error:
            raise ValueError(str(error)) from error
        # the loop process never reads the DBC: no cantools there, and no file that may have changed since
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
        # `fresh == needed` would hold in every cycle where nothing is needed: old values as new samples
        if not any(frame.required for frame in self.receive):
            msg = "at least one received frame must be required: nothing else can make a sample fresh"
            raise ValueError(msg)
        self._tell_apart()
        if self.send and not any(f.channel == "enable" for frame in self.send for f in frame.field):
            names = {f.channel for frame in self.send for f in frame.field}
            if not names & {"current_command", "torque"}:
                msg = "a board that is sent frames needs a command field (current_command, torque) or enable"
                raise ValueError(msg)
        lengths = [length for frame in (*self.receive, *self.send) for length in frame.on_wire]
        lengths += [len(frame.data) for frame in (*self.start, *self.poll, *self.stop)]
        # the bit that asked for a frame is another one's in CAN FD (ISO 11898-1)
        if self.bus.fd and any(frame.remote for frame in (*self.start, *self.poll, *self.stop)):
            raise ValueError("CAN FD has no remote frames: ask by data, or bus.fd = false")
        if not self.bus.fd and max(lengths) > 8:
            raise ValueError("frames longer than 8 bytes need bus.fd = true")
        return self

    def _tell_apart(self) -> None:
        """Frames of one identifier must be of one length, and all but one selected."""
        # each with each: of three the last two may be alike
        for one, other in combinations(self.receive, 2):
            if (one.id, one.extended) != (other.id, other.extended):
                continue
            if (one.length, one.parts) != (other.length, other.parts):
                msg = f"frames of id 0x{one.id:x} have different lengths, {one.length} and {other.length}"
                raise ValueError(msg)
            if one.select == other.select:
                raise ValueError(f"id 0x{one.id:x} is received twice: tell the frames apart by select")
