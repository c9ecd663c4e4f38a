"""The kernel cos(w (u - v)): a curve of one wave over speed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from rtctl.friction.kind import Kernel, Parameter

if TYPE_CHECKING:
    from rtctl.friction.kind_curve import Curve

RANGE_RAD = (1.0, 2.0)
"""Phases tried over the trained range, rad."""


class Waves(Kernel):
    """Every derivative is a wave again, and bounded by its frequency."""

    name = "waves"
    what = "kernel of one wave"
    parameters = (Parameter("wave_s_rad", positive=True),)
    c_shares = (1.0, 10.0, 100.0)

    def matrix(self, parameters: Mapping[str, float], u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """See `Kernel`."""
        value: np.ndarray = np.cos(parameters["wave_s_rad"] * (u[:, None] - v[None, :]))
        return value

    def grid(self, speed_max: float) -> Sequence[Mapping[str, float]]:
        """See `Kernel`."""
        return [{"wave_s_rad": phase / speed_max} for phase in RANGE_RAD]

    def derivative(self, c: Curve, v: np.ndarray, order: int) -> np.ndarray:
        """See `Kind`."""
        w = c.parameters["wave_s_rad"]
        waves = np.cos(w * (v[..., None] - c.support_vectors) + order * math.pi / 2)
        total: np.ndarray = waves @ c.dual_coef * w**order + (c.intercept if order == 0 else 0.0)
        return total

    def derivative_bound(self, c: Curve, order: int, v: np.ndarray) -> np.ndarray:
        """See `Kind`."""
        bound = float(np.abs(c.dual_coef).sum()) * c.parameters["wave_s_rad"] ** order
        return np.full(v.shape, bound)
