"""Options of the playback backend, as they stand in a rig file or on the command line.

A column is read as

    value = scale * unit * (raw - offset)

with `raw` and `offset` in the file's own unit and `unit` the factor to SI. A negative scale turns a sign.
Signs of the result follow the tick record: a torque is positive when it accelerates the joint towards
positive position, whoever applies it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from hw.fault_options import SampleFaults
from hw.option_tables import Table, number
from hw.outside import real

# eleven days
MAX_DURATION_S = 1e6

Scale = Annotated[float, number(-1e9, 1e9, "factor; negative turns the sign")]
Offset = Annotated[float, number(-1e15, 1e15, "subtracted from the raw value, in its unit")]


_UNIT = "unit of the column in the file"


class Column(Table):
    """One column of the file, by the name in its header."""

    column: str = Field(
        min_length=1, max_length=200, description="name in the header line; #2 is the second column"
    )
    scale: Scale = 1.0
    offset: Offset = 0.0

    @model_validator(mode="after")
    def _no_zero_scale(self) -> Self:
        # nothing else would say so: a log of zeros reads well, and rests
        if self.scale == 0:
            raise ValueError(f"scale of column {self.column!r} is 0: every sample would be 0")
        return self


class TimeColumn(Column):
    """The time column."""

    unit: Literal["s", "ms", "us", "ns", "min", "h", "days"] = Field("s", description=_UNIT)


class PositionColumn(Column):
    """Joint angle, link side; of a linear axis its place."""

    unit: Literal["rad", "deg", "rev", "counts", "m", "mm", "um"] = Field("rad", description=_UNIT)


class VelocityColumn(Column):
    """Joint velocity, link side."""

    unit: Literal["rad/s", "deg/s", "rev/s", "rpm", "m/s", "mm/s"] = Field("rad/s", description=_UNIT)


class CurrentColumn(Column):
    """Motor current."""

    unit: Literal["A", "mA"] = Field("A", description=_UNIT)


class TorqueColumn(Column):
    """A torque on the joint, link side; of a linear axis a force."""

    unit: Literal["N m", "mN m", "N cm", "Nm", "mNm", "Ncm", "N", "mN", "kN"] = Field(
        "N m", description=_UNIT
    )


class ForceColumn(Column):
    """One component of the force of the hand on the tip."""

    unit: Literal["N", "mN"] = Field("N", description=_UNIT)


class AxisColumns(Table):
    """Columns of one axis."""

    position: PositionColumn
    current: CurrentColumn | None = Field(None, description="of the motor")
    motor_torque: TorqueColumn | None = Field(None, description="in place of current")
    hand_torque: TorqueColumn | None = Field(None, description="in place of the force columns")
    velocity: VelocityColumn | None = Field(
        None, description="for identification; the control law estimates its own from the position"
    )

    @model_validator(mode="after")
    def _one_motor_signal(self) -> Self:
        if self.current is not None and self.motor_torque is not None:
            raise ValueError("give current or motor_torque, not both: one follows from the other")
        return self


class PlaybackOptions(Table):
    """[device.options] of `kind = "playback"`."""

    file: str = Field(
        min_length=1,
        max_length=1000,
        description="log, relative to the rig file: text (gzipped or not), .npz, .npy, .mat, .parquet, "
        ".tdms, .mcap of rtctl run --record",
    )
    delimiter: Literal[",", ";", "\t", "|"] | None = Field(
        None, description="between two cells of a row of text; default: found by the names of the columns"
    )
    decimal: Literal[".", ","] | None = Field(
        None, description="decimal mark of numbers in text; default: a comma where it delimits nothing"
    )
    time: TimeColumn | None = Field(None, description="needed unless rate_hz is given")
    rate_hz: float | None = number(1, 1e6, "rate of a log without a time column", None)
    axis: tuple[AxisColumns, ...] = Field(min_length=1, max_length=8, strict=False)
    force: tuple[ForceColumn, ForceColumn, ForceColumn] | None = Field(
        None, strict=False, description="force of the hand on the tip, sensor axes x, y, z"
    )
    loop: bool = Field(False, description="start over at the end; see docs/playback.md about the seam")
    start_s: float = number(0, MAX_DURATION_S, "skip this much of the log", 0.0)
    faults: SampleFaults = ()
    seed: int = number(0, 2**63 - 1, "of the chance of scripted faults", 1)
    end_s: float | None = number(0, MAX_DURATION_S, "stop here; default: the end", None)

    @field_validator("file")
    @classmethod
    def _found(cls, text: str, info: ValidationInfo) -> str:
        context: dict[str, Any] = info.context or {}
        path = real(Path(context.get("folder", Path()), text).expanduser())
        if not path.is_file():
            inside = sorted(each.name for each in path.iterdir())[:5] if path.is_dir() else []
            raise ValueError(
                f"{path} is a folder: give a file in it ({', '.join(inside)})"
                if inside
                else f"no file {path}"
            )
        return str(path)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        # both would contradict each other sooner or later; with neither nothing is known of speed
        if (self.time is None) == (self.rate_hz is None):
            raise ValueError("give either a time column or rate_hz")
        if self.end_s is not None and self.end_s <= self.start_s:
            raise ValueError(f"end_s {self.end_s} must be after start_s {self.start_s}")
        for name in ("hand_torque", "current", "motor_torque", "velocity"):
            given = [getattr(axis, name) is not None for axis in self.axis]
            # an axis without a column would be one of zeros, and the law is of all axes at once
            if any(given) and not all(given):
                raise ValueError(f"{name} must be given for every axis, or for none")
        if self.force is not None and self.axis[0].hand_torque is not None:
            raise ValueError("give force or hand_torque, not both: one follows from the other")
        return self
