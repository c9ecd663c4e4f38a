"""The detailed joint against independent references: the plain joint, a stiff ODE solver, closed forms,
energy.
"""

import math

import numpy as np
import pytest
from hardware import rig as hardware
from mock_runs import march, plant, sine, truth
from scipy.integrate import solve_ivp

from hw.jit import JIT_DISABLED
from hw.simulators.can_plant import MockRig
from hw.simulators.jit import records
from hw.simulators.mock_energy import stored_j
from hw.simulators.mock_options import MockOptions
from hw.simulators.mock_sensors import sense_axes
from rtctl.tick import new_ticks

FREE = {"coulomb_nm": 1e-6, "breakaway_nm": 1e-6, "viscous_nms_rad": 0.0, "bristle_damping_nms_rad": 0.0}
NO_HAND = [{"kind": "none"}]
DETAILED = {"waves": {"ripple": [[0.0, 1.0, 0.0]]}}
"""An effect that changes nothing, but takes the detailed path."""
ELASTIC = {"stiffness_nm_rad": 106.0, "damping_nms_rad": 0.01, "link_inertia_share": 0.4}
HAND = {"kind": "sine", "start_s": 0.0, "inertia_kgm2": 0.004}


@pytest.mark.compiled
@pytest.mark.parametrize("model", ["lugre", "elasto_plastic"])
def test_the_detailed_joint_with_nothing_on_is_the_plain_joint(model):
    friction = {
        "model": model,
        "scale_negative": 1.1,
        "modulation_share": 0.1,
        "second_share": 0.3,
        "thinning_nms_rad": 0.04,
    }
    torques = sine(0.5, 1.3, 1.0)
    plain, detailed = (
        march(*plant(axis=[{"friction": friction, "ripple_nm": 0.01, **effect}], hand=[HAND]), torques)
        for effect in ({}, DETAILED)
    )
    for name in ("position_rad", "velocity_rad_s", "bristle_rad", "friction_torque_nm", "hand_torque_nm"):
        assert np.allclose(truth(plain, name), truth(detailed, name), rtol=1e-9, atol=1e-12), name


def lugre_pair(friction, elastic, torque, hand, seconds):
    """Velocities of motor and link of two LuGre masses, by a stiff solver, every ms."""
    f = {"coulomb_nm": 0.25, "breakaway_nm": 0.35, "stribeck_rad_s": 0.1, "viscous_nms_rad": 0.05, **friction}
    s0, s1 = f["bristle_stiffness_nm_rad"], f["bristle_damping_nms_rad"]
    inertia = (0.012 * (1 - elastic["link_inertia_share"]), 0.012 * elastic["link_inertia_share"])
    dry = (1 - elastic["link_dry_share"], elastic["link_dry_share"])
    wet = (1 - elastic["link_viscous_share"], elastic["link_viscous_share"])

    def rates(t, y):
        x, v, z = y[0:2], y[2:4], y[4:6]
        joint = elastic["stiffness_nm_rad"] * (x[0] - x[1]) + elastic["damping_nms_rad"] * (v[0] - v[1])
        wanted, wanted_v = hand[0] * math.sin(hand[1] * t), hand[0] * hand[1] * math.cos(hand[1] * t)
        push = (torque(t) - joint, joint + 5.0 * (wanted - x[1]) + 0.1 * (wanted_v - v[1]))
        z_rate, v_rate = [0.0, 0.0], [0.0, 0.0]
        for i in range(2):
            g = f["coulomb_nm"] + (f["breakaway_nm"] - f["coulomb_nm"]) * math.exp(
                -((v[i] / f["stribeck_rad_s"]) ** 2)
            )
            z_rate[i] = v[i] - s0 * abs(v[i]) / g * z[i]
            friction_nm = dry[i] * (s0 * z[i] + s1 * z_rate[i]) + wet[i] * f["viscous_nms_rad"] * v[i]
            v_rate[i] = (push[i] - friction_nm) / inertia[i]
        return [*v, *v_rate, *z_rate]

    times = np.arange(1, round(seconds * 1e3) + 1) * 1e-3
    solved = solve_ivp(rates, (0, seconds), np.zeros(6), "LSODA", times, rtol=1e-9, atol=1e-12, max_step=1e-3)
    return solved.y[2], solved.y[3]


