"""Friction points from files of other programs: columns by name and unit, averaged by file or by speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from hw.interface import BackendError
from hw.motion import LENGTH_UNITS, SPEED_UNITS, coordinate_units, effort_units, of_units
from hw.plain_words import explain
from hw.playback.columns import read_table
from hw.playback.options import (
    Column,
    CurrentColumn,
    PositionColumn,
    TimeColumn,
    TorqueColumn,
    VelocityColumn,
)
from hw.playback.reader import ANGLE_UNITS, CURRENT_UNITS, TIME_UNITS, TORQUE_UNITS, VELOCITY_UNITS
from hw.playback.units import require_unit
from rtctl.errors import ConfigError, DataError, of_file
from rtctl.friction.logs.copied_rows import COPIED_ROWS, fresh_rows, require_own_rows
from rtctl.friction.logs.logs import FrictionSamples, files_sha256, level_points
from rtctl.friction.logs.runs import Signals, one_point, require_no_limit
from rtctl.friction.point_columns import COLUMNS
from rtctl.friction.points import FrictionPoints

Average = Literal["none", "file", "speed"]

BESIDE = {
    "time": "time_s",
    "position": "position_rad",
    "load": "load_nm",
    "motor": "motor_nm",
    "temperature": "temperature_c",
    "log": "log",
}
"""Role -> column of the points."""

ROLES = ("velocity", "torque", "current", *BESIDE)

RESTARTS_SHARE = 0.1  # of the rows; a time that goes back before more of them is in no order

_UNITS: dict[str, Mapping[str, float]] = {
    "velocity": VELOCITY_UNITS,
    "torque": TORQUE_UNITS,
    "current": CURRENT_UNITS,
    "time": TIME_UNITS,
    "position": {name: unit for name, unit in ANGLE_UNITS.items() if name != "counts"},
    "load": TORQUE_UNITS,
    "motor": TORQUE_UNITS,
    "temperature": {"degC": 1.0},
    "log": {"": 1.0},
}


class TemperatureColumn(Column):
    """A temperature."""

    unit: Literal["degC"] = "degC"


class LogColumn(Column):
    """Number of the log, lap or session of a row."""

    unit: Literal[""] = ""


class Columns(BaseModel):
    """Which column is what; friction is a torque (N m at the joint), or a current with the torque it makes as
    scale (N m/A)."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)
    velocity: VelocityColumn = VelocityColumn(column="velocity_rad_s")
    torque: TorqueColumn | None = None
    current: CurrentColumn | None = None
    time: TimeColumn | None = None
    position: PositionColumn | None = None
    load: TorqueColumn | None = None
    motor: TorqueColumn | None = None
    temperature: TemperatureColumn | None = None
    log: LogColumn | None = None


def read_mapped(
    files: Sequence[Path],
    tables: Mapping[str, Any],
    average: Average,
    text: Mapping[str, str | None],
    lead_m: float = 0.0,
) -> tuple[FrictionPoints, list[str]]:
    """Points of several files and what was left out, columns by `tables` (role -> a playback option table).

    Parameters
    ----------
    average
        "file": each file is one run at one speed and becomes one point; "speed": all rows together, by levels
        of speed; "none": each row is a point.
    text
        `delimiter` and `decimal` of text, None where they are to be found.
    lead_m
        Of a screw, m a turn: its angle and torque become a place and a force. Units of these are of a linear
        axis without it, too.

    Raises
    ------
    ConfigError
        A table that cannot be.
    DataError
        A file that cannot be read, friction that points against the motion, a run that is not steady."""
    columns = _columns(tables)
    motion = "linear" if lead_m else of_units(table.get("unit") for table in tables.values())
    parts = []
    for file in files:
        with of_file(file):
            parts.append(_signals(file, columns, text, units_of(motion, lead_m)))
    # each file a session: whole ones are held out, so that none vouches for itself
    if len(files) > 1 and columns.log is None:
        for k, part in enumerate(parts):
            part.columns["log"] = np.full(len(part.velocity), float(k))
    sha256 = files_sha256(files)
    parts, notes = _own(files, parts, average)
    # several sessions saved one below the other look like one long one otherwise
    if len(files) == 1 and columns.log is None and average != "file":
        _part_where_time_starts_over(files[0], parts[0], notes)
    source = str(files[0]) if len(files) == 1 else f"{files[0]} and {len(files) - 1} more"
    if average == "file":
        require_no_limit(files, parts)
        found = []
        for file, part in zip(files, parts, strict=True):
            with of_file(file):
                found.append(one_point(file, part, notes))
        beside = {name: np.array([columns[name] for _, columns in found]) for name in parts[0].columns}
        points = FrictionPoints.from_rows([row for row, _ in found], source, sha256, beside)
    elif average == "speed":
        points = level_points(_moving(parts, source, sha256))
    else:
        whole = _together(parts)
        points = FrictionPoints.from_signed(
            whole.velocity, whole.torque, source, sha256, whole.columns, lambda k: f"{source}: row {k + 1}"
        )
    return replace(points, motion=motion), notes


