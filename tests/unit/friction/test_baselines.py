"""Classical formulas: what was put in comes out, within its error, and what cannot be told is refused."""

import numpy as np
import pytest

from rtctl.errors import DataError, UnidentifiableError
from rtctl.friction.kind_curve import Curve
from rtctl.friction.kind_table import FORMULAS
from rtctl.friction.learn.formulas import (
    fit_formula,
    is_bend,
    require_identifiable,
    require_told,
    says_little_of_rest,
)

TRUE = {"coulomb_nm": 0.25, "viscous_nms_rad": 0.05, "breakaway_nm": 0.35, "stribeck_rad_s": 0.1}
V = np.concatenate([[0.0], np.geomspace(0.005, 2, 54)])


def noisy(curve, v, seed, noise=0.002):
    return curve(v) + np.random.default_rng(seed).normal(0, noise, len(v))


@pytest.mark.parametrize("kind", ["tustin", "gaussian", "lorentzian"])
def test_a_formula_without_noise_is_found_exactly(kind):
    found = fit_formula(kind, V, Curve.formula(kind, TRUE)(V)).curve.parameters
    for name, value in TRUE.items():
        assert found[name] == pytest.approx(value, rel=1e-5)


@pytest.mark.parametrize("kind", ["tustin", "gaussian", "lorentzian"])
def test_the_standard_errors_are_honest(kind):
    curve = Curve.formula(kind, TRUE)
    z = []
    for seed in range(40):
        fit = fit_formula(kind, V, noisy(curve, V, seed))
        require_identifiable(fit, V)
        z += [(fit.curve.parameters[n] - TRUE[n]) / fit.standard_error[n] for n in TRUE]
    assert 0.85 < np.std(z) < 1.15
    assert np.mean(np.abs(z) < 1.96) > 0.9


def test_the_standard_error_of_a_mean_is_the_textbooks():
    rng = np.random.default_rng(1)
    f = 0.3 + rng.normal(0, 0.01, 50)
    fit = fit_formula("coulomb", np.linspace(0.1, 1, 50), f)
    assert fit.curve.parameters["coulomb_nm"] == pytest.approx(f.mean())
    assert fit.standard_error["coulomb_nm"] == pytest.approx(f.std(ddof=1) / np.sqrt(50))


def test_a_break_away_below_coulomb_is_allowed():
    curve = Curve.formula("gaussian", {**TRUE, "breakaway_nm": 0.15})
    fit = fit_formula("gaussian", V, noisy(curve, V, 3))
    require_identifiable(fit, V)
    assert fit.curve.parameters["breakaway_nm"] == pytest.approx(0.15, abs=0.005)
    assert fit.peak_nm[0] < 0


def test_a_weight_counts_as_repeats():
    f = noisy(Curve.formula("coulomb_viscous", TRUE), V, 4)
    weight = np.ones(len(V))
    weight[0] = 3
    weighted = fit_formula("coulomb_viscous", V, f, weight).curve.parameters
    repeated = fit_formula("coulomb_viscous", np.r_[V, 0, 0], np.r_[f, f[0], f[0]]).curve.parameters
    assert weighted == pytest.approx(repeated)


def test_a_viscous_slope_below_zero_stays_at_its_bound():
    fit = fit_formula("coulomb_viscous", V, 0.5 - 0.1 * V)
    assert fit.curve.parameters["viscous_nms_rad"] == 0
    assert fit.standard_error["viscous_nms_rad"] == 0


@pytest.mark.parametrize("kind", ["tustin", "gaussian", "lorentzian"])
def test_points_measured_too_fast_for_the_peak_are_refused(kind):
    v = np.linspace(0.5, 2, 40)
    f = noisy(Curve.formula(kind, TRUE), v, 5)
    with pytest.raises(UnidentifiableError) as refused:
        require_identifiable(fit_formula(kind, v, f), v)
    assert refused.value.reason in {
        "no_points_below_stribeck_speed",
        "stribeck_speed_beyond_range",
        "peak_within_its_error",
    }


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("kind", ["tustin", "gaussian", "lorentzian"])
def test_a_peak_that_does_not_exist_is_not_reported(kind, seed):
    v = np.linspace(0.01, 2, 40)
    f = noisy(Curve.formula("coulomb_viscous", TRUE), v, seed)
    with pytest.raises(UnidentifiableError, match=kind):
        require_identifiable(fit_formula(kind, v, f), v)


