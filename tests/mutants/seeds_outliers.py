"""Seeded bugs of points that their neighbours contradict."""

from __future__ import annotations

from seed import Seed

SCORING = "tests/unit/friction/test_honest_scoring.py"

SEEDS = (
    Seed(
        "a bad point makes its neighbours bad",
        "rtctl/friction/outliers.py",
        "return _contradicted(speed, friction, ~bad) if bad.any() else (expected, bad)",
        "return expected, bad",
        (f"{SCORING}::test_a_bad_point_makes_none_of_its_neighbours_bad",),
    ),
    Seed(
        "two bad points of fifty are how the joint is",
        "rtctl/friction/outliers.py",
        "math.ceil(MOST_SHARE * len(rows))",
        "int(0.03 * len(rows))",
        (f"{SCORING}::test_two_bad_points_of_50_are_mistakes",),
    ),
)
