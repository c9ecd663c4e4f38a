"""Lines of text described in the rig file: `[device.options]` of `kind = "serial-lines"`. Host side only."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, ValidationInfo, model_validator

from hw.option_tables import Table, number, short_life
from hw.serial.described_plan import MEASURED
from hw.serial.lines_codec import LINE_MAX
from hw.serial.number_options import SWITCHES, NumberOptions, ToldChannel, require_one_command
from hw.serial.options import PortOptions

Text = Annotated[str, Field(max_length=100, pattern=r"^[\x20-\x7e]*$")]
Texts = Annotated[tuple[Text, ...], Field(max_length=16, strict=False)]
Checksum = Literal["none", "nmea"]
CommandChannel = Literal["current_command", "torque", "enable", "time_to_live"]


class LineSampleField(NumberOptions):
    """[[device.options.sample.field]]"""

    # a text does not say how wide the board's counter is
    start_over: ClassVar[tuple[str, ...]] = ("position", "sequence")

    channel: ToldChannel = Field(description="what the number is")
    column: int = number(0, 63, "which number of the line, from 0")
    decimals: int | None = number(0, 9, "digits behind the point, exactly: a lost character is noticed", None)

    @model_validator(mode="after")
    def _fits_its_channel(self) -> Self:
        if (self.channel in SWITCHES) != bool(self.mask):
            msg = f"mask {self.mask:#x} of {self.channel!r}: estop, fault and enabled need bits, others none"
            raise ValueError(msg)
        if self.decimals and self.channel in (*SWITCHES, "sequence"):
            raise ValueError(f"decimals of {self.channel!r}: whole numbers only")
        if self.channel == "sequence" and self.wrap_at and not self.wrap_at.is_integer():
            msg = f"wrap_at {self.wrap_at:g} of 'sequence': a whole number, 65536 of a counter of 16 bits"
            raise ValueError(msg)
        return self


class LineCommandField(NumberOptions):
    """[[device.options.command.field]]: its prefix, then its number."""

    channel: CommandChannel = Field(description="what the number is")
    prefix: Text = Field("", description="what stands before the number")
    decimals: int = number(0, 9, "digits behind the point; the rest is cut off, toward 0", 4)
    limit: float = number(1e-6, 1e6, "in the unit: larger commands are cut to it", 1e6)

    @model_validator(mode="after")
    def _says_zero(self) -> Self:
        # a zero with more digits than are written is rounded: torque from a motor that is sent 0
        if round(self.zero, self.decimals) != self.zero:
            raise ValueError(
                f"zero {self.zero:g} of {self.channel!r} has more than {self.decimals} decimals: a command "
                "of 0 cannot be sent"
            )
        return self


class LineSampleOptions(Table):
    """[device.options.sample]: the lines the board prints."""

    prefix: Text = Field(
        "", description="what a line of numbers begins with; all other lines are passed over"
    )
    separator: Literal[",", ";", ":", "\t", " "] = Field(",", description="' ': any run of blanks and tabs")
    columns: int = number(1, 64, "numbers of a line, exactly")
    checksum: Checksum = Field(
        "none", description="nmea: '*' and the exclusive or of what stands before, two digits"
    )
    field: Annotated[tuple[LineSampleField, ...], Field(strict=False)] = Field(min_length=1, max_length=64)

    @model_validator(mode="after")
    def _complete(self) -> Self:
        names = [(field.channel, field.axis, field.component) for field in self.field]
        for field in self.field:
            if field.column >= self.columns:
                raise ValueError(
                    f"column {field.column} of {field.channel!r}: the line has columns 0 to "
                    f"{self.columns - 1}"
                )
            if names.count((field.channel, field.axis, field.component)) > 1:
                raise ValueError(
                    f"field {field.channel!r} of axis {field.axis}, component {field.component} is given "
                    "twice"
                )
        if not {field.channel for field in self.field} & set(MEASURED):
            raise ValueError(f"field: nothing is measured: one of {', '.join(MEASURED)} is needed")
        return self


class LineCommandOptions(Table):
    """[device.options.command]: the line the board is sent, once per cycle."""

    time_to_live_ms: float = number(
        1, 100, "the board lets go this long after its last line: by its own watchdog"
    )
    checksum: Checksum = Field("none", description="as that of the sample")
    enter: Text = Field("", description="line sent in place of the first command after arming")
    idle: Text = Field(
        "", description="line sent in place of the command while not armed; default: command 0"
    )
    field: Annotated[tuple[LineCommandField, ...], Field(strict=False)] = Field(min_length=1, max_length=16)

    @model_validator(mode="after")
    def _complete(self, info: ValidationInfo) -> Self:
        require_one_command({field.channel for field in self.field}, bool(self.enter), bool(self.idle))
        short_life(self.time_to_live_ms, info)
        if sum(len(field.prefix) + 12 + field.decimals for field in self.field) > LINE_MAX:
            raise ValueError(f"field: the line may come to more than {LINE_MAX} characters")
        return self


class LinesOptions(PortOptions):
    """[device.options] of `kind = "serial-lines"`."""

    end: Literal["\n", "\r\n", "\r"] = Field(
        "\n", description="end of the lines sent; of those received either"
    )
    sample: LineSampleOptions
    command: LineCommandOptions | None = Field(None, description="none: a sensor")
    start: Texts = Field((), description="lines sent when opening, until the board is heard")
    poll: Text = Field(
        "", description="line sent in every cycle, after the command: asks for the next sample"
    )
    stop: Texts = Field((), description="lines sent when stopping, after commands of zero")
