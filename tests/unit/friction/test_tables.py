"""Any learned curve compiles within what is proved of it; derivatives and bounds are right."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.control.records import MAX_SEGMENTS
from rtctl.errors import ModelError
from rtctl.friction.kind_compile import cell_bounds, compile_curve, error_bound, sampled_error
from rtctl.friction.kind_cubic import PiecewiseCubic
from rtctl.friction.kind_curve import Curve

TRUE = {"coulomb_nm": 0.25, "viscous_nms_rad": 0.05, "breakaway_nm": 0.35, "stribeck_rad_s": 0.1}


def kernel_curve(kind, parameters, n=15, size=1.0, seed=0):
    rng = np.random.default_rng(seed)
    beta = rng.uniform(-size, size, n)
    return Curve(kind, parameters, np.sort(rng.uniform(0, 2, n)), beta - beta.mean(), 5.0)


CURVES = {
    "tustin": Curve.formula("tustin", TRUE),
    "gaussian": Curve.formula("gaussian", TRUE),
    "lorentzian": Curve.formula("lorentzian", TRUE),
    "rbf wide": kernel_curve("rbf", {"sigma_rad_s": 0.5}),
    "rbf narrow": kernel_curve("rbf", {"sigma_rad_s": 0.06}),
    "rbf large coefficients": kernel_curve("rbf", {"sigma_rad_s": 0.2}, size=0.5, n=60),
    "polynomial 5": kernel_curve("polynomial", {"degree": 5.0}, size=0.01),
}


@pytest.mark.parametrize("name", CURVES)
def test_a_table_is_within_its_proved_bound_and_that_is_a_millionth_of_full_scale(name):
    curve = CURVES[name]
    table, bound = compile_curve(curve, 2.0)
    speed = np.linspace(0, 2, 200_001)
    assert np.abs(table(speed) - curve(speed)).max() <= bound
    assert bound <= 1e-6 * np.abs(curve(speed)).max() + 1e-9
    assert 1 < len(table.knots) <= MAX_SEGMENTS


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.parametrize("order", [0, 1, 2, 3, 4, 7])
def test_every_derivative_is_that_of_the_one_before(name, order):
    curve, h = CURVES[name], 1e-5
    v = np.linspace(0.01, 1.9, 40)
    difference = (curve.derivative(v + h, order) - curve.derivative(v - h, order)) / (2 * h)
    exact = curve.derivative(v, order + 1)
    assert np.allclose(difference, exact, rtol=1e-4, atol=1e-4 * (np.abs(exact).max() + 1e-9))
    assert np.allclose(curve.derivative(v, 0), curve(v), rtol=1e-12)


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.parametrize("order", [2, 4, 8, 12])
def test_the_bound_of_a_derivative_holds_everywhere(name, order):
    curve = CURVES[name]
    assert np.abs(curve.derivative(np.linspace(0, 2, 5001), order)).max() <= curve.derivative_bound(order)


@settings(max_examples=40, deadline=None)
@given(
    sigma=st.floats(0.05, 2),
    seed=st.integers(0, 1000),
    start=st.floats(0, 2),
    width=st.floats(1e-3, 1.0),
)
def test_the_bound_of_a_cell_holds_for_any_kernel_sum(sigma, seed, start, width):
    curve = kernel_curve("rbf", {"sigma_rad_s": sigma}, seed=seed)
    edges = np.array([start, start + width])
    fourth = np.abs(curve.derivative(np.linspace(*edges, 200), 4)).max()
    assert cell_bounds(curve, edges)[0] >= width**4 / 384 * fourth * (1 - 1e-9)


@pytest.mark.parametrize("degree", [1.0, 2.0, 3.0])
def test_a_polynomial_kernel_up_to_degree_3_compiles_exactly_to_one_segment(degree):
    curve = kernel_curve("polynomial", {"degree": degree})
    table, bound = compile_curve(curve, 2.0)
    assert len(table.knots) == 1
    assert sampled_error(curve, table, 2.0) <= bound < 1e-10


@pytest.mark.parametrize("kind", ["coulomb", "coulomb_viscous"])
def test_straight_formulas_compile_exactly_to_one_segment(kind):
    names = ("coulomb_nm",) if kind == "coulomb" else ("coulomb_nm", "viscous_nms_rad")
    curve = Curve.formula(kind, {name: TRUE[name] for name in names})
    table, _ = compile_curve(curve, 2.0)
    assert len(table.knots) == 1
    assert sampled_error(curve, table, 2.0) < 1e-15


def test_a_curve_too_wild_for_the_segments_is_refused():
    with pytest.raises(ModelError, match=r"sigma_rad_s = 0.001 is too small for a range of 2 rad/s"):
        compile_curve(kernel_curve("rbf", {"sigma_rad_s": 1e-3}), 2.0)
    wild = Curve("polynomial", {"degree": 13.0}, np.linspace(0, 40, 9), 1e6 * np.resize([1.0, -1.0], 9), 1.0)
    with pytest.raises(ModelError, match=r"more than 1024 cells: degree = 13 with such dual coefficients"):
        compile_curve(wild, 40.0)


@pytest.mark.parametrize("kind", ["tustin", "gaussian", "lorentzian"])
def test_a_peak_far_below_the_fastest_speed_needs_few_segments_and_stays_proved(kind):
    curve = Curve.formula(kind, {**TRUE, "stribeck_rad_s": 0.002})
    table, bound = compile_curve(curve, 10.0)
    speed = np.concatenate([np.linspace(0, 0.05, 100_001), np.linspace(0, 10, 100_001)])
    assert np.abs(table(speed) - curve(speed)).max() <= bound < 1e-6
    assert len(table.knots) < 100


@pytest.mark.parametrize("name", ["tustin", "gaussian", "lorentzian"])
@pytest.mark.parametrize("order", [2, 4, 8, 12])
def test_the_bound_of_a_derivative_falls_with_the_speed_and_holds_beyond_it(name, order):
    curve = CURVES[name]
    speed = np.linspace(0, 2, 2001)
    bound = curve.derivative_bound(order, speed)
    assert (np.abs(curve.derivative(speed, order)) <= bound * (1 + 1e-9)).all()
    assert (np.diff(bound) <= 0).all()
    assert bound[-1] < 1e-3 * bound[0]


def test_a_damaged_table_is_seen_by_the_dense_check():
    curve = CURVES["rbf wide"]
    table, bound = compile_curve(curve, 2.0)
    coefficients = table.coefficients.copy()
    coefficients[7, 1] += 1e-3
    damaged = PiecewiseCubic(table.knots, coefficients)
    assert sampled_error(curve, damaged, 2.0) > bound == error_bound(curve, damaged, 2.0)


def test_least_slope_and_secant_are_those_of_a_fine_grid():
    table, _ = compile_curve(CURVES["gaussian"], 2.0)
    v = np.linspace(1e-4, 2, 400_001)
    f = CURVES["gaussian"](v)
    assert table.least_slope(2.0) == pytest.approx(np.min(np.gradient(f, v)), abs=1e-5)
    for loss in (0.0, 0.01, 0.1):
        assert table.least_secant(2.0, loss) == pytest.approx(np.min((f - loss) / v), abs=1e-8)
    assert table.least_secant(2.0, 0.3) == 0.0


def test_what_lies_beyond_the_speed_that_is_asked_about_tells_nothing_of_it():
    # from .5 on it falls steeply, to less than nothing
    table = PiecewiseCubic(np.array([0.0, 0.5]), np.array([[0.2, 0.3, 0.0, 0.0], [0.35, -9.0, 0.0, 0.0]]))
    assert table.least_slope(0.4) == pytest.approx(0.3)
    assert table.least_secant(0.4, 0.1) == pytest.approx(0.22 / 0.4)
    assert table.extreme_speeds(0.4).max() == 0.4


def test_nan_stays_nan():
    for curve in CURVES.values():
        assert np.isnan(curve(np.array([np.nan]))).all()
