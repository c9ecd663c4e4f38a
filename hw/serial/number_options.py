"""What a number of a described board means, whether it stands in a frame or in a line of text. Host side
only.

    value = scale * unit * (number on the wire - zero)

A negative scale turns the sign."""

from __future__ import annotations

from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from hw.option_tables import Table, number

Unit = Literal[
    "counts", "rad", "deg", "rev", "counts/s", "rad/s", "deg/s", "rev/s", "rpm", "A", "mA", "N", "mN",
    "N m", "mN m", "degC", "m", "mm", "um", "m/s", "mm/s", "kN", ""
]  # fmt: skip
ToldChannel = Literal[
    "position", "velocity", "current", "force", "moment", "temperature", "estop", "sequence", "fault",
    "enabled"
]  # fmt: skip
"""What a number of a frame or a line may be."""
SampleChannel = Literal[ToldChannel, "identity"]

UNITS = {
    "position": ("counts", "rad", "deg", "rev", "m", "mm", "um"),
    "velocity": ("counts/s", "rad/s", "deg/s", "rev/s", "rpm", "m/s", "mm/s"),
    "current": ("A", "mA"),
    "current_command": ("A", "mA"),
    "torque": ("N m", "mN m", "N", "mN", "kN"),
    "force": ("N", "mN"),
    "moment": ("N m", "mN m"),
    "temperature": ("degC",),
}
SWITCHES = ("estop", "fault", "enabled", "enable")


class NumberOptions(Table):
    """One number that a board sends or is sent."""

    # of the class: a line has a counter that starts over as well, a frame counts in its own width
    start_over: ClassVar[tuple[str, ...]] = ("position",)
    """Channels that may have a `wrap_at`."""

    axis: int = number(0, 7, "which joint, from 0", 0)
    component: int = number(0, 2, "force, moment: 0 x, 1 y, 2 z", 0)
    unit: Unit = Field("", description="what one step of the scale is")
    scale: float = number(-1e9, 1e9, "units per wire step; negative turns the sign", 1.0)
    # taken off before the scale: it is what a converter gives for nothing, in its own steps
    zero: float = number(-1e12, 1e12, "number on the wire that means 0", 0.0)
    wrap_at: float | None = Field(
        None,
        gt=0,
        le=1e12,
        description="position: it starts over after this much, in its unit: 360 (deg); sequence of a line: "
        "so does the counter, default 2^32",
    )
    mask: int = number(0, 2**32 - 1, "estop, fault, enabled, enable: the bits that say so", 0)
    invert: bool = Field(False, description="estop, fault, enabled, enable: they say so when 0")

    @property
    def name(self) -> str:
        """Channel of the number."""
        return str(getattr(self, "channel", ""))

    @model_validator(mode="after")
    def _means_something(self) -> Self:
        name, allowed = self.name, UNITS.get(self.name, ("",))
        if self.unit not in allowed:
            msg = f"unit {self.unit!r} of {name!r}: one of {', '.join(repr(unit) for unit in allowed)}"
            raise ValueError(msg)
        # for commands, too: what is sent is divided by it
        if self.scale == 0:
            raise ValueError(f"scale of {name!r} is 0: every value would be 0")
        if self.wrap_at is not None and name not in self.start_over:
            raise ValueError(f"wrap_at {self.wrap_at:g} of {name!r}: for a {' or a '.join(self.start_over)}")
        return self


def require_one_command(channels: set[str], enter: bool, idle: bool) -> None:
    """Raise ValueError unless one kind of command is sent, and what switches a drive on comes with what
    switches it off."""
    if len(channels & {"torque", "current_command"}) != 1:
        raise ValueError("field: either torque or current_command is needed, for every axis")
    if enter and not idle:
        raise ValueError("enter needs idle: what switches a drive on needs what switches it off")
