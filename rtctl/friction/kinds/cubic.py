"""The exact compilation of a one-dimensional spline-kernel SVR into a piecewise cubic.

Symbols: v_i support vectors (rad/s), beta_i dual coefficients, b intercept (N m); segment j starts at
knot_j and holds local coefficients (c0, c1, c2, c3) about it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rtctl.friction.kinds import spline as kernels


@dataclass(frozen=True)
class PiecewiseCubic:
    """`knots` (n,), rad/s, rising from 0; `coefficients` (n, 4). The last segment is linear and endless."""

    knots: np.ndarray
    coefficients: np.ndarray

    def __call__(self, speed: np.ndarray) -> np.ndarray:
        """Value at each speed >= 0 (rad/s), N m; NaN for NaN."""
        speed = np.asarray(speed, dtype=float)
        j = np.clip(np.searchsorted(self.knots, speed, side="right") - 1, 0, len(self.knots) - 1)
        h = speed - self.knots[j]
        c = self.coefficients[j]
        value: np.ndarray = c[..., 0] + h * (c[..., 1] + h * (c[..., 2] + h * c[..., 3]))
        return value

    def extreme_speeds(self, speed_max: float, slope: float = 0.0) -> np.ndarray:
        """Speeds in [0, speed_max] among which curve minus `slope` times speed is least and greatest.

        The knots, the end, and the roots of each cubic's derivative: exact, no grid.
        """
        found = [*self.knots[self.knots <= speed_max], speed_max]
        ends = np.append(self.knots[1:], speed_max)
        for start, end, (_, c1, c2, c3) in zip(self.knots, ends, self.coefficients, strict=True):
            roots = np.roots(np.array([3 * c3, 2 * c2, c1 - slope]))  # drops leading zeros itself
            found += [start + r.real for r in roots if r.imag == 0 and 0 < r.real < end - start]
        return np.array([speed for speed in found if speed <= speed_max])

    def least_slope(self, speed_max: float) -> float:
        """Least slope over 0..`speed_max`, N m s/rad: at an end of a piece, or where its curvature is zero."""
        c1, c2, c3 = self.coefficients[:, 1:].T
        width = np.diff(np.append(self.knots, speed_max))
        vertex = np.divide(-c2, 3 * c3, out=np.zeros_like(c2), where=c3 != 0)
        places = np.stack([np.zeros_like(width), width, np.clip(vertex, 0, width)])
        return float(np.min(c1 + places * (2 * c2 + 3 * places * c3)))

    def least_secant(self, speed_max: float, loss: float) -> float:
        """Least (curve - `loss`)/v over 0 < v <= `speed_max`, N m s/rad; 0 where the difference is below 0.

        Notes
        -----
        Within a piece the secant is stationary where slope times speed is the value: a cubic in h.
        """
        places = [speed_max, *self.knots[self.knots > 0]]
        ends = np.append(self.knots[1:], speed_max)
        for start, end, (c0, c1, c2, c3) in zip(self.knots, ends, self.coefficients, strict=True):
            cubic = [2 * c3, 3 * c3 * start + c2, 2 * c2 * start, c1 * start - c0 + loss]
            roots = np.roots(np.array(cubic))
            places += [start + r.real for r in roots if abs(r.imag) < 1e-9 and 0 < r.real < end - start]
        at = np.array(places)
        return float(np.min(np.maximum(self(at) - loss, 0.0) / at))


def compile_spline(support_vectors: np.ndarray, dual_coef: np.ndarray, intercept: float) -> PiecewiseCubic:
    """Turn a spline-kernel SVR into the same function as a piecewise cubic, C2, knots at the support vectors.

    Parameters
    ----------
    support_vectors : ndarray, shape (n,)
        Speeds, rad/s, >= 0, any order; equal ones are merged.
    dual_coef : ndarray, shape (n,)
        beta = alpha - alpha*, as scikit-learn's `dual_coef_`.
    intercept : float
        b, N m.

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
    0 belongs to the first segment.
    """
    v = np.asarray(support_vectors, dtype=float)
    beta = np.asarray(dual_coef, dtype=float)
    if v.ndim != 1 or v.shape != beta.shape:
        msg = f"support_vectors {v.shape} and dual_coef {beta.shape} must be equally long vectors"
        raise ValueError(msg)
    if not (np.isfinite(v).all() and np.isfinite(beta).all() and math.isfinite(intercept) and (v >= 0).all()):
        msg = "support vectors must be finite and >= 0, dual coefficients and intercept finite"
        raise ValueError(msg)
    s0, s1 = math.fsum(beta), math.fsum(beta * v)
    starts, where = np.unique(np.append(v, 0.0), return_inverse=True)
    jumps = np.zeros(len(starts))
    np.add.at(jumps, where[:-1], beta / 6)

    c = np.array([intercept + s0, s1, s1 / 2, -s0 / 6 + jumps[0]])
    rows = [c]
    for h, jump in zip(np.diff(starts), jumps[1:], strict=True):
        c0, c1, c2, c3 = c
        c = np.array(
            [c0 + h * (c1 + h * (c2 + h * c3)), c1 + h * (2 * c2 + 3 * h * c3), c2 + 3 * h * c3, c3 + jump]
        )
        rows.append(c)
    rows[-1][2:] = 0.0
    return PiecewiseCubic(starts, np.array(rows))


def kernel_sum(
    speed: np.ndarray, support_vectors: np.ndarray, dual_coef: np.ndarray, intercept: float
) -> np.ndarray:
    """Evaluate the SVR as its definition says: ``sum beta_i k(v_i, v) + b``. The check on the compilation."""
    matrix = kernels.spline(np.asarray(speed, dtype=float)[:, None], np.asarray(support_vectors)[:, None])
    value: np.ndarray = matrix @ np.asarray(dual_coef) + intercept
    return value


def rounding_bound(support_vectors: np.ndarray, dual_coef: np.ndarray, speed_max: float) -> float:
    """Tolerance between compiled curve and kernel sum, N m: 1e-12, or ``8 eps sum|beta| k(v_max, v_max)``."""
    top = max(speed_max, float(np.max(support_vectors, initial=0.0)))
    kernel_max = 1 + top * top + top**3 / 3
    return max(1e-12, 8 * float(np.finfo(float).eps) * float(np.abs(dual_coef).sum()) * kernel_max)
