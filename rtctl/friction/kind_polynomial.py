"""The polynomial kernel (u v + 1)^p: one polynomial, exact up to degree 3 (docs/theory.md 8.3)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from rtctl.friction.kind import Kernel, Parameter
from rtctl.friction.kind_cubic import PiecewiseCubic

if TYPE_CHECKING:
    from rtctl.friction.kind_curve import Curve

DEGREES = (2.0, 3.0, 4.0, 5.0)
# the bound of a table ends with the 12th derivative (`kind_compile`): of a higher degree that has no bound
DEGREE_MAX = 12


def powers(c: Curve) -> np.ndarray:
    """Coefficients of 1, v, v^2, ... of the sum."""
    degree = round(c.parameters["degree"])
    found = np.array(
        # fsum: dual coefficients are large and cancel
        [math.comb(degree, k) * math.fsum(c.dual_coef * c.support_vectors**k) for k in range(degree + 1)]
    )
    found[0] += c.intercept
    return found


class Polynomial(Kernel):
    """Few tubes and bounds are tried: the dual coefficients hardly shape the curve."""

    name = "polynomial"
    what = "polynomial kernel"
    parameters = (Parameter("degree", whole_to=DEGREE_MAX),)
    c_shares = (1.0, 10.0, 100.0)
    tubes = slice(1, None, 2)
    any_unit = False

    def matrix(self, parameters: Mapping[str, float], u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """See `Kernel`."""
        # whole: a JSON file has floats, and a power of a rounded one would be another kernel
        value: np.ndarray = (u[:, None] @ v[None, :] + 1) ** round(parameters["degree"])
        return value

    def grid(self, speed_max: float) -> Sequence[Mapping[str, float]]:
        """See `Kernel`."""
        return [{"degree": degree} for degree in DEGREES]

    def derivative(self, c: Curve, v: np.ndarray, order: int) -> np.ndarray:
        """See `Kind`."""
        value: np.ndarray = np.polynomial.Polynomial(powers(c)).deriv(order)(v)
        return value

    def derivative_bound(self, c: Curve, order: int, v: np.ndarray) -> np.ndarray:
        """See `Kind`."""
        # below its degree it grows with speed without end: a table's remainder is taken from there on
        if order < c.parameters["degree"]:
            return np.full(v.shape, math.inf)
        return np.full(v.shape, abs(float(self.derivative(c, np.zeros(1), order)[0])))

    def exact(self, c: Curve) -> PiecewiseCubic | None:
        """See `Kind`."""
        if c.parameters["degree"] > 3:
            return None
        found = powers(c)
        return PiecewiseCubic(np.zeros(1), np.append(found, np.zeros(4 - len(found)))[None, :])

    def too_fine(self, c: Curve, speed_max: float) -> str:
        """See `Kind`."""
        return (
            f"degree = {c.parameters['degree']:g} with such dual coefficients; choose another kernel, or a "
            "smaller C"
        )
