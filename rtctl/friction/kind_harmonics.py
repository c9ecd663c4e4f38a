"""The conservative part of a joint's torque (cogging, ripple): harmonics of its place, zero in the mean, no
matter which way it moves.

    tau_c(x) = sum_n (p_n cos n a + q_n sin n a),     a = 2 pi x / period

tau_c is positive where it pushes the joint along +x. Compensated, it is a spring of stiffness up to
max|tau_c'| whose sign changes; over a whole period it gives nothing (docs/theory.md 8.9)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from rtctl.control.records import CONSERVATIVE_CELLS

ORDER_MAX = 128
"""Highest order: 4 cells of the law's table for one of its waves, whose error is 1.6 % of its amplitude."""

ORDERS_MOST = 32
"""Most harmonics of one part."""

# sixteen places to the shortest wave: between them its slope adds at most half a step (`_most`)
_GRID = 16 * ORDER_MAX


@dataclass(frozen=True)
class Harmonics:
    """`orders` (n,) whole numbers from 1, `cos` and `sin` (n,) their amplitudes, N m; `period_rad` > 0."""

    period_rad: float
    orders: np.ndarray
    cos: np.ndarray
    sin: np.ndarray

    def __call__(self, position_rad: np.ndarray) -> np.ndarray:
        """tau_c at each position (rad), N m."""
        return self.derivative(position_rad, 0)

    def mean_over(self, position_rad: np.ndarray, travel_rad: np.ndarray) -> np.ndarray:
        """Mean of tau_c over a travel around each position, N m: what a measurement in motion sees of it."""
        per_rad = 2 * math.pi * self.orders / self.period_rad
        angle = np.asarray(position_rad, dtype=float)[..., None] * per_rad
        # numpy has the pi within
        # a travel of a whole wave leaves nothing of it
        left = np.sinc(np.asarray(travel_rad, dtype=float)[..., None] * self.orders / self.period_rad)
        value: np.ndarray = (left * (self.cos * np.cos(angle) + self.sin * np.sin(angle))).sum(-1)
        return value

    def derivative(self, position_rad: np.ndarray, order: int) -> np.ndarray:
        """Derivative of `order` (0: the value) at each position, N m / rad^order."""
        per_rad = 2 * math.pi * self.orders / self.period_rad
        # each derivative is a quarter turn ahead
        angle = np.asarray(position_rad, dtype=float)[..., None] * per_rad + order * math.pi / 2
        value: np.ndarray = (per_rad**order * (self.cos * np.cos(angle) + self.sin * np.sin(angle))).sum(-1)
        return value

    @property
    def most_nm(self) -> float:
        """Bound of |tau_c|, N m."""
        return self._most(0)

    @property
    def steepest_nm_rad(self) -> float:
        """Bound of |d tau_c/dx|, N m/rad."""
        return self._most(1)

    @property
    def swing_j(self) -> float:
        """Most energy that it gives from one place to another, J: what comes back on the way back."""
        sizes = np.hypot(self.cos, self.sin) / np.maximum(self.orders, 1)  # integrated: 1 / n
        return float(2 * sizes.sum()) * self.period_rad / (2 * math.pi)

    def _most(self, order: int) -> float:
        """Bound of a derivative: the largest on a fine grid, and half a step at the bound of the next one."""
        grid = np.arange(_GRID) * self.period_rad / _GRID
        per_rad = 2 * math.pi * self.orders / self.period_rad
        next_most = float((per_rad ** (order + 1) * np.hypot(self.cos, self.sin)).sum())
        seen = float(np.abs(self.derivative(grid, order)).max()) if len(self.orders) else 0.0
        # all waves at their crest at one place: never exceeded, seldom reached
        bound = float((per_rad**order * np.hypot(self.cos, self.sin)).sum())
        # no place is further from the grid
        return min(bound, seen + next_most * 0.5 * self.period_rad / _GRID)

    def shifted(self, shift_rad: float) -> Harmonics:
        """A copy whose places are moved by `shift_rad`: tau_c(x - shift)."""
        # each order turns by its own number of times the shift
        angle = 2 * math.pi * self.orders * shift_rad / self.period_rad
        c, s = np.cos(angle), np.sin(angle)
        return replace(self, cos=self.cos * c - self.sin * s, sin=self.cos * s + self.sin * c)

    def table(self) -> np.ndarray:
        """The law's cubics over each of `CONSERVATIVE_CELLS` cells of a period, by the share of the cell,
        shape (n, 4).

        Values and slopes are exact at the ends of each cell, so the error is at most h^4/384 max|tau_c''''|.
        """
        h = self.period_rad / CONSERVATIVE_CELLS
        edges = np.arange(CONSERVATIVE_CELLS + 1) * h
        f, s = self(edges), self.derivative(edges, 1) * h
        rise = np.diff(f)
        return np.column_stack([f[:-1], s[:-1], 3 * rise - 2 * s[:-1] - s[1:], s[:-1] + s[1:] - 2 * rise])
