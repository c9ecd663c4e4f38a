"""Requests that are refused with a remedy, and what a status warns of."""

from dataclasses import replace

import numpy as np
import pytest
from test_requests import RIG, Desk

from rtctl.control.records import params_dtype
from rtctl.control.vocabulary import State
from rtctl.host.exchange.messages import Refusal
from rtctl.host.exchange.motor_temperature import TemperatureWatch
from rtctl.host.exchange.operations import OPERATIONS
from rtctl.host.exchange.requests import Requests
from rtctl.wire.protocol import Endpoints


@pytest.fixture
def desk():
    made = Desk()
    yield made
    made.memory.close()


@pytest.mark.parametrize("shown", [0.051, -0.051, 40.0, np.nan])
def test_a_hand_that_pulls_is_not_taken_for_zero_unless_somebody_says_it_is_none(desk, shown):
    params = np.zeros(1, params_dtype(2))
    params["force_offset_limit_nm"] = 0.2
    described = replace(RIG, axes=(RIG.axes[0], replace(RIG.axes[1], motion="linear")), params=params)
    desk.requests = Requests(desk.writer, described, Endpoints("ipc://t", "ipc://c"), lambda: desk.row)
    desk.row["hand_torque_nm"] = [[0.049, shown]]
    for state in (State.INIT, State.IDLE, State.FAULT, State.ESTOP):
        desk.row["state"] = state
        told = desk.refused("not_ready", "tare")
        assert f"axis tip: the force sensor shows {shown:.3g} N, more than 0.05: a hand" in told
        assert told.endswith("`rtctl tare --hands-off`")
    assert desk.refused("missing_key", "tare", hands="off").startswith("epoch: ")
    desk.ask("tare", 0, hands="off")
    assert desk.sent["tare_count"] == 1
    desk.row["hand_torque_nm"] = [[0.049, -0.049]]
    desk.ask("tare")
    assert desk.sent["tare_count"] == 2


@pytest.mark.parametrize(
    ("op", "values"),
    [
        ("tare", {"hands": "off"}),
        ("environment", {"axis": 0, "kind": "free"}),
        ("display", {"axis": 0}),
        ("compensation", {"share": 1.0}),
        ("lease", {}),
        ("target", {"lease": "0" * 16, "position_rad": [0.0, 0.0]}),
    ],
)
def test_what_was_asked_in_an_epoch_is_void_from_a_stop_on_that_the_loop_has_not_seen(desk, op, values):
    desk.ask("stop")
    assert "on its way" in desk.refused("wrong_epoch", op, 0, **values)
    desk.row["command_seq"], desk.row["epoch"] = 1, 1
    assert "is void" in desk.refused("wrong_epoch", op, 0, **values)


class Stopped:
    """A friction watch that has stopped the rig."""

    seen = False

    def hindrance(self, compensation):
        return "" if self.seen or compensation.max() < 0.5 else "dry friction is at most .8"

    def dismiss(self):
        self.seen, before = True, self.seen
        return not before


def test_a_rig_that_was_stopped_for_its_friction_is_armed_by_less_compensation_or_a_word_only(desk):
    desk.writer.command["compensation"] = 1.0
    desk.requests._friction = Stopped()
    assert desk.refused("not_ready", "arm", 0) == "dry friction is at most .8"
    desk.writer.command["compensation"] = 0.4
    assert "command_seq" in desk.ask("arm", 0)
    desk.writer.command["compensation"] = 1.0
    assert desk.refused("not_ready", "arm", 0)
    desk.ask("reset")
    assert desk.sent["reset_count"] == 0, "nothing of the loop's"
    assert "command_seq" in desk.ask("arm", 0)
    assert "no latched fault" in desk.refused("not_ready", "reset")


@pytest.mark.parametrize("state", [State.LOCKOUT, State.SHUTDOWN])
def test_a_closed_rig_answers_stops_and_refuses_whatever_would_change_it(desk, state):
    desk.row["state"] = state
    answered = {"hello", "status", "schema", "stop"}
    for op in OPERATIONS.keys() - answered:
        assert "a person restarts the daemon" in desk.refused("not_ready", op, 0, follow="off", share=0.5)
    assert not any(isinstance(desk.ask(op), Refusal) for op in answered)
    assert "ask for the status" in desk.refused("wrong_epoch", "arm", 7)


def test_status_warns_of_a_motor_outside_the_learned_temperatures(desk):
    assert desk.ask("status")["warnings"] == []
    base = replace(RIG.axes[0], trained_c=(22.0, 31.0))
    watch = TemperatureWatch(replace(RIG, axes=(base, RIG.axes[1])))
    desk.requests = Requests(
        desk.writer, RIG, Endpoints("ipc://t", "ipc://c"), lambda: desk.row, motors=watch
    )
    desk.row["temperature_c"] = 47.0, 47.0
    (warning,) = desk.ask("status")["warnings"]
    assert (warning["name"], warning["axis"]) == ("TEMPERATURE", "base")
    assert "the motor is at 47" in warning["text"]
    watch.changes(desk.row[0])
    desk.row["temperature_c"] = 35.5, 0.0
    assert desk.ask("status")["warnings"], "nearer than the margin, but only just: as events and health"
    watch.changes(desk.row[0])
    desk.row["temperature_c"] = 34.9, 0.0
    assert desk.ask("status")["warnings"] == []
