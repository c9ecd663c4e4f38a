"""Train one candidate of the ladder: a support-vector machine with a given kernel matrix, or a formula.

Few points are trained by scikit-learn (imported when a fit runs), many, and what it gives up, by an
interior-point method (`interior`)."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from rtctl.friction.kind_curve import Curve
from rtctl.friction.kind_table import FORMULAS, MEAN
from rtctl.friction.learn import interior
from rtctl.friction.learn.formulas import fit_formula
from rtctl.friction.learn.gram import FINE, Gram, pivoted

if TYPE_CHECKING:
    from sklearn.svm import SVR, NuSVR

MAX_ITERATIONS = 300_000
"""Solver iterations of one fit, about .3 s; the useful corner of the grids needs a tenth."""

_TOLERANCE_SHARE = 3e-5
"""Solver tolerance, share of the largest friction: 1e-5 N m, a hundredth of the noise of a point."""


@dataclass(frozen=True)
class Candidate:
    """One rung and its hyper-parameters.

    `machine` is "formula", "epsilon", "nu" or "mean"; `tube` the half width epsilon (N m) or nu; `parameters`
    the kernel's (`sigma_rad_s`, `degree`); `parts` the candidates of a mean, each with its share."""

    machine: str
    kind: str
    c: float = 0.0
    tube: float = 0.0
    parameters: Mapping[str, float] = field(default_factory=dict)
    parts: tuple[tuple[float, Candidate], ...] = ()

    @classmethod
    def mean(cls, parts: Sequence[tuple[float, Candidate]]) -> Candidate:
        """Make the mean of several, each with its share; the shares are 1 together."""
        return cls(MEAN.name, MEAN.name, parts=tuple(parts))

    @property
    def family(self) -> str:
        """Rung of the ladder: `coulomb`, `epsilon-rbf`, `nu-spline`..."""
        return self.kind if self.machine in ("formula", MEAN.name) else f"{self.machine}-{self.kind}"


