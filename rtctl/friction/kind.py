"""What a kind of friction curve must say of itself: value, derivatives, proved bound, compilation,
parameters, grid, document.

Everything else (ladder, fit, compiler, report, model file, documents) asks a kind through this interface and
knows no kind by name: a new one is a file of this folder and a row of `kind_table`.

| symbol | meaning |
|---|---|
| v | speed, abs(velocity), rad/s, >= 0; arrays of any shape |
| v_i, beta_i, b | support vectors (rad/s), dual coefficients and intercept (N m) of a sum of kernels |
| c | the curve: `kind_curve.Curve`, the numbers that were learned |"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from rtctl.friction.kind_cubic import PiecewiseCubic

if TYPE_CHECKING:
    from rtctl.friction.kind_curve import Curve


@dataclass(frozen=True)
class Parameter:
    """One number of a kind: its name with the unit, whether it must be above 0, or a whole number from 1 to
    `whole_to`.

    An `optional` one may be missing; what it is then, its kind says."""

    name: str
    positive: bool = False
    whole_to: int = 0
    optional: bool = False

    def refusal(self, value: float) -> str:
        """Why a model file may not hold this value, "" when it may."""
        if self.whole_to and not (1 <= value <= self.whole_to and value == round(value)):
            return f"{self.name} {value:g} is not a whole number from 1 to {self.whole_to}"
        return f"{self.name} must be above 0" if self.positive and not value > 0 else ""


class Kind(ABC):
    """One kind of curve. Kinds hold no numbers; those are in the curve that every method is given."""

    name: ClassVar[str]
    what: ClassVar[str]
    """The curve in words or a formula, for docs/ladder.md."""
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    is_formula: ClassVar[bool] = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in their order."""
        return tuple(parameter.name for parameter in self.parameters)

    def has_parameters(self, names: Collection[str]) -> bool:
        """Whether a curve may have these parameters: all but the optional ones, and no other."""
        # a file of before an optional parameter came is as good as it was
        needed = {one.name for one in self.parameters if not one.optional}
        return needed <= set(names) <= set(self.names)

    @abstractmethod
    def value(self, c: Curve, v: np.ndarray) -> np.ndarray:
        """Friction at each speed, N m; NaN for NaN."""

    @abstractmethod
    def derivative(self, c: Curve, v: np.ndarray, order: int) -> np.ndarray:
        """Derivative of `order` (0: the value) at each speed, N m / (rad/s)^order. A kind that is always
        `exact` needs none."""

    @abstractmethod
    def derivative_bound(self, c: Curve, order: int, v: np.ndarray) -> np.ndarray:
        """Bound of abs(derivative of `order` >= 2) over every speed >= each of `v`, `breaks` apart; infinite
        without one."""

    def breaks(self, c: Curve) -> np.ndarray:
        """Speeds where some derivative jumps, rising: cells of a table end there, and bounds hold between
        them."""
        return np.zeros(0)

    def exact(self, c: Curve) -> PiecewiseCubic | None:
        """The piecewise cubic that is this very curve; None where only a table comes near."""
        return None

    def rounding(self, c: Curve, speed_max: float) -> float:
        """Rounding of one evaluation as the definition says, N m, at most (docs/theory.md 8.4)."""
        return 1e-12

    def exact_bound(self, c: Curve, speed_max: float) -> float:
        """Most that `exact` and the value as defined may differ, N m: both round."""
        return 2 * self.rounding(c, speed_max)

    def too_fine(self, c: Curve, speed_max: float) -> str:
        """Which parameter of the curve asks for too many cells of a table, and what to do."""
        # the smallest of its lengths is what cells have to resolve
        fine = min((p.name for p in self.parameters if p.positive), key=lambda name: c.parameters[name])
        what = f"{fine} = {c.parameters[fine]:.3g} is too small for a range of {speed_max:.3g} rad/s"
        other = "model" if self.is_formula else "kernel"
        return f"{what}; choose another {other}, or leave out the fastest points"


