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
    ModelWrapValidatorHandler,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from hw.channels import READ_ORDER, places
from hw.fault_kinds import KINDS, Channel, Kind
from hw.option_tables import Table
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
    axis: int | None = Field(
        None, ge=0, le=MAX_AXES - 1, description="joint, or axis of the force sensor; default all"
    )
    at_s: Seconds | None = Field(None, description="when it begins; or at_tick")
    at_tick: Ticks | None = Field(None, description="as at_s, counted in ticks")
    for_s: Seconds | None = Field(None, description="how long it is due, 0 for ever; or for_ticks")
    for_ticks: Ticks | None = Field(None, description="as for_s, counted in ticks")
    every_s: Seconds | None = Field(None, description="comes again after this long; or every_ticks")
    every_ticks: Ticks | None = Field(None, description="as every_s, counted in ticks")
    probability: float = Field(1.0, ge=0, le=1, description="of acting in each tick in which it is due")
    value: float = Field(0.0, ge=-1e12, le=1e12, description="in the unit of its kind")

    @model_validator(mode="wrap")
    @classmethod
    def _all_at_once(
        cls, table: object, handler: ModelWrapValidatorHandler[FaultOptions], info: ValidationInfo
    ) -> FaultOptions:
        """Refuse a table for all that is wrong with it: keys, bounds and contradictions."""
        wrong = _contradictions(table, info.context or {}) if isinstance(table, Mapping) else []
        told: list[Any] = []
        try:
            made = handler(_with_value(table) if isinstance(table, Mapping) else table)
        except ValidationError as error:
            told = error.errors(include_url=False)
        if not told and not wrong:
            return made
        told += [{"type": "value_error", "input": table, "ctx": {"error": ValueError(one)}} for one in wrong]
        raise ValidationError.from_exception_data(cls.__name__, told)


def _with_value(table: Mapping[str, Any]) -> dict[str, Any]:
    """The table with the default value of its kind, where it gives none."""
    found = _kind_of(table)
    default = found.default if found is not None and table.get("value") is None else None
    return dict(table) if default is None else {**table, "value": default}


def _kind_of(table: Mapping[str, Any]) -> Kind | None:
    channel, name = table.get("channel"), table.get("kind")
    if not isinstance(channel, str) or not isinstance(name, str):
        return None
    return KINDS.get((channel, name))


def _contradictions(table: Mapping[str, Any], rig: Mapping[str, Any]) -> list[str]:
    """What no key by itself shows, of a table that may be anything."""
    channel, name = table.get("channel"), table.get("kind")
    kind = _kind_of(table)
    wrong = _of_kind(table, kind, rig) if kind is not None else []
    if kind is None and isinstance(channel, str) and isinstance(name, str):
        wrong.append(_no_such_kind(channel, name))
    for first, second in (("at_s", "at_tick"), ("for_s", "for_ticks")):
        if (table.get(first) is None) == (table.get(second) is None):
            never = "; 0 is for ever" if first == "for_s" else ""
            wrong.append(f"{first}, {second}: give one of the two{never}")
    if table.get("every_s") is not None and table.get("every_ticks") is not None:
        wrong.append("every_s, every_ticks: give one of the two, or none")
    lasts = [table[key] for key in ("for_s", "for_ticks") if table.get(key) is not None]
    if (table.get("every_s") or table.get("every_ticks")) and lasts and not any(lasts):
        wrong.append("every: a fault that is due for ever cannot come again; give for_s or for_ticks")
    return wrong


def _of_kind(table: Mapping[str, Any], kind: Kind, rig: Mapping[str, Any]) -> list[str]:
    """What does not fit the kind, or the rig, whose facts are checked where they are given."""
    channel, name, value, axis = (table.get(key) for key in ("channel", "kind", "value", "axis"))
    wrong = []
    # no size is meant by itself: whoever scripts a jump says how far
    if value is None and kind.default is None:
        wrong.append(f"value: {channel} {name} needs one, {kind.low:g} to {kind.high:g} {kind.unit}")
    if isinstance(value, int | float) and not kind.low <= value <= kind.high:
        bound = f"must be {kind.low:g} to {kind.high:g} {kind.unit}" if kind.unit else "it has none"
        wrong.append(f"value: {value} of {channel} {name}: {bound}")
    axes = places(str(channel), rig.get("n_axes", MAX_AXES))
    if isinstance(axis, int) and axes <= axis < MAX_AXES:  # beyond, its own bound is told
        wrong.append(f"axis: {axis} is not there; must be below {axes}")
    if kind.channel == Channel.LOOP and rig.get("clock") == "virtual":
        wrong.append('channel loop: nothing stalls on a virtual clock; set [loop] clock = "wall"')
    return wrong


def _no_such_kind(channel: str, name: str) -> str:
    channels = sorted({known for known, _ in KINDS})
    if channel not in channels:
        return f"channel: no channel {channel!r}; there are: {', '.join(channels)}"
    kinds = ", ".join(kind for known, kind in KINDS if known == channel)
    return f"kind: {channel} has no kind {name!r}; it has: {kinds}"


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
            msg = "needs at least one [[fault]]"
            raise ValueError(msg)
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
            msg = f"[{k}].channel: {fault.channel!r}: a log has only {', '.join(SAMPLE_CHANNELS)}"
            raise ValueError(msg)
    return faults


SampleFaults = Annotated[Faults, AfterValidator(only_samples)]
"""As `Faults`, for a device that only plays samples."""
