"""Which points `rtctl fit` learns from: its own files, or columns of files that other programs wrote."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hw.motion import of_units, words
from rtctl.cli.columns import tables, text_options
from rtctl.cli.number import Number
from rtctl.cli.outputs import errors_in_units_of
from rtctl.errors import ConfigError

if TYPE_CHECKING:
    from rtctl.friction.logs.other_programs import Average
    from rtctl.friction.points import FrictionPoints


LEVELS_FEW = 10
"""Fewer speeds of a direction leave a spline free between them: by 28 % of the friction (decision 0118)."""


def options(command: Callable[..., None]) -> Callable[..., None]:
    """`--column`, `--map`, `--delimiter`, `--decimal`, `--average` and `--lead-m`."""
    command = click.option(
        "--lead-m",
        type=Number(min=0, max=10, min_open=True),
        help="of a screw, m a turn: columns of its angle, speed and torque become those of a linear axis",
    )(command)
    command = text_options(command)
    command = click.option(
        "--average",
        type=click.Choice(["none", "file", "speed"]),
        default="none",
        help="file: each file is a run at one speed and becomes one point; speed: all rows, by levels of "
        "speed",
    )(command)
    command = click.option(
        "--map", "map_file", type=click.Path(path_type=Path), help="the same as TOML, a table per role"
    )(command)
    return click.option(
        "--column",
        "columns",
        multiple=True,
        metavar="ROLE=NAME[:UNIT[:SCALE]]",
        help="ROLE: velocity, torque (or current, with N m/A as SCALE); position, load, motor, temperature, "
        "time, log",
    )(command)


def read(
    files: tuple[Path, ...],
    columns: tuple[str, ...],
    map_file: Path | None,
    average: Average,
    text: Mapping[str, str | None],
    lead_m: float | None = None,
    *,
    of_speeds: bool = True,
) -> FrictionPoints:
    """The points, with every column that was measured; `of_speeds`: enough for a curve of speed.

    Raises
    ------
    ConfigError
        Several files of the program's own format, which are one file.
    DataError
        See `rtctl.friction.point_reader.read_points` and `rtctl.friction.logs.other_programs.read_mapped`."""
    from rtctl.friction.logs.other_programs import ROLES, read_mapped
    from rtctl.friction.point_reader import read_points
    from rtctl.friction.points import require_enough
    from rtctl.recording.as_columns import register

    if not (columns or map_file or average != "none"):
        # our own files say themselves in what they are
        if lead_m:
            raise ConfigError("--lead-m is for columns of other programs; give --column, or leave it out")
        # our files hold their session; which of several files a session is, nobody said
        if len(files) > 1:
            raise ConfigError(
                "several files of points: say how they become one, --average file or speed, or --column ..."
            )
        return read_points(files[0], of_speeds=of_speeds)
    # a recording of our own is a log like any other
    register()
    # the command line over the file, role by role
    mapped = tables(columns, map_file, ROLES)
    with errors_in_units_of("linear" if lead_m else of_units(table.get("unit") for table in mapped.values())):
        points, notes = read_mapped(files, mapped, average, text, lead_m or 0.0)
        if of_speeds:
            require_enough(points)
    for note in notes:
        click.echo(words(f"warning: {note}", points.motion), err=True)
    return points


def tell_doubts(points: FrictionPoints, *, known: bool, alone: bool) -> None:
    """Say on stderr what looks like something else than friction
    (`rtctl.friction.logs.points_check.doubtful_points`), and speeds too few for a spline that is learned
    `alone`."""
    from rtctl.friction.logs.points_check import doubtful_points
    from rtctl.friction.points import level_starts

    # the poorer direction: each has a spline of its own
    levels = min(len(level_starts(points.branch(direction)[0])) for direction in (1, -1))
    if alone and levels < LEVELS_FEW:
        click.echo(
            f"warning: {points.source}: only {levels} speeds in a direction, between which a spline is free; "
            "compare formulas (--ladder), or measure more speeds",
            err=True,
        )

    for doubt in doubtful_points(points, known=known):
        click.echo(words(f"warning: {doubt}", points.motion), err=True)


def without_outliers(points: FrictionPoints, *, keep: bool) -> FrictionPoints:
    """The points without those that are far from their neighbours in speed, each named on stderr; all of them
    where asked."""
    from rtctl.friction import outliers

    # whoever has looked at them knows better
    if keep:
        return points
    # kept in the points, and marked: a plot shows them
    kept, notes = outliers.without_outliers(points)
    for note in notes:
        click.echo(words(f"warning: {note}", points.motion), err=True)
    return kept


def left_out_rows(points: FrictionPoints) -> list[dict[str, float]]:
    """What was left out, for scripts: velocity (rad/s) and friction (N m), signed."""
    # none was, or none was looked for
    if points.left_out is None:
        return []
    velocity, friction = points.velocity_rad_s, points.friction_nm * points.direction
    return [
        {"velocity_rad_s": float(velocity[row]), "friction_torque_nm": float(friction[row])}
        for row in points.left_out.nonzero()[0]
    ]
