"""The law as a whole: every field written, invariants over any input, the same in plain Python."""

import math
import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from law_rig import B, LawRig, Plant, T

from rtctl.control.vocabulary import Policy, State
from rtctl.tick import FIELDS


def full_rig(n_axes=1, **params):
    rig = LawRig(
        n_axes,
        friction_policy=int(Policy.HYBRID),
        coupling_stiffness_nm_rad=60.0,
        coupling_damping_nms_rad=0.005,
        **params,
    )
    rig.friction()
    return rig.environment("spring", environment_stiffness_nm_rad=20.0)


def test_the_law_writes_every_field_that_is_its_own_and_no_other():
    rig = full_rig()
    writers = {field.name: field.writer for field in FIELDS}
    rig.run(5)
    for name in rig.now.dtype.names:
        if writers[name] == "law":
            rig.now[name] = 77
    others = {name: rig.now[name].copy() for name in rig.now.dtype.names if writers[name] != "law"}
    others["tick"] += 1
    others["sample_count"] += 1
    rig.tick()
    for name, writer in writers.items():
        if writer == "law":
            assert np.all(rig.now[name] != 77), name
        else:
            assert np.array_equal(rig.now[name], others[name]), name


def test_currents_and_torques_convert_through_the_drive_train():
    rig = full_rig().arm()
    rig.tick(0.01, current_a=1.5)
    assert rig["motor_torque_nm"] == pytest.approx(1.5 * 80 * 0.8 * 0.02)
    assert rig["current_command_a"] == pytest.approx(rig["torque_applied_nm"] / (80 * 0.8 * 0.02))
    assert rig["torque_applied_nm"] < 0.0


def test_the_feedforwards_energy_counts_only_what_was_applied():
    rig = full_rig(torque_limit_nm=0.1).arm()
    rig.force_n[1] = 40.0  # more than the coupling pulls: a hand that brakes is not helped
    x = 0.0
    for _ in range(300):
        x += 0.5 * T
        rig.tick(x)
    assert rig["feedforward_torque_nm"] > 0.2
    assert abs(rig["energy_feedforward_j"]) < 0.1 * 0.16


def test_two_axes_do_not_disturb_each_other():
    both, alone = full_rig(2), full_rig()
    both.params["coupling_stiffness_nm_rad"][0, 1] = 10.0
    both.arm()
    alone.arm()
    for k in range(100):
        both.tick([0.02 * math.sin(k * 0.05), 0.1 * math.sin(k * 0.03)])
        alone.tick(0.02 * math.sin(k * 0.05))
    for name in ("torque_applied_nm", "velocity_rad_s", "energy_port_j", "proxy_position_rad"):
        assert both.now[name][0, 0] == alone.now[name][0, 0]
        assert both.now[name][0, 1] != both.now[name][0, 0]


def test_two_runs_on_the_same_input_are_equal_to_the_last_bit():
    def run():
        rig = full_rig().arm()
        rng = np.random.default_rng(3)
        for k in range(500):
            rig.force_n[1] = rng.normal()
            rig.tick(0.05 * math.sin(k * 0.01), fresh=rng.random() > 0.1)
        return rig.now.tobytes() + rig.state.tobytes()

    assert run() == run()


def test_a_spring_under_a_pushing_hand_settles_at_the_series_stiffness():
    rig = full_rig().arm()
    plant = Plant()
    rig.force_n[1] = 1.0
    for _ in range(4000):
        rig.tick(plant.x)
        plant.advance(rig["torque_applied_nm"] - rig["feedforward_torque_nm"] + 0.1 - 0.2 * plant.v)
    assert plant.x == pytest.approx(0.1 / (60 * 20 / 80), rel=0.01)
    assert rig.mode is State.ACTIVE


broken = st.sampled_from([math.nan, math.inf, -math.inf, 1e300, -1e300, 200.0])
event = st.fixed_dictionaries(
    {},
    optional={
        "position": broken | st.floats(-0.05, 0.05),
        "force_n": st.tuples(*[broken | st.floats(-20, 20)] * 3).map(list),
        "current_a": broken,
        "fresh": st.booleans(),
        "skipped": st.integers(0, 30),
        "link_faults": st.integers(0, 15),
        "estop": st.integers(0, 1),
        "request": st.sampled_from(
            ["arm_count", "stop_count", "reset_count", "tare_count", "target_count", "shutdown_count"]
        ),
        "kind": st.sampled_from(["free", "spring", "wall", "damper", "detents", "remote"]),
        "center": broken | st.floats(-0.2, 0.2),
        "stiffness": broken | st.floats(0, 1e6),
        "compensation": broken | st.floats(0, 1),
        "coefficient": broken,
        "repeat": st.integers(1, 60),
    },
)


