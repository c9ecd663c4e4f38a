"""The state machine inside the law: sequences over many ticks."""

import math
from itertools import pairwise

import pytest
from law_rig import LawRig

from hw.interface import LinkFault
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


def test_three_late_ticks_in_a_row_ramp_down_and_two_do_not():
    rig = spring_rig()
    rig.tick(skipped=1).tick(skipped=1).tick()
    assert rig.mode is State.ACTIVE
    for _ in range(3):
        rig.tick(skipped=1)
    assert rig.mode is State.STOPPING
    assert rig.run(60).mode is State.FAULT
    assert rig["fault_first"] == Fault.OVERRUN.value.bit_length() - 1


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
    assert rig["fault_first"] == Fault.TARGET_LOST.value.bit_length() - 1
    for _ in range(60):
        rig.request("target_count")
        rig.tick()
    assert rig.mode is State.IDLE  # nothing is broken, but only an operator's ARM leads back
    assert rig["torque_applied_nm"] == 0.0


def watched_rig(promise=200):
    rig = LawRig().arm()
    rig.command["beat_ticks"] = promise
    rig.request("beat_count")
    return rig.tick()


def test_a_host_that_is_silent_longer_than_it_promised_stops_the_rig():
    rig = watched_rig().run(200)
    assert rig.mode is State.ACTIVE
    epoch = int(rig["epoch"])
    rig.tick()
    assert rig.mode is State.STOPPING
    assert rig.faults == Fault.HOST_SILENT
    assert rig["fault_first"] == Fault.HOST_SILENT.value.bit_length() - 1
    assert rig["epoch"] == epoch + 1  # what waited in the host meanwhile is void
    rig.run(60)
    assert (rig.mode, rig.faults) == (State.IDLE, Fault(0))
    rig.request("beat_count")
    rig.run(60)
    assert rig.mode is State.IDLE  # it is back, but only an operator's ARM leads back


def test_beats_of_the_host_keep_the_rig_going_and_other_commands_do_not():
    rig = watched_rig()
    for _ in range(3):
        rig.run(190)
        rig.request("beat_count")
        rig.tick()
    assert rig.mode is State.ACTIVE
    for _ in range(250):
        rig.command["seq"] += 1
        rig.request("target_count")
        rig.tick()
    assert rig.mode is State.IDLE


def test_a_host_that_promises_nothing_is_not_watched():
    assert watched_rig(promise=0).run(400).mode is State.ACTIVE


def test_slots_that_the_loop_itself_missed_are_no_silence_of_the_host():
    rig = watched_rig(promise=20).run(19)
    rig.tick(skipped=5)
    assert rig.faults & Fault.HOST_SILENT == 0
    assert rig.mode is State.ACTIVE


def test_a_target_of_an_older_epoch_does_not_count_as_fresh():
    rig = remote_rig()
    for _ in range(30):
        rig.request("target_count")
        rig.command["target_epoch"] -= 1
        rig.tick()
    assert rig.mode is State.HOLD
    assert rig["targets_refused"] == 30


def test_only_the_holder_of_the_lease_moves_the_proxy_until_it_falls_silent():
    rig = remote_rig()
    assert rig["lease_held"] == 1
    rig.request("target_count")
    rig.command["target_lease"], rig.command["target_position_rad"] = 99, 0.005
    rig.tick()
    assert rig["proxy_position_rad"] == pytest.approx(0.002)
    assert rig["targets_refused"] == 1
    rig.run(60)
    assert rig["lease_held"] == 1
    rig.run(60)
    assert rig["lease_held"] == 0
    rig.request("target_count")
    rig.command["target_lease"] = 99
    assert rig.tick()["lease_held"] == 1
    rig.request("target_count")  # the former holder comes back too late
    assert rig.tick()["targets_refused"] == 2


