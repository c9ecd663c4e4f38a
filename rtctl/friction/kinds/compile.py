"""Compile any learned curve to a piecewise cubic, with a proof of how far the two can be apart.

Spline-kernel regressions and cubics are compiled exactly; everything else becomes a cubic Hermite table
whose cells are halved until the proved error of each is below the tolerance.
"""

from __future__ import annotations

import math

import numpy as np

from rtctl.control.records import MAX_SEGMENTS
from rtctl.errors import ModelError
from rtctl.friction.kinds.cubic import PiecewiseCubic, compile_spline
from rtctl.friction.kinds.curve import Curve

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
    if curve.kind == "spline":
        table = compile_spline(curve.support_vectors, curve.dual_coef, curve.intercept)
    elif curve.kind in ("coulomb", "coulomb_viscous"):
        at_0 = np.zeros(1)
        c0, c1 = float(curve(at_0)[0]), float(curve.derivative(at_0, 1)[0])
        table = PiecewiseCubic(np.zeros(1), np.array([[c0, c1, 0.0, 0.0]]))
    elif curve.kind == "polynomial" and curve.parameters["degree"] <= 3:
        powers = curve.powers()
        table = PiecewiseCubic(np.zeros(1), np.append(powers, np.zeros(4 - len(powers)))[None, :])
    else:
        table = _hermite(curve, _cells(curve, speed_max))
    if len(table.knots) > MAX_SEGMENTS:
        raise ModelError(
            f"{len(table.knots)} segments, at most {MAX_SEGMENTS}: too many support vectors; choose a larger epsilon"
        )
    bound = error_bound(curve, table, speed_max)
    seen = sampled_error(curve, table, speed_max)
    if not seen <= bound:
        raise ModelError(f"the compiled curve is off by {seen:.3g} N m, proved were {bound:.3g}")
    return table, bound


def error_bound(curve: Curve, table: PiecewiseCubic, speed_max: float) -> float:
    """Proved largest difference of `table` and `curve` over 0..`speed_max`, N m, rounding included.

    For a Hermite table on its own knots; exact compilations are off by rounding alone.
    """
    rounding = 2 * curve.rounding(speed_max)
    if curve.compiles_exactly:
        return rounding if curve.kind != "spline" else curve.rounding(speed_max)
    return float(cell_bounds(curve, np.append(table.knots, speed_max)).max()) + rounding


def sampled_error(curve: Curve, table: PiecewiseCubic, speed_max: float) -> float:
    """Largest difference seen at `_SAMPLES` places of every cell, N m; NaN is passed on."""
    edges = np.append(table.knots, speed_max)
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
    small enough to matter. sup is over the cell and all that is faster.
    """
    centre, r = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    fourth = np.zeros(len(r))
    for k in range(_TAYLOR):
        fourth += r**k / math.factorial(k) * np.abs(curve.derivative(centre, 4 + k))
    beyond = np.minimum(curve.derivative_bound(4 + _TAYLOR, edges[:-1]), 1e300)
    fourth += r**_TAYLOR / math.factorial(_TAYLOR) * beyond
    with np.errstate(over="ignore"):  # an infinite bound is not below any tolerance
        bound: np.ndarray = (2 * r) ** 4 / 384 * fourth
    return bound


def _cells(curve: Curve, speed_max: float) -> np.ndarray:
    edges = np.array([0.0, speed_max])
    tolerance = TOLERANCE_SHARE * float(np.max(np.abs(curve(np.linspace(0, speed_max, 500)))))
    while True:
        wide = cell_bounds(curve, edges) > tolerance
        if not wide.any():
            return edges
        edges = np.sort(np.append(edges, 0.5 * (edges[1:] + edges[:-1])[wide]))
        if len(edges) > MAX_SEGMENTS + 1:
            raise ModelError(
                f"a table of {curve.kind} to {tolerance:.2g} N m needs more than {MAX_SEGMENTS} cells: "
                f"{_too_fine(curve, speed_max)}"
            )


def _too_fine(curve: Curve, speed_max: float) -> str:
    """Which parameter of the curve asks for so many cells, and what to do."""
    if curve.kind == "polynomial":
        return f"degree = {curve.parameters['degree']:g} with such dual coefficients; choose another kernel, or a smaller C"
    name = "sigma_rad_s" if curve.kind == "rbf" else "stribeck_rad_s"
    what = f"{name} = {curve.parameters[name]:.3g} is too small for a range of {speed_max:.3g} rad/s"
    other = "choose another kernel" if curve.kind == "rbf" else "choose another model"
    return f"{what}; {other}, or leave out the fastest points"


def _hermite(curve: Curve, edges: np.ndarray) -> PiecewiseCubic:
    """Cubic with the curve's values and slopes at both ends of each cell."""
    f, s, h = curve(edges), curve.derivative(edges, 1), np.diff(edges)
    secant = np.diff(f) / h
    c2 = (3 * secant - 2 * s[:-1] - s[1:]) / h
    c3 = (s[:-1] + s[1:] - 2 * secant) / h**2
    return PiecewiseCubic(edges[:-1], np.column_stack([f[:-1], s[:-1], c2, c3]))
