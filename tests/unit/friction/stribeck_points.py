"""Points of a Stribeck curve, and the ladder climbed with them."""

from functools import cache

import numpy as np

from rtctl.friction.learn import ladder
from rtctl.friction.points import FrictionPoints

V = np.concatenate([[0.0], np.geomspace(0.01, 2, 24)])


def stribeck(v):
    return 0.25 + 0.1 * np.exp(-((v / 0.15) ** 2)) + 0.05 * v


def points(forward=stribeck, backward=lambda v: 1.1 * stribeck(v), noise=0.002, seed=5, v=V):
    rng = np.random.default_rng(seed)
    rows = [
        (sign * x, curve(x) + rng.normal(0, noise), sign, np.nan, np.nan)
        for sign, curve in ((1, forward), (-1, backward))
        for x in v
    ]
    return FrictionPoints.from_rows(rows, "points.csv", "0" * 64)


def options(**more):
    return ladder.Options(**{"backend": "sequential", "n_jobs": 1, **more})


@cache
def ascended(*families):
    """What is found with the points above, direction by direction: asked once for all tests that only look at
    it.
    """
    return ladder.ascend(points(), options(families=families, symmetric="no"))
