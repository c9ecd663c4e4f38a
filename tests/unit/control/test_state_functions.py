"""The functions of the state machine one by one, to the tick and to the last bit of their thresholds."""

import pytest
from safety_rows import LINK_LOST, OVERRUN, PER_S, STALE, Rows

from rtctl.control import states
from rtctl.control.vocabulary import Fault, State


def test_a_rig_is_ready_after_enough_fresh_ticks_in_a_row_without_a_fault():
    rig = Rows()
    assert rig.advance() is State.IDLE
    for _ in range(4):
        rig.advance()
    assert (rig["good_ticks"], rig["clear_ticks"]) == (4, 4)
    assert rig.advance(requests=states.ARM, may_arm=True) is State.IDLE, "one short; but this one counted"
    assert rig.advance(requests=states.ARM, may_arm=False) is State.IDLE
    assert rig.advance(STALE, states.ARM, may_arm=True) is State.IDLE
    assert (rig["good_ticks"], rig["clear_ticks"]) == (0, 0)
    rig["sample_age_ticks"] = 1
    rig.advance()
    assert (rig["good_ticks"], rig["clear_ticks"]) == (0, 1)
    rig["sample_age_ticks"], rig["good_ticks"] = 0, 5
    assert rig.advance(requests=states.ARM, may_arm=True) is State.ARMING
    assert (rig["good_ticks"], rig["clear_ticks"], rig["authority"]) == (0, 0, 0.0)
    assert (rig["epoch"], rig["lease"], rig["fault_first"]) == (0, 0, -1)


def test_the_soft_start_rises_evenly_to_one_and_no_further():
    rig = Rows(State.ARMING)
    rig["authority"] = 0.7
    rig.advance()
    assert (rig["authority"], rig["ticks_in_state"]) == (0.7, 1)
    assert rig.advance(tested=True) is State.ACTIVE
    assert rig["authority"] == 0.0
    shares = []
    for _ in range(6):
        rig.advance()
        shares.append(rig["authority"])
    assert shares == [0.25, 0.5, 0.75, 1.0, 1.0, 1.0]
    assert rig["ticks_in_state"] == 6
    rig = Rows(State.ACTIVE, soft_start_ticks=0)
    rig.advance()
    assert rig["authority"] == 1.0


def test_a_silent_renderer_is_held_and_comes_back_softly_in_the_same_epoch():
    rig = Rows(State.ACTIVE)
    rig["authority"], rig["lease"], rig["epoch"] = 0.4, 7, 2
    assert rig.advance(silent=True) is State.HOLD
    assert rig["authority"] == 0.4
    assert rig.advance(silent=True) is State.HOLD
    assert rig["authority"] == 1.0
    assert rig.advance() is State.ACTIVE
    assert (rig["authority"], rig["lease"], rig["epoch"]) == (0.0, 7, 2)


@pytest.mark.parametrize("state", [State.ARMING, State.ACTIVE, State.HOLD])
@pytest.mark.parametrize(
    ("faults", "requests", "reached", "first", "target"),
    [
        (0, states.STOP, State.STOPPING, -1, State.IDLE),
        (0, states.TERMINATE, State.STOPPING, -1, State.SHUTDOWN),
        (OVERRUN, 0, State.STOPPING, 6, State.FAULT),
        (STALE | OVERRUN, states.STOP, State.FAULT, 0, None),
        (STALE | int(Fault.STALLED), 0, State.FAULT, 12, None),
        (int(Fault.ESTOP), 0, State.ESTOP, 10, None),
        (int(Fault.GATE), 0, State.LOCKOUT, 18, None),
    ],
)
def test_whatever_ends_motion_begins_an_epoch_ends_the_lease_and_keeps_its_cause(
    state, faults, requests, reached, first, target
):
    rig = Rows(state)
    rig["lease"], rig["epoch"], rig["authority"] = 7, 2, 0.5
    rig["stop_target"] = State.SHUTDOWN
    assert rig.advance(faults, requests) is reached
    assert (rig["lease"], rig["epoch"], rig["fault_first"], rig["authority"]) == (0, 3, first, 0.5)
    if target is not None:
        assert rig["stop_target"] == target


