"""Friction by load in the law: the plant's own closed form, the share that is compensated, and that it feeds
back no more than is said.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from law_rig import LEVER, LawRig, T

from hw.simulators.mock_load import load_levels
from rtctl.control.force_doubt import _average
from rtctl.control.load_friction import load_friction, load_gain, load_magnitude, motor_through_gear
from rtctl.control.records import MODEL
from rtctl.control.vocabulary import Display, Policy
from rtctl.friction.load import Load

FASTEST = 5.0
LOAD = Load(0.02, 0.2, 0.09, 0.15, 0.004, 0.01, 0.3, 1.3, 2.5, 0.03)
PLANT = SimpleNamespace(
    load_outside=[0.02],
    load_motor=[0.2],
    load_outside_peak=[0.09],
    load_motor_peak=[0.15],
    load_outside_square_nm=[0.004],
    load_motor_square_nm=[0.01],
)
TORQUES = [
    (0.8, -1.2),
    (1.2, -0.8),
    (-0.5, 1.0),
    (0.7, 0.4),
    (-0.7, -0.4),
    (0.0, 0.6),
    (0.6, 0.0),
    (0.0, 0.0),
]


def model(load=LOAD):
    row = np.zeros(1, MODEL)
    row["speed_max_rad_s"] = FASTEST
    load.fill(row[0])
    return row.view(np.recarray)[0]


@pytest.mark.parametrize("speed", [0.0, 0.05, 2.0])
@pytest.mark.parametrize(("hand", "motor"), TORQUES)
def test_the_law_has_the_load_of_the_plant(speed, hand, motor):
    base, peak = getattr(load_levels, "py_func", load_levels)(motor, hand, PLANT, 0)
    true = base + math.exp(-((speed / 0.3) ** 1.3)) * peak
    assert load_magnitude(model(), speed, hand, motor) == pytest.approx(true, abs=2e-4 * peak)
    assert LOAD.added_nm(np.array([speed]), np.array([hand]), np.array([motor]))[0] == pytest.approx(true)


@pytest.mark.parametrize("power", [0.3, 0.6, 1.0, 2.0, 8.7])
def test_the_fall_of_the_peak_is_that_of_the_form_to_three_thousandths(power):
    load = Load(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.3, power, 2.0, 0.0)
    speeds = np.concatenate([np.geomspace(1e-6, FASTEST, 4000), np.linspace(0, FASTEST, 4000)])
    row = model(load)
    law = [load_magnitude(row, float(v), 1.0, 0.0) for v in speeds]
    np.testing.assert_allclose(law, load.fall(speeds), atol=3e-3)
    assert load_magnitude(row, 9.0, 1.0, 0.0) == load_magnitude(row, FASTEST, 1.0, 0.0)


def test_beyond_what_was_measured_load_adds_no_more():
    assert load_magnitude(model(), 0.1, 9.0, -9.0) == load_magnitude(model(), 0.1, 2.5, -2.5)
    bound = LOAD.most_added_nm(9.0)
    assert load_magnitude(model(), 0.0, 2.5, -2.5) <= bound == LOAD.most_added_nm(2.5)


def loaded(speed, hand_nm, gain=0.9, ticks=300, policy=Policy.HYBRID, **params):
    """An armed rig at constant speed in a hand, with a model that knows load."""
    params = {"friction_load_gain": gain, "friction_cap_nm": 2.0} | params
    rig = LawRig(friction_policy=int(policy), **params).friction().arm()
    LOAD.fill(rig.model[0])
    rig.force_n[1] = hand_nm / LEVER
    for k in range(ticks):
        rig.tick(speed * T * (k + 1))
    return rig


def test_what_the_load_adds_is_compensated_by_its_share_at_a_settled_help():
    rig, without = loaded(1.0, 0.8), loaded(1.0, 0.8, gain=0.0)
    help_nm = rig["feedforward_torque_nm"]
    added = load_magnitude(model(), 1.0, 0.8, help_nm)  # the help is the only torque of the motor here
    assert help_nm - without["feedforward_torque_nm"] == pytest.approx(0.9 * added, rel=1e-3)
    assert rig["friction_model_nm"] - without["friction_model_nm"] == pytest.approx(added, rel=1e-3)
    assert added > 0.02


def test_at_rest_there_is_no_help_by_load():
    p = LawRig(friction_load_gain=0.8).params[0]
    assert load_gain(p, 0, 0.0) == 0.0
    assert load_gain(p, 0, 1.0) == pytest.approx(0.8)
    assert 0.0 < load_gain(p, 0, 0.05) == pytest.approx(0.8 * (1 - math.exp(-1)))
    still, without = loaded(0.0, 0.8), loaded(0.0, 0.8, gain=0.0)
    assert still["feedforward_torque_nm"] == without["feedforward_torque_nm"]


def test_the_cap_holds_with_load():
    assert loaded(1.0, 2.0, friction_cap_nm=0.3)["feedforward_torque_nm"] <= 0.3


def test_an_admittance_goes_by_no_load():
    rig = loaded(1.0, 0.8)
    at = rig.now[0], rig.state[0], rig.params[0], rig.model[0], 0, 1.0
    assert load_friction(*at) > 0.02
    rig.state["display_kind"] = int(Display.ADMITTANCE)
    assert load_friction(*at) == 0.0


def test_a_model_without_load_adds_nothing():
    assert load_magnitude(np.zeros(1, MODEL).view(np.recarray)[0], 0.5, 1.0, -1.0) == 0.0


def test_a_hand_that_is_no_number_is_not_taken_for_a_load():
    assert math.isnan(load_magnitude(model(), 0.5, math.nan, 0.1))


def test_the_sum_of_help_and_load_settles_at_the_largest_share_that_check_passes():
    strong = Load(0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 5.0, 0.0)
    rig = (
        LawRig(friction_policy=int(Policy.HYBRID), friction_load_gain=1.0, friction_cap_nm=3.0)
        .friction()
        .arm()
    )
    strong.fill(rig.model[0])
    rig.force_n[1] = 0.2 / LEVER
    for k in range(300):
        rig.tick(T * (k + 1))
    # help = kappa F + .5 help as it was sent, as the hand's torque adds nothing here
    sent = motor_through_gear(rig.now[0], rig.state[0], rig.params[0], 0)
    assert 0.4 < sent <= rig["feedforward_torque_nm"]
    rig.tick(T * 301)
    assert rig["feedforward_torque_nm"] == pytest.approx(0.9 * 0.25 + 0.5 * sent, rel=1e-3)
    assert rig["feedforward_torque_nm"] <= 2 * 0.9 * 0.25


def test_an_uneven_load_is_no_offset_of_the_force_sensor():
    rig = loaded(1.0, 0.8)
    seen = float(rig.state["friction_seen_nm"][0, 0, 0])
    rig.params["friction_seen_alpha"] = 0.1
    rig.state["friction_seen_nm"][0, 0, 0] = seen + 0.4
    before = float(rig.state["friction_load_nm"][0, 0])
    assert before > 0.02
    rig.state["slid_ticks"] = 0.0
    _average(rig.state[0], rig.params[0], 0, 0, 1)
    assert rig.state["slid_friction_nm"][0, 0, 0] == pytest.approx(seen + 0.4 - before)
