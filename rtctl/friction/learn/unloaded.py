"""From points under load to points of a gear without load, and the coefficients that a model carries for the law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.learn.beside_speed import LoadVerdict, rows_of
from rtctl.friction.learn.load_terms import COEFFICIENTS
from rtctl.friction.load import Load
from rtctl.friction.points.measured import FrictionPoints


def load_of(points: FrictionPoints, verdict: LoadVerdict) -> Load:
    """The coefficients of the form that was chosen by what was held out.

    Raises
    ------
    DataError
        Nothing can be said of load, or friction does not depend on it.
    """
    if verdict.chosen is None:
        raise DataError(f"{points.source}: {verdict.reason}; leave --by-load out")
    terms = verdict.chosen.terms
    if not terms.told:
        raise DataError(
            f"{points.source}: over {verdict.span_nm:.3g} N m friction does not depend on load; leave --by-load out"
        )
    rows, _ = rows_of(points)
    most_nm = float(max(np.abs(rows.outside_nm).max(), np.abs(rows.motor_nm).max()))
    peaked = terms.value("stribeck_rad_s") > 0
    return Load(
        **{name: terms.value(name) for name in COEFFICIENTS},
        stribeck_rad_s=terms.value("stribeck_rad_s") if peaked else 1.0,
        stribeck_power=terms.value("stribeck_power") if peaked else 1.0,
        most_nm=most_nm,
    )


def without_load(points: FrictionPoints, load: Load) -> FrictionPoints:
    """The points less what the load adds to them.

    Raises
    ------
    DataError
        Points of an unknown load, or whose friction is less than what load alone would make.
    """
    if "load_nm" not in points.columns or not np.isfinite(points.columns["load_nm"]).all():
        raise DataError(
            f"{points.source}: the load of some points is unknown; leave them out, or leave --by-load out"
        )
    rows, kept = rows_of(points)
    friction_nm = points.friction_nm.copy()
    friction_nm[kept] -= load.added_nm(rows.speed, rows.outside_nm, rows.motor_nm)
    wrong = kept[friction_nm[kept] <= 0]
    if len(wrong):
        raise DataError(
            f"{points.source}: {len(wrong)} of {len(kept)} points have less friction than their load alone makes, the first at "
            f"{points.velocity_rad_s[wrong[0]]:.4g} rad/s; average more measurements, or leave --by-load out"
        )
    return replace(points, friction_nm=friction_nm)