def apply(rig, step):
    """One event of the random campaign; returns the measurements for the following ticks."""
    step = dict(step)
    if "request" in step:
        rig.request(step.pop("request"))
        rig.command["epoch"] = rig.state["epoch"]
    if "kind" in step:
        rig.environment(step.pop("kind"), environment_pitch_rad=0.05)
    for name, field in (
        ("center", "environment_center_rad"),
        ("stiffness", "environment_stiffness_nm_rad"),
        ("compensation", "compensation"),
    ):
        if name in step:
            rig.command[field] = step.pop(name)
    if "coefficient" in step:
        rig.model["coefficient"][0, 0, :50, 0] = step.pop("coefficient")
    if "force_n" in step:
        step["force_n"] = [step["force_n"]]
    return step.pop("repeat", 1), step


@cache
def own_numbers(dtype):
    """Names and places, in steps of 8 bytes, of the numbers of a state, but of those that are taken over:
    they are as broken as what was sent.
    """
    found = []
    for name, (kind, offset) in dtype.fields.items():
        if kind.base.kind == "f" and name != "tare_sum" and not name.startswith("world_"):
            found += [(name, at) for at in range(offset // 8, (offset + kind.itemsize) // 8)]
    names, places = zip(*found, strict=True)
    return np.array(names), np.array(places)


def check_invariants(rig, before):
    """Numbers of the safety contract's list of invariants."""
    torque = rig["torque_applied_nm"]
    mode, flags = rig.mode, int(rig["gate_flags"])
    assert math.isfinite(torque)
    assert math.isfinite(rig["current_command_a"])
    assert abs(torque) <= 3.0  # 2
    if torque != 0.0:
        assert mode in (State.ACTIVE, State.HOLD, State.STOPPING)  # 1
        assert rig["enabled"] == 1.0
        assert rig["sample_age_ticks"] <= 2 or int(rig["faults"]) & 16
        assert abs(torque - before["torque"]) <= 1.0 + 1e-9  # 3
        assert abs(rig["velocity_rad_s"]) <= 10.0 or torque * rig["velocity_rad_s"] <= 0  # 15
    if mode in (State.INIT, State.IDLE, State.FAULT, State.ESTOP, State.SHUTDOWN):
        assert rig["enabled"] == 0.0  # 5
        assert torque == 0.0
        assert flags == 8
    if mode is State.ACTIVE and before["mode"] is not State.ACTIVE:
        assert before["mode"] in (State.ARMING, State.HOLD)  # 6
    if mode is State.STOPPING:
        assert abs(torque) <= abs(before["torque"])  # 8
    assert rig["epoch"] >= before["epoch"]
    names, at = own_numbers(rig.state.dtype)
    finite = np.isfinite(np.asarray(rig.state).view("<f8").ravel()[at])
    assert finite.all(), names[~finite]


@settings(max_examples=150, deadline=None)
@given(st.lists(event, max_size=30))
def test_whatever_happens_the_invariants_of_the_safety_contract_hold(events):
    rig = full_rig().arm()
    for step in events:
        repeat, measured = apply(rig, step)
        for _ in range(repeat):
            before = {"torque": rig["torque_applied_nm"], "mode": rig.mode, "epoch": rig["epoch"]}
            position = measured.get("position", rig.position[0])
            rig.tick(**{**measured, "position": position})
            check_invariants(rig, before)
        if not math.isfinite(rig.position[0]) or abs(rig.position[0]) > 1:
            rig.position = np.zeros(1)


def test_the_same_source_gives_the_same_numbers_as_plain_python():
    script = """
import math, sys
sys.path.insert(0, sys.argv[1])
from test_law import full_rig
rig = full_rig().arm()
rig.force_n[1] = 0.7
for k in range(150):
    rig.tick(0.05 * math.sin(k * 0.02), fresh=k % 17 != 3)
for name in ("torque_applied_nm", "velocity_rad_s", "energy_port_j", "feedforward_torque_nm", "state"):
    print(repr(rig[name]))
"""
    here = str(Path(__file__).parent)
    outputs = []
    for disabled in ("0", "1"):
        environment = {**os.environ, "NUMBA_DISABLE_JIT": disabled}
        done = subprocess.run(
            [sys.executable, "-Werror", "-c", script, here],
            env=environment, capture_output=True, text=True, timeout=280, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        outputs.append([float(line) for line in done.stdout.split()])
    assert outputs[0] == pytest.approx(outputs[1], rel=1e-12, abs=1e-15)
    assert outputs[0][4] == float(State.ACTIVE)
    assert abs(outputs[0][0]) > 0.1 * B
