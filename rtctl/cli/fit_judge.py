"""`rtctl fit --judge MODEL`: an existing model judged by points; nothing is learned or written."""

from __future__ import annotations

import math
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from hw.motion import named, speed_scale
from rtctl.cli.fit_points import tell_doubts
from rtctl.cli.json_text import end_with
from rtctl.cli.outputs import in_units_of

if TYPE_CHECKING:
    from rtctl.friction.points import FrictionPoints

_GOES_WITH = {
    "points",
    "judged",
    "as_json",
    "columns",
    "map_file",
    "average",
    "delimiter",
    "decimal",
    "lead_m",
    "sweep",
}

_ROWS = (
    ("points", "points", 1.0),
    ("beyond the trained range", "outside", 1.0),
    ("slower than trained", "slower", 1.0),
    ("RMSE, mN m", "rmse_nm", 1e3),
    ("share of the friction, %", "error_share", 1e2),
    ("bias, mN m", "bias_nm", 1e3),
    ("largest error, mN m", "worst_nm", 1e3),
    ("at, rad/s", "worst_at_rad_s", 1.0),
    ("stated bound, mN m", "bound_nm", 1e3),
    ("points that break it", "over_bound", 1.0),
    ("outside the 95 % band, %", "outside_band_share", 1e2),
    ("Coulomb + viscous here, mN m", "floor_rmse_nm", 1e3),
)


def require_alone(context: click.Context) -> None:
    """Refuse options that only a fit has (UsageError)."""
    for option in context.command.params:
        # by where it came from: a default says nothing of what was asked
        given = context.get_parameter_source(option.name or "") == ParameterSource.COMMANDLINE
        if given and option.name not in _GOES_WITH:
            raise click.UsageError(f"{option.opts[0]} belongs to a fit, and --judge learns nothing; drop one")


def run(path: Path, points: FrictionPoints, *, as_json: bool) -> None:
    """Print table and verdict; exit code 1 when something speaks against the model."""
    from rtctl.friction import artefact
    from rtctl.friction.learn.report_judge import faults, headed, judge, not_judged
    from rtctl.friction.learn.report_judged_cause import cause, warmer
    from rtctl.friction.points import require_enough

    # any number of them: only the time of learning grows with their square
    require_enough(points, math.inf)
    # a wrong unit shows against the model, and no spline is learned between few speeds
    tell_doubts(points, known=True, alone=False)
    model = artefact.load(path)
    # by its own rig: points name none, and only their motion can be another
    artefact.require_rig(model, model.rig, path, points.motion)
    # such a model is the curve without load
    if model.load is not None and "load_nm" in points.columns:
        from rtctl.friction.learn.unloaded import without_load

        points = without_load(points, model.load)
    found = judge(model, points)
    said = faults(found)
    if said:
        said += filter(None, (cause(model, points), warmer(model, points)))
    rows = [asdict(one) for one in found]
    beyond = not_judged(found)
    judged = {"model": str(path), "holds": not said, "faults": said, "not_judged": beyond, "directions": rows}
    if as_json:
        # no code of an error: the command did what was asked, and the answer is no
        end_with(named(judged, points.motion), 1 if said else 0, indent=2)
    with in_units_of(points.motion):
        click.echo(f"{'direction':32}{'+1':>12}{'-1':>12}")
        speeds = [row["worst_at_rad_s"] for row in rows]
        unit, factor = speed_scale(
            points.motion, max((abs(one) for one in speeds if one is not None), default=1.0)
        )
        for text, key, times in _ROWS:
            slow = text == "at, rad/s"
            label, scale = (f"at, {unit}", times * factor) if slow else (text, times)
            cells = ("-" if row[key] is None else f"{scale * row[key]:.4g}" for row in rows)
            click.echo(f"{label:32}" + "".join(f"{cell:>12}" for cell in cells))
        click.echo(
            "\nthe model holds on these points" + (", as far as it was trained:" if beyond else "")
            if not said
            else f"\nthe model {headed(found)} on these points:"
        )
        for fault in (*said, *beyond):
            click.echo(f"  {fault}")
    if said:
        sys.exit(1)
