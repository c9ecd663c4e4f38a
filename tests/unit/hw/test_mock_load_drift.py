"""Load-dependent and drifting friction against closed forms written down anew."""

import math

import numpy as np
import pytest
from hardware import rig
from mock_runs import march, plant, truth
from scipy.optimize import brentq

from hw.simulators.jit import records
from hw.simulators.mock_backend import MockBackend
from hw.simulators.mock_bristles import sliding_level
from hw.simulators.mock_load import load_levels
from hw.simulators.mock_options import MockOptions
from rtctl.tick import new_ticks

NO_HAND = [{"kind": "none"}]

# Dynamixel MX-106, identified parameters: Rhoban/bam, Apache-2.0, arXiv 2410.08650
MX106 = {
    "m1": {"friction_base": 0.10352},
    "m2": {"friction_base": 2.77e-6, "friction_stribeck": 0.11742, "dtheta_stribeck": 1.84878,
        "alpha": 1.74139},
    "m3": {"friction_base": 0.11335, "load_friction_base": 0.10824},
    "m4": {
        "friction_base": 1e-6, "friction_stribeck": 0.10491, "load_friction_base": 0.00915,
        "load_friction_stribeck": 0.22236, "dtheta_stribeck": 1.62329, "alpha": 1.32349,
    },
    "m5": {
        "friction_base": 1e-6, "friction_stribeck": 0.12243, "load_friction_motor": 0.20764,
        "load_friction_external": 0.02268, "load_friction_motor_stribeck": 0.19519,
        "load_friction_external_stribeck": 0.08490, "dtheta_stribeck": 1.74571, "alpha": 1.13831,
    },
    "m6": {
        "friction_base": 1.023e-5, "friction_stribeck": 0.12195, "load_friction_motor": 0.19801,
        "load_friction_external": 0.02222, "load_friction_motor_stribeck": 0.19860,
        "load_friction_external_stribeck": 0.08710, "load_friction_motor_quad": 0.0099999,
        "load_friction_external_quad": 7.327e-5, "dtheta_stribeck": 1.74633, "alpha": 1.14283,
    },
}  # fmt: skip


def published(model, p, v, motor, outside):
    """The closed forms m1 to m6 as published, N m."""
    s = math.exp(-((abs(v) / p["dtheta_stribeck"]) ** p["alpha"])) if "alpha" in p else 0.0
    base, load = p["friction_base"], abs(outside - motor)
    if model == "m1":
        return base
    if model == "m2":
        return base + s * p["friction_stribeck"]
    if model in ("m3", "m4"):
        friction = base + p["load_friction_base"] * load
        if model == "m4":
            friction += s * (p["friction_stribeck"] + p["load_friction_stribeck"] * load)
        return friction
    q = 0.0
    if model == "m6" and outside * motor < 0:
        if abs(outside) < abs(motor):
            q = p["load_friction_external_quad"] * outside**2
        elif abs(outside) > abs(motor):
            q = p["load_friction_motor_quad"] * motor**2
    whole = abs(p["load_friction_external"] * outside - p["load_friction_motor"] * motor)
    peak = abs(p["load_friction_external_stribeck"] * outside - p["load_friction_motor_stribeck"] * motor)
    return base + whole + s * (p["friction_stribeck"] + peak + q)


def options(p):
    """The same as options of the mock."""
    both, peak = p.get("load_friction_base", 0.0), p.get("load_friction_stribeck", 0.0)
    friction = {
        "coulomb_nm": p["friction_base"],
        "breakaway_nm": p["friction_base"] + p.get("friction_stribeck", 0.0),
        "stribeck_rad_s": p.get("dtheta_stribeck", 1.0),
        "stribeck_exponent": p.get("alpha", 2.0),
    }
    load = {
        "outside": p.get("load_friction_external", both),
        "motor": p.get("load_friction_motor", both),
        "outside_peak": p.get("load_friction_external_stribeck", peak),
        "motor_peak": p.get("load_friction_motor_stribeck", peak),
        "outside_square_nm": p.get("load_friction_external_quad", 0.0),
        "motor_square_nm": p.get("load_friction_motor_quad", 0.0),
    }
    return {"friction": friction, "load": load}


@pytest.mark.parametrize("model", MX106)
@pytest.mark.parametrize("v", [0.0, 0.3, -2.0])
@pytest.mark.parametrize(("motor", "outside"), [(0, 0), (1, 0), (0, -2), (3, -1), (1, -3), (-2, 2), (1.5, 4)])
def test_the_closed_forms_are_the_published_ones(model, v, motor, outside):
    p = plant(axis=[options(MX106[model])])[0][0]
    base, peak = load_levels(motor, outside, p, 0)
    expected = published(model, MX106[model], v, motor, outside)
    assert sliding_level(v, 0.0, base, peak, p, 0) == pytest.approx(expected, rel=1e-12)


