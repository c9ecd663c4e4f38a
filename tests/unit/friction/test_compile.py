"""The compiled cubic is the regression: against scikit-learn's own predictions."""

import numpy as np
import pytest
from sklearn.svm import SVR, NuSVR

from rtctl.friction.kind_compile import compile_curve
from rtctl.friction.kind_curve import Curve
from rtctl.friction.kind_spline import compile_spline, spline


def _data():
    rng = np.random.default_rng(11)
    v = np.concatenate([[0.0], np.geomspace(0.01, 4, 53)])
    return v, 0.25 + 0.1 * np.exp(-((v / 0.1) ** 2)) + 0.05 * v + rng.normal(0, 0.004, len(v))


@pytest.mark.parametrize(
    "regression",
    [
        SVR(kernel=spline, C=10, epsilon=0.005),
        SVR(kernel=spline, C=1e3, epsilon=0.005),
        NuSVR(kernel=spline, C=100, nu=0.3),
    ],
    ids=["epsilon C=10", "epsilon C=1000", "nu C=100"],
)
def test_the_compiled_curve_equals_scikit_learn_on_40001_speeds(regression):
    v, f = _data()
    regression.fit(v[:, None], f)
    assert regression.support_vectors_.size == 0  # the trap: with a callable kernel they are not kept
    vectors, beta = v[regression.support_], regression.dual_coef_[0]
    curve = compile_spline(vectors, beta, regression.intercept_[0])
    speed = np.linspace(0, 4, 40001)
    error = np.abs(curve(speed) - regression.predict(speed[:, None])).max()
    assert error <= Curve("spline", {}, vectors, beta, 0.0).rounding(4.0)
    assert (
        np.abs(curve(speed) - Curve("spline", {}, vectors, beta, regression.intercept_[0])(speed)).max()
        <= error + 1e-11
    )
    assert error > 0 or len(vectors) < 3


def test_the_knots_are_the_support_vectors_and_zero():
    curve = compile_spline(np.array([1.0, 0.5]), np.array([2.0, -2.0]), 0.1)
    assert curve.knots.tolist() == [0.0, 0.5, 1.0]


def test_a_support_vector_at_zero_merges_into_the_first_segment():
    vectors, beta = np.array([0.0, 0.5, 1.5]), np.array([3.0, -4.0, 1.0])
    curve = compile_spline(vectors, beta, 0.2)
    speed = np.linspace(0, 3, 301)
    assert curve.knots.tolist() == [0.0, 0.5, 1.5]
    assert np.allclose(curve(speed), Curve("spline", {}, vectors, beta, 0.2)(speed), atol=1e-12)


def test_equal_support_vectors_are_merged():
    vectors, beta = np.array([0.5, 0.5, 1.5]), np.array([3.0, -1.0, -2.0])
    curve = compile_spline(vectors, beta, 0.2)
    speed = np.linspace(0, 3, 301)
    assert curve.knots.tolist() == [0.0, 0.5, 1.5]
    assert np.allclose(curve(speed), Curve("spline", {}, vectors, beta, 0.2)(speed), atol=1e-12)


def test_the_tail_is_exactly_linear():
    v, f = _data()
    regression = SVR(kernel=spline, C=1e3, epsilon=0.005).fit(v[:, None], f)
    curve = compile_spline(v[regression.support_], regression.dual_coef_[0], regression.intercept_[0])
    assert curve.coefficients[-1, 2:].tolist() == [0.0, 0.0]


def test_value_slope_and_curvature_are_continuous_at_the_knots():
    curve = compile_spline(np.array([0.3, 0.9, 2.0]), np.array([5.0, -9.0, 4.0]), 0.2)
    for j, h in enumerate(np.diff(curve.knots)):
        c0, c1, c2, c3 = curve.coefficients[j]
        end = [c0 + h * (c1 + h * (c2 + h * c3)), c1 + h * (2 * c2 + 3 * h * c3), c2 + 3 * h * c3]
        # at the last knot curvature vanishes only if sum(beta) = 0, as it does here
        assert np.allclose(end, curve.coefficients[j + 1, :3], atol=1e-12)


def test_extremes_are_found_between_the_knots():
    curve = compile_spline(np.array([0.3, 0.9, 2.0]), np.array([5.0, -9.0, 4.0]), 0.2)
    grid = np.linspace(0, 2.5, 100001)
    for slope in (0.0, 0.7, -3.0):
        places = curve.extreme_speeds(2.5, slope)
        exact = curve(places) - slope * places
        sampled = curve(grid) - slope * grid
        assert exact.min() == pytest.approx(sampled.min(), abs=1e-8)
        assert exact.max() == pytest.approx(sampled.max(), abs=1e-8)
        assert places.max() <= 2.5


@pytest.mark.parametrize(
    ("vectors", "beta", "b"),
    [
        ([-0.1], [1.0], 0.0),
        ([np.nan], [1.0], 0.0),
        ([1.0], [np.inf], 0.0),
        ([1.0], [1.0], np.nan),
        ([1.0, 2.0], [1.0], 0),
    ],
)
def test_inputs_that_are_no_regression_are_refused(vectors, beta, b):
    with pytest.raises(ValueError):
        compile_spline(np.array(vectors), np.array(beta), b)


def test_nan_speed_gives_nan():
    curve = compile_spline(np.array([0.3]), np.array([1.0]), 0.2)
    assert np.isnan(curve(np.array([np.nan]))).all()


def test_a_shared_curve_ends_with_the_range_of_the_slower_direction():
    """Both directions share a curve, one is known to 4 and one to 2 rad/s: such a model was written, and
    refused when read.
    """
    v, f = _data()
    regression = SVR(kernel=spline, C=100, epsilon=0.005).fit(v[:, None], f)
    vectors, beta = v[regression.support_], regression.dual_coef_[0]
    curve = Curve("spline", {}, vectors, beta, float(regression.intercept_[0]))
    whole, _ = compile_curve(curve, 4.0)
    table, bound = compile_curve(curve, 2.0)
    assert whole.knots[-1] > 2.0
    assert table.knots[-1] == 2.0
    speed = np.linspace(0, 2, 4001)
    assert np.abs(table(speed) - whole(speed)).max() <= bound + 1e-12
    assert table.coefficients[-1][2:].tolist() == [0, 0], "straight on beyond its range"
    slope = float(np.diff(whole(np.array([2.0 - 1e-6, 2.0 + 1e-6])))[0]) / 2e-6
    assert table.coefficients[-1][1] == pytest.approx(slope, abs=1e-4)


@pytest.mark.parametrize("degree", [5.0, 11.0, 12.0])
def test_a_polynomial_of_every_degree_that_a_file_may_have_is_compiled(degree):
    curve = Curve("polynomial", {"degree": degree}, np.array([0.1, 0.4]), np.array([3e-3, -2e-3]), 0.2)
    table, bound = compile_curve(curve, 1.0)
    speed = np.linspace(0, 1, 1001)
    assert np.abs(table(speed) - curve(speed)).max() <= bound < 2e-6 * np.abs(curve(speed)).max()
