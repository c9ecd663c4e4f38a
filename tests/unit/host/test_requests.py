import time
from dataclasses import replace

import numpy as np
import pytest

from rtctl.cli.operate import lines
from rtctl.control.environments.table import PARAMETERS
from rtctl.control.vocabulary import Environment, Fault, State
from rtctl.host.exchange.messages import Refusal, Request
from rtctl.host.exchange.operations import OPERATIONS
from rtctl.host.exchange.requests import Requests
from rtctl.host.exchange.rig_description import AxisDescription, RigDescription
from rtctl.rt.shared_memory import CommandWriter, Memory
from rtctl.tick import new_ticks
from rtctl.wire.authenticator import Caller
from rtctl.wire.protocol import Endpoints

RIG = RigDescription("mock", (AxisDescription("base", {}), AxisDescription("tip", {})), 1000.0)


OPERATOR = Caller("ipc:1:1:1", "ipc:1:1:1", "operator")


class Desk:
    def __init__(self):
        self.memory = Memory.create(2, 8, 1_000_000)
        self.caller = OPERATOR
        self.writer = CommandWriter(self.memory)
        self.row = new_ticks(1, 2)
        now_ns = time.monotonic_ns() + 10**12  # a tick that stays new for as long as a test may take
        self.row["time_ns"], self.row["state"], self.row["fault_first"] = now_ns, State.IDLE, -1
        self.requests = Requests(self.writer, RIG, Endpoints("ipc://t", "ipc://c"), lambda: self.row)

    def ask(self, op, epoch=None, **values):
        return self.requests.perform(Request(1, op, epoch, values), self.requests.newest(), self.caller)

    def refused(self, code, op, epoch=None, **values):
        before = self.writer.command.tobytes()
        outcome = self.ask(op, epoch, **values)
        assert isinstance(outcome, Refusal), outcome
        assert outcome.code == code
        assert self.writer.command.tobytes() == before
        return outcome.text

    @property
    def sent(self):
        return self.memory.slots[int(self.memory.header[0]["mailbox_seq"]) % len(self.memory.slots)][
            "command"
        ]


@pytest.fixture
def desk():
    made = Desk()
    yield made
    made.memory.close()


def test_every_operation_of_the_table_has_a_handler(desk):
    assert set(desk.requests._handlers) == set(OPERATIONS)


OPEN_TO = {
    "observer": {"hello", "status", "schema", "stop"},
    "renderer": {"lease", "release", "environment", "display", "target"},
    "operator": {"arm", "reset", "tare", "compensation", "adapt"},
}
"""What each role may do beyond the one before it: the contract, not read from the table under test."""


@pytest.mark.parametrize(("rank", "role"), list(enumerate(OPEN_TO)))
def test_each_role_is_refused_what_is_beyond_it_and_anybody_may_stop(desk, rank, role):
    desk.caller = Caller("key:x", "x", role)
    beyond = [op for later in list(OPEN_TO)[rank + 1 :] for op in OPEN_TO[later]]
    for op in beyond:
        desk.refused("forbidden", op)
    assert set(OPERATIONS) == set().union(*OPEN_TO.values())
    assert desk.ask("stop") == {"command_seq": 1}


def test_arm_raises_the_counter_once_in_the_epoch_of_the_newest_tick(desk):
    desk.row["epoch"] = 5
    assert desk.ask("arm", 5) == {"command_seq": 1}
    assert (desk.sent["arm_count"], desk.sent["epoch"]) == (1, 5)


def test_an_arm_request_that_was_given_up_long_ago_arms_nothing(desk):
    desk.row["tick"] = 7001
    assert "came too late" in desk.refused("not_ready", "arm", 0, tick=5000.0)
    assert desk.ask("arm", 0, tick=5001.0) == {"command_seq": 1}
    assert desk.ask("arm", 0) == {"command_seq": 2}, "a client of old does not tell its tick"


def test_an_arm_request_to_the_daemon_before_arms_nothing_in_this_one(desk):
    desk.row["tick"] = 600
    assert "started anew" in desk.refused("not_ready", "arm", 0, tick=601.0)


def test_a_virtual_clock_runs_on_while_a_request_is_on_its_way(desk):
    desk.requests._rig, desk.row["tick"] = replace(RIG, virtual=True), 1_000_000
    assert desk.ask("arm", 0, tick=0.0) == {"command_seq": 1}


def test_an_old_epoch_voids_every_request_but_stop(desk):
    desk.row["epoch"] = 5
    assert "5 is in force" in desk.refused("wrong_epoch", "arm", 4)
    desk.refused("wrong_epoch", "compensation", 4, share=1.0)
    assert desk.ask("stop", 4) == {"command_seq": 1}


