"""Formulas with a Stribeck peak: F_c + (F_s - F_c) shape(v/v_s) + b v (docs/theory.md 8.1).

H_n is the Hermite polynomial: d^n/dy^n exp(-y^2) = (-1)^n H_n(y) exp(-y^2)."""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial.hermite import hermval

from rtctl.friction.kind import Formula, Parameter
from rtctl.friction.kind_straight import COULOMB_NM, VISCOUS

_CRAMER = 1.0865
"""|H_n(y)| exp(-y^2/2) <= 1.0865 sqrt(2^n n!) for every y and n (Cramer's inequality)."""


def gaussian_derivative(y: np.ndarray, order: int) -> np.ndarray:
    """Derivative of `order` of exp(-y^2)."""
    # Hermite polynomials of the physicists: those of y itself, not of sqrt(2) y
    value: np.ndarray = (-1) ** order * hermval(y, [0.0] * order + [1.0]) * np.exp(-(y**2))
    return value


def gaussian_bound(order: int) -> float:
    """Bound of abs(derivative of `order`) of exp(-y^2) times exp(y^2/2), over every y."""
    return _CRAMER * math.sqrt(2.0**order * math.factorial(order))


class Tustin(Formula):
    """Tustin's peak; its bound is the value itself."""

    name = "tustin"
    what = "a Stribeck peak exp(-v/v_s)"
    parameters = (COULOMB_NM, VISCOUS, Parameter("breakaway_nm"), Parameter("stribeck_rad_s", positive=True))

    def shape(self, y: np.ndarray, order: int = 0) -> np.ndarray:
        """See `Formula`."""
        value: np.ndarray = (-1) ** order * np.exp(-y)
        return value

    def shape_bound(self, y: np.ndarray, order: int) -> np.ndarray:
        """See `Formula`."""
        bound: np.ndarray = np.exp(-y)
        return bound


class Gaussian(Tustin):
    """Tustin's with exponent 2."""

    name = "gaussian"
    what = "a Stribeck peak exp(-(v/v_s)^2)"

    def shape(self, y: np.ndarray, order: int = 0) -> np.ndarray:
        """See `Formula`."""
        return gaussian_derivative(y, order)

    def shape_bound(self, y: np.ndarray, order: int) -> np.ndarray:
        """See `Formula`."""
        # Cramer's bound is of H_n exp(-y^2/2): the other half of the exponent is left to fall
        bound: np.ndarray = gaussian_bound(order) * np.exp(-(y**2) / 2)
        return bound


class Lorentzian(Tustin):
    """1/(1+y^2) is the imaginary part of 1/(y - i), whose derivative of order n is that of (-1)^n n! / (y -
    i)^(n+1)."""

    name = "lorentzian"
    what = "a Stribeck peak 1/(1+(v/v_s)^2)"

    def shape(self, y: np.ndarray, order: int = 0) -> np.ndarray:
        """See `Formula`."""
        with np.errstate(invalid="ignore"):  # a complex NaN is noisy
            value = np.imag((-1) ** order * math.factorial(order) / (y - 1j) ** (order + 1))
        return np.asarray(value)

    def shape_bound(self, y: np.ndarray, order: int) -> np.ndarray:
        """See `Formula`."""
        # the imaginary part is no more than the size of n!/(y - i)^(n+1)
        bound: np.ndarray = math.factorial(order) / (1 + y**2) ** ((order + 1) / 2)
        return bound