class Kernel(Kind):
    """A sum of kernels, learned by a support-vector machine: f(v) = sum beta_i k(v, v_i) + b.

    `c_shares` are the bounds C that the ladder tries, multiples of the largest friction; `tubes` which of its
    tubes."""

    c_shares: ClassVar[tuple[float, ...]]
    tubes: ClassVar[slice] = slice(None)
    any_unit: ClassVar[bool] = True
    """Whether it says the same of a motion in whatever unit its speed is given: only such a kernel serves a
    linear axis."""

    @abstractmethod
    def matrix(self, parameters: Mapping[str, float], u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Kernel of every pair of speeds `u` (n,) and `v` (m,), shape (n, m)."""

    def grid(self, speed_max: float) -> Sequence[Mapping[str, float]]:
        """Parameters that the ladder tries, in the scale of points up to `speed_max` rad/s."""
        return ({},)

    def value(self, c: Curve, v: np.ndarray) -> np.ndarray:
        """See `Kind`."""
        flat = self.matrix(c.parameters, np.ravel(v), c.support_vectors) @ c.dual_coef
        total: np.ndarray = np.reshape(flat, v.shape) + c.intercept
        return total

    def rounding(self, c: Curve, speed_max: float) -> float:
        """See `Kind`."""
        # no kernel here is larger between two speeds than at the largest one with itself
        top = np.array([max(speed_max, float(np.max(c.support_vectors, initial=0.0)))])
        largest = float(self.matrix(c.parameters, top, top)[0, 0])
        # 8 eps sum|beta| k(v_max, v_max) of docs/theory.md 8.4
        spacing = 8 * float(np.finfo(float).eps)
        # duals of 1e4 cancel to .1 N m: what rounds is their size, not that of the sum
        return max(1e-12, spacing * float(np.abs(c.dual_coef).sum()) * largest)


class Formula(Kind):
    """A closed formula F_c + b v + (F_s - F_c) shape(v/v_s), fitted by least squares
    (`rtctl.friction.learn.formulas`).

    Parameters come in the order F_c, b, F_s, v_s; a straight one has the first of them."""

    is_formula = True

    @property
    def is_straight(self) -> bool:
        """Whether the formula has no peak."""
        return "stribeck_rad_s" not in self.names

    def shape(self, y: np.ndarray, order: int = 0) -> np.ndarray:
        """Shape of the Stribeck peak, 1 at y = v/v_s = 0 and falling, or its derivative of `order`."""
        raise NotImplementedError(self.name)

    def shape_bound(self, y: np.ndarray, order: int) -> np.ndarray:
        """Bound of abs(derivative of `order`) of `shape` at y >= 0 and beyond: it falls with y."""
        raise NotImplementedError(self.name)

    def value(self, c: Curve, v: np.ndarray) -> np.ndarray:
        """See `Kind`."""
        return self.derivative(c, v, 0)

    def derivative(self, c: Curve, v: np.ndarray, order: int) -> np.ndarray:
        """See `Kind`."""
        p = c.parameters
        slope = p.get("viscous_nms_rad", 0.0)
        straight = p["coulomb_nm"] + slope * v if order == 0 else np.full(v.shape, slope * (order == 1))
        if self.is_straight:
            return straight
        scale = (p["breakaway_nm"] - p["coulomb_nm"]) / p["stribeck_rad_s"] ** order
        total: np.ndarray = straight + scale * self.shape(v / p["stribeck_rad_s"], order)
        return total

    def derivative_bound(self, c: Curve, order: int, v: np.ndarray) -> np.ndarray:
        """See `Kind`."""
        p = c.parameters
        if self.is_straight:
            return np.zeros(v.shape)
        peak = abs(p["breakaway_nm"] - p["coulomb_nm"]) / p["stribeck_rad_s"] ** order
        bound: np.ndarray = peak * self.shape_bound(v / p["stribeck_rad_s"], order)
        return bound