def test_nothing_arms_until_the_loop_has_taken_a_stop(desk):
    seq = desk.ask("stop")["command_seq"]
    assert "stop" in desk.refused("not_ready", "arm", 0)
    desk.writer.command["environment_kind"] = Environment.REMOTE
    desk.refused("wrong_epoch", "target", 0, lease="0" * 16, position_rad=[0.0, 0.0])
    desk.refused("wrong_epoch", "lease", 0)
    desk.row["command_seq"] = seq
    assert desk.ask("arm", 0) == {"command_seq": 2}


@pytest.mark.parametrize("state", [s for s in State if s != State.IDLE])
def test_arming_starts_from_idle_only_and_the_refusal_names_the_state(desk, state):
    desk.row["state"] = state
    assert state.name in desk.refused("not_ready", "arm", 0)


def test_a_refused_arm_names_what_is_missing(desk):
    desk.row["faults"] = Fault.STALE | Fault.JUMP
    why = desk.refused("not_ready", "arm", 0)
    assert "STALE: the device sends no fresh samples" in why
    assert "JUMP: the position jumped" in why
    desk.row["faults"], desk.row["estop"] = 0, 1
    assert "emergency stop" in desk.refused("not_ready", "arm", 0)


def test_a_loop_that_stands_still_cannot_be_armed(desk):
    desk.row["time_ns"] = time.monotonic_ns() - 1_500_000_000
    assert "does not run" in desk.refused("not_ready", "arm", 0)


def test_before_the_first_tick_the_state_is_init_and_arming_is_refused(desk):
    desk.row = None
    assert "does not run" in desk.refused("not_ready", "arm", 0)
    assert desk.ask("status")["position_rad"] == [0.0, 0.0]


def test_reset_needs_a_latched_fault_and_never_opens_lockout(desk):
    assert "no latched fault" in desk.refused("not_ready", "reset")
    desk.row["state"] = State.LOCKOUT
    assert "restarts" in desk.refused("not_ready", "reset")
    for state in (State.ARMING, State.ACTIVE, State.HOLD, State.STOPPING):
        desk.row["state"] = state
        assert "no latched fault" in desk.refused("not_ready", "reset")
    desk.row["state"] = State.FAULT
    assert desk.ask("reset") == {"command_seq": 1}


@pytest.mark.parametrize("state", [State.FAULT, State.ESTOP])
def test_a_reset_while_the_cause_is_there_is_refused_and_names_it(desk, state):
    desk.row["state"], desk.row["faults"] = state, int(Fault.STALE | Fault.CHECKSUM)
    words = desk.refused("not_ready", "reset")
    assert f"state {state.name}, still present: STALE: the device sends no fresh samples" in words
    assert "CHECKSUM" in words
    desk.row["estop"] = 1
    assert "emergency stop is pressed; release it" in desk.refused("not_ready", "reset")
    desk.row["estop"] = desk.row["faults"] = 0
    assert desk.ask("reset") == {"command_seq": 1}


def test_the_force_is_not_tared_while_torque_may_flow(desk):
    for state in (State.ARMING, State.ACTIVE, State.HOLD, State.STOPPING):
        desk.row["state"] = state
        desk.refused("not_ready", "tare")
    desk.row["state"] = State.IDLE
    desk.ask("tare")
    assert desk.sent["tare_count"] == 1


def test_an_environment_changes_only_its_axis_and_only_the_keys_given(desk):
    desk.ask("environment", axis=1, kind="wall", stiffness_nm_rad=3.0, side=-1)
    result = desk.ask("environment", axis=1, kind="wall", center_rad=0.5)
    assert desk.sent["environment_kind"].tolist() == [Environment.FREE, Environment.WALL]
    assert desk.sent["environment_stiffness_nm_rad"].tolist() == [0.0, 3.0]
    assert desk.sent["environment_side"].tolist() == [0, -1]
    untouched = {one.name: 0.0 for one in PARAMETERS}
    asked = {"kind": "wall", "stiffness_nm_rad": 3.0, "center_rad": 0.5, "side": -1}
    assert result["environment"] == {**untouched, **asked}


def test_a_target_needs_a_remote_environment_and_counts_as_fresh(desk):
    given = desk.ask("lease", 0)
    lease = given["lease"]
    assert given["remote"] == []  # as after a restart, where the holder of before had set one
    desk.refused("not_remote", "target", 0, lease=lease, position_rad=[0.1, 0.2])
    desk.ask("environment", axis=1, kind="remote")
    assert desk.ask("lease", 0, lease=lease)["remote"] == [RIG.axes[1].name]
    desk.ask("environment", axis=0, kind="remote")
    desk.ask("target", 0, lease=lease, position_rad=[0.1, 0.2], velocity_rad_s=[1.0, 2.0])
    desk.ask("target", 0, lease=lease, position_rad=[0.3, 0.4])
    assert desk.sent["target_count"] == 2
    assert desk.sent["target_position_rad"].tolist() == [0.3, 0.4]
    assert desk.sent["target_velocity_rad_s"].tolist() == [0.0, 0.0]


