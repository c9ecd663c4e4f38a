"""Every kind of friction curve, simplest first: the one list that ladder, fit, compiler, report, model file
and documents take theirs from."""

from __future__ import annotations

from rtctl.friction.kind import Formula, Kernel, Kind
from rtctl.friction.kind_mean import Mean
from rtctl.friction.kind_polynomial import Polynomial
from rtctl.friction.kind_rbf import Rbf
from rtctl.friction.kind_spline import Spline
from rtctl.friction.kind_straight import Coulomb, CoulombViscous
from rtctl.friction.kind_stribeck import Gaussian, Lorentzian, Tustin

FORMULAS: dict[str, Formula] = {
    kind.name: kind for kind in (Coulomb(), CoulombViscous(), Tustin(), Gaussian(), Lorentzian())
}
"""Closed formulas, by name."""

KERNELS: dict[str, Kernel] = {kind.name: kind for kind in (Spline(), Rbf(), Polynomial())}
"""Sums of kernels, by name."""

MEAN = Mean()
"""The mean of several of them."""

KINDS: dict[str, Kind] = {**FORMULAS, **KERNELS, MEAN.name: MEAN}

MACHINES = ("epsilon", "nu")
"""Support-vector machines that learn a sum of kernels."""

FAMILIES = (*FORMULAS, *(f"{machine}-{kernel}" for kernel in KERNELS for machine in MACHINES))
"""Rungs of the ladder that are searched; the mean is made of them."""


def is_machine(family: str) -> bool:
    """Whether a rung is a support-vector machine: neither a formula nor the mean."""
    return family in FAMILIES and family not in FORMULAS
