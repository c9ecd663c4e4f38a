"""Friction curves as learned, before compilation: values and derivatives of any order.

A curve is a function of v = |velocity|, rad/s, v >= 0, in N m. Two sorts: sums of kernels (support-vector
regressions) and closed formulas (`baselines`). The compiler needs derivatives, and a bound that holds for
every v, to prove what a table is off by.

| symbol | meaning |
|---|---|
| v_i, beta_i, b | support vectors (rad/s), dual coefficients and intercept (N m) |
| H_n | Hermite polynomial: d^n/dy^n exp(-y^2) = (-1)^n H_n(y) exp(-y^2) |
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.hermite import hermval

from rtctl.friction.kinds import spline as kernels

KERNELS = ("spline", "rbf", "polynomial")
"""Kinds that are sums of kernels."""

FORMULAS = ("coulomb", "coulomb_viscous", "tustin", "gaussian", "lorentzian")
"""Kinds that are closed formulas, simplest first; "gaussian" is Tustin's with exponent 2."""

STRAIGHT = FORMULAS[:2]
"""Formulas without a Stribeck peak."""

_CRAMER = 1.0865
"""|H_n(y)| exp(-y^2/2) <= 1.0865 sqrt(2^n n!) for every y and n (Cramer's inequality)."""


def _gaussian_derivative(y: np.ndarray, order: int) -> np.ndarray:
    value: np.ndarray = (-1) ** order * hermval(y, [0.0] * order + [1.0]) * np.exp(-(y**2))
    return value


def _gaussian_bound(order: int) -> float:
    return _CRAMER * math.sqrt(2.0**order * math.factorial(order))


@dataclass(frozen=True)
class Curve:
    """One learned curve.

    `parameters` are the numbers of a formula (`coulomb_nm`, `breakaway_nm`, `stribeck_rad_s`,
    `viscous_nms_rad`) or of a kernel (`sigma_rad_s`, `degree`); the other fields are empty for a formula.
    """

    kind: str
    parameters: Mapping[str, float]
    support_vectors: np.ndarray
    dual_coef: np.ndarray
    intercept: float

    @classmethod
    def formula(cls, kind: str, parameters: Mapping[str, float]) -> Curve:
        """Make a curve of a closed formula."""
        return cls(kind, parameters, np.zeros(0), np.zeros(0), 0.0)

    @property
    def n_terms(self) -> int:
        """Support vectors of a kernel sum, parameters of a formula: what a choice counts."""
        return len(self.support_vectors) if self.kind in KERNELS else len(self.parameters)

    @property
    def compiles_exactly(self) -> bool:
        """Whether a piecewise cubic is this very curve, so that no table is needed."""
        cubic = self.kind == "polynomial" and self.parameters["degree"] <= 3
        return cubic or self.kind == "spline" or self.kind in STRAIGHT

    def __call__(self, speed: np.ndarray) -> np.ndarray:
        """Value at each speed >= 0, N m; NaN for NaN."""
        v = np.asarray(speed, dtype=float)
        if self.kind in FORMULAS:
            return self.derivative(v, 0)
        flat = gram(self.kind, self.parameters, np.ravel(v), self.support_vectors) @ self.dual_coef
        value: np.ndarray = np.reshape(flat, v.shape) + self.intercept
        return value

    def derivative(self, speed: np.ndarray, order: int) -> np.ndarray:
        """Derivative of `order` (0: the value itself) at each speed, N m / (rad/s)^order. Not for splines."""
        v = np.asarray(speed, dtype=float)
        if self.kind == "rbf":
            scale = math.sqrt(2.0) * self.parameters["sigma_rad_s"]
            y = (v[..., None] - self.support_vectors) / scale
            part = _gaussian_derivative(y, order) @ self.dual_coef / scale**order
            total: np.ndarray = part + (self.intercept if order == 0 else 0.0)
            return total
        if self.kind == "polynomial":
            value: np.ndarray = np.polynomial.Polynomial(self.powers()).deriv(order)(v)
            return value
        return self._formula_derivative(v, order)

    def _formula_derivative(self, v: np.ndarray, order: int) -> np.ndarray:
        p = self.parameters
        slope = p.get("viscous_nms_rad", 0.0)
        straight = p["coulomb_nm"] + slope * v if order == 0 else np.full(v.shape, slope * (order == 1))
        if self.kind in STRAIGHT:
            return straight
        y = v / p["stribeck_rad_s"]
        scale = (p["breakaway_nm"] - p["coulomb_nm"]) / p["stribeck_rad_s"] ** order
        value: np.ndarray = straight + scale * stribeck_shape(self.kind, y, order)
        return value

    def derivative_bound(self, order: int, from_speed: np.ndarray | float = 0.0) -> np.ndarray:
        """Bound of |derivative of `order` >= 2| over every speed >= each of `from_speed` (rad/s, >= 0); infinite without one.

        The peak of a formula dies out, and its bound with it (docs/theory.md 8.5); that of a kernel sum is the same everywhere.
        """
        v = np.asarray(from_speed, dtype=float)
        if self.kind == "rbf":
            scale = math.sqrt(2.0) * self.parameters["sigma_rad_s"]
            return np.full(
                v.shape, _gaussian_bound(order) * float(np.abs(self.dual_coef).sum()) / scale**order
            )
        if self.kind == "polynomial":
            return np.full(v.shape, 0.0 if order > self.parameters["degree"] else math.inf)
        p = self.parameters
        if self.kind in STRAIGHT:
            return np.zeros(v.shape)
        peak = abs(p["breakaway_nm"] - p["coulomb_nm"]) / p["stribeck_rad_s"] ** order
        bound: np.ndarray = peak * _shape_bound(self.kind, v / p["stribeck_rad_s"], order)
        return bound

    def powers(self) -> np.ndarray:
        """Coefficients of 1, v, v^2, ... of a polynomial-kernel sum."""
        degree = round(self.parameters["degree"])
        powers = np.array(
            [
                math.comb(degree, k) * math.fsum(self.dual_coef * self.support_vectors**k)
                for k in range(degree + 1)
            ]
        )
        powers[0] += self.intercept
        return powers

    def rounding(self, speed_max: float) -> float:
        """Rounding of one evaluation as the definition says, N m, at most (docs/theory.md 8.4)."""
        if self.kind not in KERNELS:
            return 1e-12
        top = np.array([max(speed_max, float(np.max(self.support_vectors, initial=0.0)))])
        largest = float(gram(self.kind, self.parameters, top, top)[0, 0])
        spacing = 8 * float(np.finfo(float).eps)
        return max(1e-12, spacing * float(np.abs(self.dual_coef).sum()) * largest)


