"""What `rtctl fit` prints of a model: the figures of both directions, side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from hw.motion import speed_scale

if TYPE_CHECKING:
    from rtctl.friction.model import FrictionModel

# the next session lies beyond all of S that were seen with probability 1 / (S + 1): one in six at five
FEW_SESSIONS = 5
"""Fewer have hardly met what sessions differ by."""

_TABLE: tuple[tuple[str, str, float, str], ...] = (
    ("points", "points", 1, "d"),
    ("support vectors", "support_vectors", 1, "d"),
    ("C", "C", 1, ".6g"),
    ("epsilon, mN m", "epsilon_nm", 1e3, ".4g"),
    ("mean training error, mN m", "train_mean_error_nm", 1, "mN m"),
    ("max training error, mN m", "train_max_error_nm", 1, "mN m"),
    ("RMS held-out error, mN m", "validation_rmse_nm", 1, "mN m"),
    ("max held-out error, mN m", "validation_max_error_nm", 1, "mN m"),
    ("95 % band, narrowest, mN m", "band_least_nm", 1, "mN m"),
    ("95 % band, widest, mN m", "band_most_nm", 1, "mN m"),
    ("compile error, N m", "compile_error_nm", 1, ".1e"),
    ("its proved bound, N m", "compile_bound_nm", 1, ".1e"),
    ("trained range, rad/s", "speed_max_rad_s", 1, ".4g"),
    ("least dry friction, N m", "friction_min_nm", 1, ".4g"),
    ("weaker at some place by, mN m", "place_spread_nm", 1, "mN m"),
    ("viscous slope, N m s/rad", "viscous_nms_rad", 1, ".4g"),
    ("secant damping, N m s/rad", "secant_damping_nms_rad", 1, ".4g"),
    ("least slope, N m s/rad", "slope_damping_nms_rad", 1, ".4g"),
)


def rows(model: FrictionModel) -> list[dict[str, Any]]:
    """Figures of both directions; keys as in the model file, units in their names."""
    from rtctl.friction.learn.fit import compile_error_nm

    return [
        {
            "direction": direction,
            "points": branch.n_points,
            "support_vectors": branch.source.n_support_vectors,
            **branch.hyper_parameters,
            "train_mean_error_nm": branch.train_mean_error_nm,
            "train_rmse_nm": branch.train_rmse_nm,
            "train_max_error_nm": branch.train_max_error_nm,
            "validation_rmse_nm": branch.validation_rmse_nm,
            "validation_max_error_nm": branch.validation_max_error_nm,
            "band_least_nm": None if branch.band is None else min(branch.band.half_width_nm),
            "band_most_nm": None if branch.band is None else branch.band.widest_nm,
            "compile_error_nm": compile_error_nm(branch),
            "compile_bound_nm": branch.rounding_bound_nm,
            "friction_lower_nm": branch.friction_lower_nm,
            "secant_damping_nms_rad": branch.secant_damping_nms_rad,
            "slope_damping_nms_rad": branch.slope_damping_nms_rad,
            "speed_max_rad_s": branch.speed_max_rad_s,
            "friction_min_nm": branch.friction_min_nm,
            "friction_max_nm": branch.friction_max_nm,
            "viscous_nms_rad": branch.viscous_nms_rad,
            "place_spread_nm": branch.place_spread_nm,
        }
        for direction, branch in zip((1, -1), model.branches, strict=True)
    ]


def band_text(model: FrictionModel) -> str:
    """What the model's band is from, in a sentence."""
    from rtctl.friction.learn.hold_out import HELD_OUT

    band = model.branches[0].band
    if band is None:
        return "band: none, as nothing could be learned without each part of the points"
    words = {**HELD_OUT, "place": "parts of a turn"}
    said = (
        f"band: 95 % of what was held out ({band.units} {words.get(band.way, band.way)}, {band.errors} "
        "errors) lies within it"
    )
    if band.way == "log" and band.units < FEW_SESSIONS:
        return f"{said}; {band.units} held-out sessions say little of the next one: record more"
    # held out of one session: what sessions differ by is in none of them
    if band.way in ("speed", "time", "place"):
        return f"{said}; one session says nothing of another one: fit several, each a log of its own"
    return said


def show(kind: str, found: Sequence[Mapping[str, Any]], motion: str = "rotary") -> None:
    """Print the table; a figure that is not known is a dash. Of a linear axis a slow range is told in
    mm/s."""
    from rtctl.friction.learn.report_tables import mnm_cell

    # one unit for both directions: the rows of a table are compared
    unit, factor = speed_scale(motion, max(row["speed_max_rad_s"] for row in found))
    click.echo(f"{kind:34}{'v >= 0':>14}{'v < 0':>14}")
    for text, key, times, shape in _TABLE:
        slow = text.endswith(", rad/s")
        label, scale = (text.replace("rad/s", unit), times * factor) if slow else (text, times)
        of_row = (row.get(key) for row in found)
        cells = [
            mnm_cell(value) if shape == "mN m" or value is None else format(value * scale, shape)
            for value in of_row
        ]
        click.echo(f"{label:<34}" + "".join(f"{cell:>14}" for cell in cells))
