"""The Gaussian kernel exp(-(u - v)^2/(2 sigma^2)); scikit-learn's gamma is 1/(2 sigma^2)
(docs/theory.md 8.3)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from rtctl.friction.kind import Kernel, Parameter
from rtctl.friction.kind_stribeck import gaussian_bound, gaussian_derivative

if TYPE_CHECKING:
    from rtctl.friction.kind_curve import Curve

SIGMA_SHARE = (0.05, 0.1, 0.2)
"""Widths tried, share of the trained range; a Stribeck speed is about .05 of it, the gap of fast points
.2."""


class Rbf(Kernel):
    """Every derivative exists, and one bound of the last that is needed holds everywhere."""

    name = "rbf"
    what = "Gaussian kernel"
    parameters = (Parameter("sigma_rad_s", positive=True),)
    c_shares = (0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0)

    def matrix(self, parameters: Mapping[str, float], u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """See `Kernel`."""
        value: np.ndarray = np.exp(-((u[:, None] - v[None, :]) ** 2) / (2 * parameters["sigma_rad_s"] ** 2))
        return value

    def grid(self, speed_max: float) -> Sequence[Mapping[str, float]]:
        """See `Kernel`."""
        return [{"sigma_rad_s": share * speed_max} for share in SIGMA_SHARE]

    def derivative(self, c: Curve, v: np.ndarray, order: int) -> np.ndarray:
        """See `Kind`."""
        scale = math.sqrt(2.0) * c.parameters["sigma_rad_s"]
        y = (v[..., None] - c.support_vectors) / scale
        # y = (v - v_i)/(sqrt 2 sigma): each derivative by v is one by y over that
        part = gaussian_derivative(y, order) @ c.dual_coef / scale**order
        total: np.ndarray = part + (c.intercept if order == 0 else 0.0)
        return total

    def derivative_bound(self, c: Curve, order: int, v: np.ndarray) -> np.ndarray:
        """See `Kind`."""
        scale = math.sqrt(2.0) * c.parameters["sigma_rad_s"]
        # sizes of the duals, whose signs no bound may count on
        return np.full(v.shape, gaussian_bound(order) * float(np.abs(c.dual_coef).sum()) / scale**order)