def test_a_display_is_taken_where_the_rig_file_lets_it_change(desk):
    rig = RigDescription(
        "mock",
        (
            AxisDescription("base", {}, displays=("admittance", "impedance")),
            AxisDescription("tip", {}, displays=("impedance",)),
        ),
        1000.0,
    )
    desk.requests = Requests(desk.writer, rig, Endpoints("ipc://t", "ipc://c"), lambda: desk.row)
    told = desk.ask("display", axis=0, display="admittance", mass_kgm2=0.03, mass_damping_nms_rad=0.4)
    assert told["display"] == {"kind": "admittance", "mass_kgm2": 0.03, "mass_damping_nms_rad": 0.4}
    # what is left out stays
    assert desk.ask("display", axis=0, display="impedance")["display"]["mass_kgm2"] == 0.03
    assert desk.sent["mass_kgm2"].tolist() == [0.03, 0.0]
    assert "display_change = true" in desk.refused("out_of_bounds", "display", axis=1, display="admittance")
    desk.caller = Caller("key:r", "r", "renderer")
    assert "lease" in desk.refused("missing_key", "display", axis=0, display="impedance")


def test_the_mass_of_an_admittance_is_in_the_status_for_a_person(desk):
    desk.writer.command["display_kind"], desk.writer.command["mass_kgm2"] = [1, 0], [0.03, 0.0]
    told = "\n".join(lines({"rig": "mock", "state": "IDLE", "authority": 0.0, **desk.ask("status")}))
    assert told.count("admittance: mass 0.03 kg m^2") == 1


def test_a_friction_that_is_followed_is_in_the_status_for_a_person(desk):
    desk.writer.command["friction_change"] = [-0.05, 0.0]
    told = desk.ask("status")
    assert [axis["friction_factor"] for axis in told["axes"]] == [0.95, 1.0]
    shown = "\n".join(lines({"rig": "mock", "state": "IDLE", "authority": 0.0, **told}))
    assert shown.count("compensation 0% of 0.950 times the learned friction\n") == 1
    assert shown.count("times the learned friction") == 1


def test_compensation_goes_to_one_axis_or_to_all(desk):
    desk.ask("compensation", share=0.5)
    desk.ask("compensation", share=1.0, axis=1)
    assert desk.sent["compensation"].tolist() == [0.5, 1.0]


def test_status_names_faults_and_the_first_cause(desk):
    desk.row["faults"] = Fault.OVERSPEED
    desk.row["fault_first"] = 5
    status = desk.ask("status")
    assert [fault["name"] for fault in status["faults"]] == ["OVERSPEED"]
    assert status["fault_first"]["name"] == "OVERSPEED"
    assert "faster" in status["fault_first"]["text"]


def test_status_tells_what_the_pulse_and_motion_showed_of_the_torque(desk):
    desk.row["arming_gain"], desk.row["arming_offset_nm"] = [0.93, np.nan], [0.02, np.nan]
    desk.row["arming_delay_ticks"], desk.row["arming_lag_ticks"] = [1.5, np.nan], [0.5, np.nan]
    desk.row["running_delay_ticks"] = desk.row["running_gain"] = desk.row["running_offset_nm"] = np.nan
    base, tip = (axis["measured"] for axis in desk.ask("status")["axes"])
    assert (base["gain"], base["offset_nm"], base["running_gain"]) == (0.93, 0.02, None)
    assert (base["delay_s"], base["lag_s"]) == pytest.approx((1.5 / RIG.rate_hz, 0.5 / RIG.rate_hz))
    assert set(tip.values()) == {None}
    told = {
        "rig": "mock", "state": "ACTIVE", "fault_first": None, "faults": [], "warnings": [], "enabled": True,
        "estop": False,
        "authority": 1.0, "waiver": False, "lease_holder": None, "position_rad": [0.0, 0.0],
        "velocity_rad_s": [0.0, 0.0],
        "axes": desk.ask("status")["axes"],
    }  # fmt: skip
    (line,) = [line for line in lines(told) if "pulse" in line]
    assert line == (
        f"    test pulse: current 0.93 of what was sent, +0.02 N m off, torque {1500 / RIG.rate_hz:.3g} ms "
        f"late at least (lag {500 / RIG.rate_hz:.3g})"
    )
    desk.row["running_gain"], desk.row["running_offset_nm"] = [0.7, np.nan], [-0.1, np.nan]
    told["axes"] = desk.ask("status")["axes"]
    assert "    running: current 0.7 of what is sent, -0.1 N m off" in lines(told)
    assert "  not proved (rtctl check): tip: row" in lines(told | {"not_proved": ["tip: row"]})


def test_results_hold_plain_python_values_only(desk):
    def walk(value):
        assert not isinstance(value, np.generic | np.ndarray), value
        for item in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
            walk(item)

    for op in ("hello", "status", "schema"):
        walk(desk.ask(op))
    walk(desk.ask("environment", axis=0, kind="detents", pitch_rad=0.5))
