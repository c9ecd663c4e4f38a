"""What is known beside the points a model was learned from: presliding length, the weakest place, single
measurements, test points.

The columns are in `rtctl.friction.point_columns`; `rtctl identify` writes them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from statistics import NormalDist

import numpy as np

from rtctl.friction.drift_deployed import SPEED_MIN_SHARE
from rtctl.friction.model import Branch, FrictionModel
from rtctl.friction.points import FrictionPoints
from rtctl.friction.presliding import Presliding, together


def with_evidence(
    model: FrictionModel,
    points: FrictionPoints,
    presliding_rad: float | None = None,
    test: FrictionPoints | None = None,
) -> FrictionModel:
    """Return the model with what its points, and test points, know beside them; a length given by hand (rad)
    goes first."""
    # a person who gives a length knows something that the points do not
    # no spread is known of it, and no ramps are counted
    found = Presliding(presliding_rad, None, 0) if presliding_rad is not None else presliding_of(points)
    spreads = place_spread_nm(model, points)
    forward, backward = (
        replace(
            branch,
            place_spread_nm=_largest((spread, branch.place_spread_nm)),
            test_max_error_nm=None if test is None else test_max_error_nm(branch, test, direction),
            # both sets of points: what single measurements scatter by is the joint's, wherever it was seen
            single_max_error_nm=_largest(
                single_max_error_nm(branch, one, direction) for one in (points, test) if one
            ),
            sliding_doubt_nm=sliding_doubt_nm(branch, points, direction),
        )
        for branch, spread, direction in zip(model.branches, spreads, (1, -1), strict=True)
    )
    doubt_nm = max((zero_doubt_nm(one) for one in (points, test) if one), default=0.0)
    # both directions get all of it: which of them has less friction is what a zero in doubt does not tell
    branches = (_with_zero_in_doubt(forward, doubt_nm), _with_zero_in_doubt(backward, doubt_nm))
    return replace(with_presliding(model, found), branches=branches)


def zero_doubt_nm(points: FrictionPoints) -> float:
    """By how much the zero of the torque of these points may be off, N m: by the largest of the offsets that
    were taken out of their logs."""
    doubt = points.columns.get("zero_doubt_nm")
    return 0.0 if doubt is None else float(np.nanmax(doubt, initial=0.0))


def _with_zero_in_doubt(branch: Branch, doubt_nm: float) -> Branch:
    """The branch of measurements that may all be off by so much besides: friction in this direction may be
    less by it."""
    if not doubt_nm:
        return branch
    return replace(branch, single_max_error_nm=branch.error_max_nm + doubt_nm)


def _largest(values: Iterable[float | None]) -> float | None:
    return max((value for value in values if value is not None), default=None)


def test_max_error_nm(branch: Branch, test: FrictionPoints, direction: int) -> float | None:
    """Largest error on the test points within the trained range, N m; None where there is none."""
    speed, friction = test.branch(direction)
    inside = speed <= branch.speed_max_rad_s
    if not inside.any():
        return None
    return float(np.abs(branch.magnitude(speed[inside]) - friction[inside]).max())


def single_max_error_nm(branch: Branch, points: FrictionPoints, direction: int) -> float | None:
    """Largest error that the single measurements behind averaged points are expected to have, N m.

    None where points are single measurements, do not tell their spread, or tell friction at the weakest
    place: that is known then, and the rest of the spread is noise of the sensors.

    Notes
    -----
    A point of n measurements that is off by e with a spread s: e plus s times the largest of n normal
    numbers, and of all points the largest. So the bound is about the same whether samples are averaged or
    not, and over how many."""
    if "weakest_place_nm" in points.columns:
        return None
    rows = points.rows_of(direction)
    speed, friction = np.abs(points.velocity_rad_s[rows]), points.friction_nm[rows]
    std, count = points.std_nm[rows], points.count[rows]
    # one measurement is its own mean, and knows no spread
    told = (speed <= branch.speed_max_rad_s) & np.isfinite(std) & (count > 1)
    if not told.any():
        return None
    # n/(n + 1): the share of all numbers below which the largest of n lies on average
    largest = np.array([NormalDist().inv_cdf(n / (n + 1)) for n in count[told]])
    error = np.abs(branch.magnitude(speed[told]) - friction[told])
    return float((error + largest * std[told]).max())


def sliding_doubt_nm(branch: Branch, points: FrictionPoints, direction: int) -> float | None:
    """Most that the points, and their weakest places, are off the curve at speeds that surely slide, N m;
    None without weakest places.

    A joint that hardly moves may stick or creep, and soft bristles never slide there: what is off at the
    slowest points says nothing of the motion that the drift watch counts."""
    weakest = points.columns.get("weakest_place_nm")
    if weakest is None:
        return None
    rows = points.rows_of(direction)
    speed = np.abs(points.velocity_rad_s[rows])
    slides = (speed >= SPEED_MIN_SHARE * branch.speed_max_rad_s) & (speed <= branch.speed_max_rad_s)
    curve = branch.magnitude(speed[slides])
    # either way: a place with more friction is as far off to the watch as one with less
    at_places = np.abs(curve - direction * weakest[rows][slides])
    if not np.isfinite(at_places).any():
        return None
    return float(max(np.nanmax(at_places), np.abs(curve - points.friction_nm[rows][slides]).max()))


def with_presliding(model: FrictionModel, found: Presliding | None) -> FrictionModel:
    """Return the model with this presliding length, or without one."""
    return replace(
        model,
        presliding_rad=found.length_rad if found else None,
        presliding_spread_rad=found.spread_rad if found else None,
        presliding_ramps=found.ramps if found and found.spread_rad is not None else 0,
    )


def presliding_of(points: FrictionPoints) -> Presliding | None:
    """Presliding length over all break-away points of a file; None without the columns, or with empty
    ones."""
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
    """Largest shortfall of the friction at any place below the curve, per branch, N m; None without the
    column."""
    weakest = points.columns.get("weakest_place_nm")
    if weakest is None:
        return None, None
    shortfall = model.magnitude(_signed_speed(points)) - points.direction * weakest
    forward, backward = (
        float(np.nanmax(here, initial=0.0)) if np.isfinite(here).any() else None
        # without points that are left out: a mistyped cell is no weak place
        for here in (shortfall[points.rows_of(sign)] for sign in (1, -1))
    )
    return forward, backward


def _signed_speed(points: FrictionPoints) -> np.ndarray:
    """Velocity of each point; at a break-away the least one of its direction, which is on its branch."""
    # the smallest number there is: -0.0 would count as forward
    least = np.nextafter(0.0, 1.0) * points.direction
    return np.where(points.velocity_rad_s == 0, least, points.velocity_rad_s)
