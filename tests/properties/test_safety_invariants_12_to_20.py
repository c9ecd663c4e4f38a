"""The invariants of the safety contract, 12 to 20, each by its number (1 to 11: test_safety_invariants)."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from observed_run import observed_run
from random_lives import axis_column
from watched_rig import POWERED, WatchedRig

from hw.simulators.mock_records import Hand
from hw.simulators.serial_firmware import Board
from rtctl.control.vocabulary import Environment, State
from rtctl.rig_file import config
from rtctl.simulation.campaign_run import TWO_AXES_OF, Order, run_traced
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.shipped_files import shipped_config

DAY_NS = 86_400 * 10**9
SPOILED = {
    "stale": {"fresh": False},
    "position nan": {"position_rad": np.nan},
    "position jumps": {"position_rad": 0.3},
    "current inf": {"current_a": np.inf},
    "current wrong": {"current_a": -9.0},
    "force nan": {"force_n": np.nan},
    "link faults": {"link_faults": 1 | 2 | 4 | 16},
    "estop": {"estop": 1},
    "late": {"skipped": 1},
    "stalled": {"skipped": 12},
}


def test_invariant_12_observers_wall_clock_and_telemetry_speed_never_change_the_output(tmp_path, monkeypatch):
    states, alone = observed_run(tmp_path / "a", 0, 1_000_000)
    assert State.ACTIVE in states
    assert states[-1] == State.SHUTDOWN
    assert observed_run(tmp_path / "b", 3, 7)[1] == alone
    wall_ns = time.time_ns
    for step_ns in (DAY_NS, -DAY_NS):
        monkeypatch.setattr(time, "time_ns", lambda step_ns=step_ns: wall_ns() + step_ns)
        assert observed_run(tmp_path / f"c{step_ns}", 1, 100)[1] == alone


def test_invariant_13_no_port_gives_out_more_than_one_and_a_half_budgets():
    active = 0
    for index in range(1, 13):
        _, rig, ticks = run_traced(Order(seed=13, rigs=20, ticks=8000, passive=True), index, keep=8000)
        budget = rig.simulation.params[0]["energy_budget_j"]
        assert (ticks["energy_port_j"] >= -1.5 * budget).all()
        active += (ticks["state"] == State.ACTIVE).sum()
    assert active > 40_000


def test_invariant_14_the_feed_forward_is_capped_zero_outside_its_range_and_counted():
    outside = largest = 0
    for index in range(1, 25):
        if index % TWO_AXES_OF == 0:
            continue
        _, rig, ticks = run_traced(Order(seed=14, rigs=30, ticks=5000, faults=8), index, keep=5000)
        p, model = rig.simulation.params[0], rig.simulation.model[0]
        forward = np.abs(axis_column(ticks, "feedforward_torque_nm"))
        both = np.abs(axis_column(ticks, "feedforward_torque_nm") + axis_column(ticks, "observer_torque_nm"))
        assert (both <= p["friction_cap_nm"][0] * (1 + 1e-9)).all()
        assert (forward <= p["friction_cap_nm"][0] * (1 + 1e-9)).all()
        end = (model["speed_max_rad_s"] + model["speed_fade_rad_s"]).max()
        beyond = np.abs(axis_column(ticks, "velocity_rad_s")) > end
        assert (forward[beyond] == 0.0).all()
        assert (both[beyond] == 0.0).all()
        outside, largest = outside + beyond.sum(), max(largest, forward.max() / p["friction_cap_nm"][0])
    assert outside > 0
    assert largest > 0.5
    simulation = Simulation(config.load(shipped_config("mock.toml")))
    simulation.arm(compensation=1.0)
    ticks = simulation.run(2.0)
    wanted, sent = axis_column(ticks, "torque_wanted_nm"), axis_column(ticks, "torque_applied_nm")
    share = np.clip(np.divide(sent, wanted, out=np.zeros_like(sent), where=wanted != 0), 0, 1)
    help_nm = axis_column(ticks, "feedforward_torque_nm") + axis_column(ticks, "observer_torque_nm")
    work = (share * help_nm)[:-1] * np.diff(axis_column(ticks, "position_rad"))
    counted = np.diff(axis_column(ticks, "energy_feedforward_j"))
    assert np.abs(work).sum() > 1e-3
    np.testing.assert_allclose(counted, work, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_invariant_15_torque_times_velocity_is_not_positive_above_the_speed_limit(direction):
    # no observer: the motion is prescribed, and a torque that explains it is nowhere to be measured
    rig = WatchedRig(energy_budget_j=1e6, energy_bank_j=1e6, observer_gain=0.0)
    rig.params["follow_kind"] = 0
    rig.world(Environment.SPRING, 1e6, direction * 0.05)
    rig.arm()
    v_max, x, speed, pushed, braked = (
        float(rig.params["velocity_limit_rad_s"][0, 0]),
        rig["position_rad"],
        0.0,
        0,
        0,
    )
    rig.world(Environment.SPRING, 1e6, direction * 50.0)
    for _ in range(700):
        speed = min(speed + v_max / 400, 1.1 * v_max)
        x += direction * speed * 1e-3
        rig.run(position_rad=x)
        power = rig["torque_applied_nm"] * rig["velocity_rad_s"]
        if abs(rig["velocity_rad_s"]) > v_max:
            assert power <= 0.0
            braked += 1
        else:
            pushed += power > 0.0
    assert rig.mode is State.ACTIVE
    assert pushed > 100
    assert braked > 100


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("bits", [12, 14, 16, 32])
def test_invariant_16_a_wrap_of_the_encoder_is_no_step_of_the_torque(bits, direction):
    ticks = []
    for width in (bits, 0):
        rig = WatchedRig()
        count_rad = float(rig.plant_params["count_rad"][0, 0])
        half_rad = 2 ** (bits - 1) * count_rad
        start = direction * (half_rad - min(0.02, half_rad / 4))
        rig.plant_params["encoder_bits"], rig.plant_params["hand_kind"] = width, int(Hand.NONE)
        rig.params["position_max_rad"], rig.params["position_min_rad"] = 1e6, -1e6
        rig.world(Environment.SPRING, 3.0, start)
        seen = []
        for k in range(2200):
            way = max(k - 1700, 0) * 1e-3  # at rest while it is armed, then 1 rad/s
            rig.plant_state["position_rad"], rig.plant_state["velocity_rad_s"] = start + direction * way, 0.0
            if k % 20 == 0 and rig.mode is State.IDLE and rig.state["epoch"][0] == 0:
                rig.ask("arm_count")
            rig.run()
            seen.append((rig["position_rad"], rig["torque_applied_nm"], rig["state"]))
        assert rig.mode is State.ACTIVE, rig.faults
        assert max(abs(torque) for _, torque, _ in seen[1700:]) > 0.3
        assert rig.plant_state["position_rad"][0, 0] * direction > half_rad, "it went past the wrap"
        ticks.append(seen)
    assert ticks[0] == ticks[1], "bit for bit as with a counter that never wraps"


COUNT_LINES = """
import itertools, json, math, sys
import numpy as np
from watched_rig import WatchedRig
from rtctl.control import law
from rtctl.control.vocabulary import Environment

