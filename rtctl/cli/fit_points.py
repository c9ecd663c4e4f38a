"""Which points `rtctl fit` learns from: its own files, or columns of files that other programs wrote."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rtctl.cli.columns import tables, text_options
from rtctl.errors import ConfigError

if TYPE_CHECKING:
    from rtctl.friction.points.measured import FrictionPoints


def options(command: Any) -> Any:  # noqa: ANN401
    """`--column`, `--map`, `--delimiter`, `--decimal` and `--average`."""
    command = text_options(command)
    command = click.option(
        "--average",
        type=click.Choice(["none", "file", "speed"]),
        default="none",
        show_default=True,
        help="file: each file is a run at one speed and becomes one point; speed: all rows, by levels of speed",
    )(command)
    command = click.option(
        "--map", "map_file", type=click.Path(path_type=Path), help="the same as TOML, a table per role"
    )(command)
    return click.option(
        "--column",
        "columns",
        multiple=True,
        metavar="ROLE=NAME[:UNIT[:SCALE]]",
        help="ROLE: velocity, torque (or current, with N m/A as SCALE); position, load, temperature, time, log",
    )(command)


def read(
    files: tuple[Path, ...],
    columns: tuple[str, ...],
    map_file: Path | None,
    average: Any,  # noqa: ANN401
    text: Mapping[str, str | None],
) -> FrictionPoints:
    """The points, with every column that was measured.

    Raises
    ------
    ConfigError
        Several files of the program's own format, which are one file.
    DataError
        See `rtctl.friction.points.reader.read_points` and `rtctl.friction.logs.other_programs.read_mapped`.
    """
    from rtctl.friction.logs.other_programs import ROLES, read_mapped
    from rtctl.friction.points.reader import read_points
    from rtctl.recording.as_columns import register

    if not (columns or map_file or average != "none"):
        if len(files) > 1:
            raise ConfigError(
                "several files of points: say how they become one, --average file or speed, or --column ..."
            )
        return read_points(files[0])
    register()
    points, notes = read_mapped(files, tables(columns, map_file, ROLES), average, text)
    for note in notes:
        click.echo(f"warning: {note}", err=True)
    return points
