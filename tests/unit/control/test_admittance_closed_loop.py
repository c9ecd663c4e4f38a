"""The display on simulated joints: what the hand feels, what it may hold, what is held against it, and every
way to stop.
"""

import math
from pathlib import Path

import numpy as np
import pytest

from hw.simulators.mock_records import Hand
from rtctl.control.vocabulary import Environment, Fault, State
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation

LOADED = load(Path(__file__).parents[3] / "configs/admittance.toml")
HZ = (0.5, 1.1, 2.3, 5.0)


def rig(*, friction=False, **params):
    """The rig file's, with hardly any dry friction, and no damping for a joint that sticks, unless it is
    asked for, and no noise.
    """
    simulation = Simulation(LOADED)
    if not friction:
        simulation.params["mass_rest_nms_rad"] = 0.0
    plant = simulation.plant_params
    for name in () if friction else ("coulomb_nm", "breakaway_nm", "bristle_max_nm"):
        plant[name] = 1e-4
    for name in ("force_noise_n", "force_resolution_n", "current_noise_a", "hand_stiffness_nm_rad"):
        plant[name] = 0.0
    plant["hand_damping_nms_rad"] = 0.0
    plant["hand_kind"] = int(Hand.REST)
    for name, value in ({"servo_position_gain_nm_rad": 5.0} | params).items():
        simulation.params[name] = value
    for name in ("mass_kgm2", "mass_damping_nms_rad"):
        simulation.command[name] = simulation.params[name]
    simulation.params["mass_max_kgm2"] = simulation.params["mass_kgm2"]
    simulation.params["mass_damping_max_nms_rad"] = simulation.params["mass_damping_nms_rad"]
    return simulation


def delay_by_a_tick(simulation):
    """Let the torque come a tick late, as the law is told."""
    simulation.plant_params["torque_delay_ticks"] = 1
    for name, value in (("actuator_delay_ticks", 1), ("follow_delay_ticks", 3), ("proof_delay_s", 0.0)):
        simulation.params[name] = value


def grip(simulation, stiffness, way_rad, damping=0.0):
    """Let a hand hold the joint, which it wants `way_rad` from where it is."""
    simulation.plant_params["hand_center_rad"] = simulation.plant_state["position_rad"][0] + way_rad
    simulation.plant_params["hand_stiffness_nm_rad"] = stiffness
    simulation.plant_params["hand_damping_nms_rad"] = damping


@pytest.mark.parametrize(
    ("mass", "gain", "spring", "band"),
    [
        *((0.012, 2.0, 5.0, 0.003), (0.012, 5.0, 5.0, 0.003), (0.015, 5.0, 5.0, 0.003)),
        *((0.006, 5.0, 20.0, 0.0), (0.024, 2.0, 20.0, 0.0), (0.03, 2.0, 20.0, 0.0), (0.05, 2.0, 20.0, 0.0)),
    ],
)
def test_the_hand_feels_the_mass_and_damping_asked_for_within_5_percent(mass, gain, spring, band):
    """The dead band is felt as a torque of its own: 3 to 8 % of the damping at these speeds."""
    simulation = rig(
        mass_kgm2=mass,
        servo_velocity_gain_nms_rad=gain,
        mass_forward=min(1.0, mass / 0.012),
        mass_force_deadband_nm=band,
        servo_position_gain_nm_rad=spring,
    )
    plant = simulation.plant_params
    plant["hand_kind"], plant["hand_stiffness_nm_rad"], plant["hand_damping_nms_rad"] = (
        int(Hand.SINES),
        5.0,
        0.1,
    )
    for k, hz in enumerate(HZ):
        plant["hand_sine_rad"][0, 0, k], plant["hand_sine_rad_s"][0, 0, k] = 0.15 / hz, 2 * math.pi * hz
    simulation.arm()
    simulation.run(1.0)
    assert not simulation.run(4.0)["faults"].any()
    speed = simulation.truth["velocity_rad_s"][:, 0]
    parts = np.stack([np.gradient(speed, 1e-3), speed], axis=1)
    (felt_mass, felt_damping), *_ = np.linalg.lstsq(parts, simulation.truth["hand_torque_nm"][:, 0])
    assert felt_mass == pytest.approx(mass, rel=0.05)
    assert felt_damping == pytest.approx(0.1, rel=0.05)


def grows(mass, damping, stiffness):
    """True when a joint in a spring swings more and more, with neither account nor watch to calm it."""
    simulation = rig(
        mass_kgm2=mass,
        mass_damping_nms_rad=damping,
        servo_position_gain_nm_rad=0.0,
        mass_forward=0.0,
        mass_force_deadband_nm=0.0,
        energy_budget_j=1e6,
        watch_floor_nm=math.inf,
    )
    delay_by_a_tick(simulation)
    simulation.arm()
    grip(simulation, stiffness, 0.5 / stiffness if stiffness > 100 else 0.02)
    trace = simulation.run(3.0)
    away = simulation.truth["position_rad"][:, 0] - simulation.plant_params["hand_center_rad"][0, 0]
    return bool(trace["faults"].any()) or np.ptp(away[-500:]) > np.ptp(away[500:1000])


