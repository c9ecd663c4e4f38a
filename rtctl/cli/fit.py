"""`rtctl fit`: learn a friction model from measured points."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from rtctl.friction.model import FrictionModel

_File = click.Path(dir_okay=False, path_type=Path)


_POSITIVE = click.FloatRange(min=0, min_open=True, max=1e9)


def _number(_: click.Context, option: click.Parameter, value: float | None) -> float | None:
    """Refuse NaN, which click's own ranges let through."""
    if value is not None and math.isnan(value):
        raise click.BadParameter("NaN is not a number above 0", param=option)
    return value


@click.command("fit")
@click.argument("points", type=_File)
@click.option("--out", type=_File, required=True, help="model file to write (JSON)")
@click.option("--rig", default="mock", show_default=True, help="name of the rig the points were measured on")
@click.option(
    "--C",
    "c",
    type=_POSITIVE,
    callback=_number,
    help="bound on the dual coefficients; default: by cross-validation",
)
@click.option(
    "--epsilon",
    "epsilon_nm",
    type=_POSITIVE,
    callback=_number,
    help="width of the epsilon tube, N m; default 0.005",
)
@click.option(
    "--fade",
    "fade_rad_s",
    type=_POSITIVE,
    callback=_number,
    help="fade beyond the trained range, rad/s; default a tenth of it",
)
@click.option("--plot", type=_File, help="draw points and learned curve (PNG)")
@click.option("--json", "as_json", is_flag=True, help="one JSON object with every figure, for scripts")
def command(
    points: Path,
    *,
    out: Path,
    rig: str,
    c: float | None,
    epsilon_nm: float | None,
    fade_rad_s: float | None,
    plot: Path | None,
    as_json: bool,
) -> None:
    """Learn the friction of a rig: one spline-kernel epsilon-SVR per direction, compiled exactly.

    POINTS is a CSV file with the columns velocity_rad_s and friction_torque_nm (both signed), and for
    break-away points at zero velocity optionally direction (+1 or -1). At least 8 points per direction.
    """
    from rtctl.friction import artefact, fit
    from rtctl.friction.points import read_points

    measured = read_points(points)
    model = fit.fit_points(
        measured, rig=rig, c=c, epsilon_nm=epsilon_nm or fit.EPSILON_NM, fade_rad_s=fade_rad_s
    )
    artefact.save(model, out)
    if plot is not None:
        from rtctl.friction import figure

        figure.draw(model, measured, plot)
    rows = _rows(model)
    if as_json:
        body = {"model": str(out), "rig": model.rig, "data_sha256": model.data_sha256, "directions": rows}
        click.echo(json.dumps(body, indent=2, allow_nan=False))
        return
    click.echo(f"{'':34}{'v >= 0':>14}{'v < 0':>14}")
    for label, key, scale, shape in _TABLE:
        click.echo(f"{label:<34}" + "".join(f"{format(row[key] * scale, shape):>14}" for row in rows))
    click.echo(f"\nmodel: {out}" + (f"\nplot:  {plot}" if plot else ""))


_TABLE: tuple[tuple[str, str, float, str], ...] = (
    ("points", "points", 1, "d"),
    ("support vectors", "support_vectors", 1, "d"),
    ("C", "C", 1, "g"),
    ("epsilon, mN m", "epsilon_nm", 1e3, "g"),
    ("mean training error, mN m", "train_mean_error_nm", 1e3, ".3f"),
    ("max training error, mN m", "train_max_error_nm", 1e3, ".3f"),
    ("RMS held-out error, mN m", "validation_rmse_nm", 1e3, ".3f"),
    ("max held-out error, mN m", "validation_max_error_nm", 1e3, ".3f"),
    ("compile error, N m", "compile_error_nm", 1, ".1e"),
    ("trained range, rad/s", "speed_max_rad_s", 1, ".4g"),
    ("least dry friction, N m", "friction_min_nm", 1, ".4g"),
    ("viscous slope, N m s/rad", "viscous_nms_rad", 1, ".4g"),
)


def _rows(model: FrictionModel) -> list[dict[str, Any]]:
    """Figures of both directions; keys as in the model file, units in their names."""
    from rtctl.friction.fit import compile_error_nm

    return [
        {
            "direction": direction,
            "points": branch.n_points,
            "support_vectors": len(branch.support_vectors),
            **branch.hyper_parameters,
            "train_mean_error_nm": branch.train_mean_error_nm,
            "train_rmse_nm": branch.train_rmse_nm,
            "train_max_error_nm": branch.train_max_error_nm,
            "validation_rmse_nm": branch.validation_rmse_nm,
            "validation_max_error_nm": branch.validation_max_error_nm,
            "compile_error_nm": compile_error_nm(branch),
            "speed_max_rad_s": branch.speed_max_rad_s,
            "friction_min_nm": branch.friction_min_nm,
            "friction_max_nm": branch.friction_max_nm,
            "viscous_nms_rad": branch.viscous_nms_rad,
        }
        for direction, branch in zip((1, -1), model.branches, strict=True)
    ]
