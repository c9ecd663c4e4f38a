"""The exact compilation of a (position, velocity) product-spline SVR: bicubic on a grid of support vectors.

Symbols: (p_i, v_i) support vectors (shifted to >= 0), beta_i dual coefficients, b intercept.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtctl.friction.kinds.cubic import PiecewiseCubic
from rtctl.friction.kinds.spline import compile_spline

MAX_CELLS = 101 * 101
"""Most cells: 100 support vectors at places all different, 1.3 MB. Above it the sum itself is cheaper."""


@dataclass(frozen=True)
class PiecewiseBicubic:
    """`knots_x` (n,), `knots_y` (m,), both rising from 0; `coefficients` (n, m, 4, 4) about each corner."""

    knots_x: np.ndarray
    knots_y: np.ndarray
    coefficients: np.ndarray

    def __call__(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Value at each (x, y), both >= 0; NaN for NaN. Linear in each coordinate beyond its last knot."""
        j, h = _cell(self.knots_x, np.asarray(x, dtype=float))
        k, g = _cell(self.knots_y, np.asarray(y, dtype=float))
        c = self.coefficients[j, k]
        rows = c[..., 0] + g[..., None] * (c[..., 1] + g[..., None] * (c[..., 2] + g[..., None] * c[..., 3]))
        value: np.ndarray = rows[..., 0] + h * (rows[..., 1] + h * (rows[..., 2] + h * rows[..., 3]))
        return value


def _cell(knots: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    j = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, len(knots) - 1)
    return j, at - knots[j]


def compile_spline_2d(
    support_vectors: np.ndarray, dual_coef: np.ndarray, intercept: float
) -> PiecewiseBicubic:
    """Turn a product-spline-kernel SVR of two inputs into the same function, cell by cell a bicubic.

    Parameters
    ----------
    support_vectors : ndarray, shape (n, 2)
        Position (rad, shifted to >= 0) and speed (rad/s, >= 0).
    dual_coef : ndarray, shape (n,)
    intercept : float

    Raises
    ------
    ValueError
        For shapes that differ, negative or not finite values, or more than `MAX_CELLS` cells.

    Notes
    -----
    docs/theory.md 8.6. Each factor k(x, p_i) is a one-dimensional cubic spline with its knot at p_i; over
    the cells of all knots f = b + sum_i beta_i A_i (x) B_i. Unlike in one dimension the quadratic and cubic
    terms of each factor alone vanish beyond its own knot, so the tails are linear whatever sum(beta) is.
    """
    points = np.asarray(support_vectors, dtype=float)
    beta = np.asarray(dual_coef, dtype=float)
    if points.ndim != 2 or points.shape != (len(beta), 2):
        msg = f"support_vectors {points.shape} must be (n, 2), dual_coef {beta.shape} (n,)"
        raise ValueError(msg)
    if not (np.isfinite(points).all() and np.isfinite(beta).all() and (points >= 0).all()):
        msg = "support vectors must be finite and >= 0, dual coefficients finite"
        raise ValueError(msg)
    knots = [np.unique(np.append(points[:, i], 0.0)) for i in (0, 1)]
    if len(knots[0]) * len(knots[1]) > MAX_CELLS:
        msg = f"{len(knots[0])} x {len(knots[1])} cells, at most {MAX_CELLS}: evaluate the sum itself"
        raise ValueError(msg)
    factors = [
        np.array([_factor(at, knots[i]) for at in points[:, i]]).reshape(len(beta), -1, 4) for i in (0, 1)
    ]
    coefficients = np.einsum("i,ija,ikb->jkab", beta, *factors)
    coefficients[..., 0, 0] += intercept
    return PiecewiseBicubic(knots[0], knots[1], coefficients)


def _factor(at: float, knots: np.ndarray) -> np.ndarray:
    """Local coefficients of k(., at) about every knot, shape (n, 4)."""
    one: PiecewiseCubic = compile_spline(np.array([at]), np.ones(1), 0.0)
    j, h = _cell(one.knots, knots)
    c0, c1, c2, c3 = one.coefficients[j].T
    return np.column_stack(
        [c0 + h * (c1 + h * (c2 + h * c3)), c1 + h * (2 * c2 + 3 * h * c3), c2 + 3 * h * c3, c3]
    )
