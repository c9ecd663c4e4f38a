"""What a file of friction points knows beside the points: presliding length, and friction at the weakest place.

The columns are in `rtctl.friction.points.columns`; `rtctl identify` writes them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtctl.friction.model import FrictionModel
from rtctl.friction.points.measured import FrictionPoints
from rtctl.friction.points.presliding import Presliding, together


def with_evidence(
    model: FrictionModel, points: FrictionPoints, presliding_rad: float | None = None
) -> FrictionModel:
    """Return the model with what its points know beside them; a length given by hand (rad) goes first."""
    found = Presliding(presliding_rad, None, 0) if presliding_rad is not None else presliding_of(points)
    spreads = place_spread_nm(model, points)
    forward, backward = (
        replace(branch, place_spread_nm=_larger(spread, branch.place_spread_nm))
        for branch, spread in zip(model.branches, spreads, strict=True)
    )
    return replace(with_presliding(model, found), branches=(forward, backward))


def _larger(first: float | None, second: float | None) -> float | None:
    """The larger of two spreads; one that nobody knows does not count."""
    known = [one for one in (first, second) if one is not None]
    return max(known) if known else None


def with_presliding(model: FrictionModel, found: Presliding | None) -> FrictionModel:
    """Return the model with this presliding length, or without one."""
    return replace(
        model,
        presliding_rad=found.length_rad if found else None,
        presliding_spread_rad=found.spread_rad if found else None,
        presliding_ramps=found.ramps if found and found.spread_rad is not None else 0,
    )


def presliding_of(points: FrictionPoints) -> Presliding | None:
    """Presliding length over all break-away points of a file; None without the columns, or with empty ones."""
    lengths, spreads, ramps = (
        points.columns.get(name) for name in ("presliding_rad", "presliding_spread_rad", "presliding_ramps")
    )
    if lengths is None or spreads is None or ramps is None:
        return None
    known = np.isfinite(lengths) & np.isfinite(spreads) & np.isfinite(ramps)
    return together(
        [
            Presliding(float(lengths[row]), float(spreads[row]), int(ramps[row]))
            for row in np.flatnonzero(known)
        ]
    )


def place_spread_nm(model: FrictionModel, points: FrictionPoints) -> tuple[float | None, float | None]:
    """Largest shortfall of the friction at any place below the curve, per branch, N m; None without the column."""
    weakest = points.columns.get("weakest_place_nm")
    if weakest is None:
        return None, None
    shortfall = model.magnitude(_signed_speed(points)) - points.direction * weakest
    forward, backward = (
        float(np.nanmax(here, initial=0.0)) if np.isfinite(here).any() else None
        for here in (shortfall[points.direction == sign] for sign in (1, -1))
    )
    return forward, backward


def _signed_speed(points: FrictionPoints) -> np.ndarray:
    """Velocity of each point; at a break-away the least one of its direction, which is on its branch."""
    least = np.nextafter(0.0, 1.0) * points.direction
    return np.where(points.velocity_rad_s == 0, least, points.velocity_rad_s)
