"""A display that is changed while somebody holds it: mass, damping, impedance to admittance and back; a share
of it felt.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hw.simulators.mock_records import Hand
from rtctl.check.admittance_figures import fading
from rtctl.control.display import CHANGE_S
from rtctl.control.proofs import admittance_margin
from rtctl.control.proofs.admittance_loop import AdmittanceLoop, Box
from rtctl.control.vocabulary import Display, Environment
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation

LOADED = load(Path(__file__).parents[3] / "configs/admittance.toml")
RATE_NM = 0.2
SWING = (0.3, 2 * math.pi * 1.3)


def rig(*, hand=(5.0, 0.1), swing=SWING, **params):
    """The shipped rig, in a hand that swings it, free to be changed: armed, and a second gone."""
    simulation = Simulation(LOADED)
    free = {
        "display_change": 1,
        "mass_max_kgm2": 0.1,
        "mass_damping_max_nms_rad": 2.0,
        "coupling_stiffness_nm_rad": 40.0,
        "coupling_damping_nms_rad": 0.02,
    }
    for name, value in (free | params).items():
        simulation.params[name] = value
    plant = simulation.plant_params
    plant["hand_kind"] = int(Hand.SINES)
    plant["hand_stiffness_nm_rad"], plant["hand_damping_nms_rad"] = hand
    plant["hand_sine_rad"][0, 0, 0], plant["hand_sine_rad_s"][0, 0, 0] = swing
    simulation.arm()
    simulation.run(1.0)
    return simulation


def world(simulation, kind, **numbers):
    """What the renderer asks for."""
    simulation.command["environment_kind"] = int(kind)
    simulation.command["environment_side"] = 1
    for name, value in numbers.items():
        simulation.command[f"environment_{name}"] = value


def largest_step_nm(trace, before_nm):
    """Of what the law wants, before the gate holds it to its rate; `before_nm` was sent last."""
    felt = trace["torque_wanted_nm"][:, 0] * trace["authority"]
    return float(np.abs(np.diff(felt, prepend=before_nm)).max())


def sent_nm(simulation):
    """The torque that was sent last."""
    return float(simulation.state["torque_applied_nm"][0, 0])


def given_j(simulation, trace, before):
    """Energy that the hand was given beyond what it gave, at most, from here on."""
    dx = np.diff(simulation.truth["position_rad"][:, 0], prepend=before)
    return float(-np.cumsum(simulation.truth["hand_torque_nm"][:, 0] * dx).min())


CHANGES = [
    {"mass_kgm2": 0.03},
    {"mass_damping_nms_rad": 2.0},
    {"mass_kgm2": 0.03, "mass_damping_nms_rad": 2.0},
    {"display_kind": int(Display.IMPEDANCE)},
]


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("stiffness", [0.0, 60.0])
def test_a_change_in_motion_and_the_way_back_make_no_step_that_the_gate_would_have_to_hold(change, stiffness):
    simulation = rig()
    if stiffness:
        world(simulation, Environment.SPRING, stiffness_nm_rad=stiffness, center_rad=0.0)
        simulation.run(1.0)
    back = {name: simulation.command[name].copy() for name in change}
    last = sent_nm(simulation)
    usual = largest_step_nm(simulation.run(0.8), last)
    for asked in (change, back):
        for name, value in asked.items():
            simulation.command[name] = value
        last = sent_nm(simulation)
        trace = simulation.run(1.5)
        assert not trace["faults"].any()
        assert largest_step_nm(trace, last) <= max(RATE_NM, usual)
        for name, value in asked.items():
            assert trace[name][-1, 0] == (
                0.0 if trace["display_kind"][-1, 0] == 0 and "mass" in name else value
            )


def test_a_renderer_that_turns_the_mass_up_and_down_with_the_motion_gives_a_hand_no_more_than_it_may():
    """Heavier at full speed, lighter at the turns: each swing would give (m after - m before) v^2/2."""
    simulation = rig(hand=(5.0, 0.0), swing=(0.0, 1.0), mass_max_kgm2=0.2)
    simulation.plant_params["hand_sine_rad"][0, 0, 0] = 0.0
    simulation.plant_params["hand_center_rad"] = 0.3
    simulation.run(0.5)
    start = simulation.truth["position_rad"][-1, 0]
    path, torques = [start], []
    for _ in range(400):
        fast = abs(float(simulation.state["velocity_rad_s"][0, 0])) > 0.4
        simulation.command["mass_kgm2"] = 0.2 if fast else 0.012
        trace = simulation.run(0.01)
        path.extend(simulation.truth["position_rad"][:, 0])
        torques.extend(simulation.truth["hand_torque_nm"][:, 0])
        assert not trace["faults"].any()
    given = -np.cumsum(np.array(torques) * np.diff(path)).min()
    store, power, budget = (
        float(simulation.params[n][0]) for n in ("renderer_store_j", "renderer_power_w", "energy_budget_j")
    )
    stored = 0.5 * 5.0 * 0.3**2  # the hand's own spring, drawn at the start
    assert given <= store + power * 4.0 + 1.5 * budget + stored


def test_a_heavier_mass_at_speed_is_paid_for_from_the_renderers_store():
    paid, poor = rig(), rig(renderer_power_w=0.0)
    poor.state["renderer_store_j"] = 0.0
    for simulation in (paid, poor):
        simulation.command["mass_kgm2"] = 0.1
        while abs(float(simulation.state["mass_velocity_rad_s"][0, 0])) < 0.5:
            simulation.run(0.001)
        simulation.run(0.02)
    assert paid.state["mass_kgm2"][0, 0] > 0.012
    assert paid.state["renderer_store_j"][0, 0] < float(paid.params["renderer_store_j"][0])
    assert poor.state["mass_kgm2"][0, 0] < paid.state["mass_kgm2"][0, 0]


def test_mass_and_damping_take_a_tenth_of_a_second_from_end_to_end_and_are_taken_at_once_at_rest():
    simulation = rig(hand=(0.0, 0.0))
    simulation.command["mass_kgm2"], simulation.command["mass_damping_nms_rad"] = 0.1, 2.0
    half = simulation.run(0.4 * CHANGE_S)
    assert 0.03 < half["mass_kgm2"][-1, 0] < 0.07
    assert simulation.run(CHANGE_S)["mass_damping_nms_rad"][-1, 0] == 2.0
    resting = Simulation(LOADED)
    resting.params["mass_max_kgm2"], resting.command["mass_kgm2"] = 0.1, 0.1
    assert resting.run(0.01)["mass_kgm2"][-1, 0] == 0.1


@pytest.mark.parametrize(("asked", "taken"), [(1e9, 0.1), (-5.0, 0.012), (0.0, 0.012)])
def test_what_the_rig_file_does_not_allow_is_the_nearest_that_it_does(asked, taken):
    simulation = rig()
    simulation.command["mass_kgm2"] = asked
    assert simulation.run(1.0)["mass_kgm2"][-1, 0] == taken


@pytest.mark.parametrize("name", ["mass_kgm2", "mass_damping_nms_rad"])
def test_a_command_that_is_no_number_is_a_fault_and_leaves_nothing(name):
    simulation = rig()
    before = simulation.command[name].copy()
    simulation.command[name] = math.nan
    assert simulation.run(0.01)["faults"].any()
    simulation.command[name] = before
    later = simulation.run(0.5)
    for field in ("mass_kgm2", "mass_damping_nms_rad", "torque_applied_nm", "energy_port_j"):
        assert np.isfinite(later[field]).all()


def test_a_display_that_the_rig_file_does_not_let_change_does_not():
    simulation = rig(display_change=0)
    simulation.command["display_kind"] = int(Display.IMPEDANCE)
    assert (simulation.run(0.5)["display_kind"] == int(Display.ADMITTANCE)).all()


def test_a_display_that_is_changed_at_rest_under_load_gives_the_hand_what_is_paid_and_no_more():
    simulation = rig(hand=(40.0, 0.3), swing=(0.0, 1.0))
    world(simulation, Environment.SPRING, stiffness_nm_rad=60.0, center_rad=0.5)
    simulation.run(2.0)
    for kind in (Display.IMPEDANCE, Display.ADMITTANCE, Display.IMPEDANCE, Display.ADMITTANCE):
        before, last = simulation.truth["position_rad"][-1, 0], sent_nm(simulation)
        assert abs(last) > 2 * RATE_NM
        simulation.command["display_kind"] = int(kind)
        trace = simulation.run(1.5)
        assert not trace["faults"].any()
        assert trace["display_kind"][-1, 0] == int(kind)
        assert largest_step_nm(trace, last) <= RATE_NM
        assert given_j(simulation, trace, before) <= 0.1 + 1.0 * 1.5 + 1.5 * 0.02


def test_a_display_of_which_a_share_is_felt_bears_the_hands_that_the_whole_bears():
    """A soft start so long that the share stands still: a spring of 60 N m/rad on a world of 100 grew without
    the damping.
    """
    simulation = Simulation(LOADED)
    for name in ("coulomb_nm", "breakaway_nm", "bristle_max_nm"):
        simulation.plant_params[name] = 1e-4
    for name in ("force_noise_n", "force_resolution_n", "current_noise_a", "hand_stiffness_nm_rad"):
        simulation.plant_params[name] = 0.0
    simulation.params["mass_force_deadband_nm"] = 0.0
    simulation.plant_params["hand_kind"] = int(Hand.REST)
    world(simulation, Environment.SPRING, stiffness_nm_rad=100.0, center_rad=0.0)
    simulation.arm()
    simulation.params["soft_start_ticks"], simulation.state["authority"] = 10**7, 0.1
    simulation.params["watch_floor_nm"] = math.inf  # it would calm it, too
    simulation.plant_params["hand_stiffness_nm_rad"] = 60.0
    simulation.plant_params["hand_damping_nms_rad"] = 0.0
    simulation.plant_params["hand_center_rad"] = simulation.plant_state["position_rad"][0] + 0.003
    trace = simulation.run(2.0)
    assert not trace["faults"].any()
    away = simulation.truth["position_rad"][:, 0]
    assert np.ptp(away[-400:]) < 0.3 * np.ptp(away[:400])


def test_every_share_of_a_display_bears_at_least_the_hand_that_the_whole_bears():
    loop = AdmittanceLoop(
        0.012, 0.05, 1e-3, 0.012, 0.1, 2.0, 20.0,
        force_lowpass_hz=150.0, velocity_lowpass_hz=100.0, feedforward=1.0, feedforward_lowpass_hz=60.0,
        told_viscous_nms_rad=0.05, box=Box(120.0, 1.0, 0.005),
    )  # fmt: skip
    whole = admittance_margin.largest_hand(loop)
    for one in fading(loop):
        assert admittance_margin.largest_hand(one) > whole
        weak = replace(one, virtual_damping_nms_rad=loop.virtual_damping_nms_rad)
        assert admittance_margin.largest_hand(weak) < whole


def test_a_display_that_nobody_pays_for_does_not_come_up():
    """What the hand has stretched of the world is not felt for a moment; to have it felt again puts in its
    energy anew.
    """
    simulation = rig(hand=(10.0, 0.3), swing=(0.0, 1.0), renderer_power_w=0.0)
    world(simulation, Environment.SPRING, stiffness_nm_rad=20.0, center_rad=0.0)
    simulation.run(1.0)
    simulation.plant_params["hand_center_rad"] = 0.3
    simulation.run(1.0)
    simulation.state["renderer_store_j"] = 0.0
    simulation.command["display_kind"] = int(Display.IMPEDANCE)
    trace = simulation.run(1.5)
    assert not trace["faults"].any()
    assert trace["display_kind"][-1, 0] == int(Display.IMPEDANCE)
    assert simulation.state["display_faded"][0, 0] > 0.5
