"""The oracle can see: every invariant is broken once by hand, and each time its bit is set."""

import math

import numpy as np
import pytest
from law_rig import LawRig

from hw.simulators.mock_records import params_dtype, state_dtype
from rtctl.control.jit import records
from rtctl.control.vocabulary import Fault, Program, State
from rtctl.simulation import campaign_monitor
from rtctl.simulation.campaign_monitor import INVARIANTS, memory_dtype, watch, watch_hand


class Watched:
    """A rig in ACTIVE with the monitor behind it, so far without complaint."""

    def __init__(self):
        self.rig = LawRig(coupling_stiffness_nm_rad=60.0, friction_cap_nm=0.9)
        self.memory = records(np.zeros(1, memory_dtype(1)))
        self.memory["stop_age"] = -1
        self.rig.environment("spring", environment_stiffness_nm_rad=60.0, environment_center_rad=0.01)
        self.run(40)
        self.rig.request("arm_count")
        self.run(80)
        assert self.rig.mode is State.ACTIVE
        assert self.rig["torque_applied_nm"] == pytest.approx(0.3)

    def watch(self, *, passive=True):
        bits = watch(
            self.rig.now[0],
            self.rig.state[0],
            self.rig.params[0],
            self.rig.command[0],
            self.rig.model,
            self.memory[0],
            passive,
        )
        return {number for number in INVARIANTS if bits >> number & 1}

    def run(self, n, **measured):
        for _ in range(n):
            self.rig.tick(**measured)
            assert self.watch() == set()

    def spoil(self, **fields):
        """Run one tick, overwrite what it wrote, and judge that."""
        self.rig.tick()
        for name, value in fields.items():
            self.rig.now[name] = value
        return self.watch()


@pytest.mark.parametrize(
    ("fields", "broken"),
    [
        ({"sample_age_ticks": 3}, {1}),
        ({"state": State.ARMING}, {1, 6}),
        ({"state": State.IDLE}, {1, 5}),
        ({"state": State.IDLE, "enabled": 0}, {1, 5}),
        ({"enabled": 0}, {5}),
        ({"current_command_a": 3.1 / 1.28}, {2}),
        ({"torque_applied_nm": 3.1}, {2, 3}),
        ({"torque_applied_nm": -0.8}, {3}),
        ({"torque_applied_nm": math.nan}, {4}),
        ({"torque_applied_nm": math.inf}, {4}),
        ({"current_command_a": math.nan}, {4}),
        ({"faults": int(Fault.STALE)}, {8}),
        ({"faults": int(Fault.GATE)}, {8}),
        ({"faults": int(Fault.VELOCITY)}, {8}),
        ({"faults": int(Fault.PASSIVITY)}, {8}),
        ({"faults": int(Fault.DEVICE), "torque_applied_nm": 0.4}, {8, 19}),
        ({"state": State.STOPPING, "torque_applied_nm": 0.31}, {8}),
        ({"state": State.FAULT, "enabled": 0, "torque_applied_nm": 0.0}, {9}),
        ({"lease_held": 1}, {10}),
        ({"energy_port_j": -0.031}, {13}),
        ({"energy_port_j": math.nan}, {13}),
        ({"friction_factor": 0.69}, {14}),
        ({"friction_factor": 1.01}, {14}),
        ({"friction_factor": math.nan}, {14}),
        ({"feedforward_torque_nm": 0.91}, {14}),
        ({"observer_torque_nm": -0.91}, {14}),
        ({"feedforward_torque_nm": 0.5, "observer_torque_nm": 0.41}, {14}),
        ({"feedforward_torque_nm": 0.5, "observer_torque_nm": -0.41}, set()),
        ({"feedforward_torque_nm": 0.1, "velocity_rad_s": 9.0, "torque_applied_nm": 0.3}, {14}),
        ({"velocity_rad_s": 10.1}, {15}),
    ],
)
def test_each_invariant_is_seen_when_broken(fields, broken):
    assert Watched().spoil(**fields) == broken


def test_every_fault_that_ends_torque_has_its_reaction_judged():
    judged = {fault for fault in Fault if fault & (campaign_monitor._CUT | campaign_monitor._RAMP)}
    # a log at its end is no fault of a rig, and who has no real-time rights is never armed
    assert set(Fault) - judged == {Fault.END_OF_LOG, Fault.REALTIME}


@pytest.mark.parametrize(("learned", "broken"), [(True, {14}), (False, set())])
def test_an_observer_beyond_the_trained_range_is_seen_where_there_is_a_range(learned, broken):
    watched = Watched()
    if learned:
        watched.rig.friction()
    assert watched.spoil(observer_torque_nm=0.1, velocity_rad_s=-4.4, torque_applied_nm=0.3) == set()
    assert watched.spoil(observer_torque_nm=0.1, velocity_rad_s=-4.6, torque_applied_nm=0.3) == broken


