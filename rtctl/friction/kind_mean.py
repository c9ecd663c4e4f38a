"""A weighted mean of curves of other kinds: what the ladder deploys where several rungs may be right
(docs/theory.md 8.7).

A sum of kinds of which each says all of itself: values, derivatives, bounds and rounding are those of the
parts, each by its weight. The law evaluates one compiled cubic, as of every other kind."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtctl.friction.kind import Kind

if TYPE_CHECKING:
    from rtctl.friction.kind_curve import Curve


class Mean(Kind):
    """The mean of `Curve.parts`; it has no numbers of its own."""

    name = "mean"
    what = "the mean of the rungs above, those that err least weighing most"

    def value(self, c: Curve, v: np.ndarray) -> np.ndarray:
        """See `Kind`."""
        return np.asarray(np.sum([share * part(v) for share, part in c.parts], axis=0))

    def derivative(self, c: Curve, v: np.ndarray, order: int) -> np.ndarray:
        """See `Kind`."""
        return np.asarray(np.sum([share * part.derivative(v, order) for share, part in c.parts], axis=0))

    def derivative_bound(self, c: Curve, order: int, v: np.ndarray) -> np.ndarray:
        """See `Kind`."""
        return np.asarray(
            np.sum([share * part.derivative_bound(order, v) for share, part in c.parts], axis=0)
        )

    def breaks(self, c: Curve) -> np.ndarray:
        """See `Kind`: those of the parts, and the knots of parts that are piecewise cubics themselves."""
        found = [np.zeros(0)]
        for _, part in c.parts:
            exact = part.exact
            # a cubic's third derivative jumps there
            found.append(part.of.breaks(part) if exact is None else exact.knots)
        return np.unique(np.concatenate(found))

    def rounding(self, c: Curve, speed_max: float) -> float:
        """See `Kind`."""
        # of adding them
        return float(sum(share * part.rounding(speed_max) for share, part in c.parts)) + 1e-12

    def too_fine(self, c: Curve, speed_max: float) -> str:
        """See `Kind`."""
        return "its parts bend at different speeds; take one rung alone (--no-mean)"
