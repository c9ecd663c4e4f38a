import math

import pytest
from law_rig import LawRig

from hw.interface import LinkFault
from rtctl.control.vocabulary import Fault, State


def started(**params):
    return LawRig(**params).run(30)


@pytest.mark.parametrize(
    ("spoilt", "fault"),
    [
        ({"position": math.nan}, Fault.BAD_SAMPLE),
        ({"position": math.inf}, Fault.BAD_SAMPLE),
        ({"position": 101.0}, Fault.BAD_SAMPLE),
        ({"current_a": math.nan}, Fault.BAD_SAMPLE),
        ({"current_a": -21.0}, Fault.BAD_SAMPLE),
        ({"force_n": [0.0, 0.0, math.nan]}, Fault.BAD_SAMPLE),
        ({"force_n": [51.0, 0.0, 0.0]}, Fault.BAD_SAMPLE),
        ({"fresh": False}, Fault.STALE),
        ({"link_faults": int(LinkFault.SEQUENCE)}, Fault.STALE),
        ({"link_faults": int(LinkFault.CHECKSUM)}, Fault.CHECKSUM),
    ],
)
def test_two_spoilt_samples_are_held_and_the_third_is_a_fault(spoilt, fault):
    rig = started().arm()
    for age in (1, 2):
        rig.tick(**spoilt)
        assert rig["sample_age_ticks"] == age
        assert rig.faults == Fault(0)
        assert rig.mode is State.ACTIVE
        assert math.isfinite(rig["torque_wanted_nm"])
    rig.tick(**spoilt)
    assert rig.faults == fault
    assert rig.mode is State.FAULT
    assert rig["fault_first"] == fault.value.bit_length() - 1
    assert rig["torque_applied_nm"] == 0.0


def test_a_good_sample_in_between_starts_the_count_again():
    rig = started().arm()
    for _ in range(20):
        rig.run(2, fresh=False).tick()
    assert rig.mode is State.ACTIVE


def test_an_older_sample_is_never_accepted():
    rig = started()
    rig.tick(0.001)
    rig.tick(0.002, sample_count=5)
    assert rig.state["position_rad"][0, 0] == 0.001


@pytest.mark.parametrize("to_rad", [0.1, -0.1])
def test_one_jump_is_discarded_and_a_second_cuts(to_rad):
    rig = started().arm()
    rig.tick(to_rad)  # 100 rad/s: far above 1.5 * 10 rad/s
    assert rig.state["position_rad"][0, 0] == 0.0
    assert rig.mode is State.ACTIVE
    rig.tick(to_rad)
    assert rig.faults == Fault.JUMP
    assert rig.mode is State.FAULT
    assert rig["torque_applied_nm"] == 0.0


def test_after_a_jump_the_estimators_start_again_where_the_joint_is():
    rig = started().arm()
    rig.tick(0.1).tick(0.1).tick(0.1)
    assert rig.faults == Fault(0)
    assert rig["velocity_rad_s"] == 0.0
    assert rig.state["position_rad"][0, 0] == 0.1


def test_motion_during_missed_samples_and_ticks_is_no_jump():
    rig = started()
    rig.tick(0.0, fresh=False)
    rig.tick(0.055, skipped=2)  # 4 slots at 14 rad/s
    assert rig["sample_age_ticks"] == 0
    rig.tick(0.055 + 0.016)
    assert rig["sample_age_ticks"] == 1


def test_a_lost_link_is_a_fault_at_once_also_at_rest():
    rig = started().tick(fresh=False, link_faults=int(LinkFault.LOST))
    assert rig.faults & Fault.LINK_LOST
    assert rig.mode is State.FAULT


@pytest.mark.parametrize(
    ("measured", "fault"),
    [
        ({"link_faults": int(LinkFault.DEVICE)}, Fault.DEVICE),
        ({"estop": 1}, Fault.ESTOP),
        ({"estop": -1}, Fault.ESTOP),
    ],
)
def test_what_the_device_reports_of_itself_is_a_fault_in_the_same_tick_and_gone_with_it(measured, fault):
    rig = started().tick(**measured)
    assert rig.faults == fault
    assert rig.tick().faults == Fault(0)


