"""The loop that a virtual mass closes with a joint and a hand, against plain NumPy; and a mass that a
renderer leads.
"""

import math

import numpy as np
import pytest
from law_rig import of_rows
from scipy.linalg import expm

from rtctl.control.jit import records
from rtctl.control.records import new_records
from rtctl.control.velocity import lowpass_alpha
from rtctl.control.virtual_mass import servo_torque
from rtctl.control.vocabulary import Display, Environment, State

TORQUE = of_rows(servo_torque)
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
            "watch_floor_nm": math.inf,
            "torque_rate_nm": 1e9,
            "velocity_limit_rad_s": 1e9,
            "inertia_kgm2": J,
        }.items():
            self.params[name][0] = value
        self.params["period_s"] = T
        self.params["renderer_store_j"], self.params["renderer_power_w"] = 1.0, 1e6
        self.state["state"], self.state["authority"] = State.ACTIVE, 1.0
        self.state["display_kind"] = Display.ADMITTANCE

    def step(self, position_rad=0.0, difference_rad_s=0.0, hand_nm=0.0, elapsed=1, *, disabled=False):
        self.state["position_rad"][0] = position_rad
        return TORQUE(self.state, self.params, self.command, 0, elapsed, difference_rad_s, hand_nm, disabled)

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


@pytest.mark.parametrize(
    ("mass", "damping", "first_unstable"),
    [(0.006, 0.02, 13.77), (0.009, 0.05, 149.6), (0.012, 0.05, 602.4)],
)
@pytest.mark.parametrize("share", [0.95, 1.05])
def test_with_a_spring_for_a_hand_it_rings_down_below_the_first_unstable_stiffness_and_up_above(
    mass, damping, first_unstable, share
):
    """Rows of docs/theory.md 2.13: 1 kHz, K_v 2, v_hat 100 Hz, force 150 Hz, the torque a tick late."""
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


def test_a_renderer_that_holds_the_other_end_of_a_spring_leads_the_mass_as_far_as_it_is_paid():
    one = Servo(damping=0.3)
    one.params["coupling_stiffness_nm_rad"], one.params["coupling_damping_nms_rad"] = 20.0, 0.05
    one.params["target_hold_ticks"] = 100
    one.command["environment_kind"][0] = Environment.REMOTE
    one.step(disabled=True)
    one.params["renderer_store_j"], one.params["renderer_power_w"] = 0.05, 0.0
    one.state["renderer_store_j"] = 0.05
    one.state["target_position_rad"], one.state["target_age_ticks"], one.state["remote_ticks"] = 1.0, 0, 1
    granted = 0.0
    for _ in range(5000):
        one.step(one.place)  # a joint that is where the mass is
        granted += float(one.state["renderer_grant_j"][0, 0])
        assert granted <= 0.05 + 1e-12
    assert granted > 0.04
    assert one.place > 0.02


def test_a_renderer_finds_its_end_of_the_spring_at_the_mass_wherever_that_went_in_another_world():
    """It was left where the mass was armed: targets on the joint itself jolted a hand at .5 rad by the torque
    limit, and nobody paid.
    """
    one = Servo()
    one.params["coupling_stiffness_nm_rad"], one.params["target_hold_ticks"] = 60.0, 100
    one.params["velocity_limit_rad_s"] = 6.0
    one.world(Environment.FREE)
    for _ in range(600):
        one.step(one.place, one.velocity, hand_nm=0.05)
    assert one.place > 0.2
    one.state["mass_velocity_rad_s"] = 0.0
    one.command["environment_kind"][0] = Environment.REMOTE
    one.state["target_position_rad"], one.state["remote_ticks"] = one.place, 1
    assert abs(one.step(one.place)) < 1e-9
    assert one.state["stored_energy_j"][0, 0] < 1e-12
