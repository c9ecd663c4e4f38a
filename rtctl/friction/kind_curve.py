"""Friction curves as learned, before compilation: values and derivatives of any order.

A curve is a function of v = |velocity|, rad/s, v >= 0, in N m. What its numbers mean its kind knows
(`kind_table.KINDS`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rtctl.friction.kind import Kind
from rtctl.friction.kind_cubic import PiecewiseCubic
from rtctl.friction.kind_table import KINDS, MEAN


@dataclass(frozen=True)
class Curve:
    """One learned curve.

    `parameters` are the numbers of a formula (`coulomb_nm`, `breakaway_nm`, `stribeck_rad_s`,
    `viscous_nms_rad`) or of a kernel (`sigma_rad_s`, `degree`); the other fields are empty for a formula.
    `parts` are those of a mean, each with its share, 0 to 1, all together 1; a mean has nothing else."""

    kind: str
    parameters: Mapping[str, float]
    support_vectors: np.ndarray
    dual_coef: np.ndarray
    intercept: float
    parts: tuple[tuple[float, Curve], ...] = ()

    @classmethod
    def formula(cls, kind: str, parameters: Mapping[str, float]) -> Curve:
        """Make a curve of a closed formula."""
        return cls(kind, parameters, np.zeros(0), np.zeros(0), 0.0)

    @classmethod
    def mean(cls, parts: Sequence[tuple[float, Curve]]) -> Curve:
        """Make the mean of curves, each with its share."""
        return cls(MEAN.name, {}, np.zeros(0), np.zeros(0), 0.0, tuple(parts))

    @property
    def of(self) -> Kind:
        """What the curve is."""
        return KINDS[self.kind]

    @property
    def n_terms(self) -> int:
        """Support vectors of a kernel sum, parameters of a formula, of a mean those of its parts: what a
        choice counts."""
        if self.parts:
            return sum(part.n_terms for _, part in self.parts)
        return len(self.parameters) if self.of.is_formula else len(self.support_vectors)

    @property
    def n_support_vectors(self) -> int:
        """Support vectors, of a mean those of all its parts; none of a formula."""
        return len(self.support_vectors) + sum(part.n_support_vectors for _, part in self.parts)

    @property
    def exact(self) -> PiecewiseCubic | None:
        """The piecewise cubic that is this very curve; None where only a table comes near."""
        return self.of.exact(self)

    def __call__(self, speed: np.ndarray) -> np.ndarray:
        """Value at each speed >= 0, N m; NaN for NaN."""
        return self.of.value(self, np.asarray(speed, dtype=float))

    def derivative(self, speed: np.ndarray, order: int) -> np.ndarray:
        """Derivative of `order` (0: the value itself) at each speed, N m / (rad/s)^order."""
        return self.of.derivative(self, np.asarray(speed, dtype=float), order)

    def derivative_bound(self, order: int, from_speed: np.ndarray | float = 0.0) -> np.ndarray:
        """Bound of |derivative of `order` >= 2| over every speed >= each of `from_speed` (rad/s, >= 0);
        infinite without one.

        The peak of a formula dies out, and its bound with it (docs/theory.md 8.5); that of a kernel sum is
        the same everywhere."""
        return self.of.derivative_bound(self, order, np.asarray(from_speed, dtype=float))

    def rounding(self, speed_max: float) -> float:
        """Rounding of one evaluation as the definition says, N m, at most (docs/theory.md 8.4)."""
        return self.of.rounding(self, speed_max)
