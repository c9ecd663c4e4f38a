"""`rtctl fit --report`: what it needs is read before the search, so that a mistake costs no time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rtctl.cli.fit_checks import require_motion

if TYPE_CHECKING:
    from rtctl.friction.learn.beside_speed import LoadVerdict
    from rtctl.friction.learn.ladder import Ladder
    from rtctl.friction.learn.warmth import Warmth
    from rtctl.friction.model import FrictionModel
    from rtctl.friction.points import FrictionPoints
    from rtctl.rig_file.config import LoadedConfig


HEAD_BYTES = 4096
"""Begin of a file of points, which names its columns."""

TEST_POINTS_MIN = 2
"""Least number of points of a test: the error of a single one has no spread."""


@dataclass(frozen=True)
class Plan:
    """Where the report goes (None: nowhere), and what else is looked at."""

    folder: Path | None
    test: FrictionPoints | None
    loaded: LoadedConfig | None


def prepare(
    folder: Path | None, test: Path | None, config: Path | None, rig: str, read: Callable[..., FrictionPoints]
) -> Plan:
    """Read test points (with `read`, as the others, unless they are in a file of our own) and rig file, and
    look whether the report may be written.

    Raises
    ------
    click.UsageError
        --test without --report.
    DataError
        A folder in the way, test points that cannot be used, or a rig file of another rig."""
    if folder is None and test is not None:
        raise click.UsageError("--test is for the report; add --report DIR")
    from rtctl.errors import DataError
    from rtctl.friction.learn import report_write as report
    from rtctl.rig_file.config import load

    if folder is not None:
        report.require_place(folder)
    loaded = None if config is None else load(config)
    # limits and advice would be those of another joint
    if loaded is not None and loaded.config.rig.name != rig:
        raise DataError(
            f"{config}: is of rig {loaded.config.rig.name}, the fit of {rig}; correct --rig or --config"
        )
    return Plan(folder, None if test is None else _test_points(test, read), loaded)


def _test_points(path: Path, read: Callable[..., FrictionPoints]) -> FrictionPoints:
    """Points to judge by, of either direction: few will do, as nothing is learned from them. Raises
    DataError."""
    from rtctl.errors import DataError
    from rtctl.friction.point_columns import TORQUE
    from rtctl.friction.point_reader import read_points

    try:
        with path.open("rb") as file:
            own = TORQUE.name.removesuffix("m").encode() in file.read(HEAD_BYTES)  # of a linear axis, too
    except OSError as error:
        raise DataError(f"{path}: cannot read the points: {error.strerror}; correct the path") from error
    points = read_points(path, of_speeds=False) if own else read((path,), of_speeds=False)
    if len(points.friction_nm) < TEST_POINTS_MIN:
        raise DataError(
            f"{path}: {len(points.friction_nm)} points, a test has at least {TEST_POINTS_MIN}; measure more "
            "speeds"
        )
    return points


def require_plausible(plan: Plan, measured: FrictionPoints) -> None:
    """Refuse points and test points that the rig file rules out, and a test that is none. Raises
    DataError."""
    from rtctl.friction.logs.points_check import require_held_out, require_plausible_points

    if plan.test is not None:
        require_motion(plan.test.motion, measured.motion, plan.test.source)
        require_held_out(plan.test, measured)
    for points in (measured, plan.test):
        if points is not None and plan.loaded is not None:
            require_plausible_points(points, plan.loaded)


def write(
    plan: Plan,
    measured: FrictionPoints,
    model: FrictionModel,
    ladder: Ladder | None,
    options: dict[str, Any],
    folds: str,
    beside: tuple[LoadVerdict, Warmth],
) -> Path | None:
    """Write the report; returns its page, None when none is wanted."""
    if plan.folder is None:
        return None
    from rtctl.friction.learn import report_evidence
    from rtctl.friction.learn import report_write as report

    evidence = report_evidence.gather(measured, model, ladder, plan.test, folds, beside)
    report.write(plan.folder, evidence, options, plan.loaded)
    return plan.folder / report.PAGE
