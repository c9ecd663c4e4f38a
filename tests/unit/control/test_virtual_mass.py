"""The virtual mass of an admittance display: its step, what bounds it, and the loop it closes, against plain NumPy."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from rtctl.control.environments.changes import felt_through
from rtctl.control.jit import records
from rtctl.control.passivity import passivity_fault
from rtctl.control.records import new_records
from rtctl.control.velocity import lowpass_alpha
from rtctl.control.virtual_mass import observe_hand, servo_torque
from rtctl.control.vocabulary import Display, Environment, Fault, State

T = 1e-3
J, B = 0.012, 0.05


class Servo:
    """The law's half of the loop, on records as the law has them."""

    def __init__(
        self, mass=0.012, damping=0.1, gain=2.0, spring=0.0, force_hz=0.0, velocity_hz=0.0, deadband=0.0
    ):
        params, state, command, _ = (records(one) for one in new_records(1))
        self.p, self.s, self.c = params[0], state[0], command[0]
        self.params, self.state, self.command = params, state, command
        for name, value in {
            "display_kind": Display.ADMITTANCE,
            "mass_kgm2": mass,
            "mass_damping_nms_rad": damping,
            "servo_velocity_gain_nms_rad": gain,
            "servo_position_gain_nm_rad": spring,
            "mass_force_alpha": lowpass_alpha(force_hz, T),
            "servo_velocity_alpha": lowpass_alpha(velocity_hz, T),
            "mass_force_deadband_nm": deadband,
            "torque_limit_nm": 1e9,
            "torque_rate_nm": 1e9,
            "velocity_limit_rad_s": 1e9,
            "inertia_kgm2": J,
        }.items():
            self.params[name][0] = value
        self.params["period_s"] = T
        self.params["renderer_store_j"], self.params["renderer_power_w"] = 1.0, 1e6
        self.state["state"] = State.ACTIVE

    def step(self, position_rad=0.0, difference_rad_s=0.0, hand_nm=0.0, elapsed=1, *, disabled=False):
        self.state["position_rad"][0] = position_rad
        return servo_torque(
            self.state[0], self.params[0], self.command[0], 0, elapsed, difference_rad_s, hand_nm, disabled
        )

    def world(self, kind, **numbers):
        self.command["environment_kind"][0] = kind
        for name, value in numbers.items():
            self.command[f"environment_{name}"][0] = value
        self.step(disabled=True)  # it is in force at once while no torque leaves

    @property
    def velocity(self):
        return float(self.state["mass_velocity_rad_s"][0, 0])

    @property
    def place(self):
        return float(self.state["proxy_position_rad"][0, 0])


def test_a_free_mass_is_moved_by_the_force_alone():
    one, v, x = Servo(mass=0.02, damping=0.3, gain=2.0, spring=7.0), 0.0, 0.0
    for k in range(200):
        force = math.sin(0.05 * k)
        torque = one.step(hand_nm=force)
        v = (0.02 * v + T * force) / (0.02 + 0.3 * T)
        x += T * v
        assert one.velocity == pytest.approx(v, rel=1e-9, abs=1e-12)
        assert one.place == pytest.approx(x, rel=1e-9, abs=1e-12)
        assert torque == pytest.approx(2.0 * v + 7.0 * x, rel=1e-9, abs=1e-11)


@pytest.mark.parametrize("stiffness", [0.0, 1.0, 1e3, 1e6])
def test_a_spring_of_any_stiffness_brings_the_mass_to_rest(stiffness):
    one = Servo()
    one.world(Environment.SPRING, stiffness_nm_rad=stiffness)
    most = 0.0
    for k in range(5000):
        one.step(hand_nm=0.5 if k < 500 else 0.0)
        most = max(most, abs(one.velocity))
    assert abs(one.velocity) < 1e-6 * most
    if stiffness:
        assert abs(one.place) < 1e-6


def test_the_mass_leans_on_a_wall_with_the_hands_torque():
    one = Servo(damping=0.3)
    one.world(Environment.WALL, stiffness_nm_rad=1e4, center_rad=0.05, side=1)
    for _ in range(5000):
        one.step(hand_nm=0.5)
    assert one.place == pytest.approx(0.05 + 0.5 / 1e4, abs=1e-7)
    assert abs(one.velocity) < 1e-9


def test_outside_active_the_mass_rests_at_the_joint_and_starts_from_there():
    one = Servo(spring=5.0)
    for _ in range(50):
        one.step(hand_nm=1.0)
    assert one.place > 0
    for state in (State.HOLD, State.STOPPING, State.ARMING):
        one.state["state"] = state
        assert one.step(position_rad=0.3, hand_nm=1.0) == 0.0
        assert (one.place, one.velocity) == (0.3, 0.0)
    one.state["state"] = State.ACTIVE
    torque = one.step(position_rad=0.3, hand_nm=1.0)
    assert 0 < torque < 2.0 * T / 0.012 + 1e-2, "one tick of force, no step"


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_of_a_number_that_is_none_nothing_stays(bad):
    one = Servo(spring=5.0, force_hz=150.0, velocity_hz=100.0)
    for _ in range(20):
        one.step(hand_nm=1.0)
    assert math.isnan(one.step(hand_nm=bad))
    assert (one.velocity, one.place) == (0.0, 0.0)
    assert math.isfinite(one.step(hand_nm=1.0))
    assert math.isnan(one.step(difference_rad_s=bad))
    assert math.isfinite(one.step(hand_nm=1.0))
    one.command["environment_stiffness_nm_rad"][0] = bad
    assert math.isnan(one.step(hand_nm=1.0))


