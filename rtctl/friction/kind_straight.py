"""Formulas without a Stribeck peak: F_c, and F_c + b v (docs/theory.md 8.1)."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from rtctl.friction.kind import Formula, Parameter
from rtctl.friction.kind_cubic import PiecewiseCubic

if TYPE_CHECKING:
    from rtctl.friction.kind_curve import Curve

COULOMB_NM, VISCOUS = Parameter("coulomb_nm"), Parameter("viscous_nms_rad")


class Coulomb(Formula):
    """A constant."""

    name = "coulomb"
    what = "constant: F_c"
    parameters: ClassVar[tuple[Parameter, ...]] = (COULOMB_NM,)

    def exact(self, c: Curve) -> PiecewiseCubic:
        """See `Kind`."""
        at_0 = np.zeros(1)
        # by value and slope: alike for the constant, which has no parameter for a slope
        c0, c1 = float(c(at_0)[0]), float(c.derivative(at_0, 1)[0])
        return PiecewiseCubic(np.zeros(1), np.array([[c0, c1, 0.0, 0.0]]))


class CoulombViscous(Coulomb):
    """A constant and a slope."""

    name = "coulomb_viscous"
    what = "constant and slope: F_c + b v"
    parameters = (COULOMB_NM, VISCOUS)
