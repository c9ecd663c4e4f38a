"""The curve that the loop evaluates: a piecewise cubic.

Segment j starts at knot_j and holds local coefficients (c0, c1, c2, c3) about it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np


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

    def derivative(self, speed: np.ndarray, order: int) -> np.ndarray:
        """Derivative of `order` (0: the value) at each speed >= 0, N m / (rad/s)^order; that of the segment
        above at a knot."""
        speed = np.asarray(speed, dtype=float)
        j = np.clip(np.searchsorted(self.knots, speed, side="right") - 1, 0, len(self.knots) - 1)
        h, c = speed - self.knots[j], self.coefficients
        for _ in range(order):
            c = np.pad(c[:, 1:] * np.arange(1, c.shape[1]), ((0, 0), (0, 1)))
        value: np.ndarray = np.polynomial.polynomial.polyval(h, np.moveaxis(c[j], -1, 0), tensor=False)
        return value

    def _pieces(self, speed_max: float) -> Iterator[tuple[float, float, np.ndarray]]:
        """Begin, end and coefficients of every piece below `speed_max`, the last one cut there."""
        ends = np.minimum(np.append(self.knots[1:], speed_max), speed_max)
        for start, end, c in zip(self.knots, ends, self.coefficients, strict=True):
            if start < speed_max:
                yield start, end, c

    def extreme_speeds(self, speed_max: float, slope: float = 0.0) -> np.ndarray:
        """Speeds in [0, speed_max] among which curve minus `slope` times speed is least and greatest.

        The knots, the end, and the roots of each cubic's derivative: exact, no grid."""
        # knots, too: a slope may jump there, and an extreme need be no root
        found = [*self.knots[self.knots <= speed_max], speed_max]
        for start, end, (_, c1, c2, c3) in self._pieces(speed_max):
            roots = np.roots(np.array([3 * c3, 2 * c2, c1 - slope]))  # drops leading zeros itself
            found += [start + r.real for r in roots if r.imag == 0 and 0 < r.real < end - start]
        return np.array(found)

    def least_slope(self, speed_max: float) -> float:
        """Least slope over 0..`speed_max`, N m s/rad: at an end of a piece, or where its curvature is
        zero."""
        starts, ends, coefficients = (np.array(each) for each in zip(*self._pieces(speed_max), strict=True))
        c1, c2, c3 = coefficients[:, 1:].T
        width = ends - starts
        # a slope without curvature of its own is least at an end
        vertex = np.divide(-c2, 3 * c3, out=np.zeros_like(c2), where=c3 != 0)
        places = np.stack([np.zeros_like(width), width, np.clip(vertex, 0, width)])
        return float(np.min(c1 + places * (2 * c2 + 3 * places * c3)))

    def least_secant(self, speed_max: float, loss: float) -> float:
        """Least (curve - `loss`)/v over 0 < v <= `speed_max`, N m s/rad; 0 where the difference is below 0.

        Notes
        -----
        Within a piece the secant is stationary where slope times speed is the value: a cubic in h."""
        places = [speed_max, *self.knots[(self.knots > 0) & (self.knots < speed_max)]]
        for start, end, (c0, c1, c2, c3) in self._pieces(speed_max):
            # (f - loss)' (start + h) = f - loss, multiplied out in h
            cubic = [2 * c3, 3 * c3 * start + c2, 2 * c2 * start, c1 * start - c0 + loss]
            roots = np.roots(np.array(cubic))
            # a double root comes out as a complex pair
            places += [start + r.real for r in roots if abs(r.imag) < 1e-9 and 0 < r.real < end - start]
        at = np.array(places)
        # friction never helps: less than nothing is nothing
        return float(np.min(np.maximum(self(at) - loss, 0.0) / at))