@pytest.mark.parametrize(("stiffness", "damping"), [(50.0, 0.1), (250.0, 1.0), (2000.0, 3.0)])
def test_two_masses_move_as_a_stiff_solver_says(stiffness, damping):
    elastic = {**ELASTIC, "link_dry_share": 0.3, "link_viscous_share": 0.25}
    friction = {"bristle_stiffness_nm_rad": stiffness, "bristle_damping_nms_rad": damping}
    hand = {"kind": "sine", "start_s": 0.0, "amplitude_rad": 0.3, "frequency_hz": 0.5}
    # the motor's torque is held over a period: the solver is given the same steps, smooth enough for it
    states = march(*plant(axis=[{"friction": friction, "elastic": elastic}], hand=[hand]), np.full(800, 0.1))
    motor, link = lugre_pair(friction, elastic, lambda _t: 0.1, (0.3, math.pi), 0.8)
    assert np.max(np.abs(truth(states, "velocity_rad_s") - link)) < 1e-3 * np.max(np.abs(link))
    twist_rate = truth(states, "joint_twist_rate_rad_s")
    assert np.max(np.abs(twist_rate - (motor - link))) < 5e-3 * np.max(np.abs(motor - link))


def test_a_free_pair_of_masses_swings_at_its_own_frequency_and_decays_by_the_joints_damping():
    elastic = {"stiffness_nm_rad": 200.0, "damping_nms_rad": 0.02, "link_inertia_share": 0.25}
    params, state = plant(axis=[{"friction": FREE, "elastic": elastic}], hand=NO_HAND)
    state["joint_twist_rad"] = 0.01
    twist = truth(march(params, state, np.zeros(400)), "joint_twist_rad")
    reduced = 0.012 * 0.25 * 0.75
    decay, omega = 0.02 / (2 * reduced), math.sqrt(200.0 / reduced)
    ring = math.sqrt(omega**2 - decay**2)
    t = np.arange(1, 401) * 1e-3
    expected = 0.01 * np.exp(-decay * t) * (np.cos(ring * t) + decay / ring * np.sin(ring * t))
    assert np.max(np.abs(twist - expected)) < 0.01 * 0.01
    assert np.ptp(truth(march(params, state, np.zeros(50)), "position_rad")) < 0.01


def test_the_hand_stands_on_the_link_and_the_encoder_on_the_side_it_is_said_to():
    for side, angle in (("motor", 0.4 / 20.0 + 0.4 / 100.0), ("link", 0.4 / 20.0)):
        elastic = {"stiffness_nm_rad": 100.0, "damping_nms_rad": 0.5, "encoder": side}
        hand = [{"kind": "rest", "stiffness_nm_rad": 20.0, "damping_nms_rad": 0.3}]
        params, state = plant(axis=[{"friction": FREE, "elastic": elastic}], hand=hand, velocity={})
        states = march(params, state, np.full(1000 if JIT_DISABLED else 4000, 0.4))
        assert truth(states, "position_rad")[-1] == pytest.approx(0.4 / 20.0, rel=1e-3)
        assert truth(states, "joint_twist_rad")[-1] == pytest.approx(0.4 / 100.0, rel=1e-3)
        assert truth(states, "hand_torque_nm")[-1] == pytest.approx(-0.4, rel=1e-3)
        tick = records(new_ticks(1))
        state["velocity_rad_s"], state["joint_twist_rate_rad_s"] = 0.5, 0.25
        sense_axes(tick[0], state[0], params[0], 1)
        assert tick["position_rad"][0, 0] == pytest.approx(angle, rel=5e-3)
        assert tick["device_velocity_rad_s"][0, 0] == pytest.approx(0.75 if side == "motor" else 0.5)


@pytest.mark.compiled
@pytest.mark.parametrize("model", ["lugre", "elasto_plastic", "gms"])
@pytest.mark.parametrize(("stiffness", "damping"), [(50.0, 0.1), (2000.0, 0.1), (2000.0, 3.0)])
@pytest.mark.parametrize("elastic", [None, ELASTIC, {"stiffness_nm_rad": 2000.0, "link_dry_share": 0.3}])
def test_the_usual_step_is_right_to_half_a_thousandth(model, stiffness, damping, elastic):
    friction = {"model": model, "bristle_stiffness_nm_rad": stiffness, "bristle_damping_nms_rad": damping}
    axis, hand = {"friction": friction, "elastic": elastic, **DETAILED}, {"kind": "sine", "start_s": 0.0}
    usual, fine = (
        truth(march(*plant(axis=[axis], hand=[hand], substeps=steps), sine(0.15, 3.0, 2.0)), "velocity_rad_s")
        for steps in (10, 100)
    )
    assert np.sqrt(np.mean((usual - fine) ** 2)) < 5e-4 * np.sqrt(np.mean(fine**2))


