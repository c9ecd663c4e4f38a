"""Compile any learned curve to a piecewise cubic, with a proof of how far the two can be apart.

Spline-kernel regressions and cubics are compiled exactly; everything else becomes a cubic Hermite table
whose cells are halved until the proved error of each is below the tolerance."""

from __future__ import annotations

import math

import numpy as np

from rtctl.control.records import MAX_SEGMENTS
from rtctl.errors import ModelError
from rtctl.friction.kind_cubic import PiecewiseCubic
from rtctl.friction.kind_curve import Curve

# far below the half percent that counts as equal (decision 0012): no check need know of it
TOLERANCE_SHARE = 1e-6
"""Largest proved error of a table, share of the largest friction."""

_TAYLOR = 8
"""Terms of the Taylor series that bounds the fourth derivative within a cell."""

_SAMPLES = 9
"""Places per cell where table and curve are compared."""


def compile_curve(curve: Curve, speed_max: float) -> tuple[PiecewiseCubic, float]:
    """Compile a learned curve for 0..`speed_max` rad/s.

    Returns
    -------
    table : PiecewiseCubic
    bound_nm : float
        Proved largest difference to the curve over the range, N m, rounding included.

    Raises
    ------
    ModelError
        When the tolerance needs more than `MAX_SEGMENTS` segments, or the dense check contradicts the proof.
    """
    # exact where there is one: no cells, and no error but rounding
    table = _within(curve.exact, speed_max) if curve.exact else _hermite(curve, _cells(curve, speed_max))
    # the law's record has room for so many, whatever the curve is worth
    if len(table.knots) > MAX_SEGMENTS:
        raise ModelError(
            f"{len(table.knots)} segments, at most {MAX_SEGMENTS}: too many support vectors; choose a "
            "larger epsilon"
        )
    # proved and then looked at: a mistake in a bound would otherwise be in the loop before anybody saw it
    bound = error_bound(curve, table, speed_max)
    seen = sampled_error(curve, table, speed_max)
    if not seen <= bound:  # a NaN contradicts it, too
        raise ModelError(f"the compiled curve is off by {seen:.3g} N m, proved were {bound:.3g}")
    return table, bound


def _within(table: PiecewiseCubic, speed_max: float) -> PiecewiseCubic:
    """The table without the cells that begin beyond the range, straight on from its end: of a curve that both
    directions share, one of which is faster."""
    # a knot at the end has no cell within the range
    kept = table.knots < speed_max
    if kept.sum() == len(kept) or table.knots[-1] == speed_max:
        return table
    c0, c1, c2, c3 = table.coefficients[kept][-1]
    # value and slope at the end, and straight on: a cubic that ran on would bend beyond the last point
    h = speed_max - table.knots[kept][-1]
    tail = [c0 + h * (c1 + h * (c2 + h * c3)), c1 + h * (2 * c2 + 3 * h * c3), 0.0, 0.0]
    return PiecewiseCubic(
        np.append(table.knots[kept], speed_max), np.vstack([table.coefficients[kept], tail])
    )


def error_bound(curve: Curve, table: PiecewiseCubic, speed_max: float) -> float:
    """Proved largest difference of `table` and `curve` over 0..`speed_max`, N m, rounding included.

    For a Hermite table on its own knots; exact compilations are off by rounding alone."""
    if curve.exact is not None:
        return curve.of.exact_bound(curve, speed_max)
    return float(cell_bounds(curve, np.append(table.knots, speed_max)).max()) + 2 * curve.rounding(speed_max)


def sampled_error(curve: Curve, table: PiecewiseCubic, speed_max: float) -> float:
    """Largest difference seen at `_SAMPLES` places of every cell, N m; NaN is passed on."""
    edges = np.append(table.knots, speed_max)
    # inside the cells: at their edges a Hermite table is right by construction
    share = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    inner = (edges[:-1, None] + np.diff(edges)[:, None] * share).ravel()
    speed = np.concatenate([edges, inner, np.linspace(0, speed_max, 1000)])
    return float(np.max(np.abs(table(speed) - curve(speed))))


def cell_bounds(curve: Curve, edges: np.ndarray) -> np.ndarray:
    """Proved error (N m) of a cubic Hermite table in each cell between `edges`, rounding apart.

    Notes
    -----
    |error| <= h^4/384 max|f''''| (docs/theory.md 8.5). Within the cell of centre m and half width r,
    |f''''| <= sum_{k<8} r^k/k! |f^(4+k)(m)| + r^8/8! sup|f^(12)|: the dual coefficients alternate, so the
    derivatives at the place itself are far below a sum of their sizes, and the remainder is nil in a cell
    small enough to matter. sup is over the cell and all that is faster. Infinite in a cell with a place
    inside where a derivative jumps."""
    centre, r = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    breaks = curve.of.breaks(curve)
    inside = np.searchsorted(breaks, edges[:-1], side="right") < np.searchsorted(
        breaks, edges[1:], side="left"
    )
    fourth = np.where(inside, np.inf, 0.0)  # no bound holds across a jump
    for k in range(_TAYLOR):
        # at the middle: duals of both signs cancel there, as they do not in a sum of sizes
        fourth += r**k / math.factorial(k) * np.abs(curve.derivative(centre, 4 + k))
    beyond = np.minimum(curve.derivative_bound(4 + _TAYLOR, edges[:-1]), 1e300)
    fourth += r**_TAYLOR / math.factorial(_TAYLOR) * beyond
    with np.errstate(over="ignore"):  # an infinite bound is not below any tolerance
        bound: np.ndarray = (2 * r) ** 4 / 384 * fourth
    return bound


def _cells(curve: Curve, speed_max: float) -> np.ndarray:
    breaks = curve.of.breaks(curve)
    # a bound of the fourth derivative holds between the places where a lower one jumps, hence cells end there
    edges = np.unique([0.0, *breaks[(breaks > 0) & (breaks < speed_max)], speed_max])
    # a grid is enough for a scale: a peak between its speeds makes the tolerance smaller, not larger
    tolerance = TOLERANCE_SHARE * float(np.max(np.abs(curve(np.linspace(0, speed_max, 500)))))
    while True:
        wide = cell_bounds(curve, edges) > tolerance
        if not wide.any():
            return edges
        # the error goes by h^4: a cell that was halved is 16 times better, and needs no cleverer place
        edges = np.sort(np.append(edges, 0.5 * (edges[1:] + edges[:-1])[wide]))
        if len(edges) > MAX_SEGMENTS + 1:  # told here: halving a cell with no bound would never end
            raise ModelError(
                f"a table of {curve.kind} to {tolerance:.2g} N m needs more than {MAX_SEGMENTS} cells: "
                f"{curve.of.too_fine(curve, speed_max)}"
            )


def _hermite(curve: Curve, edges: np.ndarray) -> PiecewiseCubic:
    """Cubic with the curve's values and slopes at both ends of each cell."""
    f, s, h = curve(edges), curve.derivative(edges, 1), np.diff(edges)
    secant = np.diff(f) / h
    c2 = (3 * secant - 2 * s[:-1] - s[1:]) / h
    c3 = (s[:-1] + s[1:] - 2 * secant) / h**2
    return PiecewiseCubic(edges[:-1], np.column_stack([f[:-1], s[:-1], c2, c3]))