class FailedFitError(Exception):
    """A fit that gave no usable solution; `reason` is "not finite", "not converged", "refused", or "not
    fitted" and why."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


@dataclass(frozen=True)
class Trained:
    """A trained curve and the half width of its tube, N m (found by the machine for nu, 0 for a formula).

    `weights` (r,) are those of the columns of the factor it was trained by: factor @ weights + intercept is
    the curve at any row of it."""

    curve: Curve
    epsilon_nm: float
    converged: bool
    weights: np.ndarray | None = None


def train(
    candidate: Candidate,
    speed: np.ndarray,
    friction_nm: np.ndarray,
    weight: np.ndarray,
    *,
    gram: Gram | None = None,
    max_iterations: int = MAX_ITERATIONS,
    tolerance_nm: float | None = None,
) -> Trained:
    """Train a candidate on one direction.

    Parameters
    ----------
    speed, friction_nm, weight : ndarray, shape (n,)
        |v| (rad/s), friction magnitude (N m), weight of each point.
    gram, tolerance_nm
        Kernel matrix of `speed`, when it is at hand; of the solver, N m, default `_TOLERANCE_SHARE` of the
        largest friction.

    Raises
    ------
    FailedFitError
        A solution that is not finite, as scikit-learn's NuSVR may return or refuse itself; a formula whose
        solver gave up.
    UnidentifiableError
        A formula with as many parameters as points."""
    if candidate.parts:
        parts = [
            (share, train(part, speed, friction_nm, weight, max_iterations=max_iterations))
            for share, part in candidate.parts
        ]
        curve = Curve.mean([(share, one.curve) for share, one in parts])
        return Trained(curve, 0.0, all(one.converged for _, one in parts))
    if candidate.kind in FORMULAS:
        return _formula(candidate.kind, speed, friction_nm, weight)
    if gram is None:
        gram = Gram.of(candidate.kind, candidate.parameters, speed)
    if tolerance_nm is None:
        tolerance_nm = _TOLERANCE_SHARE * float(friction_nm.max())
    # few points: LIBSVM, which gives the very same models as ever (decision 0032)
    if gram.factor is None:
        found = _by_libsvm(candidate, speed, friction_nm, weight, gram, tolerance_nm, max_iterations)
        # early rounds of a search stop early on purpose, and are content with where it is
        if found is not None and (found.converged or max_iterations < MAX_ITERATIONS):
            return found
        assert gram.matrix is not None
        # what LIBSVM gives up has an optimum all the same
        gram = Gram(gram.matrix, pivoted(gram.matrix, FINE))
    return _by_factor(candidate, speed, friction_nm, weight, gram, tolerance_nm)


def _by_libsvm(
    candidate: Candidate,
    speed: np.ndarray,
    friction_nm: np.ndarray,
    weight: np.ndarray,
    gram: Gram,
    tolerance_nm: float,
    max_iterations: int,
) -> Trained | None:
    """Train by scikit-learn; None where that has no finite solution."""
    from sklearn import config_context

    machine = _machine(candidate, tolerance_nm, max_iterations)
    with config_context(skip_parameter_validation=True), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the iteration limit: reported as `converged`
        try:
            machine.fit(gram.matrix, friction_nm, sample_weight=weight)
        except ValueError:  # scikit-learn: "the dual coefficients or intercepts are not finite"
            return None
    # finite numbers are asked for once more: not every version of scikit-learn refuses others itself
    beta, intercept = machine.dual_coef_[0], float(machine.intercept_[0])
    if not (np.isfinite(beta).all() and np.isfinite(intercept)):
        return None
    curve = Curve(candidate.kind, candidate.parameters, speed[machine.support_], beta, intercept)
    if candidate.machine == "epsilon":
        epsilon_nm = candidate.tube
    else:
        epsilon_nm = _tube(machine, candidate.c, weight, curve(speed) - friction_nm)
    converged = machine.fit_status_ == 0 and int(np.max(machine.n_iter_)) < max_iterations
    return Trained(curve, epsilon_nm, converged)


def _formula(kind: str, speed: np.ndarray, friction_nm: np.ndarray, weight: np.ndarray) -> Trained:
    try:
        return Trained(fit_formula(kind, speed, friction_nm, weight).curve, 0.0, converged=True)
    except (ValueError, RuntimeError) as error:  # of scipy's solvers; numpy's LinAlgError is a ValueError
        raise FailedFitError(f"not fitted ({error})") from error


def _by_factor(
    candidate: Candidate,
    speed: np.ndarray,
    friction_nm: np.ndarray,
    weight: np.ndarray,
    gram: Gram,
    tolerance_nm: float,
) -> Trained:
    """Train by the factor of the kernel matrix; where the whole matrix is there, the sum of kernels is held
    to it, and a finer factor taken if need be."""
    assert gram.factor is not None
    factor, bound = gram.factor, candidate.c * weight
    while True:
        tube = {"nu": candidate.tube} if candidate.machine == "nu" else {"epsilon_nm": candidate.tube}
        found = interior.solve(factor, friction_nm, bound, **tube, tolerance_nm=tolerance_nm)
        # r numbers that predict any row of the factor: held-out points then cost the rank, not the support
        # vectors
        weights = factor.T @ found.beta
        if gram.matrix is None or np.abs(gram.matrix @ found.beta - factor @ weights).max() <= tolerance_nm:
            break
        # finer once already: what it still misses is of the kernel's rounding
        if factor is not gram.factor:
            found = replace(found, converged=False)
            break
        factor = pivoted(gram.matrix, FINE)
    if not (np.isfinite(found.beta).all() and np.isfinite(found.intercept)):
        raise FailedFitError("not finite")
    # the others are inside the tube: a file of them would be as long as the points
    at = np.flatnonzero(found.beta)
    curve = Curve(candidate.kind, candidate.parameters, speed[at], found.beta[at], found.intercept)
    return Trained(curve, found.epsilon_nm, found.converged, weights)


def _machine(candidate: Candidate, tolerance_nm: float, max_iterations: int) -> SVR | NuSVR:
    from sklearn.svm import SVR, NuSVR

    same = {"kernel": "precomputed", "C": candidate.c, "tol": tolerance_nm, "max_iter": max_iterations}
    if candidate.machine == "nu":
        return NuSVR(nu=candidate.tube, **same)
    return SVR(epsilon=candidate.tube, **same)


def _tube(machine: SVR | NuSVR, c: float, weight: np.ndarray, residual: np.ndarray) -> float:
    """Half width of the tube a nu-SVR found, N m: its free support vectors lie on the edge."""
    at = machine.support_
    size = np.abs(residual[at])
    free = np.abs(machine.dual_coef_[0]) < c * weight[at] * (1 - 1e-9)  # the others are at C but for rounding
    # the median: each of them lies on the edge but for the tolerance of the solver
    if free.any():
        return float(np.median(size[free]))
    return float(size.min(initial=0.0))
