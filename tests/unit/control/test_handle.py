"""What was chosen for a joint is on a linear axis as it is at a handle: each part of the law asked on both,
at a speed between the two.
"""

import math
from pathlib import Path

import pytest
from law_rig import LawRig, T, of_rows

from hw.motion import HANDLE_M
from rtctl.check.law_plan import build
from rtctl.control.assistance import CREEP_RAD_S, keep_assistance
from rtctl.control.disturbance_observer import SLOW_RAD_S, SLOW_SHARE, observer_torque
from rtctl.control.force_feedback import SPEED_MIN_RAD_S, SPEND_S, assistance_limit
from rtctl.control.handle import own_rad
from rtctl.control.jit import records
from rtctl.control.resting import BENT_S, advance_rest, is_bent
from rtctl.control.shrinking import LEFT_MOST, steady_share
from rtctl.control.trembling import MOST_S, ON_RAD, calm_share
from rtctl.control.vocabulary import Policy, State
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[3] / "configs"
BETWEEN = math.sqrt(HANDLE_M)
"""Times a joint's threshold: below it, and above a carriage's."""


def made(linear, **state):
    rig = LawRig(is_linear=int(linear))
    rig.state["state"] = int(State.ACTIVE)
    for name, value in state.items():
        rig.state[name] = value
    return rig


@pytest.mark.parametrize(("rig_file", "linear"), [("mock.toml", 0), ("mock-linear.toml", 1)])
def test_the_law_is_told_which_it_is(rig_file, linear):
    params = records(build(load(CONFIGS / rig_file)).params)
    assert int(params["is_linear"][0, 0]) == linear
    assert of_rows(own_rad)(params, 0, 0.03) == pytest.approx(0.03 * (HANDLE_M if linear else 1.0))


@pytest.mark.parametrize("linear", [False, True])
def test_a_carriage_that_a_hand_moves_is_no_joint_that_creeps(linear):
    rig = made(linear, assistance_energy_j=-1.0, friction_credit_j=1e-3)
    rig.params["assistance_bank_j"] = 1.0
    keep_assistance(rig.state[0], rig.params[0], 0, 1e-6, 1, BETWEEN * CREEP_RAD_S, True)
    assert (float(rig.state["assistance_energy_j"][0, 0, 0]) > -1.0) == linear


@pytest.mark.parametrize("linear", [False, True])
def test_nor_does_it_rest(linear):
    rig = made(linear, bristle_share=1.0, velocity_rad_s=BETWEEN * CREEP_RAD_S)
    for k in range(2 + round(BENT_S / T)):
        rig.state["position_rad"] = 1e-3 * k
        advance_rest(rig.state[0], rig.params[0], 0, 0.0, 0.0)
    assert is_bent(rig.state[0], rig.params[0], 0) != linear


@pytest.mark.parametrize("linear", [False, True])
def test_its_strokes_are_seen_to_shrink(linear):
    rig, share = made(linear), of_rows(steady_share)
    rig.params["count_rad"] = 0.0
    for peak, way in ((BETWEEN, 1.0), (0.3 * BETWEEN, -1.0)):
        rig.now["velocity_rad_s"], rig.state["bristle_share"] = way * peak * CREEP_RAD_S, way
        for _ in range(20):
            share(rig.now, rig.state, rig.params, 0)
    rig.now["velocity_rad_s"] = 0.0
    left = [share(rig.now, rig.state, rig.params, 0) for _ in range(500)][-1]
    assert left == pytest.approx(1.0 - LEFT_MOST if linear else 1.0, abs=1e-3)


@pytest.mark.parametrize("linear", [False, True])
def test_a_way_that_a_hand_has_moved_it_forgets_a_tremble(linear):
    rig, calm = made(linear, trembled_s=MOST_S), of_rows(calm_share)
    for k in range(3000):
        rig.state["position_rad"] = BETWEEN * ON_RAD * k / 3000
        left = calm(rig.state, rig.params, 0)
    assert left == (1.0 if linear else 0.0)


@pytest.mark.parametrize("linear", [False, True])
def test_the_observer_leaves_friction_to_what_hardly_moves(linear):
    rig = made(linear)
    rig.params["observer_gain"], rig.params["friction_policy"] = 1.0, int(Policy.OBSERVER)
    rig.params["observer_deadband_nm"], rig.params["friction_cap_nm"] = 0.0, 1.0
    rig.now["compensation"], rig.now["friction_observed_nm"] = 1.0, 0.1
    rig.now["velocity_rad_s"] = SLOW_RAD_S * HANDLE_M
    torque = observer_torque(rig.now[0], rig.state[0], rig.params[0], rig.model[0], 0, 1)
    slow = math.exp(-1.0) if linear else math.exp(-(HANDLE_M**2))
    assert torque == pytest.approx(0.1 * (1.0 - SLOW_SHARE * slow))


@pytest.mark.parametrize("linear", [False, True])
def test_free_energy_lasts_at_the_speed_that_is_noise(linear):
    rig = made(linear, force_feedback_energy_j=0.03)
    rig.params["energy_bank_j"] = 0.04
    rig.params["force_feedback_share"] = 0.0
    most = assistance_limit(rig.state[0], rig.params[0], rig.model[0], 0, 0.0)
    assert most == pytest.approx(0.01 / (SPEND_S * SPEED_MIN_RAD_S * (HANDLE_M if linear else 1.0)))
