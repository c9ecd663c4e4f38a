"""The state machine inside the law: sequences over many ticks."""

import math
from itertools import pairwise

import pytest
from law_rig import LawRig

from rtctl.control.states import CLEAR_TICKS
from rtctl.control.vocabulary import Fault, State


def spring_rig(**params):
    """An armed rig that pushes with 0.5 N m."""
    rig = LawRig(coupling_stiffness_nm_rad=60.0, energy_budget_j=1.0, **params)
    rig.environment("spring", environment_stiffness_nm_rad=60.0).arm()
    rig.run(1)
    for k in range(40):
        rig.tick(0.0005 * (k + 1) * 30 / 36)
    assert rig["torque_applied_nm"] == pytest.approx(-0.5)
    return rig


def test_arming_waits_for_good_ticks_and_takes_a_fresh_request():
    rig = LawRig()
    rig.request("arm_count")
    rig.run(60)
    assert rig.mode is State.IDLE  # the request came before the rig was ready: used up
    rig.request("arm_count")
    assert rig.tick().mode is State.ARMING
    assert rig["enabled"] == 1.0


def test_arming_waits_for_the_tare():
    rig = LawRig(tare_ticks=100).run(60)
    rig.request("arm_count")
    assert rig.run(5).mode is State.IDLE
    rig.run(60)
    rig.request("arm_count")
    assert rig.tick().mode is State.ARMING


def test_an_arm_request_of_an_older_epoch_is_void():
    rig = LawRig().arm()
    rig.request("stop_count")
    rig.run(100)
    assert rig.mode is State.IDLE
    rig.request("arm_count")
    assert rig.run(5).mode is State.IDLE
    rig.command["epoch"] = rig.state["epoch"]
    assert rig.run(5).mode is State.IDLE
    rig.request("arm_count")
    assert rig.tick().mode is State.ARMING


def test_arming_sends_no_torque_and_the_soft_start_rises_without_steps():
    rig = LawRig(coupling_stiffness_nm_rad=60.0)
    rig.environment("spring", environment_stiffness_nm_rad=60.0, environment_center_rad=0.01).run(40)
    rig.request("arm_count")
    torques = []
    for _ in range(100):
        rig.tick()
        torques.append(rig["torque_applied_nm"])
        if rig.mode is State.ARMING:
            assert torques[-1] == 0.0
    steps = [b - a for a, b in pairwise(torques)]
    assert max(steps) == pytest.approx(0.3 / 50, rel=1e-6)
    assert min(steps) >= -1e-12
    assert torques[-1] == pytest.approx(0.3)


def test_a_stop_ramps_monotonically_to_zero_within_its_ticks_and_bumps_the_epoch():
    rig = spring_rig()
    epoch = rig["epoch"]
    rig.request("stop_count")
    before, ticks = rig["torque_applied_nm"], 0
    while rig.tick()["enabled"] == 1.0:
        ticks += 1
        assert abs(rig["torque_applied_nm"]) <= abs(before)
        before = rig["torque_applied_nm"]
    assert before == 0.0
    assert ticks == 50
    assert rig.mode is State.IDLE
    assert rig["epoch"] == epoch + 1
    assert rig["fault_first"] == -1


def test_a_ramp_too_steep_for_the_rate_limit_still_ends_in_time():
    rig = spring_rig()
    rig.params["torque_rate_nm"] = 1e-4
    rig.request("stop_count")
    assert rig.run(51)["enabled"] == 0.0
    assert rig["torque_applied_nm"] == 0.0


def test_a_fault_is_latched_and_left_only_by_reset_after_the_cause_is_long_gone():
    rig = spring_rig()
    rig.run(3, position_rad=math.nan)
    assert rig.mode is State.FAULT
    rig.run(CLEAR_TICKS - 2)
    rig.request("reset_count")
    assert rig.tick().mode is State.FAULT
    assert rig["fault_first"] == 1
    rig.request("reset_count")
    assert rig.tick().mode is State.IDLE
    assert rig["fault_first"] == -1
    assert rig.run(100).mode is State.IDLE


def test_the_first_cause_is_kept_when_others_follow():
    rig = spring_rig()
    rig.run(3, fresh=False)
    rig.run(5, position=math.nan)
    assert rig["fault_first"] == 0


