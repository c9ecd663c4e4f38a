"""Friction over position in the law: what place adds to the curve of speed, and the conservative part.

    F(v, x) = F_0(v) + sum_{h=1..H} (C_h(v) cos h a + S_h(v) sin h a)    (docs/theory.md 8.6)
    tau_c(x)     (a = 2 pi x / period) cogging or ripple, a cubic over each cell of its period

All tables of speed have the knots of the curve, and the cubics of one segment stand side by side; cos h a and
sin h a come from a recurrence."""

from __future__ import annotations

import math

import numpy as np

from rtctl.control.friction_curve import BACKWARD, FORWARD, of_segment, segment
from rtctl.control.jit import compiled, inlined
from rtctl.control.records import CONSERVATIVE_CELLS, MAX_SEGMENTS, PLACE_ORDERS, PLACE_SEGMENTS, Record


@compiled
def turn_waves(turns: float) -> tuple[float, float]:
    """Cos and sin of an angle given in turns, finite; off by at most 1e-14 within a turn.

    Notes
    -----
    Without a branch, for a third of the time of both library functions: series at a quarter of the angle, |r|
    <= pi/4, and cos 2 r = 1 - 2 sin^2 r, sin 2 r = 2 sin r cos r twice."""
    # within half a turn first: the series below are exact there alone
    r = (turns - np.floor(turns + 0.5)) * (0.5 * math.pi)  # a quarter of the angle, within +-pi/4
    z = r * r
    s = 1.0 / 362880.0 + z * (-1.0 / 39916800.0 + z * (1.0 / 6227020800.0 - z / 1307674368000.0))
    s = r + r * z * (-1.0 / 6.0 + z * (1.0 / 120.0 + z * (-1.0 / 5040.0 + z * s)))
    c = 1.0 / 40320.0 + z * (-1.0 / 3628800.0 + z * (1.0 / 479001600.0 - z / 87178291200.0))
    c = 1.0 - z * (0.5 + z * (-1.0 / 24.0 + z * (1.0 / 720.0 - z * c)))
    s, c = 2.0 * s * c, 1.0 - 2.0 * s * s
    return 1.0 - 2.0 * s * s, 2.0 * s * c


@inlined
def _of_branch(model: Record, branch: int, speed: float, position: float) -> tuple[float, float]:
    """`curve_and_place` of a branch that is a constant where this is inlined."""
    if min(model.n_segments[branch], MAX_SEGMENTS) < 1:
        return 0.0, 0.0
    # written so that NaN is refused, too: it would be looked for in a table
    if not speed >= 0.0:
        return math.nan, math.nan
    j, h = segment(model, branch, speed)
    # the curve of speed alone: what counts where nothing is known of the place
    curve = of_segment(model, branch, j, h)
    orders = min(model.place_orders[branch], PLACE_ORDERS)
    if orders < 1:
        return curve, 0.0
    if not math.isfinite(position):
        return curve, math.nan
    j = min(j, PLACE_SEGMENTS - 1)  # the table of places is shorter than the curve's
    cos, sin = turn_waves(model.place_turns_per_rad * position)
    # the cubics of one segment, evaluated at the same h for all orders
    c, s, h2 = cos, sin, h * h
    h3 = h * h2
    table, total = model.place_coefficient[branch, j], 0.0
    for i in range(orders):
        a, b = table[2 * i], table[2 * i + 1]
        total += c * (a[0] + h * a[1] + h2 * a[2] + h3 * a[3])
        total += s * (b[0] + h * b[1] + h2 * b[2] + h3 * b[3])
        # of the next order: no library call for each
        c, s = c * cos - s * sin, s * cos + c * sin
    return curve, total


@compiled
def curve_and_place(model: Record, branch: int, speed: float, position: float) -> tuple[float, float]:
    """Friction of one direction by speed, and what place adds to it, both N m: the segment of the speed is
    looked for once.

    Parameters
    ----------
    speed, position : float
        |v| (rad/s, >= 0, held at the last knot beyond it) and the joint's angle (rad, any turn).

    Returns
    -------
    tuple of float
        0 without a model, and 0 by place for a model without place; NaN for a NaN or negative speed, and by
        place for a position that is not finite.

    Notes
    -----
    A jump that the processor foresees: as an index the branch would have all of this wait for the direction,
    whose bristle of LuGre waits for an exponential."""
    if branch == FORWARD:
        return _of_branch(model, FORWARD, speed, position)
    return _of_branch(model, BACKWARD, speed, position)


@compiled
def conservative_torque(model: Record, position: float) -> float:
    """Torque that the joint's place alone exerts on it, N m, positive along +x; 0 without one, NaN for a
    NaN."""
    per_rad = model.conservative_per_rad
    if not per_rad > 0.0:
        return 0.0
    if not math.isfinite(position):
        return math.nan
    turns = per_rad * position
    at = (turns - math.floor(turns)) * CONSERVATIVE_CELLS  # floor, not int: angles below 0
    j = min(int(at), CONSERVATIVE_CELLS - 1)
    # within the cell, 0 to 1: cubics are of that, and not of the angle
    h = at - j
    c = model.conservative[j]
    return c[0] + h * (c[1] + h * (c[2] + h * c[3]))
