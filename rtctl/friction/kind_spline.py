"""The infinite linear-spline kernel, and the piecewise cubic that its regressions are (docs/theory.md 8.3,
8.4).

Symbols: v_i support vectors (rad/s), beta_i dual coefficients, b intercept (N m). Given to
`SVR(kernel=spline)` as a callable, scikit-learn leaves `support_vectors_` empty: take `X[model.support_]`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from rtctl.friction.kind import Kernel, Parameter
from rtctl.friction.kind_cubic import PiecewiseCubic

if TYPE_CHECKING:
    from rtctl.friction.kind_curve import Curve


UNIT = "unit_rad_s"
"""Parameter of a curve: the speed that counts as 1 in its kernel, rad/s; without it 1. Of a linear axis (m/s)
half of the largest speed, as 2 rad/s is what a joint reaches."""


def spline(X: np.ndarray, Y: np.ndarray) -> np.ndarray:
    """Infinite linear-spline kernel, product over the coordinates.

    Parameters
    ----------
    X, Y : ndarray, shapes (n, d) and (m, d)
        Inputs, all >= 0: friction models give it |v|, one model per direction.

    Returns
    -------
    ndarray, shape (n, m)

    Raises
    ------
    ValueError
        For a negative or NaN input: the kernel is positive definite only on [0, inf).

    Notes
    -----
    Per coordinate, with m = min(u, v): ``k = 1 + uv + uv m/2 - m^3/6``, which is
    ``1 + uv + integral_0^inf (u-t)_+ (v-t)_+ dt``. (Vapnik; as "curvspline" in Gunn's SVM toolbox.)
    Not scale invariant: speeds of a rotary axis are in rad/s, those of a linear one in `UNIT`."""
    out = np.ones((len(X), len(Y)))
    for u, v, m in _coordinates(X, Y):
        # the integral of (u - t)(v - t) over t from 0 to m is u v m/2 - m^3/6, since m is one of the two
        out *= 1 + u * v * (1 + m / 2) - m**3 / 6
    return out


def _coordinates(X: np.ndarray, Y: np.ndarray) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    X, Y = np.asarray(X, dtype=float), np.asarray(Y, dtype=float)
    if not (np.all(X >= 0) and np.all(Y >= 0)):
        raise ValueError("the spline kernel needs inputs >= 0: give it |v|, one model per direction")
    pairs = [(X[:, i, None], Y[None, :, i]) for i in range(X.shape[1])]
    return [(u, v, np.minimum(u, v)) for u, v in pairs]


def compile_spline(
    support_vectors: np.ndarray, dual_coef: np.ndarray, intercept: float, unit: float = 1.0
) -> PiecewiseCubic:
    """Turn a spline-kernel SVR into the same function as a piecewise cubic, C2, knots at the support vectors.

    Parameters
    ----------
    support_vectors : ndarray, shape (n,)
        Speeds, rad/s, >= 0, any order; equal ones are merged.
    dual_coef : ndarray, shape (n,)
        beta = alpha - alpha*, as scikit-learn's `dual_coef_`.
    intercept : float
        b, N m.
    unit : float
        Speed that counts as 1, see `UNIT`: the curve is that of v / unit.

    Raises
    ------
    ValueError
        For shapes that differ, or values that are negative or not finite.

    Notes
    -----
    docs/theory.md 8.4. Below v_i the kernel is ``1 + v v_i + v_i v^2/2 - v^3/6``; above it exceeds that
    cubic by ``(v - v_i)^3/6``. Hence f = p0 + sum beta_i/6 (v - v_i)_+^3 with
    ``p0 = (b + S0) + S1 v + S1/2 v^2 - S0/6 v^3``, S0 = sum beta_i, S1 = sum beta_i v_i. Re-expanding p0
    from knot to knot keeps rounding local. Beyond the last knot the cubic and quadratic terms cancel
    identically; their rounding residue is removed, so that the tail is exactly linear. A support vector at
    0 belongs to the first segment."""
    v = np.asarray(support_vectors, dtype=float)
    beta = np.asarray(dual_coef, dtype=float)
    if v.ndim != 1 or v.shape != beta.shape:
        raise ValueError(f"support_vectors {v.shape} and dual_coef {beta.shape} must be equally long vectors")
    if not (np.isfinite(v).all() and np.isfinite(beta).all() and math.isfinite(intercept) and (v >= 0).all()):
        raise ValueError("support vectors must be finite and >= 0, dual coefficients and intercept finite")
    s0, s1 = math.fsum(beta), math.fsum(beta * (v / unit))  # duals are large and sum to nearly 0
    # 0 is a knot in any case: the first piece begins at rest, whatever the slowest support vector is
    starts, where = np.unique(np.append(v, 0.0), return_inverse=True)
    jumps = np.zeros(len(starts))
    # `add.at`: equal support vectors, as of repeats, add up at one knot
    np.add.at(jumps, where[:-1], beta / 6)

    c = np.array([intercept + s0, s1, s1 / 2, -s0 / 6 + jumps[0]])
    rows = [c]
    for h, jump in zip(np.diff(starts / unit), jumps[1:], strict=True):
        c0, c1, c2, c3 = c
        c = np.array(
            [c0 + h * (c1 + h * (c2 + h * c3)), c1 + h * (2 * c2 + 3 * h * c3), c2 + 3 * h * c3, c3 + jump]
        )
        rows.append(c)
    # nothing bends beyond the last support vector: what is left there is rounding, and grows with v^3
    rows[-1][2:] = 0.0
    return PiecewiseCubic(starts, np.array(rows) / unit ** np.arange(4))  # back from units of `unit`


class Spline(Kernel):
    """Exactly a piecewise cubic, so that no derivative is asked for."""

    name = "spline"
    parameters = (Parameter(UNIT, positive=True, optional=True),)
    what = "infinite spline kernel: exactly a cubic spline"
    c_shares = (10.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4, 3e4)
    """Large: the dual coefficients are jumps of the third derivative, and a Stribeck peak is steep."""

    def matrix(self, parameters: Mapping[str, float], u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """See `Kernel`."""
        unit = parameters.get(UNIT, 1.0)
        return spline(u[:, None] / unit, v[:, None] / unit)

    def derivative(self, c: Curve, v: np.ndarray, order: int) -> np.ndarray:
        """See `Kind`; of the compiled cubic, up to the third."""
        return self.exact(c).derivative(v, order)

    def derivative_bound(self, c: Curve, order: int, v: np.ndarray) -> np.ndarray:
        """See `Kind`: a cubic has no fourth derivative."""
        return np.full(v.shape, 0.0 if order > 3 else math.inf)

    def exact(self, c: Curve) -> PiecewiseCubic:
        """See `Kind`."""
        return compile_spline(c.support_vectors, c.dual_coef, c.intercept, c.parameters.get(UNIT, 1.0))

    def exact_bound(self, c: Curve, speed_max: float) -> float:
        """See `Kind`: of the kernel sum alone, whose dual coefficients are large."""
        return self.rounding(c, speed_max)
