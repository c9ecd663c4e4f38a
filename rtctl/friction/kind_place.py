"""Friction that comes back with every turn: a spline kernel of speed times a periodic kernel of place, and
its exact compilation.

    k((v, x), (v', x')) = k_spl(v, v') (1 + lambda sum_{h=1..H} rho^(h-1) cos h (a - a')), a = 2 pi x / period

cos h(a - a_i) = cos h a cos h a_i + sin h a sin h a_i, so a regression f(v, x) = sum beta_i k(., (v_i,
x_i)) + b is 2 H + 1 cubic splines of speed, all with their knots at the v_i: one of duals beta_i (with b),
and two for each order, of duals beta_i lambda rho^(h-1) cos h a_i and beta_i lambda rho^(h-1) sin h a_i
(docs/theory.md 8.6).

x position (rad, any turn), v speed (rad/s, >= 0), b and f N m, lambda and rho 0 to 1 (here `share` and
`decay`)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rtctl.control.records import PLACE_ORDERS, PLACE_SEGMENTS
from rtctl.friction.kind_cubic import PiecewiseCubic
from rtctl.friction.kind_spline import compile_spline, spline

WAVES_MOST = PLACE_ORDERS
"""Most waves a turn that the law has room for."""

SPEEDS_MOST = PLACE_SEGMENTS
"""Most different speeds, 0 among them."""

ANGLES = 256
"""Places of a turn where a modulation is looked at: eight or more for the shortest of its waves."""


@dataclass(frozen=True)
class PlaceKernel:
    """Kernel of place: `period_rad` (> 0) is one turn of whatever turns; `orders` H (0 to `PLACE_ORDERS`),
    `share` and `decay`.

    `unit_rad_s` is the speed that counts as 1 (`kind_spline.UNIT`)."""

    period_rad: float
    orders: int
    share: float
    decay: float
    unit_rad_s: float = 1.0

    @property
    def weights(self) -> np.ndarray:
        """Lambda rho^(h-1) of each order, shape (H,)."""
        return self.share * self.decay ** np.arange(self.orders)

    def angle(self, position_rad: np.ndarray) -> np.ndarray:
        """Place as an angle of the turn, rad."""
        return np.asarray(position_rad, dtype=float) * (2 * math.pi / self.period_rad)

    def matrix(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """1 + lambda sum rho^(h-1) cos h (x - y) of every pair of positions (rad), shape (n, m)."""
        between = self.angle(x)[:, None] - self.angle(y)[None, :]
        total = np.ones(between.shape)
        # by the difference of places alone: the kernel is the same wherever the encoder has its zero
        for order, weight in enumerate(self.weights, 1):
            total += weight * np.cos(order * between)
        return total

    def product(self, v: np.ndarray, x: np.ndarray, u: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Kernel of every pair of (speed, position), shape (n, m)."""
        # a product: how far friction differs from place to place may change with speed
        value: np.ndarray = spline(v[:, None] / self.unit_rad_s, u[:, None] / self.unit_rad_s) * self.matrix(
            x, y
        )
        return value


@dataclass(frozen=True)
class PlaceTables:
    """What place adds to a curve of speed: `coefficients` (n, 2 H, 4) about `knots` (n,), cos and sin of each
    order in turn.

    The knots are those of the curve itself: both are splines with the same support vectors."""

    period_rad: float
    knots: np.ndarray
    coefficients: np.ndarray

    @property
    def orders(self) -> int:
        """Orders H."""
        return int(self.coefficients.shape[1] // 2)

    def waves(self, speed: np.ndarray) -> np.ndarray:
        """Amplitude of cos and sin of each order at each speed (n,), N m, shape (n, 2 H)."""
        columns = [PiecewiseCubic(self.knots, self.coefficients[:, i])(speed) for i in range(2 * self.orders)]
        return np.stack(columns, axis=-1) if columns else np.zeros((len(speed), 0))

    def __call__(self, speed: np.ndarray, position_rad: np.ndarray) -> np.ndarray:
        """What place adds at each speed (>= 0, rad/s) and position (rad), N m; arrays of one length."""
        angle = np.asarray(position_rad, dtype=float) * (2 * math.pi / self.period_rad)
        total: np.ndarray = (self.waves(np.asarray(speed, dtype=float)) * _basis(angle, self.orders)).sum(-1)
        return total

    def over_turn(self, speed: np.ndarray) -> np.ndarray:
        """What place adds at each speed (n,) and at `ANGLES` even places of a turn, N m, shape (n,
        ANGLES)."""
        angle = 2 * math.pi * np.arange(ANGLES) / ANGLES
        value: np.ndarray = self.waves(speed) @ _basis(angle, self.orders).T
        return value

    def steepest_nm_rad(self, speed: np.ndarray) -> float:
        """Bound of its slope over position at any of the speeds, N m/rad: 2 pi / period times sum of h
        |amplitude|."""
        waves = self.waves(speed)
        # a wave of order h is nowhere steeper than h times its size, wherever the waves stand to each other
        sizes = np.hypot(waves[:, 0::2], waves[:, 1::2])
        if not self.orders:
            return 0.0
        return float((sizes @ np.arange(1, self.orders + 1)).max()) * 2 * math.pi / self.period_rad


def _basis(angle: np.ndarray, orders: int) -> np.ndarray:
    """Cos and sin of each order in turn, shape (n, 2 H)."""
    h = angle[..., None] * np.arange(1, orders + 1)
    value: np.ndarray = np.stack([np.cos(h), np.sin(h)], axis=-1).reshape(*np.shape(angle), 2 * orders)
    return value


def compile_place(
    kernel: PlaceKernel, speeds: np.ndarray, positions: np.ndarray, dual_coef: np.ndarray
) -> PlaceTables:
    """The part of a product-kernel regression that place makes; the rest is `compile_spline` of the same
    duals.

    Parameters
    ----------
    speeds, positions, dual_coef : ndarray, shape (n,)
        Support vectors (rad/s, >= 0; rad) and beta.

    Raises
    ------
    ValueError
        Shapes that differ, values that are not finite, more than `PLACE_SEGMENTS` different speeds or
        `PLACE_ORDERS` orders."""
    x = np.asarray(positions, dtype=float)
    if x.shape != np.shape(speeds) or not np.isfinite(x).all():
        raise ValueError(f"positions {x.shape} and speeds {np.shape(speeds)} must be equally long and finite")
    knots = np.unique(np.append(speeds, 0.0))  # as `compile_spline` has them: the law walks both by one index
    if len(knots) > PLACE_SEGMENTS or kernel.orders > PLACE_ORDERS:
        raise ValueError(
            f"{len(knots)} speeds and {kernel.orders} orders, at most {PLACE_SEGMENTS} and {PLACE_ORDERS}: "
            "average the points by speed"
        )
    # a cos and a sin of each order
    # cos h (a - a_i) parted into the place of a look and that of the point, which goes into the dual
    turned = _basis(kernel.angle(x), kernel.orders) * np.repeat(kernel.weights, 2)
    tables = [
        # without intercept: that is the curve's alone
        compile_spline(speeds, dual_coef * turned[:, i], 0.0, kernel.unit_rad_s)
        for i in range(2 * kernel.orders)
    ]
    coefficients = (
        np.stack([one.coefficients for one in tables], axis=1) if tables else np.zeros((len(knots), 0, 4))
    )
    return PlaceTables(kernel.period_rad, knots, coefficients)
