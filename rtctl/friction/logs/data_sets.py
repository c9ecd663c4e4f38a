"""Data on disk that models are judged by: a description (TOML) of sets of logs, of runs at one speed, or of
points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Self

from pydantic import Field, ValidationError, model_validator

from rtctl.errors import ConfigError, DataError
from rtctl.friction.logs.log_input import Gearing
from rtctl.friction.logs.log_points import points_of_logs
from rtctl.friction.logs.other_programs import read_mapped
from rtctl.friction.outliers import without_outliers
from rtctl.friction.point_reader import read_points
from rtctl.friction.points import FrictionPoints, require_enough
from rtctl.rig_file.fields import Table
from rtctl.rig_file.mistakes import fault_lines
from rtctl.rig_file.toml_lines import read_toml

LEFT_OUT = "left out: "
"""How a note about a file begins that could not be read."""

ROLES = {
    "time": "time",
    "position": "position",
    "torque": "motor_torque",
    "current": "current",
    "external": "hand_torque",
    "velocity": "velocity",
}
"""Role as `rtctl identify --log` calls it -> option of the reader of logs."""


class DataSet(Table):
    """One set: `logs` (each a session, for the balance of a joint in motion), `runs` (each at one speed), or
    `points`."""

    name: str = Field(min_length=1, max_length=200, description="heading on the page")
    source: str = Field("", max_length=1000, description="where it is from, and what it is")
    logs: tuple[str, ...] = Field((), max_length=200, strict=False, description="sessions")
    runs: tuple[str, ...] = Field((), max_length=200, strict=False, description="files at one speed each")
    points: str | None = Field(None, max_length=1000, description="a file of friction points")
    columns: dict[str, dict[str, Any]] = Field(default_factory=dict, description="tables as of --map")
    beside: bool = Field(False, description="paths are relative to the description")

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if (bool(self.logs) + bool(self.runs) + bool(self.points)) != 1:
            raise ValueError("give one of logs, runs and points")
        return self


class Description(Table):
    """A whole file."""

    set: tuple[DataSet, ...] = Field(min_length=1, max_length=100, strict=False)


def read_description(path: Path) -> tuple[DataSet, ...]:
    """The sets of a description. Raises ConfigError, naming file, key and what is wrong."""
    _raw, data, where = read_toml(path, "description", " (docs/evidence.toml is one)")
    try:
        return Description.model_validate(data).set
    except ValidationError as error:
        faults = tuple(fault_lines(where, (), error, Description, data))
        raise ConfigError(f"{path}: not a description of data sets", faults) from error


def read_set(one: DataSet, folder: Path) -> tuple[FrictionPoints, tuple[str, ...]]:
    """Points of a set whose files are below `folder`, and what is to be said of them.

    Raises
    ------
    ConfigError
        A file that is not there.
    DataError
        What `rtctl identify --log` or `rtctl fit` would refuse, likewise, of all files of the set: some of
        several are left out, and the notes say why."""
    notes: tuple[str, ...] = ()
    if one.points:
        # a pattern in `points` would be several files, which are several sets
        points = read_points(_found(one.points, folder)[0])
    elif one.runs:
        files = [file for pattern in one.runs for file in _found(pattern, folder)]
        marks = {"delimiter": None, "decimal": None}
        points, notes = _readable(files, lambda some: read_mapped(some, one.columns, "file", marks))
        require_enough(points)
    else:
        files = [file for pattern in one.logs for file in _found(pattern, folder)]
        unknown = sorted(set(one.columns) - set(ROLES))
        if unknown:
            raise ConfigError(
                f"set {one.name!r}: columns.{unknown[0]}: no role of a log; one of {', '.join(ROLES)}"
            )
        # the words of the command line: a description and `--column` then say the same
        mapped = {ROLES[role]: table for role, table in one.columns.items()}
        points, notes = _readable(files, lambda some: points_of_logs(some, mapped, Gearing()))
    kept, left_out = without_outliers(points)
    return kept, (*notes, *left_out)


def _readable(
    files: list[Path], read: Callable[[list[Path]], tuple[FrictionPoints, Sequence[str]]]
) -> tuple[FrictionPoints, tuple[str, ...]]:
    """Points of the files that can be read, and the notes: why others were left out comes first."""
    try:
        points, notes = read(files)
    except DataError as error:
        # by the file and not its name: a link, or ./ before it, is the same one
        sound = [file for file in files if error.file is None or not file.samefile(error.file)]
        # no file is named, or none is left: the error is of the set
        if not sound or len(sound) == len(files):
            raise
        points, notes = _readable(sound, read)
        notes = (f"{LEFT_OUT}{error}", *notes)
    return points, tuple(notes)


def _found(pattern: str, folder: Path) -> list[Path]:
    # sorted: sessions are numbered by it, and a page of evidence must come out alike on every machine
    files = sorted(folder.glob(pattern)) if "*" in pattern else [folder / pattern]
    if not files or not all(file.is_file() for file in files):
        raise ConfigError(f"{folder}: no file {pattern}; give the folder of the data with --data")
    return files
