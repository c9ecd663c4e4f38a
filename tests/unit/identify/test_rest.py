"""Friction at rest where ramps are too quick for it: what the slowest speeds show."""

import math

import pytest

from rtctl.identify.measurement_order import Known
from rtctl.identify.rest import held_nm, raise_break_away
from rtctl.identify.slip import RISE_S, ramp_slope

FALLING = [Known(1, 0.005, 0.54), Known(1, 0.00125, 0.59), Known(1, 0.0025, 0.58), Known(-1, 0.005, 0.7)]


def _point(torque, direction=1, speed=0.0):
    return {
        "target_rad_s": speed,
        "direction": direction,
        "friction_torque_nm": direction * torque,
        "weakest_place_nm": direction * 0.9 * torque,
        "presliding_rad": 1e-3,
        "presliding_spread_rad": None,
    }


def test_a_joint_at_rest_holds_what_it_drags_at_the_slowest_speed_of_a_falling_curve():
    points = [_point(0.56), _point(0.56, -1), _point(0.54, speed=0.005)]
    for _ in range(2):  # however often it is asked
        raise_break_away(points, [Known(1, 0.0, 0.56), *FALLING])
        assert points[0]["friction_torque_nm"] == pytest.approx(0.59)
        assert points[0]["weakest_place_nm"] == pytest.approx(0.9 * 0.59)
        assert points[0]["presliding_rad"] == pytest.approx(1e-3 * 0.59 / 0.56), "of the whole torque"
        assert points[0]["ramp_nm"] == 0.56
    assert points[1]["friction_torque_nm"] == -0.56, "one speed alone tells nothing"
    assert points[2]["friction_torque_nm"] == 0.54


@pytest.mark.parametrize("ramp_nm", [0.586, 0.6])
def test_noise_raises_nothing_and_what_ramps_found_is_never_lowered(ramp_nm):
    raise_break_away(points := [_point(ramp_nm)], FALLING)
    assert points[0]["friction_torque_nm"] == ramp_nm


def test_viscous_friction_is_not_held_at_rest():
    rising = [Known(-1, 0.005, 0.02), Known(-1, 0.01, 0.04), Known(-1, 0.0, 1e-5)]
    assert held_nm(rising, -1) == held_nm(rising, 1) == 0.0
    assert held_nm(FALLING, 1) == 0.59


@pytest.mark.parametrize(
    ("seen", "slope"),
    [([], 0.375), ([0.2], 0.05), ([0.2, 0.0016, 0.3], 0.05), ([0.0016], 0.375 / 64), ([9.0], 0.375)],
)
def test_a_break_away_that_took_nothing_makes_no_ramp_slow(seen, slope):
    assert RISE_S == 4.0
    assert math.isclose(ramp_slope(0.375, seen), slope)
