"""The virtual mass by itself: its implicit step, its worlds, its rest, its account."""

import math

import numpy as np
import pytest
from law_rig import of_rows

from rtctl.control.environments.changes import follow_world
from rtctl.control.jit import records
from rtctl.control.passivity import FAULT_FACTOR, passivity_fault
from rtctl.control.records import new_records
from rtctl.control.virtual_mass import CALM_S, observe_hand, raise_damping, servo_torque
from rtctl.control.vocabulary import Display, Environment, Fault, State

TORQUE = of_rows(servo_torque)
T = 1e-3
M, B_V, K_V, K_P, LIMIT = 0.02, 0.1, 2.0, 5.0, 2.0
PARAMS = {
    "period_s": T,
    "energy_budget_j": 0.02,
    "energy_bank_j": 0.02,
    "renderer_store_j": 0.1,
    "renderer_power_w": 1.0,
    "display_kind": int(Display.ADMITTANCE),
    "inertia_kgm2": 0.012,
    "torque_limit_nm": LIMIT,
    "torque_rate_nm": 0.2,
    "velocity_limit_rad_s": 6.0,
    "mass_kgm2": M,
    "mass_damping_nms_rad": B_V,
    "mass_force_alpha": 1.0,
    "servo_velocity_gain_nms_rad": K_V,
    "servo_position_gain_nm_rad": K_P,
    "servo_velocity_alpha": 1.0,
}


class Mass:
    """Records of an armed axis, and `tick` to run the display once."""

    def __init__(self, **params):
        self.params, self.state, self.command, _ = (records(array) for array in new_records(1))
        for name, value in (PARAMS | params).items():
            self.params[name] = value
        self.state["state"] = int(State.ACTIVE)
        self.state["authority"] = 1.0
        self.state["display_kind"] = int(Display.ADMITTANCE)
        for name in ("mass_kgm2", "mass_damping_nms_rad"):
            self.state[name] = self.command[name] = self.params[name]

    def world(self, kind, **numbers):
        """Put a world in force at once."""
        self.command["environment_kind"] = int(kind)
        self.command["environment_side"] = 1
        for name, value in numbers.items():
            self.command[f"environment_{name}"] = value
        follow_world(self.state[0], self.params[0], self.command[0], 0, 0.0, True)

    def tick(self, hand_nm, *, joint=None, elapsed=1, difference=None, disabled=False):
        """One tick; the joint follows exactly, unless it is said where it is."""
        s = self.state[0]
        s["position_rad"] = s["proxy_position_rad"] if joint is None else joint
        speed = s["mass_velocity_rad_s"][0] if difference is None else difference
        return TORQUE(self.state, self.params, self.command, 0, elapsed, speed, hand_nm, disabled)

    def __getattr__(self, name):
        return float(self.state[name][0, 0])


def test_in_free_space_the_mass_is_the_difference_equation_of_mass_and_damping():
    mass, v, x = Mass(), 0.0, 0.0
    mass.tick(0.0)
    for k in range(400):
        torque = 0.3 * math.sin(0.03 * k)
        mass.tick(torque)
        v = (M * v + T * torque) / (M + T * B_V)
        x += T * v
        assert mass.mass_velocity_rad_s == pytest.approx(v, rel=1e-9, abs=1e-12)
    assert mass.proxy_position_rad == pytest.approx(x, rel=1e-9)


@pytest.mark.parametrize("kind", [Environment.SPRING, Environment.WALL])
@pytest.mark.parametrize("stiffness", [0.0, 3.0, 600.0, 1e6])
def test_a_world_of_any_stiffness_holds_the_mass_where_the_hand_balances_it(kind, stiffness):
    damping = 0.4
    mass = Mass(mass_damping_nms_rad=damping)
    mass.world(kind, stiffness_nm_rad=stiffness, center_rad=0.0)
    mass.tick(0.0)
    for _ in range(2000):
        mass.tick(0.4)
    if stiffness == 0.0:
        assert mass.mass_velocity_rad_s == pytest.approx(0.4 / damping, rel=1e-3)
    else:
        assert mass.proxy_position_rad == pytest.approx(0.4 / stiffness, rel=1e-3)
        assert abs(mass.mass_velocity_rad_s) < 1e-6


def test_a_stiff_wall_gives_nothing_back_that_was_not_brought():
    mass = Mass(mass_damping_nms_rad=1e-6)
    mass.world(Environment.WALL, stiffness_nm_rad=1e5, center_rad=0.05)
    mass.tick(0.0)
    speeds = [mass.mass_velocity_rad_s for k in range(400) if mass.tick(0.3 if k < 60 else 0.0) is not None]
    assert max(speeds) > 0.5
    assert -min(speeds) <= max(speeds)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_force_that_is_no_number_gives_none_and_nothing_of_it_stays(bad):
    mass, clean = Mass(mass_force_alpha=0.3), Mass(mass_force_alpha=0.3)
    mass.world(Environment.SPRING, stiffness_nm_rad=50.0, center_rad=0.0)
    clean.world(Environment.SPRING, stiffness_nm_rad=50.0, center_rad=0.0)
    mass.tick(0.0)
    clean.tick(0.0)
    for _ in range(5):
        mass.tick(0.2)
    assert math.isnan(mass.tick(bad, joint=0.0))
    for name in ("mass_velocity_rad_s", "mass_force_nm", "servo_velocity_rad_s", "stored_energy_j"):
        assert getattr(mass, name) == 0.0, name
    assert mass.tick(0.2, joint=0.0, difference=0.0) == clean.tick(0.2, joint=0.0, difference=0.0)


