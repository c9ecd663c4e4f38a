"""The table of transitions, row by row and as a whole: every state x every set of events that matters."""

import itertools

import pytest

from rtctl.control import faults as fault_table
from rtctl.control.states import (
    ARM,
    RESET,
    STOP,
    TERMINATE,
    TRANSITIONS,
    Event,
    fault_events,
    is_powered,
    next_state,
    request_events,
    stop_target,
)
from rtctl.control.vocabulary import Fault, Reaction, State

ROWS = {row.fault: row for row in fault_table.TABLE}
LATCHED_AT_REST = {Fault.LINK_LOST, Fault.LAW_NOT_FINITE, Fault.GATE}
POWERED = [State.ARMING, State.ACTIVE, State.HOLD, State.STOPPING]
CLOSED = [State.LOCKOUT, State.SHUTDOWN]


def after(state, events):
    return State(next_state(int(state), int(Event.ALWAYS | events)))


def on(fault):
    return Event(fault_events(int(fault)))


def test_every_fault_has_one_row_with_cause_and_remedy_and_the_masks_share_no_bit():
    assert list(ROWS) == [row.fault for row in fault_table.TABLE]
    assert set(ROWS) == set(Fault)
    for row in ROWS.values():
        assert len(row.text) > 15
        assert row.detection
        assert row.clears
        assert row.within_ticks >= 1
    masks = [fault_table.mask(reaction) for reaction in Reaction]
    assert sum(masks) == sum(int(fault) for fault in Fault)
    for a, b in itertools.combinations(masks, 2):
        assert a & b == 0


def test_what_is_latched_at_rest_and_what_may_be_a_first_cause():
    latching = {row.fault for row in fault_table.TABLE if row.latches_at_rest}
    assert latching == LATCHED_AT_REST
    # The gate's own reaction outranks a latch.
    assert Fault(fault_table.LATCHING_AT_REST) == Fault.LINK_LOST | Fault.LAW_NOT_FINITE
    assert Fault(fault_table.LATCHED) == ~(Fault.END_OF_LOG | Fault.REALTIME)


@pytest.mark.parametrize("state", [State.ARMING, State.ACTIVE, State.HOLD])
@pytest.mark.parametrize("fault", list(Fault))
def test_a_fault_while_moving_reacts_as_its_row_says(state, fault):
    expected = {
        Reaction.CUT: State.FAULT,
        Reaction.RAMP: State.STOPPING,
        Reaction.STOP: State.STOPPING,
        Reaction.END: State.STOPPING,
        Reaction.ESTOP: State.ESTOP,
        Reaction.LOCKOUT: State.LOCKOUT,
        Reaction.REFUSE: state,
    }[ROWS[fault].reaction]
    assert after(state, on(fault)) is expected


@pytest.mark.parametrize("fault", [row.fault for row in fault_table.TABLE if row.reaction is Reaction.CUT])
@pytest.mark.parametrize("state", POWERED)
def test_a_cut_pre_empts_ramps_requests_and_the_end_of_a_ramp(state, fault):
    others = Event.RAMP | Event.STOP | Event.END | Event.ARM | Event.SILENT | Event.RAMPED_TO_IDLE
    assert after(state, on(fault) | others) is State.FAULT


@pytest.mark.parametrize("state", [state for state in State if state not in CLOSED])
def test_lock_out_outranks_the_emergency_stop_and_that_a_cut(state):
    assert after(state, Event.LOCKOUT | Event.ESTOP | Event.CUT) is State.LOCKOUT
    assert after(state, Event.ESTOP | Event.CUT | Event.RAMP | Event.STOP) is State.ESTOP


