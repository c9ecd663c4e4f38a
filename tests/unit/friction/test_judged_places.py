"""A model by place is not judged by what uneven places make of a mean."""

from types import SimpleNamespace

import numpy as np

from rtctl.friction.learn.report_judge import judge
from rtctl.friction.points import FrictionPoints


def test_the_worst_point_is_one_that_counts_against_the_model():
    speeds = np.linspace(0.1, 1.0, 6)
    rows = [(sign * v, 0.3, sign, 0.01, 100) for sign in (1, -1) for v in speeds]
    points = FrictionPoints.from_rows(rows, "made up", "")
    # the first point of each direction is far off, of few measurements that scatter by as much
    points.friction_nm[[0, 6]], points.std_nm[[0, 6]], points.count[[0, 6]] = 0.4, 0.1, 2
    points.friction_nm[[3, 9]] = 0.36
    branch = SimpleNamespace(
        band=None, speed_max_rad_s=1.0, error_max_nm=0.05, magnitude=lambda v: np.full(len(v), 0.3)
    )
    for one in judge(SimpleNamespace(place=1, branches=(branch, branch)), points):
        assert one.over_bound == 1
        assert one.worst_nm is not None
        assert abs(one.worst_nm + 0.06) < 1e-9
        assert one.worst_at_rad_s == speeds[3]
