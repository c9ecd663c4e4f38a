"""`--column ROLE=NAME[:UNIT[:SCALE]]` and `--map FILE.toml`: which column of a log is what, in every command
that reads one."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hw.interface import BackendError
from hw.motion import FORCE_UNITS, LENGTH_UNITS, SPEED_UNITS, name
from hw.outside import read_toml
from hw.playback.columns import read_table
from hw.playback.reader import ANGLE_UNITS, CURRENT_UNITS, TIME_UNITS, TORQUE_UNITS, VELOCITY_UNITS
from hw.playback.text_rows import is_number
from hw.playback.units import OTHERS, SPELT, unread
from rtctl.errors import ConfigError

if TYPE_CHECKING:
    from rtctl.rig_file.axis_tables import AxisTable

_LINEAR = {*LENGTH_UNITS, *SPEED_UNITS, *FORCE_UNITS}
# "": NAME::SCALE has a scale and no unit
_UNITS = {"", "counts", "degC"}.union(
    TIME_UNITS, ANGLE_UNITS, VELOCITY_UNITS, CURRENT_UNITS, TORQUE_UNITS, _LINEAR
)


DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t", "bar": "|"}


def text_options(command: Callable[..., None]) -> Callable[..., None]:
    """`--delimiter` and `--decimal`, for text whose own are not found."""
    command = click.option(
        "--decimal", type=click.Choice(["point", "comma"]), help="decimal mark in text; default: found"
    )(command)
    return click.option(
        "--delimiter",
        type=click.Choice(list(DELIMITERS)),
        help="between two cells of text; default: found by the names",
    )(command)


def text_of(delimiter: str | None, decimal: str | None) -> dict[str, str | None]:
    """`delimiter` and `decimal` of the reader, from the words of the command line."""
    return {
        "delimiter": DELIMITERS[delimiter] if delimiter else None,
        "decimal": {"point": ".", "comma": ","}[decimal] if decimal else None,
    }


def tables(
    columns: tuple[str, ...], map_file: Path | None, roles: tuple[str, ...]
) -> dict[str, dict[str, Any]]:
    """Option tables of the reader, by the names of the command line, which overrides the file.

    Raises
    ------
    ConfigError
        A file that cannot be read, a role that does not exist."""
    given: dict[str, Any] = {}
    if map_file:
        try:
            given = read_toml(map_file)
        except (OSError, ValueError) as error:
            raise ConfigError(f"{map_file}: cannot read the map of columns: {error}") from error
        for role, table in given.items():
            if not isinstance(table, dict):
                raise ConfigError(f"{map_file}: {role} must be a table: [{role}], and below it column = NAME")
            if not isinstance(table.get("unit", ""), str):
                raise ConfigError(f"{map_file}: unit of {role} must be text in quotes")
    for text in columns:
        role, _, rest = text.partition("=")
        name, unit, scale = _name_unit_scale(rest)
        if not name:
            raise click.BadParameter(f"{text!r} is not ROLE=NAME[:UNIT[:SCALE]]")
        # the whole table: unit and scale of the file are those of its own column
        given[role] = {"column": name} | ({"unit": unit} if unit else {})
        given[role] |= {"scale": float(scale)} if scale else {}
    # of the file as well: a role that is spelt wrong would be left out without a word
    unknown = sorted(set(given) - set(roles))
    if unknown:
        raise ConfigError(f"unknown role {unknown[0]!r} of a column; there are {', '.join(roles)}")
    return given


def _name_unit_scale(text: str) -> tuple[str, str, str]:
    """Parts of NAME[:UNIT[:SCALE]]; a name may hold colons, so unit and scale are told by what they are."""
    *before, last = re.split(r":(?![^\[(]*[\])])", text)  # not within brackets: `Time [hh:mm:ss]`
    said = before[-1] if len(before) > 1 and is_number(last) else last
    if before and (other := SPELT.get(said.lower(), said)) in OTHERS:
        raise click.BadParameter(f"{text!r}: {unread(other)}; a column whose name ends so is said in --map")
    unit = unit_of(before[-1]) if len(before) > 1 else None
    if unit or (unit == "" and is_number(last)):  # `Axis 1::Torque` is a name
        return ":".join(before[:-1]), unit, _scale(text, last)
    unit = unit_of(last) if before else None
    if unit is not None:
        return ":".join(before), unit, ""
    return text, "", ""


def unit_of(text: str) -> str | None:
    """A unit in our spelling, also where it is spelt as programs do (`sec`, `degrees`); None where it is
    none."""
    unit = text if text in _UNITS else SPELT.get(text.lower(), text)
    return unit if unit in _UNITS else None


def _scale(text: str, scale: str) -> str:
    try:
        float(scale or 1)
    except ValueError as error:
        raise click.BadParameter(f"{text!r}: the scale must be a number") from error
    return scale


def own_columns(axis: AxisTable) -> tuple[str, ...]:
    """Columns of an axis in a recording of rtctl's own; a force sensor that is not there shows no torque."""
    roles = (("position", "position_rad"), ("torque", "motor_torque_nm"), ("external", "hand_torque_nm"))
    return tuple(f"{role}={name(field, axis.motion)}.{axis.name}" for role, field in roles)


def held_columns(log: Path) -> str:
    """What columns there are, in the words in which the reader refuses one that is not."""
    try:
        read_table(log, ("position or torque",))
    except BackendError as error:
        return f"\n  {error}"
    return ""