@pytest.mark.parametrize("kind", ["tustin", "gaussian", "lorentzian"])
def test_a_bend_over_all_speeds_is_a_curve_but_no_peak(kind):
    v = np.linspace(0.02, 2, 40)
    bend = noisy(Curve.formula(kind, {**TRUE, "breakaway_nm": 0.8, "stribeck_rad_s": 1.6}), v, 3)
    fit = fit_formula(kind, v, bend)
    assert is_bend(fit, v)
    with pytest.raises(UnidentifiableError, match="not well below the fastest"):
        require_identifiable(fit, v)
    require_told(fit, v)
    straight = noisy(Curve.formula("coulomb_viscous", TRUE), v, 3)
    with pytest.raises(UnidentifiableError):
        require_told(fit_formula(kind, v, straight), v)


def test_a_peak_below_the_slowest_speeds_is_no_curve_either():
    v = np.linspace(0.3, 2, 40)
    fit = fit_formula(
        "gaussian", v, noisy(Curve.formula("gaussian", {**TRUE, "stribeck_rad_s": 0.2}), v, 1, 1e-4)
    )
    with pytest.raises(UnidentifiableError) as refused:
        require_told(fit, v)
    assert refused.value.reason == "no_points_below_stribeck_speed"


@pytest.mark.parametrize("kind", ["tustin", "gaussian", "lorentzian"])
def test_a_peak_below_the_slowest_speed_says_of_rest_little_more_than_was_seen(kind):
    """It said 100 times the friction of a joint whose peak was over at the slowest speed."""
    v = np.linspace(0.3, 2, 12)
    for seed in range(20):
        f = noisy(Curve.formula(kind, {**TRUE, "stribeck_rad_s": 0.08}), v, seed, 0.02)
        fit = fit_formula(kind, v, f)
        p = fit.curve.parameters
        seen = abs(fit.curve(v[:1])[0] - p["coulomb_nm"] - p["viscous_nms_rad"] * v[0])
        assert abs(fit.peak_nm[0]) <= 2.8 * seen + 1e-9
        assert says_little_of_rest(fit, v)


def test_where_rest_was_measured_a_peak_may_be_over_before_the_slowest_motion():
    v = np.append(0.0, np.linspace(0.3, 2, 12))
    fit = fit_formula("gaussian", v, Curve.formula("gaussian", {**TRUE, "stribeck_rad_s": 0.15})(v))
    assert fit.curve.parameters["stribeck_rad_s"] == pytest.approx(0.15, rel=0.01)
    assert not says_little_of_rest(fit, v)


def test_the_refusal_names_a_missing_slow_speed():
    v = np.geomspace(0.05, 2, 40)
    v = v[(v > 0.09) | (v < 0.051)]
    fit = fit_formula(
        "gaussian", v, noisy(Curve.formula("gaussian", {**TRUE, "stribeck_rad_s": 0.06}), v, 1, 1e-4)
    )
    with pytest.raises(UnidentifiableError, match="measure slower") as refused:
        require_identifiable(fit, v)
    assert refused.value.reason == "no_points_below_stribeck_speed"
    assert isinstance(refused.value, DataError)
    assert refused.value.exit_code == 10


@pytest.mark.parametrize("kind", FORMULAS)
def test_not_more_points_than_parameters_are_refused(kind):
    n = len(fit_formula(kind, V, 0.3 + 0 * V + 0.01 * V).curve.parameters)
    with pytest.raises(UnidentifiableError) as refused:
        fit_formula(kind, V[:n], np.linspace(0.3, 0.4, n))
    assert refused.value.reason == "too_few_points"


@pytest.mark.parametrize("kind", ["tustin", "gaussian", "lorentzian"])
def test_a_joint_that_only_creeps_is_fitted_all_the_same(kind):
    curve = Curve.formula(kind, {**TRUE, "stribeck_rad_s": 5e-4})
    v = V / 200  # up to .01 rad/s: the usual starts of v_s lie beyond ten times that
    assert fit_formula(kind, v, curve(v)).curve.parameters["stribeck_rad_s"] == pytest.approx(5e-4, rel=1e-4)
