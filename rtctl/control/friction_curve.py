"""Evaluate a compiled friction model: one piecewise cubic per direction, found through a uniform grid.

The offline compiler (`rtctl.friction`) fills the `MODEL` record; here it is only read."""

from __future__ import annotations

import math

from rtctl.control.jit import compiled, inlined
from rtctl.control.records import LOOKUP_CELLS, MAX_SEGMENTS, Record

FORWARD = 0
"""Branch of the model for v >= 0."""

BACKWARD = 1
"""Branch of the model for v < 0."""


@inlined
def segment(model: Record, branch: int, speed: float) -> tuple[int, float]:
    """Segment of one direction's curve at a speed >= 0, and the way into it, rad/s; the model has one at
    least."""
    n = min(model.n_segments[branch], MAX_SEGMENTS)
    knot = model.knot_rad_s[branch]
    u = min(max(speed, knot[0]), knot[n])  # held beyond the ends: a cubic would run away
    cell = min(max(u * model.lookup_scale[branch], 0.0), LOOKUP_CELLS - 1.0)
    j = min(max(int(model.lookup[branch, int(cell)]), 0), n - 1)
    while u >= knot[j + 1] and j < n - 1:
        j += 1
    while u < knot[j] and j > 0:
        j -= 1
    h = u - knot[j]
    return j, h


@inlined
def of_segment(model: Record, branch: int, j: int, h: float) -> float:
    """Friction magnitude of one direction, N m, at a way into segment j, rad/s."""
    c = model.coefficient[branch, j]
    return c[0] + h * (c[1] + h * (c[2] + h * c[3]))


@inlined
def branch_magnitude(model: Record, branch: int, speed: float) -> float:
    """Friction magnitude of one direction at a speed.

    Parameters
    ----------
    model : MODEL record
    branch : int
        `FORWARD` or `BACKWARD`.
    speed : float
        |v|, rad/s, >= 0. Held at the first and the last knot outside them.

    Returns
    -------
    float
        N m, viscous part included; 0 without a model; NaN for a NaN or negative speed.

    Notes
    -----
    Segment j covers [knot_j, knot_{j+1}); F = c0 + h (c1 + h (c2 + h c3)), h = speed - knot_j
    (docs/theory.md 8.4). The look-up may point to any segment near the speed: the two short
    walks make a rounding of its cell harmless."""
    n = min(model.n_segments[branch], MAX_SEGMENTS)
    if n < 1:
        return 0.0
    if not speed >= 0.0:
        return math.nan
    j, h = segment(model, branch, speed)
    return of_segment(model, branch, j, h)


@compiled
def friction_magnitude(model: Record, velocity: float) -> float:
    """Friction magnitude (N m, viscous part included) at a signed velocity in rad/s; NaN stays NaN."""
    return branch_magnitude(model, int(velocity < 0.0), abs(velocity))  # a jump here would be mispredicted