def test_a_stop_at_rest_voids_lease_and_epoch_and_one_in_motion_does_so_once():
    for state in (State.IDLE, State.FAULT, State.ESTOP):
        rig = Rows(state)
        rig["lease"] = 7
        assert rig.advance(requests=states.STOP) is state
        assert (rig["lease"], rig["epoch"]) == (0, 1)
        rig["lease"] = 7
        rig.advance(requests=states.RESET)
        assert (rig["lease"], rig["epoch"]) == (7, 1)


@pytest.mark.parametrize("torque", [0.5, -0.5, 1.0, -1.0])
def test_a_ramp_is_over_when_nothing_is_left_or_its_time_is(torque):
    rig = Rows(State.STOPPING)
    rig["torque_applied_nm"] = torque
    for tick in range(1, 50):
        assert rig.advance() is State.STOPPING
        assert rig["ticks_in_state"] == tick
    assert rig.advance() is State.IDLE
    rig = Rows(State.STOPPING)
    rig.advance(requests=states.TERMINATE)
    assert rig.mode is State.SHUTDOWN
    rig = Rows(State.STOPPING)
    assert rig.advance(OVERRUN) is State.FAULT


def test_what_comes_during_a_ramp_decides_where_it_leads_and_the_first_cause_stays():
    rig = Rows(State.STOPPING)
    rig["torque_applied_nm"] = 1.0
    rig.advance(OVERRUN)
    assert (rig["stop_target"], rig["fault_first"], rig["epoch"]) == (State.FAULT, 6, 0)
    rig.advance(int(Fault.TARGET_LOST))
    assert (rig["stop_target"], rig["fault_first"]) == (State.FAULT, 6)
    rig.advance(requests=states.TERMINATE)
    assert rig["stop_target"] == State.SHUTDOWN
    rig["fault_first"] = 0
    rig.advance(OVERRUN)
    assert (rig["stop_target"], rig["fault_first"]) == (State.SHUTDOWN, 0)
    rig["torque_applied_nm"] = 0.0
    assert rig.advance() is State.SHUTDOWN


def test_a_reset_needs_the_cause_to_be_gone_for_a_thousand_ticks_an_emergency_stop_only_its_release():
    rig = Rows(State.FAULT)
    rig["fault_first"], rig["clear_ticks"] = 3, 998
    assert rig.advance(requests=states.RESET) is State.FAULT
    assert rig.advance(requests=states.RESET) is State.IDLE
    assert rig["fault_first"] == -1
    rig = Rows(State.FAULT)
    rig["clear_ticks"] = 5000
    assert rig.advance(STALE, states.RESET) is State.FAULT
    rig = Rows(State.ESTOP)
    assert rig.advance(int(Fault.ESTOP), states.RESET) is State.ESTOP
    assert rig.advance(requests=states.RESET) is State.IDLE


def faults_at(*slots):
    """State after a rig was found to have lost its link at these slots, and was reset in between."""
    rig = Rows(State.IDLE)
    for slot in slots:
        rig["state"], rig["ticks_in_state"], rig.now = State.IDLE, 3, slot - 1
        rig.advance(LINK_LOST)
    return rig.mode


@pytest.mark.parametrize("start", [1, 12 * 60 * PER_S])
def test_three_faults_within_a_minute_to_the_tick_lock_the_rig_out(start):
    minute = 60 * PER_S
    assert faults_at(start) is State.FAULT
    assert faults_at(start, start + 1) is State.FAULT
    assert faults_at(start, start + 1, start + minute) is State.LOCKOUT
    assert faults_at(start, start + 1, start + minute + 1) is State.FAULT
    assert faults_at(start, start + minute - 1, start + minute + 1) is State.FAULT
    assert faults_at(start, start + 50 * PER_S, start + 70 * PER_S, start + 110 * PER_S) is State.LOCKOUT
    assert faults_at(start, start + 50 * PER_S, start + 70 * PER_S, start + 111 * PER_S) is State.FAULT


def test_the_lowest_bit_is_found_among_sixty_three():
    assert [states.lowest_bit(1 << bit | 1 << 62) for bit in range(63)] == list(range(63))
    assert states.lowest_bit(0) == -1
    assert states.lowest_bit(-(1 << 63)) == -1, "the sign is no fault"
