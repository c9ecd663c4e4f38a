"""Schedules of faults as they are written: `[[fault]]` tables in a TOML file. Host side only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from hw.channels import READ_ORDER, places
from hw.fault_kinds import KINDS
from hw.option_tables import Table, number
from hw.outside import read_toml, real
from hw.plain_words import explain
from hw.scripted_faults import FAULTS

MAX_S = 1e9
MAX_TICKS = 10**15
MAX_AXES = 8

Seconds = Annotated[float, Field(ge=0, le=MAX_S)]
Ticks = Annotated[int, Field(ge=0, le=MAX_TICKS)]


SAMPLE_CHANNELS = ("position", "current", "force", "link", "loop")
"""Channels that can go wrong in a device that only plays samples."""


class FaultOptions(Table):
    """[[fault]]: one scripted fault. Times count from the device's first sample."""

    channel: str = Field(description=", ".join((*READ_ORDER, "link", "actuator", "loop")))
    kind: str = Field(description="what goes wrong there; docs/faults.md lists them")
    axis: int | None = number(0, MAX_AXES - 1, "joint, or axis of the force sensor; default all", None)
    at_s: Seconds | None = Field(None, description="when it begins; or at_tick")
    at_tick: Ticks | None = Field(None, validate_default=True, description="as at_s, counted in ticks")
    for_s: Seconds | None = Field(None, description="how long it is due, 0 for ever; or for_ticks")
    for_ticks: Ticks | None = Field(None, validate_default=True, description="as for_s, counted in ticks")
    every_s: Seconds | None = Field(None, description="comes again after this long; or every_ticks")
    every_ticks: Ticks | None = Field(None, validate_default=True, description="as every_s, counted in ticks")
    probability: float = number(0, 1, "of acting in each tick in which it is due", 1.0)
    value: float = number(-1e12, 1e12, "in the unit of its kind", 0.0)

    # each by its key, none over the whole table: what is wrong in a table is then told at once
    @model_validator(mode="before")
    @classmethod
    def _own_value(cls, table: object) -> object:
        """The default of its kind, where no value is given; None for a kind that needs one."""
        if not isinstance(table, Mapping) or table.get("value") is not None:
            return table
        kind = KINDS.get((str(table.get("channel")), str(table.get("kind"))))
        return table if kind is None else {**table, "value": kind.default}

    @field_validator("kind")
    @classmethod
    def _known(cls, name: str, info: ValidationInfo) -> str:
        channel = info.data.get("channel")
        if channel is not None and (channel, name) not in KINDS:
            raise ValueError(_no_such_kind(channel, name))
        if channel == "loop" and (info.context or {}).get("clock") == "virtual":
            raise ValueError('nothing stalls on a virtual clock; set [loop] clock = "wall"')
        return name

    @field_validator("axis")
    @classmethod
    def _there(cls, axis: int | None, info: ValidationInfo) -> int | None:
        if axis is None or not {"channel", "kind"} <= info.data.keys():
            return axis
        axes = places(info.data["channel"], (info.context or {}).get("n_axes", MAX_AXES))
        if axis >= axes:
            raise ValueError(f"{axis} is not there; must be below {axes}")
        return axis

    @field_validator("at_tick", "for_ticks", "every_ticks")
    @classmethod
    def _one_of_two(cls, ticks: int | None, info: ValidationInfo) -> int | None:
        name = str(info.field_name).partition("_")[0]
        if f"{name}_s" not in info.data:  # refused already
            return ticks
        seconds = info.data[f"{name}_s"]
        both = f"give one of {name}_s and {info.field_name}"
        if name == "every":
            if seconds is not None and ticks is not None:
                raise ValueError(f"{both}, or neither")
            due = info.data.get("for_s") or info.data.get("for_ticks")
            if (seconds or ticks) and {"for_s", "for_ticks"} <= info.data.keys() and not due:
                raise ValueError("a fault that is due for ever cannot come again; give for_s or for_ticks")
        elif (seconds is None) == (ticks is None):
            raise ValueError(both + ("; 0 is for ever" if name == "for" else ""))
        return ticks

    @field_validator("value", mode="before")
    @classmethod
    def _of_its_kind(cls, value: object, info: ValidationInfo) -> object:
        if not {"channel", "kind"} <= info.data.keys():
            return value
        channel, name = info.data["channel"], info.data["kind"]
        kind = KINDS[channel, name]
        if value is None:
            # no size is meant by itself: whoever scripts a jump says how far
            raise ValueError(f"{channel} {name} needs one, {kind.low:g} to {kind.high:g} {kind.unit}")
        if isinstance(value, int | float) and not kind.low <= value <= kind.high:
            bound = f"must be {kind.low:g} to {kind.high:g} {kind.unit}" if kind.unit else "it has none"
            raise ValueError(f"{value} of {channel} {name}: {bound}")
        return value


