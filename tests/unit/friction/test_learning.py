"""Learning a model from points: accuracy, sparsity, reported figures, refusals."""

from dataclasses import replace

import numpy as np
import pytest

from rtctl.errors import DataError
from rtctl.friction import artefact
from rtctl.friction.learn import fit
from rtctl.friction.points import FrictionPoints

V = np.concatenate([[0.0], np.geomspace(0.01, 3, 53)])


def friction(v):
    return 0.25 + 0.1 * np.exp(-((v / 0.1) ** 2)) + 0.05 * v


def points(seed=5, noise=0.004, forward=friction, backward=lambda v: 1.1 * friction(v)):
    rng = np.random.default_rng(seed)
    rows = [
        (sign * v, curve(v) + rng.normal(0, noise), sign, np.nan, np.nan)
        for sign, curve in ((1, forward), (-1, backward))
        for v in V
    ]
    return FrictionPoints.from_rows(rows, "points.csv", "0" * 64)


def test_the_learned_curves_follow_the_truth_with_few_support_vectors():
    model = fit.fit_points(points(), rig="mock")
    v = np.linspace(0, 3, 1000)
    assert np.abs(model.magnitude(v) - friction(v)).max() < 0.012
    assert np.abs(model.magnitude(-v[1:]) - 1.1 * friction(v[1:])).max() < 0.012
    for branch in model.branches:
        assert 4 <= len(branch.support_vectors) <= 25  # theory: 9 to 12 of 54 at this noise
        assert branch.n_points == 54
        assert fit.compile_error_nm(branch) <= branch.rounding_bound_nm


def test_a_linear_axis_is_learned_as_well_as_the_joint_whose_handle_it_would_be():
    lever_m, joint = 0.1, points()
    v, f = joint.velocity_rad_s * lever_m, joint.friction_nm / lever_m
    rows = [(*pair, way, np.nan, np.nan) for *pair, way in zip(v, f, joint.direction, strict=True)]
    rail = replace(FrictionPoints.from_rows(rows, "points.csv", "0" * 64), motion="linear")
    model = fit.fit_points(rail, rig="slide", epsilon_nm=fit.EPSILON_NM / lever_m)
    v = np.linspace(0, 3, 1000)
    assert np.abs(lever_m * model.magnitude(lever_m * v) - friction(v)).max() < 0.012


def test_reported_errors_are_those_of_the_curve():
    measured = points()
    for sign, branch in zip((1, -1), fit.fit_points(measured, rig="mock").branches, strict=True):
        speed, value = measured.branch(sign)
        error = np.abs(branch.magnitude(speed) - value)
        assert branch.train_mean_error_nm == pytest.approx(error.mean())
        assert branch.train_max_error_nm == pytest.approx(error.max())
        assert branch.train_rmse_nm == pytest.approx(np.sqrt(np.mean(error**2)))


def test_dry_friction_and_viscous_slope_are_recovered():
    model = fit.fit_points(points(noise=0.001), rig="mock", c=1e3)
    forward, backward = model.branches
    assert forward.viscous_nms_rad == pytest.approx(0.05, rel=0.05)
    assert backward.viscous_nms_rad == pytest.approx(0.055, rel=0.05)
    v = np.linspace(0, 3, 30001)
    dry = forward.magnitude(v) - forward.viscous_nms_rad * v
    assert forward.friction_min_nm == pytest.approx(dry.min(), abs=1e-6)
    assert forward.friction_min_nm <= dry.min()
    assert forward.friction_min_nm == pytest.approx(0.25, abs=0.01)


def test_few_speeds_in_the_upper_half_leave_the_viscous_slope_right():
    """24 speeds over a range of 400 have three there: the slope of all was that of the Stribeck peak, 6 % of
    the true one.
    """
    v = np.geomspace(0.005, 2.0, 24)
    f = 0.22 + 0.08 * np.exp(-((v / 0.05) ** 2)) + 0.12 * v
    assert np.sum(v >= 0.5 * v.max()) == 3
    assert fit.viscous_slope(v, f) == pytest.approx(0.12, rel=1e-6)


def test_the_viscous_slope_ignores_an_outlier_and_is_never_negative():
    v = np.linspace(0, 2, 41)
    f = 0.2 + 0.05 * v
    f[-2] += 1.0
    assert fit.viscous_slope(v, f) == pytest.approx(0.05, rel=1e-6)
    assert fit.viscous_slope(v, 0.5 - 0.05 * v) == 0.0


def test_repeats_at_one_speed_are_held_out_together():
    # two clusters of repeats disagree with a smooth curve: held-out error must show it, not a twin's help
    speed = np.repeat(np.linspace(0.1, 1.0, 10), 3)
    friction_nm = np.where(np.isclose(speed, 0.5), 0.5, 0.3) + 0.001 * np.tile([0, 1, 2], 10)
    errors = np.abs(fit.validation_errors(speed, friction_nm, 1e4, 0.001))
    assert errors.max() > 0.15
    assert len(errors) == 24  # 10 speeds, the two ends always train


def test_a_given_c_and_epsilon_are_used_and_recorded():
    model = fit.fit_points(points(), rig="mock", c=50.0, epsilon_nm=0.008)
    for branch in model.branches:
        assert branch.hyper_parameters == {"C": 50.0, "epsilon_nm": 0.008}
        assert np.abs(branch.dual_coef).max() <= 50.0 + 1e-9


def test_learning_twice_gives_the_same_model():
    first, second = (fit.fit_points(points(), rig="mock") for _ in range(2))
    assert np.array_equal(first.self_test, second.self_test)
    assert np.array_equal(first.record(), second.record())


def test_points_within_the_tube_give_a_constant_that_can_be_saved_and_read(tmp_path):
    coulomb = points(noise=0.001, forward=lambda v: 0.25 + 0 * v, backward=lambda v: 0.3 + 0 * v)
    model = fit.fit_points(coulomb, rig="mock")
    assert [len(branch.support_vectors) for branch in model.branches] == [0, 0]
    artefact.save(model, tmp_path / "m.json")
    again = artefact.load(tmp_path / "m.json")
    assert again.magnitude([1.0, -1.0]) == pytest.approx([0.25, 0.3], abs=0.003)
    assert again.record()["n_segments"].tolist() == [[1, 1]]


def test_a_curve_that_is_not_positive_is_refused():
    falling = points(noise=0.0, forward=lambda v: np.maximum(0.3 - 0.3 * v, 1e-9) + 1e-3 * (v > 2))
    with pytest.raises(DataError, match="not positive"):
        fit.fit_points(falling, rig="mock", epsilon_nm=0.02, c=1e3)
