"""What the options of `rtctl fit` may be, beyond what click itself checks."""

from __future__ import annotations

import re
from pathlib import Path

import click

from rtctl.errors import ConfigError, DataError
from rtctl.friction.kind_table import KERNELS

KERNEL = click.option(
    "--kernel",
    type=click.Choice(["all", *KERNELS, "formula"]),
    default="all",
    help="rungs of the ladder to climb",
)
"""As of every command that climbs the ladder."""


def temperatures(
    _: click.Context, option: click.Parameter, value: tuple[float, float] | None
) -> tuple[float, float] | None:
    """Refuse a range of temperature (degrees C) that is none."""
    if value is not None and not -100 <= value[0] <= value[1] <= 300:
        raise click.BadParameter("must be -100 <= MIN <= MAX <= 300 degrees C", param=option)
    return value


def rig_name(_ctx: click.Context, _param: click.Parameter, name: str) -> str:
    """A name that a rig can have, before anything is learned."""
    from hw.plain_words import NAME_PATTERN, NAME_WORDS

    if not re.fullmatch(NAME_PATTERN, name):
        raise click.BadParameter(f"{name!r} is no rig's name: {NAME_WORDS}, as [rig] name of its rig file")
    return name


def require_motion(motion: str, wanted: str, where: Path | str) -> None:
    """Refuse what is of an axis of the other motion: m would be read as rad. Raises DataError, naming
    `where`."""
    if motion != wanted:
        raise DataError(
            f"{where}: is of a {motion} axis, the points are of a {wanted} one; give files of one axis"
        )


def require_of_linear(families: tuple[str, ...], kernel: str, search: str | None) -> None:
    """Refuse what a model of a linear axis cannot have: a kernel, tube and C that know what rad/s and N m
    are.

    Raises
    ------
    ConfigError
        Names the option and what to give in its place."""
    if not families:
        others = ", ".join(name for name, kind in KERNELS.items() if kind.any_unit)
        raise ConfigError(
            f"--kernel {kernel}: its curve depends on the unit of speed; of a linear axis give --kernel "
            f"{others} or formula"
        )
    if search == "none":
        raise ConfigError(
            "--search none has a tube and bounds C for N m and rad/s; of a linear axis leave it out"
        )
