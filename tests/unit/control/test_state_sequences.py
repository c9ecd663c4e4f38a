"""The state machine inside the law: sequences over many ticks."""

import math
from itertools import pairwise

import pytest
from law_rig import LawRig

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


def test_arming_waits_for_good_ticks_also_when_the_tare_is_complete():
    rig = LawRig().run(15)
    assert rig.state["tare_count"][0, 0] == 10
    rig.request("arm_count")
    assert rig.tick().mode is State.IDLE
    rig.run(4)
    rig.request("arm_count")
    assert rig.tick().mode is State.IDLE
    rig.request("arm_count")
    assert rig.tick().mode is State.ARMING


@pytest.mark.parametrize("first", [0, 7, 2**31 - 1, -1])
def test_a_daemon_begins_in_the_epoch_that_its_first_command_names(first):
    rig = LawRig()
    rig.command["epoch"] = first
    rig.run(2)
    assert rig["epoch"] == max(first, 0)
    rig.command["epoch"] = first + 1
    assert rig.tick()["epoch"] == max(first, 0), "and in no other one without a stop"
    rig.request("stop_count")
    assert rig.tick()["epoch"] == max(first, 0) + 1


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


@pytest.mark.parametrize(("rate_hz", "ticks"), [(500.0, 500), (4000.0, 4000), (7000.0, 7000)])
def test_a_cause_must_be_gone_for_a_second_at_any_rate(rate_hz, ticks):
    rig = LawRig(period_s=1.0 / rate_hz)
    rig.run(60)
    rig.request("arm_count")
    rig.run(1)
    rig.run(3, position_rad=math.nan)
    assert rig.mode is State.FAULT
    rig.run(ticks - 2)
    rig.request("reset_count")
    assert rig.tick().mode is State.FAULT
    rig.request("reset_count")
    assert rig.tick().mode is State.IDLE


def test_a_fault_is_latched_and_left_only_by_reset_after_the_cause_is_long_gone():
    rig = spring_rig()
    rig.run(3, position_rad=math.nan)
    assert rig.mode is State.FAULT
    rig.run(1000 - 2)
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


def test_a_fault_during_the_ramp_of_another_does_not_replace_it():
    rig = spring_rig()
    rig.state["energy_port_j"] = -1.4
    assert rig.tick().mode is State.STOPPING
    rig.state["energy_port_j"] = 0.0
    for _ in range(3):
        assert rig.tick(skipped=1).mode is State.STOPPING
    assert rig.faults & Fault.OVERRUN
    assert rig["fault_first"] == Fault.PASSIVITY.value.bit_length() - 1
    assert rig.run(3, fresh=False).mode is State.FAULT
    assert rig["fault_first"] == Fault.PASSIVITY.value.bit_length() - 1


def test_a_fault_during_a_stop_decides_where_the_stop_leads():
    rig = spring_rig()
    rig.request("stop_count")
    rig.run(5)
    rig.state["energy_port_j"] = -1.4
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


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_over_speed_brakes_from_the_limit_and_cuts_at_a_fifth_above(way):
    rig = LawRig(velocity_limit_rad_s=1.0, coupling_stiffness_nm_rad=60.0, energy_budget_j=10.0)
    rig.environment("spring", environment_stiffness_nm_rad=60.0, environment_center_rad=0.2 * way).arm()
    x = 0.0
    for _ in range(60):
        x += 1.1e-3 * way
        rig.tick(x)
    assert rig["torque_wanted_nm"] * way > 0.0
    assert rig["torque_applied_nm"] == 0.0
    assert rig.mode is State.ACTIVE
    for _ in range(40):
        x += 1.3e-3 * way
        rig.tick(x)
    assert rig.mode is State.FAULT
    assert rig["fault_first"] == Fault.OVERSPEED.value.bit_length() - 1


def test_a_stop_voids_the_arm_request_of_the_same_tick():
    rig = LawRig().run(40)
    rig.request("arm_count", "stop_count")
    assert rig.tick().mode is State.IDLE
    assert rig["epoch"] == 1
    assert rig.run(5).mode is State.IDLE


def test_the_end_of_the_process_is_not_forgotten_behind_an_emergency_stop():
    rig = spring_rig()
    rig.request("shutdown_count")
    rig.tick(estop=1)
    assert rig["torque_applied_nm"] == 0.0
    assert rig.tick(estop=1).mode is State.SHUTDOWN


def test_three_faults_within_a_minute_lock_the_rig_out_until_a_restart():
    rig = spring_rig()
    for k in range(3):
        rig.run(3, fresh=False)
        if k == 2:
            break
        assert rig.mode is State.FAULT
        rig.run(1000)
        rig.request("reset_count")
        assert rig.tick().mode is State.IDLE
        rig.arm()
    assert rig.mode is State.LOCKOUT
    assert rig["torque_applied_nm"] == 0.0
    rig.run(1000)
    rig.command["epoch"] = rig.state["epoch"]
    rig.request("reset_count", "arm_count")
    assert rig.run(50).mode is State.LOCKOUT
    rig.request("shutdown_count")
    assert rig.tick().mode is State.SHUTDOWN


def test_three_faults_spread_over_more_than_a_minute_do_not():
    rig = spring_rig()
    for _ in range(4):
        rig.run(3, fresh=False)
        assert rig.mode is State.FAULT
        rig.run(1000)
        rig.now["tick"] += 30_001
        rig.request("reset_count")
        assert rig.tick().mode is State.IDLE
        rig.arm()


def test_more_than_five_percent_of_damaged_frames_are_a_cut():
    rig = spring_rig()
    for _ in range(50):
        assert rig.tick(fresh=False, link_faults=1).mode is State.ACTIVE
        rig.run(3)
    rig.tick(fresh=False, link_faults=1)
    assert rig.mode is State.FAULT
    assert rig["fault_first"] == Fault.CHECKSUM.value.bit_length() - 1


def test_a_fault_of_the_device_itself_is_cut_at_once():
    rig = spring_rig().tick(link_faults=16)
    assert rig.mode is State.FAULT
    assert rig["fault_first"] == Fault.DEVICE.value.bit_length() - 1


@pytest.mark.parametrize(
    ("share", "armed", "limit"), [(1.0, True, 3.0), (0.25, True, 0.75), (0.0, False, 0.0)]
)
def test_without_real_time_rights_a_rig_needs_a_waiver_that_caps_its_torque(share, armed, limit):
    rig = LawRig(coupling_stiffness_nm_rad=60.0, energy_budget_j=10.0)
    rig.params["waiver_share"], rig.params["renderer_store_j"] = share, 100.0
    rig.environment("spring", environment_stiffness_nm_rad=1e6, environment_center_rad=1.0).run(40, waiver=1)
    rig.request("arm_count")
    rig.run(100, waiver=1)
    assert (rig.mode is State.ACTIVE) == armed
    assert bool(rig.faults & Fault.REALTIME) != armed
    assert rig["torque_applied_nm"] == pytest.approx(limit)