@pytest.mark.compiled
@pytest.mark.parametrize("joint", [None, {"stiffness_nm_rad": 200.0, "damping_nms_rad": 0.05}])
@pytest.mark.parametrize("friction", ["lugre", "gms"])
def test_a_driven_joint_ends_at_the_speed_whose_loaded_friction_it_equals(joint, friction):
    table = options(MX106["m3"])
    table["friction"] |= {"viscous_nms_rad": 0.05, "model": friction}
    table["elastic"] = joint
    states = march(*plant(axis=[table], hand=NO_HAND), np.full(6000, 0.6))
    # nothing pushes from outside, and at constant speed nothing passes the elastic joint
    speed = brentq(lambda v: published("m3", MX106["m3"], v, 0.6, 0.0) + 0.05 * v - 0.6, 1e-3, 100)
    assert truth(states, "velocity_rad_s")[-1] == pytest.approx(speed, rel=1e-4)


@pytest.mark.compiled
def test_a_joint_pressed_against_a_hand_breaks_away_later_than_a_free_one():
    table = options(MX106["m3"])
    found = []
    for offset in (0.0, 0.5):
        hand = [
            {
                "kind": "rest",
                "stiffness_nm_rad": 0.01,
                "damping_nms_rad": 0.0,
                "center_rad": -100 * offset,
                "start_s": 0.0,
            }
        ]
        params, state = plant(axis=[table], hand=hand)
        march(params, state, np.full(2000, offset))  # the motor holds against the hand
        ramp = offset + np.arange(30_000) * 1e-5
        moved = truth(march(params, state, ramp), "position_rad") > 0.005
        found.append(ramp[int(np.argmax(moved))] - offset)
    assert found[0] == pytest.approx(0.11335 / (1 - 0.10824), rel=0.04)
    # net torque r = base + .10824 (2 .5 + r), with the hand's .5 against the motor's .5 + r
    assert found[1] == pytest.approx((0.11335 + 0.10824) / (1 - 0.10824), rel=0.04)


@pytest.mark.compiled
def test_a_drift_follows_its_points_and_the_steady_friction_follows_it():
    drift = {"points": [[1.0, 1.0, 1.0], [3.0, 1.5, 2.0]]}
    friction = {"coulomb_nm": 0.2, "breakaway_nm": 0.2, "viscous_nms_rad": 0.1}
    states = march(*plant(axis=[{"friction": friction, "drift": drift}], hand=NO_HAND), np.full(8000, 0.6))
    t = np.arange(8000) * 1e-3
    assert np.allclose(truth(states, "dry_factor"), np.interp(t, [1, 3], [1.0, 1.5]), atol=1e-12)
    assert np.allclose(truth(states, "viscous_factor"), np.interp(t, [1, 3], [1.0, 2.0]), atol=1e-12)
    speed = truth(states, "velocity_rad_s")
    assert speed[999] == pytest.approx((0.6 - 0.2) / 0.1, rel=2e-3)
    assert speed[-1] == pytest.approx((0.6 - 0.3) / 0.2, rel=2e-3)


def test_the_motors_sensor_shows_the_temperature_that_the_friction_follows():
    drift = {"temperature": [[0.0, 25.0], [4.0, 65.0]], "dry_per_c": -0.005, "viscous_per_c": -0.01}
    device = MockBackend(
        MockOptions.model_validate({"axis": [{"drift": drift}], "hand": NO_HAND}).model_dump(mode="json"),
        rig(),
    )
    tick = records(new_ticks(1))
    for slot, celsius in ((0, 25.0), (1000, 35.0), (3000, 55.0), (9000, 65.0)):
        tick["tick"] = slot
        device.read(tick)
        device.write(tick)
        assert tick["temperature_c"][0, 0] == pytest.approx(celsius, abs=1e-9)
        assert device.state["dry_factor"][0, 0] == pytest.approx(1 - 0.005 * (celsius - 25), rel=1e-9)
        assert device.state["viscous_factor"][0, 0] == pytest.approx(1 - 0.01 * (celsius - 25), rel=1e-9)


def test_script_and_temperature_multiply_and_stay_within_their_bounds():
    drift = {
        "points": [[0.0, 2.0, 0.05]],
        "temperature": [[0.0, 125.0]],
        "dry_per_c": 0.005,
        "viscous_per_c": -0.1,
    }
    states = march(*plant(axis=[{"drift": drift}], hand=NO_HAND), np.zeros(1))
    assert truth(states, "dry_factor")[0] == pytest.approx(3.0)
    assert truth(states, "viscous_factor")[0] == 0.05
