import pytest

from rtctl.control.states import (
    ARM,
    ARMING_TICKS,
    CUT,
    RAMP,
    RESET,
    STOP,
    TERMINATE,
    is_powered,
    next_state,
)
from rtctl.control.vocabulary import Fault, State

ALL = [Fault(1 << bit) for bit in range(12)]


def after(state, faults=0, requests=0, **given):
    """Next state with everything else permitting and nothing due."""
    situation = {
        "ticks": 1, "may_arm": True, "may_reset": True, "hold": False, "ramped": False, "stop_target": State.IDLE,
        **given,
    }  # fmt: skip
    return State(next_state(int(state), int(faults), requests, *(int(value) for value in situation.values())))


def test_every_fault_has_exactly_one_reaction():
    ramp_or_cut = [fault for fault in ALL if fault not in (Fault.ESTOP, Fault.END_OF_LOG)]
    for fault in ramp_or_cut:
        assert bool(fault & CUT) != bool(fault & RAMP), fault


@pytest.mark.parametrize("state", [State.ARMING, State.ACTIVE, State.HOLD])
@pytest.mark.parametrize("fault", ALL)
def test_a_fault_while_powered_cuts_ramps_or_stops(state, fault):
    expected = State.FAULT if fault & CUT else State.STOPPING
    assert after(state, fault) is (State.ESTOP if fault is Fault.ESTOP else expected)


@pytest.mark.parametrize("fault", [fault for fault in ALL if fault & CUT])
def test_a_cut_pre_empts_a_ramp(fault):
    assert after(State.STOPPING, fault) is State.FAULT


@pytest.mark.parametrize("state", list(State))
@pytest.mark.parametrize("requests", range(16))
def test_only_arm_in_idle_leads_to_power_and_only_through_arming(state, requests):
    reached = after(state, requests=requests)
    if not is_powered(int(state)) and is_powered(int(reached)):
        assert state is State.IDLE
        assert reached is State.ARMING
        assert requests & ARM


@pytest.mark.parametrize("state", [State.INIT, State.FAULT, State.ESTOP, State.LOCKOUT, State.SHUTDOWN])
def test_arm_is_void_outside_idle(state):
    assert after(state, requests=ARM) is not State.ARMING


def test_the_table_of_transitions_without_faults():
    assert after(State.INIT) is State.IDLE
    assert after(State.IDLE) is State.IDLE
    assert after(State.IDLE, requests=ARM, may_arm=False) is State.IDLE
    assert after(State.ARMING, ticks=ARMING_TICKS - 1) is State.ARMING
    assert after(State.ARMING, ticks=ARMING_TICKS) is State.ACTIVE
    assert after(State.ACTIVE, hold=True) is State.HOLD
    assert after(State.HOLD, hold=True) is State.HOLD
    assert after(State.HOLD) is State.ACTIVE
    assert after(State.ACTIVE, requests=STOP) is State.STOPPING
    assert after(State.STOPPING) is State.STOPPING
    assert after(State.STOPPING, ramped=True, stop_target=State.SHUTDOWN) is State.SHUTDOWN
    assert after(State.FAULT, requests=RESET) is State.IDLE
    assert after(State.FAULT, requests=RESET, may_reset=False) is State.FAULT
    assert after(State.ESTOP, Fault.ESTOP, RESET) is State.ESTOP
    assert after(State.ESTOP, requests=RESET) is State.IDLE
    assert after(State.FAULT, requests=TERMINATE) is State.SHUTDOWN
    assert after(State.SHUTDOWN, Fault.ESTOP, ARM | RESET) is State.SHUTDOWN