lines, raised, runs = 0, [], 0
def local(frame, event, _):
    global lines
    lines += event == "line"
    return local
def counted(rig, **measured):
    global lines
    lines, step = 0, law.step
    def traced(*arrays):
        sys.settrace(lambda frame, event, _: local if "rtctl/control" in frame.f_code.co_filename else None)
        try:
            step(*arrays)
        finally:
            sys.settrace(None)
    law.step = traced
    try:
        rig.step(**measured)
    except (ValueError, ArithmeticError):  # plain Python raises where compiled code goes on with nan or inf
        raised.append(measured)
    finally:
        law.step = step
    return lines
rig = WatchedRig(ready_ticks=5, soft_start_ticks=5, tare_ticks=5, arming_ticks=3).arm()
ordinary = max(counted(rig) for _ in range(50))
saved, worst = rig.copy_records(), 0
values = [math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, 1e18]
for value, kind in itertools.product(values, Environment):
    rig.put_back(saved)
    rig.world(kind, value, value)
    for name in ("environment_damping_nms_rad", "environment_pitch_rad", "target_position_rad",
                 "compensation"):
        rig.command[name] = value
    rig.target(value)
    for measured in ({}, {"position_rad": value}, {"force_n": value, "current_a": value},
                     {"skipped": 10**12}):
        worst, runs = max(worst, counted(rig, **measured)), runs + 1
    for name in ("arm_count", "stop_count", "reset_count", "tare_count", "target_count"):
        rig.command[name] = 2**62
    worst = max(worst, counted(rig, link_faults=63, estop=1))
