"""Fits that fail: a solver that gives up, formulas nobody can identify, curves that cannot be compiled; each
is survived and said.
"""

from dataclasses import replace

import numpy as np
import pytest
import sklearn.svm
from stribeck_points import V, options, points, stribeck

from rtctl.errors import ModelError
from rtctl.friction.kind_table import FORMULAS, KERNELS
from rtctl.friction.learn import fit, ladder, machines, search
from rtctl.friction.learn.machines import Candidate, FailedFitError, train


@pytest.fixture
def broken_nu(monkeypatch):
    """NuSVR that fails as scikit-learn's does now and then: by ValueError, or by NaN coefficients."""
    real = sklearn.svm.NuSVR

    class Broken(real):
        def fit(self, *arguments, **more):
            if self.nu == 0.1:
                msg = "The dual coefficients or intercepts are not finite."
                raise ValueError(msg)
            super().fit(*arguments, **more)
            if self.nu == 0.2:
                self.intercept_ = np.array([np.nan])
            return self

    monkeypatch.setattr(sklearn.svm, "NuSVR", Broken)


@pytest.fixture
def nobody_else(monkeypatch):
    """No other method ends what scikit-learn gives up."""

    def gives_up(*_):
        raise FailedFitError("not finite")

    monkeypatch.setattr(machines, "_by_factor", gives_up)


def test_a_non_finite_solution_is_found_by_another_method(broken_nu):
    data = search.side(points(), 1)
    for nu in (0.1, 0.2):
        found = train(Candidate("nu", "spline", 10.0, nu), data.speed, data.friction_nm, data.weight)
        assert found.converged
        assert np.sqrt(np.mean((found.curve(data.speed) - data.friction_nm) ** 2)) < 0.02


def test_a_non_finite_solution_is_a_failed_fit(broken_nu, nobody_else):
    data = search.side(points(), 1)
    for nu in (0.1, 0.2):
        with pytest.raises(FailedFitError, match="not finite"):
            train(Candidate("nu", "spline", 10.0, nu), data.speed, data.friction_nm, data.weight)


@pytest.mark.parametrize("strategy", ["full", "halving"])
def test_a_non_finite_nusvr_inside_a_search_is_survived_and_counted(broken_nu, nobody_else, strategy):
    found = ladder.ascend(points(), options(families=("nu-spline",), strategy=strategy, symmetric="no"))
    rung = found.choice.chosen
    assert rung.failures["not finite"] >= 2 * 2 * len(KERNELS["spline"].c_shares)  # two nus, two directions
    assert all(score.candidate.tube not in (0.1, 0.2) for score in rung.scores)
    assert np.isfinite(rung.rmse_nm)


def test_an_unidentifiable_formula_is_refused_by_name_and_not_chosen():
    straight = points(forward=lambda v: 0.25 + 0.05 * v, backward=lambda v: 0.3 + 0.05 * v)
    found = ladder.ascend(straight, options(families=tuple(FORMULAS), symmetric="no"))
    by_name = {rung.family: rung for rung in found.choice.rungs}
    for family in ("tustin", "gaussian", "lorentzian"):
        assert by_name[family].refused
        assert by_name[family].rmse_nm == np.inf
    assert found.choice.chosen.family == "coulomb_viscous"


@pytest.fixture
def no_table_of_gaussian(monkeypatch):
    """The table of a Gaussian cannot be made; every other curve compiles."""
    compile_curve = fit.compile_curve

    def broken(curve, speed_max):
        if curve.kind == "gaussian":
            raise ModelError(
                "a table of gaussian needs more than 1024 cells: stribeck_rad_s = 0.1 is too small"
            )
        return compile_curve(curve, speed_max)

    monkeypatch.setattr(fit, "compile_curve", broken)


@pytest.mark.parametrize("symmetric", ["auto", "yes", "no"])
def test_a_rung_that_cannot_be_compiled_is_passed_over_and_says_why(no_table_of_gaussian, symmetric):
    found = ladder.ascend(points(), options(families=tuple(FORMULAS), symmetric=symmetric, mean=False))
    by_name = {rung.family: rung for rung in found.choice.rungs}
    assert len(by_name) == len(FORMULAS)
    assert by_name["gaussian"].refused.startswith("direction +1: a table of gaussian needs")
    assert by_name["gaussian"].rmse_nm == np.inf
    assert found.choice.chosen.family in ("lorentzian", "tustin")
    assert ladder.learn(points(), found, rig="mock").kind == found.choice.chosen.family


def test_a_curve_that_is_nowhere_near_positive_is_passed_over_too():
    rise = points(
        forward=lambda v: 0.004 + 0.3 * v**3, backward=lambda v: 0.004 + 0.3 * v**3, noise=1e-4, v=V[V > 0.05]
    )
    found = ladder.ascend(rise, options(families=("coulomb", "epsilon-spline"), tolerance_share=0.0))
    by_name = {rung.family: rung for rung in found.choice.rungs}
    assert "not positive" in (by_name["epsilon-spline"].refused or "")
    assert found.choice.chosen.family == "coulomb"


def test_a_symmetric_curve_that_cannot_be_compiled_leaves_one_curve_per_direction(monkeypatch):
    usable = ladder._usable

    def no_pooled(rung, data, sides):
        pooled = [side.direction for side in sides] == [0]
        return replace(rung, refused="too fine") if pooled else usable(rung, data, sides)

    monkeypatch.setattr(ladder, "_usable", no_pooled)
    same = points(backward=stribeck)
    found = ladder.ascend(same, options(families=("gaussian",)))
    assert not found.symmetric
    assert "one symmetric curve could not be learned (too fine)" in found.explanation
    assert ladder.learn(same, found, rig="mock").kind == "gaussian"


def test_a_formula_whose_solver_gives_up_is_a_failed_fit(monkeypatch):
    def gives_up(*_):
        raise RuntimeError("Maximum number of iterations reached.")

    monkeypatch.setattr(machines, "fit_formula", gives_up)
    score = search.cross_validate(Candidate("formula", "tustin"), search.side(points(), 1))
    assert score.failed == "not fitted (Maximum number of iterations reached.)"


def test_a_curve_no_formula_has_is_left_to_a_machine():
    bumpy = points(
        forward=lambda v: 0.3 + 0.05 * np.sin(4 * v),
        backward=lambda v: 0.3 + 0.05 * np.sin(4 * v),
        noise=1e-3,
    )
    found = ladder.ascend(bumpy, options(families=(*FORMULAS, "epsilon-spline")))
    assert found.choice.chosen.family == "epsilon-spline"
    assert "No parametric model is as good" in found.explanation
