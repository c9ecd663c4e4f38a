import math

import numpy as np
import pytest

from rtctl.control.friction_curve import BACKWARD, FORWARD, branch_magnitude, friction_magnitude
from rtctl.control.jit import records
from rtctl.control.records import LOOKUP_CELLS, MODEL

KNOTS = np.array([0.0, 0.05, 0.11, 0.4, 1.0, 3.0])


def model():
    """Cubics that differ per direction; the look-up names the segment at the start of each cell."""
    made = np.zeros(1, MODEL)
    coefficients = np.random.default_rng(1).uniform(0.1, 1.0, (2, 5, 4))
    made["n_segments"] = 5
    made["knot_rad_s"][..., :6] = KNOTS
    made["coefficient"][0, :, :5] = coefficients
    made["lookup_scale"] = LOOKUP_CELLS / 3.0
    starts = np.arange(LOOKUP_CELLS) * 3.0 / LOOKUP_CELLS
    made["lookup"] = np.clip(np.searchsorted(KNOTS, starts, side="right") - 1, 0, 4)
    return made, coefficients


def expected(coefficients, branch, speed):
    j = min(max(int(np.searchsorted(KNOTS, speed, side="right")) - 1, 0), 4)
    return float(np.polyval(coefficients[branch, j][::-1], min(speed, 3.0) - KNOTS[j]))


def test_the_evaluator_equals_the_piecewise_cubic_everywhere():
    made, coefficients = model()
    row = records(made)[0]
    speeds = np.concatenate([np.random.default_rng(2).uniform(0, 3, 2000), KNOTS, np.nextafter(KNOTS, 0)])
    for speed in np.abs(speeds):
        for branch in (FORWARD, BACKWARD):
            assert branch_magnitude(row, branch, speed) == pytest.approx(
                expected(coefficients, branch, speed), rel=1e-12
            )


def test_the_sign_of_the_velocity_chooses_the_branch_and_zero_is_forward():
    made, coefficients = model()
    row = records(made)[0]
    assert friction_magnitude(row, 0.2) == pytest.approx(expected(coefficients, FORWARD, 0.2))
    assert friction_magnitude(row, -0.2) == pytest.approx(expected(coefficients, BACKWARD, 0.2))
    assert friction_magnitude(row, 0.0) == coefficients[FORWARD, 0, 0]


@pytest.mark.parametrize("speed", [3.0, 3.0001, 1e6, math.inf])
def test_beyond_the_last_knot_the_last_value_is_kept(speed):
    made, coefficients = model()
    assert branch_magnitude(records(made)[0], FORWARD, speed) == pytest.approx(
        expected(coefficients, FORWARD, 3.0), rel=1e-12
    )


@pytest.mark.parametrize("shift", [-3, 2, 10_000, -10_000])
def test_a_wrong_look_up_costs_steps_but_not_the_value(shift):
    made, coefficients = model()
    made["lookup"] += shift
    row = records(made)[0]
    for speed in (0.0, 0.07, 0.39, 0.4, 2.9):
        assert branch_magnitude(row, FORWARD, speed) == pytest.approx(expected(coefficients, FORWARD, speed))


def test_no_model_is_no_friction_and_nan_stays_nan():
    assert friction_magnitude(records(np.zeros(1, MODEL))[0], 1.0) == 0.0
    made, _ = model()
    assert math.isnan(friction_magnitude(records(made)[0], math.nan))


def test_a_look_up_scale_that_is_not_finite_cannot_leave_the_table():
    made, coefficients = model()
    made["lookup_scale"] = math.inf
    assert branch_magnitude(records(made)[0], FORWARD, 0.2) == pytest.approx(
        expected(coefficients, FORWARD, 0.2)
    )
