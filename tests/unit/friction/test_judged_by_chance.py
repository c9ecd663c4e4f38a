"""A right session is refused by chance in one of twenty at most, however few its points are."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from rtctl.friction.learn.fit import fit_points
from rtctl.friction.learn.formulas import fit_formula
from rtctl.friction.learn.report_judge import BAND_SIGMAS, Judgement, by_chance, faults, judge
from rtctl.friction.points import FrictionPoints

ONE = Judgement(1, 5, 0, 0.01, 0, 0.005, 0.01, 0.0, 0.012, 1.0, 0.005, 0.01, 0.0)


@pytest.mark.parametrize("points", [1, 2, 5, 8, 16, 24, 40, 60, 100, 1000])
def test_both_directions_of_a_right_session_hold_in_19_of_20(points):
    assert 1 - binom.cdf(by_chance(points), points, 0.05) ** 2 <= 0.05
    assert by_chance(points) >= 0.1 * points  # no larger share than before is allowed of many
    if by_chance(points) > 0.1 * points:  # and no more than that takes
        assert 1 - binom.cdf(by_chance(points) - 1, points, 0.05) ** 2 > 0.05


def test_one_point_of_five_outside_is_chance_and_three_are_not():
    assert not faults((replace(ONE, outside_band_share=0.2, over_bound=1),))
    (band,) = faults((replace(ONE, outside_band_share=0.6),))
    assert "60 % of the points lie outside" in band
    (bound,) = faults((replace(ONE, over_bound=3),))
    assert "3 points break the stated bound" in bound


@pytest.mark.parametrize("points", [5, 60])
def test_a_line_is_nearer_to_a_right_session_in_one_of_twenty_at_most(points):
    """Errors as the band tells them; what two numbers win alone refuses more of 5 points."""
    random, speed = np.random.default_rng(162), np.linspace(0.1, 2.0, 40)
    rows = [
        (way * v, 1 + np.exp(-v / 0.15) + 0.01 * random.normal(), way, np.nan, np.nan)
        for way in (1, -1)
        for v in speed
    ]
    model = fit_points(FrictionPoints.from_rows(rows, "x", "0" * 64), rig="x", c=100.0)
    v = np.linspace(0.8, 1.9, points)  # where a line is as good as the curve

    def said(share):
        session = [
            (way * at, share * friction, way, np.nan, np.nan)
            for way, branch in zip((1, -1), model.branches, strict=True)
            for at, friction in zip(
                v,
                branch.magnitude(v) + branch.band.at(v) / BAND_SIGMAS * random.normal(size=points),
                strict=True,
            )
        ]
        return " ".join(faults(judge(model, FrictionPoints.from_rows(session, "y", "0" * 64))))

    assert sum("nearer" in said(1.0) for _ in range(100)) <= 5
    assert all("nearer" in said(1.3) for _ in range(10))


def test_a_joint_that_comes_to_rest_has_points_at_rest():
    """Warnings are errors in tests: 1e-240 rad/s squared, and a table with such a cell, divided by 0."""
    speed = np.r_[1e-240, 1e-200, np.geomspace(1e-3, 10.0, 20)]
    friction = 0.2 + 0.1 * np.exp(-((speed / 0.05) ** 1)) + 0.03 * speed
    points = FrictionPoints.from_signed(
        np.r_[speed, -speed], np.r_[friction, -friction], "x", "0" * 64, {}, lambda row: str(row)
    )
    v, f = points.branch(-1)
    assert (v[:2] == 0).all()
    assert (points.direction == np.sign(np.r_[speed, -speed])).all()
    assert fit_formula("gaussian", v, f).rmse_nm < 0.01