def test_fifty_damaged_frames_among_a_thousand_are_let_pass_and_one_more_is_not():
    rig = started()
    for _ in range(50):
        rig.tick(fresh=False, link_faults=int(LinkFault.CHECKSUM)).tick()
        assert rig.faults == Fault(0)
    assert rig.tick(fresh=False, link_faults=int(LinkFault.CHECKSUM)).faults == Fault.CHECKSUM
    assert rig.tick().faults == Fault.CHECKSUM, "as long as there are more among the last thousand"


def test_nothing_is_stale_before_the_first_valid_sample():
    rig = LawRig()
    rig.run(10, fresh=False)
    assert rig.faults == Fault(0)
    assert rig.mode in (State.INIT, State.IDLE)


def test_the_end_of_a_log_stops_and_shuts_down_without_a_fault():
    rig = started().arm()
    rig.run(60, fresh=False, link_faults=int(LinkFault.END_OF_LOG))
    assert rig.mode is State.SHUTDOWN
    assert rig["fault_first"] == -1


def test_the_measured_fields_stay_as_they_were_measured():
    rig = started().tick(math.nan)
    assert math.isnan(rig["position_rad"])
    for name in (
        "velocity_rad_s",
        "hand_torque_nm",
        "coupling_torque_nm",
        "energy_port_j",
        "motor_torque_nm",
    ):
        assert math.isfinite(rig[name])


def test_a_device_that_was_lost_begins_anew_and_only_a_reset_and_an_arm_lead_back():
    rig = started().arm()
    rig.tick(link_faults=int(LinkFault.LOST), fresh=False)
    assert rig.mode is State.FAULT
    assert rig["fault_first"] == Fault.LINK_LOST.value.bit_length() - 1
    rig.run(700, link_faults=int(LinkFault.LOST), fresh=False)
    rig.now["sample_count"] = 0  # the device starts counting again, and stands elsewhere
    rig.run(3, position=2.5)
    assert rig.faults == Fault(0)
    assert rig["sample_age_ticks"] == 0
    assert rig.state["position_rad"][0, 0] == 2.5
    assert rig["velocity_rad_s"] == 0.0
    rig.run(1100)
    assert rig.mode is State.FAULT
    rig.request("reset_count")
    assert rig.tick().mode is State.IDLE
    assert rig.run(500).mode is State.IDLE


@pytest.mark.parametrize(
    ("spoilt", "fault"),
    [
        ({"position": math.nan}, Fault.BAD_SAMPLE),
        ({"force_n": [0.0, 0.0, math.nan]}, Fault.BAD_SAMPLE),
        ({"fresh": False}, Fault.STALE),
        ({"link_faults": int(LinkFault.CHECKSUM)}, Fault.CHECKSUM),
    ],
)
def test_a_sensor_that_is_bad_from_the_first_tick_on_names_its_cause_and_is_not_armed(spoilt, fault):
    rig = LawRig()
    rig.run(19, **spoilt)
    assert rig.faults == Fault(0), "a start may take as long as readiness does"
    rig.tick(**spoilt)
    assert (rig.faults, rig.mode) == (fault, State.IDLE)
    rig.request("arm_count")
    rig.run(20, **spoilt)
    assert (rig.faults, rig.mode) == (fault, State.IDLE)
    assert rig.tick(0.0).faults == Fault(0)


def test_a_device_that_is_found_again_and_shows_nothing_usable_names_its_cause():
    rig = started().run(30, fresh=False, link_faults=int(LinkFault.LOST))
    assert rig.faults == Fault.LINK_LOST, "as long as it is gone that is all there is to say"
    rig.run(30, current_a=math.nan)
    assert rig.faults == Fault.BAD_SAMPLE
