"""What the page tells a person to do, and which buttons it holds back."""

from unittest.mock import Mock

import pytest

from rtctl.client.view_guidance import hindrances, next_step, taken_apart
from rtctl.client.view_panel import ACTIONS
from rtctl.control.faults import TABLE
from rtctl.control.states import TRANSITIONS, Event
from rtctl.control.vocabulary import Fault, State


@pytest.mark.parametrize(("button", "event"), [("arm", Event.ARM), ("reset", Event.RESET)])
def test_a_button_is_offered_in_the_states_that_it_leads_out_of(button, event):
    leads = {state for row in TRANSITIONS if row.event == event for state in row.states}
    assert {state for state in State if not hindrances(state, 0)[button]} == leads


@pytest.mark.parametrize("state", State)
def test_what_is_not_offered_says_why_and_every_state_says_what_it_means(state):
    why = hindrances(state, int(Fault.STALE))
    assert why["arm"], "never with a fault present"
    assert all(not text or state.name in text or "fault" in text for text in why.values())
    assert next_step(state, 0)
    assert next_step(state, int(Fault.STALE))


@pytest.mark.parametrize("body", [{}, {"hands": "off"}, {"hands": True}, {"hands": "on"}])
def test_the_page_tares_under_a_pull_only_when_it_was_told_to(body):
    client = Mock()
    ACTIONS["tare"](client, None, body)
    client.tare.assert_called_once_with(hands_off=body == {"hands": "off"})


def test_a_stop_of_the_friction_watch_is_reset_in_idle():
    stopped = [{"name": "OVERCOMPENSATION"}]
    assert hindrances(State.IDLE, 0, stopped)["reset"] == ""
    assert hindrances(State.ACTIVE, 0, stopped)["reset"]
    assert hindrances(State.IDLE, 0, [{"name": "FRICTION_DRIFT"}])["reset"]


def test_a_reset_is_told_only_when_it_can_succeed():
    assert "Remove the cause" in next_step(State.FAULT, int(Fault.STALE))
    assert "The cause is gone: Reset" in next_step(State.FAULT, 0)
    assert "Release the emergency stop" in next_step(State.ESTOP, int(Fault.ESTOP))
    assert "restart" in next_step(State.LOCKOUT, 0)


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.name)
def test_every_fault_has_a_remedy_beside_what_is_wrong(row):
    wrong, remedy = taken_apart(row.name, row.text)
    assert wrong
    assert remedy
    assert not remedy.startswith(" ")
