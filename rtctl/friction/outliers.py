"""Points that cannot be friction of the same joint as their neighbours in speed: named, and left out.

One bad point of a hundred (a bump, a cell mistyped, a unit) would otherwise decide which model is chosen."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from rtctl.friction.points import POINTS_MIN, FrictionPoints

NEIGHBOURS = 4
"""Neighbours in speed on each side that a point is compared with."""

SCALES = 8.0
"""Robust standard deviations of all points about their neighbours, beyond which one is bad ..."""

SHARE = 0.25
"""... if it is off by more than this share of the friction there, too: half a Stribeck peak may lie between
two points."""

END_SHARE, BREAK_AWAY_SHARE = 1.0, 1.8
"""As `SHARE`, of the two lowest and the two highest speeds, which have neighbours on one side only, and of
break-away, which may well stand out."""

# at .03 two bad points of 50 were used both, and erred 8 times the clean fit (decision 0119)
MOST_SHARE = 0.05
"""When more than this share of a direction (one point at least) looks bad, it is no mistake but how the joint
is: nothing is left out."""


def without_outliers(points: FrictionPoints) -> tuple[FrictionPoints, tuple[str, ...]]:
    """Leave bad points out (`FrictionPoints.left_out`), and name them in words; the same points where there
    are none."""
    bad: list[int] = []
    notes: list[str] = []
    for direction in (1, -1):
        rows = points.rows_of(direction)
        speed, friction = np.abs(points.velocity_rad_s[rows]), points.friction_nm[rows]
        # eight points have eight neighbours at most: each would judge all others
        if len(rows) <= POINTS_MIN:
            continue
        expected, off = _off(speed, friction)
        found = np.flatnonzero(off)
        # rounded up: two of 50 are mistakes still (decision 0119)
        if len(found) > math.ceil(MOST_SHARE * len(rows)):
            notes.append(
                f"{points.source}: direction {direction:+d}: {len(found)} of {len(rows)} points are far "
                "from their neighbours in speed: too many for mistakes, so all are used; look at the plot "
                "(--plot)"
            )
            continue
        bad += [int(rows[at]) for at in found]
        notes += [
            f"{points.source}: {direction * speed[at]:.4g} rad/s, {direction * friction[at]:.4g} N m is "
            f"left out: its neighbours in speed say {direction * expected[at]:.4g} N m; measure it again "
            "(--keep-outliers uses it)"
            for at in found
        ]
    if not bad:
        return points, tuple(notes)
    left_out = np.zeros(len(points.direction), dtype=bool)
    left_out[bad] = True
    return replace(points, left_out=left_out), tuple(notes)


def _off(speed: np.ndarray, friction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Friction that the neighbours of each point say, N m, and which points are bad. By rising speed, shape
    (n,).

    Twice, for a bad point makes good ones look bad: the second time it is no neighbour any more."""
    expected, bad = _contradicted(speed, friction, np.ones(len(speed), dtype=bool))
    return _contradicted(speed, friction, ~bad) if bad.any() else (expected, bad)


def _contradicted(
    speed: np.ndarray, friction: np.ndarray, heard: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """`_off` by those neighbours that are `heard`, shape (n,).

    Notes
    -----
    The neighbours' median slope and level over their rank (Theil-Sen): measured speeds are spaced so that
    friction is about as smooth over their rank as it can be."""
    n = len(speed)
    expected = np.empty(n)
    for at in range(n):
        others = np.flatnonzero(heard & (np.arange(n) != at))
        middle = int(np.searchsorted(others, at))
        # at an end: more of the other side
        first = min(max(0, middle - NEIGHBOURS), max(0, len(others) - 2 * NEIGHBOURS))
        near = others[first : first + 2 * NEIGHBOURS]
        # by rank: near[j] - near[i] is never 0, as a difference of two equal speeds would be
        i, j = np.triu_indices(len(near), 1)
        slope = np.median((friction[near][j] - friction[near][i]) / (near[j] - near[i]))
        expected[at] = np.median(friction[near] + slope * (at - near))
    residual = friction - expected
    # 1.4826: a normal distribution's; the floor: points that a computer made have no scatter to speak of
    scale = max(1.4826 * float(np.median(np.abs(residual))), 1e-3 * float(np.median(friction)))
    share = np.full(n, SHARE)
    share[[0, 1, -2, -1]] = END_SHARE
    share[speed == 0] = BREAK_AWAY_SHARE  # after the ends: it is one of them
    bad: np.ndarray = (np.abs(residual) > SCALES * scale) & (np.abs(residual) > share * np.abs(expected))
    return expected, bad