@pytest.mark.parametrize("bias", [0.002, -0.002, 0.004, -0.01])
def test_without_a_hand_it_drifts_no_faster_than_the_bias_beyond_the_dead_band_over_its_damping(bias):
    one = Servo(damping=0.1, deadband=0.003)
    for _ in range(5000):
        one.step(hand_nm=bias)
    bound = max(abs(bias) - 0.003, 0.0) / 0.1
    assert abs(one.velocity) <= bound + 1e-12
    assert one.velocity == pytest.approx(math.copysign(bound, bias), abs=1e-6)


def test_it_never_runs_away_from_a_joint_that_is_held():
    one = Servo(gain=2.0, spring=5.0)
    one.params["torque_limit_nm"] = 1.0
    for _ in range(5000):
        one.step(hand_nm=3.0)
    assert one.velocity <= 0.5
    assert one.place <= 0.2 + 1e-12


def test_a_missed_sample_holds_the_force_and_the_mass_goes_on():
    one, other = Servo(force_hz=50.0), Servo(force_hz=50.0)
    for k in range(60):
        one.step(hand_nm=1.0)
        other.step(hand_nm=1.0 if k < 30 else 99.0, elapsed=1 if k < 30 else 0)
    felt = float(other.state["mass_force_nm"][0, 0])
    assert felt == pytest.approx(1 - (1 - lowpass_alpha(50.0, T)) ** 30)
    assert 0 < other.velocity < one.velocity


def test_a_world_on_the_mass_does_not_carry_it_along_and_is_paid():
    one = Servo()
    one.params["renderer_store_j"], one.params["renderer_power_w"] = 0.01, 0.0
    one.world(Environment.SPRING, stiffness_nm_rad=0.0, center_rad=0.0)
    one.step()
    one.command["environment_stiffness_nm_rad"][0] = 10.0
    one.command["environment_center_rad"][0] = 0.1
    granted, before = 0.0, one.place
    for _ in range(3000):
        one.step()
        granted += float(one.state["renderer_grant_j"][0, 0])
    kinetic = 0.5 * 0.012 * one.velocity**2
    assert granted <= 0.01 + 1e-12
    assert kinetic + float(one.state["stored_energy_j"][0, 0]) <= granted + 1e-9
    assert one.place != before


def test_the_stiffness_the_world_is_felt_through_is_the_masses():
    one = Servo(mass=0.02)
    assert felt_through(one.params[0], 0) == pytest.approx(0.02 / T**2)
    one.params["display_kind"] = Display.IMPEDANCE
    one.params["coupling_stiffness_nm_rad"] = 60.0
    assert felt_through(one.params[0], 0) == 60.0


@pytest.mark.parametrize(
    ("mass", "damping", "first_unstable"),
    [(0.006, 0.02, 13.77), (0.009, 0.05, 149.6), (0.012, 0.05, 602.4)],
)
@pytest.mark.parametrize("share", [0.95, 1.05])
def test_with_a_spring_for_a_hand_it_rings_down_below_the_first_unstable_stiffness_and_up_above(
    mass, damping, first_unstable, share
):
    """Rows of docs/theory.md 11: 1 kHz, K_v 2, v_hat 100 Hz, force 150 Hz, the torque a tick late."""
    k_h = share * first_unstable
    one = Servo(mass, damping, 2.0, force_hz=150.0, velocity_hz=100.0)
    A = np.array([[0.0, 1.0, 0.0], [-k_h / J, -B / J, 1 / J], [0.0, 0.0, 0.0]])
    motion = expm(A * T)
    joint, held, before, rms = np.array([0.01, 0.0]), [0.0], 0.01, []
    while len(rms) < 20 and joint[0] < 1e3:
        square = 0.0
        for _ in range(500):
            x = joint[0]
            held.append(one.step(x, (x - before) / T, -k_h * x))
            before = x
            joint = (motion @ np.array([*joint, held.pop(0)]))[:2]
            square += x * x
        rms.append(math.sqrt(square / 500))
    late = np.log(rms[len(rms) // 3 :])
    slope = np.polyfit(np.arange(len(late)), late, 1)[0]
    assert (slope > 0) == (share > 1), (slope, rms[0], rms[-1])


def test_the_account_of_the_hand_is_its_work_and_never_more_than_is_held_and_banked():
    one = Servo()
    s, p = one.state[0], one.params[0]
    one.params["energy_bank_j"] = 0.02
    one.state["authority"] = 1.0
    observe_hand(s, p, 0, -0.01, 0.004, 0.0)
    assert float(one.state["energy_port_j"][0, 0]) == pytest.approx(-0.006)
    observe_hand(s, p, 0, 5.0, 0.0, 2.0)
    assert float(one.state["energy_port_j"][0, 0]) == pytest.approx(0.02 + 0.5 * J * 4)
    observe_hand(s, p, 0, math.nan, 0.0, 0.0)
    assert passivity_fault(s, p, 0) == Fault.PASSIVITY_GROSS, "what is no number is the worst"
