"""`rtctl fit --places --sweep`: what friction and the joint itself do over a turn."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hw.motion import words
from rtctl.cli.fit_checks import require_motion
from rtctl.cli.number import Number
from rtctl.cli.outputs import errors_in_units_of

if TYPE_CHECKING:
    from rtctl.friction.kind_harmonics import Harmonics
    from rtctl.friction.learn.cogging import Sweep
    from rtctl.friction.model import FrictionModel
    from rtctl.friction.points import FrictionPoints
    from rtctl.rig_file.config import LoadedConfig

_File = click.Path(dir_okay=False, path_type=Path)
_PERIOD = Number(min=1e-3, max=1e4)


def options(command: Callable[..., None]) -> Callable[..., None]:
    """`--places`, `--sweep`, `--turn` and `--ripple-turn`."""
    # the last first: what is applied last is listed first
    for flag, kind, text in (
        ("--ripple-turn", _PERIOD, "period of the conservative part, rad; default: that of --turn"),
        (
            "--turn",
            _PERIOD,
            "period of friction over place, rad of the joint; default: a turn of it, 2 pi, or the lead of "
            "a linear axis",
        ),
        (
            "--sweep",
            _File,
            "slow two-way sweep (points_sweep.csv): learn the conservative part, cogging or ripple",
        ),
        ("--places", _File, "measurements place by place (points_places.csv): learn friction over the turn"),
    ):
        command = click.option(flag, type=kind, help=text)(command)
    return command


def turn_of(motion: str, lead_m: float | None, loaded: LoadedConfig | None) -> float:
    """Period of friction over place where none is given: a turn of the joint, or of a linear axis its lead; 0
    where that is not known."""
    if motion != "linear":
        return 2 * math.pi
    return lead_m or (loaded.config.axis[0].lead_m if loaded else 0.0)


def read_sweep(path: Path, motion: str) -> Sweep:
    """Rows of a sweep of an axis of that motion, as motor torque along +x. Raises DataError."""
    from rtctl.errors import DataError
    from rtctl.friction.learn.cogging import Sweep
    from rtctl.friction.point_reader import read_points

    # a sweep has a single speed, too few for a curve of speed
    points = read_points(path, of_speeds=False)
    require_motion(points.motion, motion, path)
    position = points.columns.get("position_rad")
    if position is None:
        raise DataError(
            f"{points.source}: no column position_rad; give points_sweep.csv of rtctl identify --sweep"
        )
    return Sweep(position, points.direction * points.friction_nm, points.direction)


@dataclass(frozen=True)
class OverTurn:
    """Measurements place by place and a slow sweep, None where they were not given, and the period of
    friction, rad."""

    places: FrictionPoints | None
    sweep: Sweep | None
    period_rad: float


def read(places: Path | None, sweep: Path | None, motion: str, period: float) -> OverTurn:
    """Read both before the search: a mistake in them would cost all that was learned.

    Raises
    ------
    ConfigError
        No period, of a linear axis.
    DataError
        Files of an axis of the other motion, or without places; a sweep of one direction only."""
    from rtctl.errors import ConfigError, DataError
    from rtctl.friction.point_reader import read_points

    if not period and (places or sweep):
        raise ConfigError(
            "--places and --sweep of a linear axis need the period of its friction: give --turn in m, or "
            "--config RIG with its lead"
        )
    rows = read_points(places) if places else None
    if rows is not None:
        require_motion(rows.motion, motion, rows.source)
    swept = read_sweep(sweep, motion) if sweep else None
    # friction has the sign of the motion, the conservative part has not: one direction tells their sum
    if swept is not None and len(set(swept.direction.tolist())) < 2:
        raise DataError(f"{sweep}: one direction only: friction cannot be told from the conservative part")
    return OverTurn(rows, swept, period)


def learn(
    model: FrictionModel, measured: OverTurn, ripple_turn: float | None
) -> tuple[FrictionModel, list[str], dict[str, Any]]:
    """The model with what was measured over a turn; what to tell, and the same for `--json`.

    Raises
    ------
    DataError
        Rows too few, or without places."""
    from rtctl.friction.learn.cogging import fit_cogging
    from rtctl.friction.learn.places import fit_places
    from rtctl.friction.learn.report_tables import mnm_cell

    text, body, part = list[str](), dict[str, Any](), None
    period = measured.period_rad
    if measured.sweep is not None:
        found = fit_cogging(measured.sweep, ripple_turn or period, friction_period_rad=period)
        # no wave bettered held-out places: nothing is carried, rather than zeros
        part = found.part if len(found.part.orders) else None
        text.append(_of_part(part, found.rmse_nm))
        body["conservative"] = {
            "orders": found.part.orders.astype(int).tolist(),
            "friction_nm": found.friction_nm,
            "held_out_rmse_nm": found.tried,
        }
        # before the places: what comes and goes with the angle is taken off their torque
        model = replace(model, conservative=part)
    if measured.places is not None:
        fitted = fit_places(model, measured.places, period, part)
        model = fitted.model
        text += ["", "waves a turn    held-out places, mN m"]
        text += [
            f"{one.kernel.orders:<16d}{mnm_cell(one.rmse_nm)} +- {mnm_cell(one.se_nm)}"
            for one in fitted.rungs
        ]
        text.append(fitted.sentence)
        body["places"] = {
            "orders": fitted.chosen.kernel.orders,
            "rungs": [[one.kernel.orders, one.rmse_nm, one.se_nm] for one in fitted.rungs],
        }
    return model, text, body


def _of_part(part: Harmonics | None, rmse_nm: float) -> str:
    if part is None:
        return "No conservative part: no wave betters held-out places."
    orders = ", ".join(f"{order:g}" for order in part.orders)
    return (
        f"Conservative part: up to {1e3 * part.most_nm:.3g} mN m, waves {orders} of {part.period_rad:.4g} "
        f"rad, steepest {part.steepest_nm_rad:.3g} N m/rad; the sweep's rest is {1e3 * rmse_nm:.3g} mN m."
    )


def tell_shift(path: Path, sweep: Path, *, err: bool) -> None:
    """Say by how much the places of a model have moved in a new sweep, and whether they fit there at all.

    Raises
    ------
    DataError
        A model without a conservative part, which alone can be found again, or a sweep that is too short."""
    from rtctl.errors import DataError
    from rtctl.friction import artefact
    from rtctl.friction.learn.cogging import FIT_SHARE, OFF_MOST, changed_since, find_shift

    model = artefact.load(path)
    if model.conservative is None:
        raise DataError(f"{path}: no conservative part: its places cannot be found again by a sweep")
    with errors_in_units_of(model.motion):
        rows = read_sweep(sweep, model.motion)
    period = model.place.period_rad if model.place else None
    found = find_shift(model.conservative, rows, period)
    what = (
        f"explains {100 * found.explained:.1f} % of the sweep there and leaves {1e3 * found.rmse_nm:.3g} mN m"
    )
    if found.explained >= FIT_SHARE and not found.fits:
        what += (
            f"; waves of any other joint do so by some shift in {100 * found.chance:.0f} of 100 draws, and "
            f"{100 * found.off:.2g} % of their power is wrong there, {100 * OFF_MOST:.0f} % at most is wanted"
        )
    said = (
        f"places: moved by {found.shift_rad:.6g} rad (or whole periods of "
        f"{model.conservative.period_rad:.4g} rad more): {what}; friction.place_shift_rad = "
        # digits and not decimals: 1e-5 of a turn is nothing, of a ripple of 5 mm it is .2 %
        f"{found.shift_rad:.6g}"
        if found.fits
        else f"places: the model does not fit this sweep wherever its index is ({what}): compensate nothing "
        "by it, or learn it anew"
    )
    click.echo(words(said, model.motion), err=err)
    if found.fits:
        more = changed_since(model.conservative, rows, found, period)
        if len(more.part.orders):
            waves = ", ".join(f"{order:g}" for order in more.part.orders)
            changed = (
                f"since then waves {waves} have changed, which no shift explains: {1e3 * more.tried[0]:.3g} "
                f"mN m at held-out places, {1e3 * more.tried[len(more.part.orders)]:.3g} with them told "
                "anew; learn the part from this sweep (rtctl fit --sweep)"
            )
            click.echo(words(changed, model.motion), err=err)