def test_active_out_of_nowhere_is_seen():
    watched = Watched()
    watched.memory["state"] = State.IDLE
    assert watched.spoil() == {6, 7}


def test_an_arm_request_of_another_epoch_is_no_excuse():
    watched = Watched()
    watched.memory["state"], watched.memory["epoch"] = State.IDLE, 5
    watched.rig.request("arm_count")
    assert {6, 7} <= watched.spoil(state=State.ARMING, torque_applied_nm=0.0, epoch=5)


def test_a_ramp_or_a_stop_that_takes_too_long_is_seen():
    watched = Watched()
    watched.memory["ramp_age"] = 51
    assert 8 in watched.spoil(state=State.STOPPING)
    watched = Watched()
    watched.memory["stop_age"] = 51
    assert watched.spoil() == {18}


def test_a_first_cause_that_changes_is_seen():
    watched = Watched()
    watched.memory["state"], watched.memory["fault_first"] = State.FAULT, 3
    fault = {"state": State.FAULT, "enabled": 0, "torque_applied_nm": 0.0}
    assert watched.spoil(**fault, fault_first=4) == {9}


def test_a_program_nobody_asked_for_is_seen():
    assert Watched().spoil(program_kind=Program.TRACK) == {10}


def test_a_program_asked_for_before_the_last_stop_is_seen_when_it_begins():
    watched = Watched()
    watched.rig.request("program_count")
    watched.memory["epoch"] += 1
    assert 10 in watched.spoil(program_kind=Program.TRACK, epoch=int(watched.memory["epoch"][0]))


def test_a_program_may_begin_by_a_fresh_request_go_on_and_be_ended_by_a_guard():
    watched = Watched()
    watched.rig.request("program_count")
    assert watched.spoil(program_kind=Program.TRACK) == set()
    assert watched.spoil(program_kind=Program.TRACK) == set()
    assert watched.spoil(program_kind=Program.BRAKE) == set()
    assert watched.spoil(program_kind=Program.SERVO) == {10}


def test_a_program_outside_active_is_seen():
    watched = Watched()
    watched.rig.request("program_count")
    assert watched.spoil(program_kind=Program.TRACK) == set()
    watched.memory["state"] = State.HOLD
    assert watched.spoil(program_kind=Program.TRACK) == {10}


def test_a_target_nobody_may_send_is_seen_when_it_has_an_effect():
    watched = Watched()
    watched.rig.request("target_count")
    watched.rig.tick()
    assert watched.watch() == set()
    watched.rig.request("target_count")
    watched.rig.command["target_lease"], watched.rig.command["target_position_rad"] = 99, 0.5
    watched.rig.tick()
    watched.rig.state["target_position_rad"] = 0.5
    assert watched.watch() == {10}


@pytest.mark.parametrize("given_j", [0.12, 0.14, math.nan])
def test_a_hand_that_is_given_more_than_store_power_and_budgets_is_seen(given_j):
    """0.1 J, 5 ticks of 1 W, 0.03 J; the hand gives way by a radian at the end of a tick."""
    rig = LawRig()
    rig.params["energy_budget_j"] = 0.02
    plant_p, plant, memory = (
        records(np.zeros(1, kind)) for kind in (params_dtype(1), state_dtype(1), memory_dtype(1))
    )

    def judged(state, torque=0.0, place=0.0):
        rig.now["state"], plant["hand_torque_nm"], plant["position_rad"] = int(state), torque, place
        return watch_hand(rig.now[0], plant[0], plant_p[0], rig.params[0], memory[0])

    assert judged(State.IDLE, -9.0, 1.0) == 0, "before arming it is the hand's own affair"
    for _ in range(4):
        assert judged(State.ACTIVE, 0.0, 1.0) == 0
    seen = judged(State.ACTIVE, -2.0 * given_j, 2.0)
    assert seen == (0 if given_j == 0.12 else 1 << 21)
    assert judged(State.ACTIVE, 0.0, 2.0) == seen
    assert judged(State.FAULT, 0.0, 2.0) == 0


def test_what_the_device_had_stored_at_arming_is_the_hands():
    rig, plant_p = LawRig(), records(np.zeros(1, params_dtype(1)))
    plant, memory = records(np.zeros(1, state_dtype(1))), records(np.zeros(1, memory_dtype(1)))
    plant_p["inertia_kgm2"], plant["velocity_rad_s"] = 0.02, 3.0
    plant_p["bristle_stiffness_nm_rad"], plant["bristle_rad"] = 200.0, 1e-2
    watch_hand(rig.now[0], plant[0], plant_p[0], rig.params[0], memory[0])
    assert memory["given_j"][0, 0] == pytest.approx(-0.09 - 0.01)