def test_a_fault_during_a_stop_decides_where_the_stop_leads():
    rig = spring_rig()
    rig.request("stop_count")
    rig.run(5)
    rig.state["energy_port_j"] = -10.0
    rig.tick()
    rig.state["energy_port_j"] = 0.0
    rig.run(60)
    assert rig.mode is State.FAULT
    assert rig["fault_first"] == Fault.PASSIVITY.value.bit_length() - 1


def test_estop_takes_the_torque_at_once_and_needs_release_and_reset():
    rig = spring_rig().tick(estop=1)
    assert rig.mode is State.ESTOP
    assert rig["torque_applied_nm"] == 0.0
    rig.request("reset_count")
    assert rig.tick(estop=1).mode is State.ESTOP
    assert rig.run(5).mode is State.ESTOP
    rig.request("reset_count")
    assert rig.tick().mode is State.IDLE


def test_shutdown_ramps_first_and_is_final():
    rig = spring_rig()
    rig.request("shutdown_count")
    assert rig.tick().mode is State.STOPPING
    rig.run(60)
    assert rig.mode is State.SHUTDOWN
    rig.request("arm_count", "reset_count")
    assert rig.run(100).mode is State.SHUTDOWN


def test_three_late_ticks_in_a_row_ramp_down_and_two_do_not():
    rig = spring_rig()
    rig.tick(skipped=1).tick(skipped=1).tick()
    assert rig.mode is State.ACTIVE
    for _ in range(3):
        rig.tick(skipped=1)
    assert rig.mode is State.STOPPING
    assert rig.run(60).mode is State.FAULT
    assert rig["fault_first"] == Fault.OVERRUN.value.bit_length() - 1


def test_over_speed_brakes_from_the_limit_and_cuts_at_a_fifth_above():
    rig = LawRig(velocity_limit_rad_s=1.0, coupling_stiffness_nm_rad=60.0, energy_budget_j=10.0)
    rig.environment("spring", environment_stiffness_nm_rad=60.0, environment_center_rad=0.5).arm()
    x = 0.0
    for _ in range(60):
        x += 1.1e-3
        rig.tick(x)
    assert rig["torque_wanted_nm"] > 0.0
    assert rig["torque_applied_nm"] == 0.0
    assert rig.mode is State.ACTIVE
    for _ in range(40):
        x += 1.3e-3
        rig.tick(x)
    assert rig.mode is State.FAULT
    assert rig["fault_first"] == Fault.OVERSPEED.value.bit_length() - 1


def remote_rig():
    rig = LawRig(coupling_stiffness_nm_rad=60.0)
    rig.environment("remote", target_position_rad=0.002)
    rig.request("target_count")
    rig.run(40)
    rig.request("arm_count", "target_count")
    for _ in range(70):
        rig.request("target_count")
        rig.tick()
    assert rig.mode is State.ACTIVE
    assert rig["torque_applied_nm"] == pytest.approx(0.12)
    return rig


def test_an_old_target_holds_with_damping_only_and_a_new_one_starts_softly():
    rig = remote_rig().run(20)
    assert rig.mode is State.ACTIVE
    assert rig.tick().mode is State.HOLD
    rig.run(5)
    assert rig["torque_applied_nm"] == 0.0
    for k in range(10):
        rig.tick(1e-3 * (k + 1))
    assert rig["torque_applied_nm"] == pytest.approx(-0.05)
    rig.request("target_count")
    rig.tick()
    assert rig.mode is State.ACTIVE
    assert rig["authority"] == 0.0


def test_the_damping_of_hold_is_capped():
    rig = remote_rig().run(30)
    rig.params["hold_damping_nms_rad"] = 100.0
    for k in range(20):
        rig.tick(1e-3 * (k + 1))
    assert rig["torque_applied_nm"] == pytest.approx(-0.2 * 3.0)


def test_a_target_lost_for_long_stops_and_only_the_operator_brings_it_back():
    rig = remote_rig().run(101)
    assert rig.mode is State.STOPPING
    rig.request("target_count")
    rig.run(60)
    assert rig.mode is State.FAULT
    assert rig["fault_first"] == Fault.TARGET_LOST.value.bit_length() - 1


def test_a_target_of_an_older_epoch_does_not_count_as_fresh():
    rig = remote_rig()
    rig.command["epoch"] -= 1
    for _ in range(30):
        rig.request("target_count")
        rig.tick()
    assert rig.mode is State.HOLD