def stribeck_shape(kind: str, y: np.ndarray, order: int = 0) -> np.ndarray:
    """Shape of the Stribeck peak, 1 at y = v/v_s = 0 and falling, or its derivative of `order`.

    Notes
    -----
    tustin: exp(-y); gaussian: exp(-y^2); lorentzian: 1/(1+y^2), the imaginary part of 1/(y - i), whose
    derivative of order n is that of (-1)^n n! / (y - i)^(n+1), at most n! in size.
    """
    y = np.asarray(y, dtype=float)
    if kind == "tustin":
        value: np.ndarray = (-1) ** order * np.exp(-y)
    elif kind == "gaussian":
        value = _gaussian_derivative(y, order)
    else:
        with np.errstate(invalid="ignore"):  # a complex NaN is noisy
            value = np.imag((-1) ** order * math.factorial(order) / (y - 1j) ** (order + 1))
    return value


def _shape_bound(kind: str, y: np.ndarray, order: int) -> np.ndarray:
    """Bound of |derivative of `order`| of `stribeck_shape` at y >= 0 and beyond: it falls with y."""
    if kind == "tustin":
        value: np.ndarray = np.exp(-y)
    elif kind == "gaussian":
        value = _gaussian_bound(order) * np.exp(-(y**2) / 2)
    else:
        value = math.factorial(order) / (1 + y**2) ** ((order + 1) / 2)
    return value


def gram(kind: str, parameters: Mapping[str, float], u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Kernel matrix of speeds `u` (n,) and `v` (m,), shape (n, m)."""
    u, v = np.asarray(u)[:, None], np.asarray(v)[:, None]
    if kind == "rbf":
        return kernels.rbf(u, v, parameters["sigma_rad_s"])
    if kind == "polynomial":
        return kernels.polynomial(u, v, round(parameters["degree"]))
    return kernels.spline(u, v)
