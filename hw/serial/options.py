"""What can be said about a board on a serial port in a rig file: `[device.options]`. Host side only."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from hw.option_tables import Table, number
from hw.outside import whole

Byte = Annotated[int, Field(ge=0, le=255)]
Bytes = Annotated[tuple[Byte, ...], Field(strict=False)]
Channel = Literal["current", "force", "moment", "velocity", "temperature", "estop"]


class PortOptions(Table):
    """The port itself, whatever is spoken on it."""

    port: str = Field(
        min_length=1,
        max_length=500,
        pattern=r"^/",
        description="path of the port; /dev/serial/by-id/... stays with the board",
    )
    # 12 Mbit/s is what bridges of high-speed USB reach (FT232H); 9600 are 960 bytes a second
    baud: int = number(9600, 12_000_000, "bit rate; USB boards ignore it", 921_600)
    open_timeout_s: float = number(0.1, 30, "patience at start, for a board that boots", 3.0)
    reopen_timeout_s: float = number(
        0.01, 10, "patience after a re-plug: the loop waits meanwhile, and tries again", 0.2
    )
    rate_hz: float | None = number(
        1,
        100_000,
        "samples a second the board sends; default: [[device]] rate_hz, or one in every cycle",
        None,
    )

    @model_validator(mode="before")
    @classmethod
    def _own_rate(cls, data: object, info: ValidationInfo) -> object:
        """Take the rate that the device's table gives, unless the options have one of their own."""
        rate_hz = (info.context or {}).get("device_rate_hz")
        if rate_hz and isinstance(data, dict) and data.get("rate_hz") is None:
            return {**data, "rate_hz": rate_hz}
        return data


class AskedOptions(PortOptions):
    """A board that may want to be started, asked in every cycle, and told to stop."""

    # each until it is heard: a board that boots drops what it is sent meanwhile
    start: Annotated[tuple[Bytes, ...], Field(strict=False)] = Field(
        (), max_length=16, description="sent when opening, each by itself, until the board is heard"
    )
    poll: Bytes = Field(
        (), max_length=250, description="sent in every cycle, after the command: asks for the next sample"
    )
    stop: Annotated[tuple[Bytes, ...], Field(strict=False)] = Field(
        (), max_length=16, description="sent when stopping, after commands of zero"
    )


class AxisOptions(Table):
    """[[device.options.axis]]: how the board's numbers relate to the joint."""

    position_sign: Annotated[Literal[-1, 1], BeforeValidator(whole)] = Field(
        1, description="-1: counts fall as the joint angle rises"
    )
    # behind the sign: the angle is sign * counts + offset, whichever way the counts go
    position_offset_rad: float = number(-1e3, 1e3, "joint angle at count 0", 0.0)
    motor_sign: Annotated[Literal[-1, 1], BeforeValidator(whole)] = Field(
        1, description="-1: a positive current (or torque) of the board drives the joint to smaller angles"
    )


class SerialOptions(PortOptions):
    """[device.options] of `kind = "serial"`. `axis`: one table for all axes, or one per axis."""

    identity: str | None = Field(
        None,
        min_length=1,
        max_length=16,
        pattern=r"^[\x20-\x7e]+$",
        description="serial number the board must give; default: the first one met",
    )
    channels: Annotated[tuple[Channel, ...], Field(strict=False)] = Field(
        ("current", "force", "temperature", "estop"),
        max_length=6,
        description="what the board measures besides the position; velocity: it sends packets of type 03, "
        "moment: of type 05 or 07",
    )
    command: Literal["current", "torque"] = Field(
        "current", description="torque: the board does its own current"
    )
    # of what length its cycles are, the board says when it is opened: the bounds in s are held there
    time_to_live_cycles: int = number(
        1, 255, "board cycles a command is held without a new one; 2 to 10 periods of the loop", 10
    )
    axis: tuple[AxisOptions, ...] = Field((AxisOptions(),), strict=False)

    @field_validator("channels")
    @classmethod
    def _once(cls, channels: tuple[Channel, ...]) -> tuple[Channel, ...]:
        if len(set(channels)) != len(channels):
            raise ValueError(f"channels {list(channels)}: each at most once")
        return channels

    @field_validator("axis")
    @classmethod
    def _some(cls, tables: tuple[AxisOptions, ...]) -> tuple[AxisOptions, ...]:
        if not 1 <= len(tables) <= 8:
            raise ValueError(f"needs 1 to 8 tables, not {len(tables)}")
        return tables