print(json.dumps([ordinary, worst, runs, len(raised)]))
"""


def test_invariant_17_the_work_of_a_step_is_bounded_whatever_comes_in():
    """Lines executed by the law as plain Python: its loops run over axes, table rows, windows and bisections.

    A longest window and a bisection in the same tick are three times an ordinary one; a loop that follows its
    input would be thousands.
    """
    here, root = Path(__file__).parent, Path(__file__).parents[2]
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": f"{root}{os.pathsep}{here}"}
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", COUNT_LINES],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
    )
    assert done.returncode == 0, done.stderr
    ordinary, worst, runs, raised = json.loads(done.stdout)
    assert raised < runs / 2, "what plain Python cannot follow"
    assert ordinary > 100
    assert worst <= 4 * ordinary, (ordinary, worst)


@pytest.mark.parametrize(
    "state", [State.IDLE, *POWERED, State.FAULT, State.ESTOP], ids=lambda state: state.name
)
def test_invariant_18_a_stop_disables_within_51_ticks_and_every_open_state_leads_to_idle(state):
    rig = WatchedRig().enter(state)
    rig.ask("stop_count")
    for _ in range(51):
        rig.run()
    assert rig["enabled"] == 0.0
    assert rig["torque_applied_nm"] == 0.0
    if rig.mode is not State.IDLE:
        rig.run(1000)
        rig.ask("reset_count")
        rig.run()
    assert rig.mode is State.IDLE


@pytest.mark.parametrize(
    "state", [State.ARMING, State.ACTIVE, State.HOLD, State.STOPPING], ids=lambda state: state.name
)
@pytest.mark.parametrize("spoiled", SPOILED.values(), ids=SPOILED)
def test_invariant_19_a_fault_never_raises_the_torque_in_the_tick_that_sees_it(spoiled, state):
    rig, appeared = WatchedRig().enter(state), 0
    for _ in range(4):
        saved = rig.copy_records()
        faults_before, torque_before = rig.faults, abs(rig["torque_applied_nm"])
        rig.run()
        without = rig.faults
        rig.put_back(saved)
        rig.run(**spoiled)
        if rig.faults & ~without & ~faults_before:
            assert abs(rig["torque_applied_nm"]) <= torque_before
            appeared += 1
    assert appeared


@pytest.mark.parametrize("time_to_live", [1, 3, 10])
def test_invariant_20_with_frames_withheld_the_device_is_without_torque_after_its_time_to_live(time_to_live):
    rig = WatchedRig()
    rig.plant_params["time_to_live_ticks"] = time_to_live
    rig.arm()
    assert rig.plant_state["motor_torque_nm"][0, 0] > 0.1
    torques = []
    for _ in range(time_to_live + 4):
        rig.run(heard=False)
        torques.append(rig.plant_state["motor_torque_nm"][0, 0])
    assert not any(torques[time_to_live + 1 :])
    board = Board(1, "SIM", 500)
    board.held, board.expired, board.age = False, False, 0
    board.command["enable"], board.command["value"], board.command["time_to_live"] = 1, 10**6, time_to_live
    outputs = []
    for _ in range(time_to_live + 3):
        board.begin_cycle()
        outputs.append(float(board.output[0]))
    assert not any(outputs[time_to_live:])
    assert all(outputs[: time_to_live - 1])
    board.command["enable"] = 1
    assert board.output[0] == 0.0, "held until a command with enable 0"