def _own(files: Sequence[Path], parts: list[Signals], average: Average) -> tuple[list[Signals], list[str]]:
    """The signals without rows that are others again, and what is to be said."""
    beside = [[part.columns[n] for n in part.columns if n not in ("log", "time_s")] for part in parts]
    tables = [np.column_stack([p.velocity, p.torque, *more]) for p, more in zip(parts, beside, strict=True)]
    # points have no order in time: a copy is told by whole rows, wherever they stand
    if average == "none":
        require_own_rows(tables, files)
        return parts, []
    # runs at one speed go nowhere: there is no place to be shifted by
    still = [np.zeros(len(one)) for one in tables]
    fresh, told = fresh_rows(tables, still, list(map(str, files)), COPIED_ROWS)
    own = [part.at(mine) for part, mine in zip(parts, fresh, strict=True)]
    return own, [f"{told}: counted once"] if told else []


def _columns(tables: Mapping[str, Any]) -> Columns:
    """The map of columns; where none is friction, that of our own name is. Raises ConfigError."""
    try:
        columns = Columns.model_validate(dict(tables))
    except ValidationError as error:
        told = "; ".join(f"{each.where}: {each.text}" for each in explain(error, Columns, dict(tables)))
        raise ConfigError(f"--column: {told}") from error
    if (columns.torque is None) == (columns.current is None):
        if columns.torque is not None:
            raise ConfigError("--column: give torque or current, not both")
        columns = columns.model_copy(update={"torque": TorqueColumn(column="friction_torque_nm")})
    # 1 N m/A by default would be believed: no column of friction is in amperes
    if columns.current is not None and "scale" not in columns.current.model_fields_set:
        raise ConfigError(
            f"--column: a current ({columns.current.column}) needs its scale, what an ampere is at the joint "
            "in N m/A (torque constant times gear ratio and efficiency): current=NAME:A:SCALE"
        )
    return columns


def units_of(motion: str, lead_m: float) -> dict[str, Mapping[str, float]]:
    """Units of every role on an axis of this motion, factors to its own."""
    effort = effort_units(TORQUE_UNITS, motion, lead_m)
    return {
        **_UNITS,
        "velocity": coordinate_units(VELOCITY_UNITS, SPEED_UNITS, motion, lead_m),
        "position": coordinate_units(_UNITS["position"], LENGTH_UNITS, motion, lead_m),
        **dict.fromkeys(("torque", "load", "motor"), effort),
    }


def _signals(
    file: Path, columns: Columns, text: Mapping[str, str | None], known: Mapping[str, Mapping[str, float]]
) -> Signals:
    """The mapped columns of a file, SI."""
    given = {role: column.model_dump() for role in ROLES if (column := getattr(columns, role))}
    try:
        table = read_table(file, tuple(column["column"] for column in given.values()), **text)
        found = {}
        for role, column in given.items():
            name, units = column["column"], known[role]
            if column["unit"] not in units:
                raise DataError(
                    f"{file}: column {name!r} is read in {column['unit']!r}, which this axis does not have: "
                    f"it has {', '.join(units)}"
                )
            require_unit(file, name, table.units.get(name, ""), column, tuple(units))
            found[role] = column["scale"] * units[column["unit"]] * (table.columns[name] - column["offset"])
    except BackendError as error:
        raise DataError(str(error)) from error
    torque = found["torque"] if "torque" in found else found["current"]
    beside = {column: found[role] for role, column in BESIDE.items() if role in found}
    for name, values in beside.items():
        bounds = COLUMNS[name]
        wrong = np.flatnonzero(~((values >= bounds.low) & (values <= bounds.high)))
        if len(wrong):
            raise DataError(
                f"{file}: row {wrong[0] + 1}: {name} {values[wrong[0]]:g} is not within {bounds.low:g} to "
                f"{bounds.high:g}; correct the column or its unit"
            )
    return Signals(found["velocity"], torque, beside)


def _together(parts: Sequence[Signals]) -> Signals:
    names = parts[0].columns
    return Signals(
        np.concatenate([part.velocity for part in parts]),
        np.concatenate([part.torque for part in parts]),
        {name: np.concatenate([part.columns[name] for part in parts]) for name in names},
    )


def _moving(parts: Sequence[Signals], source: str, sha256: str) -> FrictionSamples:
    """Rows of all files at which the joint moves."""
    whole = _together(parts)
    # at rest friction is any torque up to break-away: no level of speed
    whole = whole.at(whole.velocity != 0)
    still = np.zeros(len(whole.velocity))
    return FrictionSamples(still, whole.velocity, whole.torque, source, sha256, whole.columns)


def _part_where_time_starts_over(file: Path, part: Signals, notes: list[str]) -> None:
    over = np.diff(part.columns.get("time_s", np.zeros(1)), prepend=-np.inf) < 0
    if 0 < over.sum() <= RESTARTS_SHARE * len(over):
        part.columns["log"] = np.cumsum(over).astype(float)
        notes.append(
            f"{file}: the time starts over before row {int(np.argmax(over)) + 1}: taken for {over.sum() + 1} "
            "sessions; --column log=NAME says which is which"
        )