@pytest.mark.parametrize("fault", list(Fault))
@pytest.mark.parametrize("state", [State.INIT, State.IDLE])
def test_at_rest_only_faults_that_latch_lead_anywhere(state, fault):
    reaction = ROWS[fault].reaction
    reached = after(state, on(fault))
    if reaction is Reaction.LOCKOUT:
        assert reached is State.LOCKOUT
    elif reaction is Reaction.ESTOP:
        assert reached is State.ESTOP
    elif reaction is Reaction.END:
        assert reached is State.SHUTDOWN
    else:
        assert reached is (State.FAULT if ROWS[fault].latches_at_rest else State.IDLE)


ALL_EVENTS = [event for event in Event if event is not Event.ALWAYS]


def every_set_of_events():
    """All 2^16 sets."""
    for bits in range(1 << len(ALL_EVENTS)):
        yield bits << 1 | 1


def test_exhaustive_every_state_under_every_set_of_events():
    arming = into_active = 0
    for state in State:
        reached_somewhere = set()
        for events in every_set_of_events():
            to = State(next_state(int(state), events))
            reached_somewhere.add(to)
            # 6, 7: only a fresh ARM in IDLE leads to power
            if to is State.ARMING and state is not State.ARMING:
                assert state is State.IDLE
                assert events & Event.ARM
                assert not events & (Event.STOP | Event.ESTOP | Event.LOCKOUT | Event.LATCH | Event.TERMINATE)
                arming += 1
            if is_powered(int(to)) and not is_powered(int(state)):
                assert to is State.ARMING
            if to is State.ACTIVE and state is not State.ACTIVE:
                assert state in (State.ARMING, State.HOLD)
                into_active += 1
            if state in POWERED and events & Event.CUT:  # 8
                assert not is_powered(int(to))
            if state in (State.ARMING, State.ACTIVE, State.HOLD) and events & Event.STOP:  # 18
                assert to not in (State.ARMING, State.ACTIVE, State.HOLD)
            if state is State.SHUTDOWN:
                assert to is State.SHUTDOWN
            if state is State.LOCKOUT:
                assert to in CLOSED
        assert reached_somewhere
    assert arming > 0
    assert into_active > 0


def test_every_state_but_the_closed_ones_can_reach_idle_again_and_all_are_reachable():
    graph = {state: {after(state, event) for event in Event} for state in State}

    def reach(start):
        seen, todo = {start}, [start]
        while todo:
            for to in graph[todo.pop()]:
                if to not in seen:
                    seen.add(to)
                    todo.append(to)
        return seen

    assert reach(State.INIT) == set(State)
    for state in State:
        assert (State.IDLE in reach(state)) == (state not in CLOSED), state


def test_every_row_of_the_table_decides_in_some_situation():
    for i, row in enumerate(TRANSITIONS):
        deciding = [
            state
            for state in row.states
            if not any(state in before.states and before.event is row.event for before in TRANSITIONS[:i])
        ]
        assert deciding == list(row.states), row
        for state in row.states:
            assert after(state, row.event) is row.to or row.event is Event.ALWAYS or state is State.INIT


def test_requests_become_events_only_where_they_are_allowed():
    assert request_events(ARM, False, True) == 0
    assert request_events(RESET, True, False) == 0
    assert request_events(ARM | RESET | STOP | TERMINATE, True, True) == (
        Event.ARM | Event.RESET | Event.STOP | Event.TERMINATE
    )
    assert request_events(STOP, False, False) == Event.STOP
    assert request_events(TERMINATE, False, False) == Event.TERMINATE


@pytest.mark.parametrize("target", [State.IDLE, State.FAULT, State.SHUTDOWN])
def test_where_a_stop_leads_only_grows_in_rank(target):
    assert stop_target(int(target), 0, STOP) == target
    assert stop_target(int(target), 0, TERMINATE) == State.SHUTDOWN
    assert stop_target(int(target), int(Fault.END_OF_LOG), 0) == State.SHUTDOWN
    with_fault = stop_target(int(target), int(Fault.PASSIVITY), 0)
    assert with_fault == (State.SHUTDOWN if target is State.SHUTDOWN else State.FAULT)
    assert stop_target(int(target), int(Fault.TARGET_LOST), 0) == target