PLANTS = {
    "maxwell-slip": {"friction": {"model": "gms"}, **DETAILED},
    "maxwell-slip on both sides": {
        "friction": {"model": "gms", "bristle_stiffness_nm_rad": 2000.0, "modulation_share": 0.2},
        "elastic": {**ELASTIC, "link_dry_share": 0.4, "link_viscous_share": 0.3},
    },
    "sixteen soft elements, strong stiction": {
        "friction": {
            "model": "gms", "elements": 16, "breakaway_nm": 0.45, "bristle_stiffness_nm_rad": 50.0,
            "bristle_damping_nms_rad": 0.1,
        },
        "elastic": {**ELASTIC, "link_dry_share": 0.1},
    },
    "elasto-plastic": {"friction": {"model": "elasto_plastic", "bristle_damping_nms_rad": 0.0},
        "elastic": ELASTIC},
    "elements under a load that comes and goes, while friction falls": {
        "friction": {"model": "gms"},
        "elastic": {**ELASTIC, "link_dry_share": 0.3},
        "load": {"motor": 0.4, "outside": 0.3, "motor_peak": 0.3},
        "drift": {"points": [[0.0, 1.5, 1.0], [0.5, 0.5, 2.0]]},
    },
    "LuGre under a load that comes and goes, while friction falls": {
        "friction": {"bristle_damping_nms_rad": 0.0},
        "load": {"motor": 0.4, "outside": 0.3, "motor_peak": 0.3, "motor_square_nm": 0.1},
        "drift": {"points": [[0.0, 1.5, 1.0], [0.5, 0.5, 2.0]]},
    },
    "LuGre": {"friction": {"bristle_damping_nms_rad": 0.0}, "elastic": ELASTIC},
}  # fmt: skip


@pytest.mark.parametrize("name", PLANTS)
@pytest.mark.parametrize("period_s", [1e-4, 2e-3])
def test_no_step_gives_energy(name, period_s):
    # one sub-step a period: the work of a step is torque times way, exactly
    n = 600 if JIT_DISABLED else 6000
    rng = np.random.default_rng(3)
    torques = np.repeat(rng.uniform(-0.8, 0.8, n // 50), 50) * rng.choice([1.0, 0.1], n)
    params, state = plant(period_s, substeps=1, axis=[PLANTS[name]], hand=NO_HAND)
    before = stored_j(state, params, 0)[0]
    states = march(params, state, torques)
    motor_rad = truth(states, "position_rad") + truth(states, "joint_twist_rad")
    work = torques * np.diff(motor_rad, prepend=0.0)
    taken = work - np.diff(stored_j(states, params, 0), prepend=before)
    assert taken.min() > -1e-12, "a step gave energy"
    assert taken.sum() > 0.1 * np.abs(work).sum() > 0, "friction takes what the motor gives"


@pytest.mark.compiled
@pytest.mark.parametrize("stiffness", [50.0, 2000.0, 1e6])
@pytest.mark.parametrize("joint", [1.0, 1e4, 1e7])
@pytest.mark.parametrize("model", ["lugre", "elasto_plastic", "gms"])
def test_no_stiffness_makes_even_coarse_steps_grow(stiffness, joint, model):
    elastic = {
        "stiffness_nm_rad": joint,
        "damping_nms_rad": 0.0,
        "link_inertia_share": 0.1,
        "link_dry_share": 0.5,
    }
    friction = {"model": model, "bristle_stiffness_nm_rad": stiffness, "bristle_damping_nms_rad": 3.0}
    hand = [{"kind": "rest", "stiffness_nm_rad": 500.0, "damping_nms_rad": 1.0}]
    params, state = plant(0.01, substeps=1, axis=[{"friction": friction, "elastic": elastic}], hand=hand)
    march(params, state, sine(20.0, 7.0, 2.0, 0.01))
    rest = march(params, state, np.zeros(1000))
    assert np.isfinite(truth(rest, "position_rad")).all()
    assert abs(truth(rest, "velocity_rad_s")[-1]) < 1e-3
    assert abs(truth(rest, "joint_twist_rate_rad_s")[-1]) < 1e-2


def test_a_simulated_drive_turns_with_the_motor_of_an_elastic_joint():
    options = {"axis": [{"elastic": ELASTIC}], "hand": [{"kind": "rest"}]}
    rig = MockRig(MockOptions.model_validate(options).model_dump(mode="json"), hardware())
    rig.advance(0.02, [1.0])
    state = rig._mock.state
    twist, link = float(state["joint_twist_rad"][0, 0]), float(state["position_rad"][0, 0])
    assert twist != 0
    assert rig.motor_turns(0) == pytest.approx(80 * (link + twist) / (2 * math.pi), rel=1e-12)
