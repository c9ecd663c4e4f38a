"""Friction points from files as other programs write them: columns by name and unit, averaged by file or by speed."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from hw.interface import BackendError
from hw.plain_words import explain
from hw.playback.options import CurrentColumn, TimeColumn, TorqueColumn, VelocityColumn
from hw.playback.reader import CURRENT_UNITS, TIME_UNITS, TORQUE_UNITS, VELOCITY_UNITS
from hw.playback.tables import read_table
from hw.playback.units import require_unit
from rtctl.errors import ConfigError, DataError
from rtctl.friction.logs.logs import FrictionSamples, file_sha256, level_points
from rtctl.friction.logs.row_faults import quantum
from rtctl.friction.points.measured import FrictionPoints, require_enough

Average = Literal["none", "file", "speed"]

ROLES = ("velocity", "torque", "current", "time")

QUARTERS, UNSTEADY = 4, 0.5
"""Largest range of the mean velocities of the quarters of a file that is one point, share of its mean: encoders count whole steps."""

OUTLIER_SCALES = 10.0
"""Rows of a run further from its median, robust standard deviations, are left out."""

_UNITS: dict[str, Mapping[str, float]] = {
    "velocity": VELOCITY_UNITS,
    "torque": TORQUE_UNITS,
    "current": CURRENT_UNITS,
    "time": TIME_UNITS,
}


class Columns(BaseModel):
    """Which column is what; friction is a torque (N m at the joint), or a current with the torque it makes as scale (N m/A)."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)
    velocity: VelocityColumn = VelocityColumn(column="velocity_rad_s")
    torque: TorqueColumn | None = None
    current: CurrentColumn | None = None
    time: TimeColumn | None = None


def read_mapped(
    files: Sequence[Path], tables: Mapping[str, Any], average: Average, text: Mapping[str, str | None]
) -> tuple[FrictionPoints, list[str]]:
    """Points of several files and what was left out of them, columns by `tables` (role -> option table as of the playback reader).

    Parameters
    ----------
    average
        "file": each file is one run at one speed and becomes one point; "speed": all rows together, by levels of speed;
        "none": each row is a point.
    text
        `delimiter` and `decimal` of text, None where they are to be found.

    Raises
    ------
    ConfigError
        A table that cannot be.
    DataError
        A file that cannot be read, friction that points against the motion, a run that is not steady, too few points.
    """
    try:
        columns = Columns.model_validate(dict(tables))
    except ValidationError as error:
        told = "; ".join(f"{each.where}: {each.text}" for each in explain(error, Columns, dict(tables)))
        raise ConfigError(f"--column: {told}") from error
    if (columns.torque is None) == (columns.current is None):
        if columns.torque is not None:
            raise ConfigError("--column: give torque or current, not both")
        columns = columns.model_copy(update={"torque": TorqueColumn(column="friction_torque_nm")})
    parts = [_signals(file, columns, text) for file in files]
    source = str(files[0]) if len(files) == 1 else f"{files[0]} and {len(files) - 1} more"
    sha256 = _checksum(files)
    notes: list[str] = []
    if average == "file":
        points = FrictionPoints.from_rows(
            [_one_point(file, *part[:2], notes) for file, part in zip(files, parts, strict=True)],
            source,
            sha256,
        )
    elif average == "speed":
        velocity, torque = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
        moving = velocity != 0
        rows = FrictionSamples(np.zeros(int(moving.sum())), velocity[moving], torque[moving], source, sha256)
        points = level_points(rows)
    else:
        points = _rows(parts, source, sha256, timed=columns.time is not None)
    require_enough(points)
    return points, notes


def _signals(
    file: Path, columns: Columns, text: Mapping[str, str | None]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Velocity, friction torque and time (zeros without) of a file, SI."""
    given = {role: column.model_dump() for role in ROLES if (column := getattr(columns, role))}
    try:
        table = read_table(file, tuple(column["column"] for column in given.values()), **text)
        found = {}
        for role, column in given.items():
            name, units = column["column"], _UNITS[role]
            require_unit(file, name, table.units.get(name, ""), column, tuple(units))
            found[role] = column["scale"] * units[column["unit"]] * (table.columns[name] - column["offset"])
    except BackendError as error:
        raise DataError(str(error)) from error
    torque = found["torque"] if "torque" in found else found["current"]
    return found["velocity"], torque, found.get("time", np.zeros(len(torque)))


def _one_point(file: Path, velocity: np.ndarray, torque: np.ndarray, notes: list[str]) -> tuple[float, ...]:
    """(velocity, friction, direction, std, count) of a run at one speed; rows far off the others are left out and told."""
    off = np.abs(torque - np.median(torque))
    far = off > OUTLIER_SCALES * 1.4826 * max(float(np.median(off)), quantum(torque))
    if far.any():
        row = int(np.argmax(off))
        notes.append(
            f"{file}: {int(far.sum())} rows left out, the furthest row {row + 1} with {torque[row]:.4g} N m against {np.median(torque):.4g}"
        )
    velocity, torque = velocity[~far], torque[~far]
    mean, friction = float(velocity.mean()), float(torque.mean())
    quarters = [float(part.mean()) for part in np.array_split(velocity, min(QUARTERS, len(velocity)))]
    if not np.ptp(quarters) <= UNSTEADY * abs(mean):
        raise DataError(
            f"{file}: not one speed: its quarters have {', '.join(f'{each:.3g}' for each in quarters)} rad/s; cut what is not steady, or use "
            "--average speed"
        )
    _require_opposed(file, mean, friction)
    return mean, abs(friction), float(np.sign(mean)), float(torque.std(ddof=1)), float(len(torque))


def _rows(
    parts: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]], source: str, sha256: str, *, timed: bool
) -> FrictionPoints:
    velocity, torque, time_s = (np.concatenate([part[k] for part in parts]) for k in range(3))
    direction = np.where(velocity != 0, np.sign(velocity), np.sign(torque))
    against = np.flatnonzero(torque * direction <= 0)
    if len(against):
        _require_opposed(
            Path(f"{source}: row {against[0] + 1}"), float(velocity[against[0]]), float(torque[against[0]])
        )
    nothing = np.full(len(velocity), np.nan)
    return FrictionPoints(
        velocity, np.abs(torque), direction, nothing, nothing, source, sha256, time_s if timed else None
    )


def _require_opposed(where: Path, velocity: float, friction: float) -> None:
    if velocity * friction <= 0:
        raise DataError(
            f"{where}: the torque, {friction:.4g} N m, does not have the sign of the motion ({velocity:.4g} rad/s): turn the sign of one of them "
            "(scale -1), take its offset away, or average (--average)"
        )


def _checksum(files: Sequence[Path]) -> str:
    digests = [file_sha256(file) for file in files]
    for digest in digests:
        if digests.count(digest) > 1:
            first, second, *_ = (file for file, each in zip(files, digests, strict=True) if each == digest)
            raise DataError(f"{second}: the same as {first}; give each file once")
    return digests[0] if len(files) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()
