"""From points under load to points of a gear without load, and the coefficients that a model carries for the
law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.learn.beside_speed import LoadVerdict, rows_of
from rtctl.friction.load import COEFFICIENTS, Load
from rtctl.friction.points import FrictionPoints

LIGHT = 0.5
"""Most of a light point's friction that is its load's: the curve without load is learned from light points,
and held against them."""


def load_of(points: FrictionPoints, verdict: LoadVerdict) -> Load:
    """The coefficients of the form that was chosen by what was held out; the law knows one of both
    directions, that of the one that rubs less.

    Raises
    ------
    DataError
        Nothing can be said of load, or friction does not depend on it."""
    if verdict.chosen is None:
        raise DataError(f"{points.source}: {verdict.reason}; leave --by-load out")
    terms = verdict.chosen.terms
    if not terms.told:
        raise DataError(
            f"{points.source}: over {verdict.span_nm:.3g} N m friction does not depend on load; leave "
            "--by-load out"
        )
    rows, _ = rows_of(points)
    most_nm = float(max(np.abs(rows.outside_nm).max(), np.abs(rows.motor_nm).max()))
    miss = np.abs(terms(rows) - rows.friction_nm)
    peaked = terms.value("stribeck_rad_s") > 0
    # the law knows one load for both directions: help by the stronger one would be too much in the other
    weaker = min(1.0, terms.value("backward"))
    load = Load(
        **{name: weaker * terms.value(name) for name in COEFFICIENTS},
        # without a peak nothing falls, and any speed will do but 0, which is divided by
        stribeck_rad_s=terms.value("stribeck_rad_s") if peaked else 1.0,
        stribeck_power=terms.value("stribeck_power") if peaked else 1.0,
        most_nm=most_nm,
        doubt_share=0.0,
        second_share=terms.value("second_share"),
        second_rad_s=terms.value("second_rad_s"),
    )
    added = load.added_nm(rows.speed, rows.outside_nm, rows.motor_nm)
    heavy = added > LIGHT * rows.friction_nm
    known_nm = float(miss[~heavy].max(initial=0.0))
    # what light points err by is the curve's own, and is in its band already
    beyond = np.maximum(miss[heavy] - known_nm, 0.0) / added[heavy]
    return replace(load, doubt_share=float(beyond.max(initial=0.0)))


def without_load(points: FrictionPoints, load: Load) -> FrictionPoints:
    """The light points, less what the load adds to them.

    Raises
    ------
    DataError
        Points of an unknown load."""
    if "load_nm" not in points.columns or not np.isfinite(points.columns["load_nm"]).all():
        raise DataError(
            f"{points.source}: the load of some points is unknown; leave them out, or leave --by-load out"
        )
    rows, kept = rows_of(points)
    added = load.added_nm(rows.speed, rows.outside_nm, rows.motor_nm)
    # heavy points are left out and not put right: an error of the load's form would be most of what is left
    # of them
    light = added <= LIGHT * rows.friction_nm
    chosen, off = kept[light], np.zeros(len(points.friction_nm))
    off[chosen] = added[light]
    # back in the order of the file: `rows_of` had them by speed
    chosen.sort()
    columns = {name: column[chosen] for name, column in points.columns.items()}
    return replace(
        points,
        velocity_rad_s=points.velocity_rad_s[chosen],
        friction_nm=(points.friction_nm - off)[chosen],
        direction=points.direction[chosen],
        std_nm=points.std_nm[chosen],
        count=points.count[chosen],
        columns=columns,
        left_out=None,
    )