@pytest.mark.parametrize("state", [State.IDLE, State.ARMING, State.HOLD, State.STOPPING, State.FAULT])
def test_outside_active_the_mass_rests_where_the_joint_is(state):
    mass = Mass()
    mass.tick(0.0)
    for _ in range(50):
        mass.tick(0.5)
    assert mass.mass_velocity_rad_s > 0.5
    mass.state["state"] = int(state)
    assert mass.tick(0.5, joint=0.7) == 0.0
    assert mass.proxy_position_rad == 0.7
    assert mass.mass_velocity_rad_s == 0.0
    mass.state["state"] = int(State.ACTIVE)
    assert mass.tick(0.0, joint=0.7, difference=0.0) == 0.0  # it starts at rest, from the joint


@pytest.mark.parametrize(("bias", "speed"), [(0.004, 0.0), (0.005, 0.0), (0.008, 0.03), (-0.008, -0.03)])
def test_without_a_hand_it_drifts_at_what_the_bias_is_beyond_the_dead_band_over_the_damping(bias, speed):
    mass = Mass(mass_force_deadband_nm=0.005)
    mass.tick(0.0)
    for _ in range(1500):
        mass.tick(bias)
        assert abs(mass.mass_velocity_rad_s) <= abs(speed) * (1 + 1e-9)
    assert mass.mass_velocity_rad_s == pytest.approx(speed, rel=1e-3)


def test_on_missed_samples_the_mass_goes_on_with_the_last_force():
    seen, missed = Mass(), Mass()
    for mass in (seen, missed):
        mass.tick(0.0)
        mass.tick(0.2)
    seen.tick(0.2)
    missed.tick(5.0, elapsed=0)
    assert missed.mass_velocity_rad_s == pytest.approx(seen.mass_velocity_rad_s, rel=1e-12)


def test_the_servo_never_runs_further_ahead_than_the_torque_limit():
    mass = Mass()
    mass.tick(0.0, joint=0.0)
    for _ in range(500):
        torque = mass.tick(1.9, joint=0.0, difference=0.0)
        assert abs(mass.mass_velocity_rad_s) <= LIMIT / K_V * (1 + 1e-9)
        assert abs(mass.proxy_position_rad) <= LIMIT / K_P * (1 + 1e-9)
    assert torque >= LIMIT


def test_a_stiffer_spring_is_paid_by_the_work_it_does_on_a_mass_that_stays_where_it_is():
    mass = Mass()
    mass.world(Environment.SPRING, stiffness_nm_rad=20.0, center_rad=0.0)
    s, before = mass.state[0], 0.05
    s["proxy_position_rad"] = s["position_rad"] = before
    mass.command["environment_stiffness_nm_rad"] = 200.0
    follow_world(s, mass.params[0], mass.command[0], 0, 0.0, False)
    stiffer = float(s["world_stiffness_nm_rad"][0])
    assert 20.0 < stiffer < 200.0
    assert mass.proxy_position_rad == before
    assert mass.renderer_grant_j == pytest.approx(0.5 * (stiffer - 20.0) * before**2, rel=1e-9)


def test_the_account_holds_what_mass_joint_and_world_may_give_back_and_a_bank():
    mass = Mass()
    mass.state["mass_velocity_rad_s"], mass.state["stored_energy_j"] = 2.0, 0.01
    observe_hand(mass.state[0], mass.params[0], 0, 5.0, 0.0, 1.0)
    assert mass.energy_port_j == pytest.approx(0.01 + 0.5 * M * 4 + 0.5 * 0.012 + 0.02, rel=1e-12)


def test_what_the_hand_was_given_is_owed_and_what_was_granted_is_not():
    mass = Mass()
    observe_hand(mass.state[0], mass.params[0], 0, -0.01, 0.004, 0.0)
    assert mass.energy_port_j == pytest.approx(-0.006, rel=1e-12)
    for work, fault in ((-0.02, 0), (-0.01, Fault.PASSIVITY), (-0.04, Fault.PASSIVITY_GROSS)):
        observe_hand(mass.state[0], mass.params[0], 0, work, 0.0, 0.0)
        assert passivity_fault(mass.state[0], mass.params[0], 0) == fault, mass.energy_port_j
    assert pytest.approx(0.027) == FAULT_FACTOR * 0.02


def test_damping_that_is_injected_slows_the_mass():
    free, damped = Mass(), Mass()
    damped.state["mass_injected_nms_rad"] = K_V
    for mass in (free, damped):
        mass.tick(0.0)
        for _ in range(200):
            mass.tick(0.2)
    ratio = (1 - np.exp(-200 * T * B_V / M)) / B_V * (B_V + K_V)
    assert free.mass_velocity_rad_s / damped.mass_velocity_rad_s == pytest.approx(ratio, rel=0.01)


def test_the_test_pulse_of_arming_owes_nobody_anything():
    mass = Mass()
    mass.state["state"] = int(State.ARMING)
    observe_hand(mass.state[0], mass.params[0], 0, -0.01, 0.0, 0.0)
    assert mass.energy_port_j == 0.0


def test_damping_rises_at_once_with_a_deficit_that_counts_and_falls_slowly():
    mass = Mass()
    s, p = mass.state[0], mass.params[0]
    s["energy_port_j"] = -0.01 * 0.02
    assert raise_damping(s, p, 0, 2.0) == 0.0  # noise on little motion
    s["energy_port_j"] = -0.05 * 0.02
    assert raise_damping(s, p, 0, 1.5) == 1.5
    s["energy_port_j"] = 0.01
    for _ in range(round(CALM_S / T)):
        left = raise_damping(s, p, 0, 0.0)
    assert left == pytest.approx(1.5 / math.e, rel=1e-6)
    assert mass.mass_injected_nms_rad == left