@pytest.mark.parametrize(
    ("mass", "damping", "first_unstable"),
    [(0.006, 0.02, 13.85), (0.009, 0.05, 150.0), (0.012, 0.05, 606.0)],
)
def test_the_stiffest_hand_it_bears_is_that_of_the_eigenvalues(mass, damping, first_unstable):
    """Numbers: the closed loop's eigenvalues at K_v 2, low-passes of 100 and 150 Hz, a tick of delay
    (docs/theory.md 2.13).
    """
    assert not grows(mass, damping, 0.9 * first_unstable)
    assert grows(mass, damping, 1.1 * first_unstable)


def test_a_hand_stiffer_than_promised_is_calmed_within_a_fifth_of_a_second_and_stays_so():
    simulation = rig(mass_kgm2=0.009, mass_damping_nms_rad=0.05)
    delay_by_a_tick(simulation)
    simulation.arm()
    grip(simulation, 300.0, 0.005)
    trace = simulation.run(3.0)
    x, torque = (simulation.truth[name][:, 0] for name in ("position_rad", "hand_torque_nm"))
    raised = trace["injected_damping_nms_rad"][:, 0] > 0
    short = trace["energy_port_j"][:, 0] < 0
    assert np.argmax(raised) - np.argmax(short) <= 200
    given = -np.cumsum(torque * np.diff(x, prepend=x[0]))
    assert given.max() <= 0.02
    assert np.ptp(x[1500:]) < 1e-3 < np.ptp(x[:500])
    assert not trace["faults"].any()


def test_a_grip_four_times_as_stiff_as_it_bears_ends_in_a_fault_with_the_torque_bounded_by_what_is_left():
    """At -1.53 budgets, and -2.14 with a torque that the account does not bound."""
    simulation = rig(
        mass_kgm2=0.009, mass_damping_nms_rad=0.05, mass_force_deadband_nm=0.003, mass_forward=0.0
    )
    simulation.plant_params["force_range_n"] = 1e3
    simulation.params["force_limit_n"] = 1e3
    delay_by_a_tick(simulation)
    simulation.arm()
    grip(simulation, 600.0, 0.005)
    trace = simulation.run(1.0)
    assert int(np.bitwise_or.reduce(trace["faults"])) == Fault.PASSIVITY
    assert trace["energy_port_j"].min() >= -1.6 * 0.02


@pytest.mark.parametrize("kind", [Environment.SPRING, Environment.WALL])
def test_a_hand_that_leans_on_a_spring_or_wall_is_held_there_by_the_position_gain(kind):
    simulation = rig(friction=True, servo_position_gain_nm_rad=40.0)
    world = {
        "environment_kind": int(kind),
        "environment_stiffness_nm_rad": 60.0,
        "environment_center_rad": 0.0,
    }
    simulation.change(**world, environment_side=1)
    simulation.arm()
    grip(simulation, 5.0, 0.3, damping=0.2)
    simulation.run(3.0)
    trace = simulation.run(1.0)
    mass, hand = trace["proxy_position_rad"][:, 0], trace["hand_torque_nm"][:, 0]
    assert np.ptp(mass) < 1e-3
    assert np.mean(hand) > 0.3
    assert 60.0 * np.mean(mass) == pytest.approx(np.mean(hand), rel=0.05)
    assert not trace["faults"].any()


def test_without_a_hand_a_biased_sensor_moves_it_no_faster_than_the_bias_beyond_the_dead_band():
    simulation = rig(mass_force_deadband_nm=0.01)
    simulation.arm()
    simulation.run(1.0)
    simulation.state["tare"][0, 0, 1] -= 0.2  # N at .1 m: .02 N m that nobody gives
    simulation.run(1.0)
    speed = simulation.run(1.0)["velocity_rad_s"][:, 0]
    bound = (0.02 - 0.01) / 0.1
    assert 0.8 * bound < abs(np.mean(speed)) <= 1.05 * bound
    simulation.params["mass_force_deadband_nm"] = 0.025
    simulation.run(1.5)
    start = float(simulation.plant_state["position_rad"][0, 0])
    simulation.run(2.0)
    assert float(simulation.plant_state["position_rad"][0, 0]) == pytest.approx(start, abs=1e-4)


def test_a_stop_ramps_the_torque_down_and_leaves_the_mass_at_the_joint():
    simulation = rig(friction=True)
    simulation.arm()
    grip(simulation, 5.0, 0.3, damping=0.1)
    moving = simulation.run(0.15)
    assert abs(moving["velocity_rad_s"][-1, 0]) > 0.1
    trace = simulation.run(0.2, stop_count=1)
    stopping = trace["state"] == State.STOPPING
    assert 1 <= np.count_nonzero(stopping) <= 51
    size = np.abs(trace["torque_applied_nm"][:, 0])
    assert np.all(np.diff(size[stopping]) <= 1e-12)
    assert size[-1] == 0.0
    assert simulation.state["mass_velocity_rad_s"][0, 0] == 0.0
    assert trace["proxy_position_rad"][-1, 0] == trace["position_rad"][-1, 0]


def test_a_force_that_is_no_number_cuts_and_nothing_of_it_stays():
    simulation = rig()
    simulation.arm()
    simulation.state["force_filtered_nm"] = math.nan
    simulation.params["force_alpha"] = 0.5
    trace = simulation.run(0.01)
    assert int(trace["faults"][0]) & Fault.LAW_NOT_FINITE
    assert not trace["torque_applied_nm"].any()
    for name in ("mass_velocity_rad_s", "mass_force_nm", "servo_velocity_rad_s", "stored_energy_j"):
        assert simulation.state[name][0, 0] == 0.0, name