def _no_such_kind(channel: str, name: str) -> str:
    channels = sorted({known for known, _ in KINDS})
    if channel not in channels:
        return f"no channel {channel!r}; there are: {', '.join(channels)}"
    kinds = ", ".join(kind for known, kind in KINDS if known == channel)
    return f"{channel} has no kind {name!r}; it has: {kinds}"


class Schedule(BaseModel):
    """A file of faults."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)

    description: str = Field("", max_length=1000)
    fault: tuple[FaultOptions, ...] = Field(max_length=FAULTS, strict=False)

    @field_validator("fault")
    @classmethod
    def _some(cls, faults: tuple[FaultOptions, ...]) -> tuple[FaultOptions, ...]:
        # as Field(min_length=1) one bad table would be reported as "too short" besides
        if not faults:
            raise ValueError("needs at least one [[fault]]")
        return faults


def load_schedule(path: Path, context: Mapping[str, Any] | None = None) -> tuple[FaultOptions, ...]:
    """Read a schedule.

    Parameters
    ----------
    path
        TOML file.
    context
        Facts of the rig, where known: `n_axes`, `clock`.

    Raises
    ------
    ValueError
        The text names the file and every fault in it: key, value, bound."""
    try:
        data = read_toml(path)
        return Schedule.model_validate(data, context=dict(context or {})).fault
    except OSError as error:
        msg = f"{path}: cannot read the faults: {error.strerror}"
    except ValidationError as error:
        msg = "; ".join(f"{path}: {told.where}: {told.text}" for told in explain(error, Schedule, data))
    except ValueError as error:
        msg = f"{path}: not a TOML file: {error}"
    raise ValueError(msg)


def read_faults(
    faults: str | Path | Sequence[Mapping[str, Any]], context: Mapping[str, Any] | None = None
) -> list[dict[str, Any]]:
    """Faults from a file or from tables, validated, as `hw.fault_script.fill_schedule` takes them.

    Raises
    ------
    ValueError
        As `load_schedule`."""
    if isinstance(faults, str | Path):
        found = load_schedule(Path(faults), context)
    else:
        given = {"fault": list(faults)}
        try:
            found = _Tables.model_validate(given, context=dict(context or {})).fault
        except ValidationError as error:
            told = explain(error, _Tables, given)
            raise ValueError("; ".join(f"{one.where}: {one.text}" for one in told)) from error
    return [fault.model_dump(mode="json") for fault in found]


class _Tables(BaseModel):
    """Faults that a program gives, none among them."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)

    fault: tuple[FaultOptions, ...] = Field(max_length=FAULTS, strict=False)


def _from_file(given: object, info: ValidationInfo) -> object:
    """Tables as they are; for a path, the tables in the file."""
    if not isinstance(given, str):
        return given
    context: dict[str, Any] = info.context or {}
    path = real(Path(context.get("folder", Path()), given).expanduser())
    return load_schedule(path, context)


Faults = Annotated[
    tuple[FaultOptions, ...],
    BeforeValidator(_from_file),
    Field(max_length=FAULTS, strict=False, description="scripted faults: a file, or the tables themselves"),
]
"""An option of a backend: a path relative to the rig file, or a list of tables. docs/faults.md."""


def only_samples(faults: tuple[FaultOptions, ...]) -> tuple[FaultOptions, ...]:
    """Refuse, by ValueError, faults that a device without actuator and other inputs cannot have."""
    for k, fault in enumerate(faults):
        if fault.channel not in SAMPLE_CHANNELS:
            raise ValueError(f"[{k}].channel: {fault.channel!r}: a log has only {', '.join(SAMPLE_CHANNELS)}")
    return faults


SampleFaults = Annotated[Faults, AfterValidator(only_samples)]
"""As `Faults`, for a device that only plays samples."""
