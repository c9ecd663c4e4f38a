"""Load terms of a gear whose peak falls at two speeds and whose directions differ: found again, and what of
them the law gets.
"""

import numpy as np
import pytest

from rtctl.friction.learn import beside_speed, unloaded
from rtctl.friction.load import COEFFICIENTS
from rtctl.friction.points import FrictionPoints

LOAD = {"outside": 0.03, "motor": 0.18, "outside_peak": 0.09, "motor_peak": 0.2}
BACKWARD = 0.92


def fall(v):
    return 0.45 * np.exp(-((v / 0.06) ** 2)) + 0.55 * np.exp(-((v / 0.6) ** 2))


def points(backward=BACKWARD):
    """Steady points of such a gear under weights: written here anew, by a bisection of the motor's torque."""
    noise, rows, loads = np.random.default_rng(3), [], []
    for sign, scale in ((1, 1.0), (-1, backward)):
        for v in (0.02, 0.04, 0.08, 0.15, 0.3, 0.6, 1.2, 2.5, 5.0):
            for e in np.linspace(-0.9, 0.9, 7):

                def friction(m, v=v, e=e, scale=scale):
                    base = 0.25 + abs(LOAD["outside"] * e - LOAD["motor"] * m)
                    peak = 0.1 + abs(LOAD["outside_peak"] * e - LOAD["motor_peak"] * m)
                    return scale * (base + fall(v) * peak + 0.05 * v)

                low, high = -10.0, 10.0
                for _ in range(60):
                    middle = (low + high) / 2
                    low, high = (middle, high) if middle + e < friction(middle) else (low, middle)
                if low + e > 0:
                    rows.append((sign * v, low + e + noise.normal(0, 5e-4), sign, np.nan, np.nan))
                    loads.append(sign * e)
    return FrictionPoints.from_rows(rows, "made", "0" * 64, {"load_nm": np.array(loads)})


@pytest.fixture(scope="module")
def judged():
    return beside_speed.judge_load(points(), "speed")


def test_a_peak_of_two_speeds_is_chosen_and_its_coefficients_are_found(judged):
    terms = judged.chosen.terms
    assert terms.rung == "load_two_speeds"
    for name, true in LOAD.items():
        assert terms.value(name) == pytest.approx(true, rel=0.1)
    assert terms.value("backward") == pytest.approx(BACKWARD, abs=0.005)
    one_speed = judged.of("load_squared")
    assert one_speed.rmse_nm > 3 * judged.chosen.rmse_nm
    assert one_speed.terms.value("motor_peak") > 1.1 * LOAD["motor_peak"]


def test_the_law_gets_the_load_of_the_direction_that_rubs_less(judged):
    made = points()
    load = unloaded.load_of(made, judged)
    for name in COEFFICIENTS:
        weaker = judged.chosen.terms.value("backward")
        assert getattr(load, name) == pytest.approx(weaker * judged.chosen.terms.value(name))
    np.testing.assert_allclose(
        load.fall(np.array([0.0, 0.06, 0.6, 3.0])), fall(np.array([0.0, 0.06, 0.6, 3.0])), atol=0.03
    )
    rows, _ = beside_speed.rows_of(made)
    added = load.added_nm(rows.speed, rows.outside_nm, rows.motor_nm)
    assert (load.sure_share * added < rows.friction_nm).all()
    made = points(backward=1.08)
    verdict = beside_speed.judge_load(made, "speed")
    assert unloaded.load_of(made, verdict).motor == pytest.approx(verdict.chosen.terms.value("motor"))