def test_a_stop_ends_the_lease_and_empties_the_slot():
    rig = remote_rig()
    rig.request("stop_count")
    rig.tick()
    assert rig["lease_held"] == 0
    rig.run(60)
    for _ in range(700):
        rig.tick()  # the target of before still stands in the command
    rig.command["epoch"] = rig.state["epoch"]
    rig.request("arm_count")
    rig.run(14)
    assert rig.mode is State.STOPPING  # armed, and no target of this epoch ever came
    assert rig["torque_applied_nm"] == 0.0


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("field", ["target_position_rad", "target_velocity_rad_s"])
def test_a_target_that_is_not_finite_is_refused_in_the_loop_too(field, bad):
    rig = remote_rig()
    rig.request("target_count")
    rig.command[field] = bad
    rig.tick()
    assert rig["targets_refused"] == 1
    assert rig["torque_applied_nm"] == pytest.approx(0.12)


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
        rig.run(CLEAR_TICKS)
        rig.request("reset_count")
        assert rig.tick().mode is State.IDLE
        rig.arm()
    assert rig.mode is State.LOCKOUT
    assert rig["torque_applied_nm"] == 0.0
    rig.run(CLEAR_TICKS)
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
        rig.run(CLEAR_TICKS)
        rig.now["tick"] += 30_001
        rig.request("reset_count")
        assert rig.tick().mode is State.IDLE
        rig.arm()


def test_more_than_one_percent_of_late_ticks_ramps_down_and_exactly_one_percent_does_not():
    rig = spring_rig()
    for _ in range(10):
        rig.tick(skipped=1)
        rig.run(30)
    rig.run(1000)
    assert rig.mode is State.ACTIVE
    for _ in range(11):
        assert rig.mode is State.ACTIVE
        rig.tick(skipped=1)
        rig.tick()
    assert rig.faults & Fault.OVERRUN
    assert rig.mode is State.STOPPING


def test_one_tick_more_than_ten_periods_late_is_cut_before_anything_is_sent():
    assert spring_rig().tick(skipped=9).mode is State.ACTIVE
    rig = spring_rig().tick(skipped=10)
    assert rig.mode is State.FAULT
    assert rig["torque_applied_nm"] == 0.0
    assert rig["fault_first"] == Fault.STALLED.value.bit_length() - 1


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


def test_what_is_found_after_a_standstill_does_not_hide_it():
    rig = spring_rig().tick(skipped=10, link_faults=int(LinkFault.LOST | LinkFault.DEVICE))
    assert rig.faults & (Fault.LINK_LOST | Fault.STALLED) == Fault.LINK_LOST | Fault.STALLED
    assert rig["fault_first"] == Fault.STALLED.value.bit_length() - 1


def changed_to_remote(**before):
    """A rig in a spring that has just been asked to follow a renderer, which has not sent anything."""
    rig = LawRig(coupling_stiffness_nm_rad=60.0)
    rig.environment("spring", environment_stiffness_nm_rad=5.0, **before).arm()
    return rig.environment("remote")


def test_an_active_rig_can_change_to_a_remote_environment_and_waits_for_the_renderer():
    rig = changed_to_remote().run(20)
    assert rig.mode is State.ACTIVE
    rig.run(20)
    assert rig.mode is State.HOLD
    rig.command["target_position_rad"] = 0.001
    for _ in range(80):
        rig.request("target_count")
        rig.tick()
    assert rig.mode is State.ACTIVE
    assert rig["proxy_position_rad"] == pytest.approx(0.001)


def test_a_renderer_that_never_comes_stops_the_rig_after_as_long_as_one_that_falls_silent():
    rig = changed_to_remote().run(100)
    assert rig.mode is State.HOLD
    rig.run(1)
    assert rig.mode is State.STOPPING
    assert rig["fault_first"] == Fault.TARGET_LOST.value.bit_length() - 1


def test_what_a_renderer_sent_before_the_change_moves_nothing():
    rig = remote_rig()
    rig.environment("free").run(5)
    rig.environment("remote").run(15)
    assert rig.mode is State.ACTIVE
    assert rig["torque_applied_nm"] == pytest.approx(0.0, abs=1e-9)
