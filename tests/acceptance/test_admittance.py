"""A rig displayed as an admittance, on simulated joints: what is felt, what holds, what stops."""

import numpy as np
import pytest
from admittance_rigs import QUIET, SLIPPERY, felt, hand, rig

from rtctl.control.vocabulary import Environment, State

PERIOD_S = 1e-3
UNCHANGED = ("mass_max_kgm2 = 0.02 ", "mass_max_kgm2 = 0.0 ")
"""A mass that no client may change."""


def lived(made, seconds, **fields):
    """Ticks of so many seconds, with the joint's true position and speed."""
    ticks = made.run(seconds, **fields)
    return ticks, made.truth["position_rad"][:, 0], made.truth["velocity_rad_s"][:, 0]


@pytest.mark.parametrize("frequency_hz", [0.5, 1.0, 2.0])
def test_what_is_felt_is_mass_and_damping_through_the_servo_where_little_rubs(tmp_path, frequency_hz):
    changes = (
        *QUIET,
        *SLIPPERY,
        *hand(20.0, 0.1, 0.2, frequency_hz),
        ("mass_kgm2 = 0.012", "feedforward = 0\nmass_kgm2 = 0.03"),
        UNCHANGED,
        ("damping_nms_rad = 0.1               #", "damping_nms_rad = 0.3               #"),
    )
    made = rig(tmp_path, *changes)
    made.arm()
    made.run(1.0)
    ticks, _, speed = lived(made, 4.0)
    turn = 2j * np.pi * frequency_hz
    servo = 2.0 + 10.0 / turn
    asked = (0.012 * turn + 0.05 + servo) / (1 + servo / (0.03 * turn + 0.3))
    assert abs(felt(ticks, speed, frequency_hz, PERIOD_S) / asked - 1) < 0.05


@pytest.mark.parametrize("frequency_hz", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("mass", [0.008, 0.03])
def test_what_is_sent_ahead_has_the_hand_feel_what_is_asked_for(tmp_path, mass, frequency_hz):
    changes = (
        *QUIET,
        *SLIPPERY,
        *hand(20.0, 0.1, 0.15 / frequency_hz, frequency_hz),
        ("mass_kgm2 = 0.012", f"mass_kgm2 = {mass}"),
        UNCHANGED,
        ("damping_nms_rad = 0.1               #", "damping_nms_rad = 0.2               #"),
    )
    made = rig(tmp_path, *changes)
    made.arm()
    made.run(1.0)
    ticks, _, speed = lived(made, 4.0)
    asked = mass * 2j * np.pi * frequency_hz + 0.2
    assert abs(felt(ticks, speed, frequency_hz, PERIOD_S) / asked - 1) < 0.05


def test_friction_is_not_felt_but_for_what_the_servo_leaves(tmp_path):
    """A dry friction of .25 N m; the hand moves at 1 rad/s."""
    made = rig(tmp_path, *QUIET)
    made.arm()
    made.run(1.0)
    ticks, _, _ = lived(made, 4.0)
    assert set(ticks["state"]) == {State.ACTIVE}
    assert np.sqrt(np.mean(ticks["hand_torque_nm"] ** 2)) < 0.25 / 2.5
    assert ticks["energy_port_j"].min() > 0.0


@pytest.mark.parametrize("environment", ["spring", "wall"])
def test_a_world_is_held_by_the_servos_spring(tmp_path, environment):
    """The hand leans on it: its torque is the world's, and the joint stays where the world has the mass."""
    made = rig(
        tmp_path,
        *QUIET,
        *hand(5.0, 0.1, 0.3, 0.05),
        ('kind = "free"', f'kind = "{environment}"\nstiffness_nm_rad = 40.0'),
    )
    made.arm()
    made.run(4.0)
    ticks, place, speed = lived(made, 1.0)  # near the end of the swing
    assert set(ticks["state"]) == {State.ACTIVE}
    mass = ticks["proxy_position_rad"][:, 0]
    assert np.abs(mass - place).max() < 0.05, "the servo's spring bends under the friction"
    assert np.abs(ticks["hand_torque_nm"][:, 0] - 40.0 * mass - 0.1 * speed).max() < 0.03


def test_a_hand_stiffer_than_promised_is_damped_first_and_then_the_rig_stops(tmp_path):
    changes = (
        *hand(2000.0, 0.0, 0.02, 0.5),
        ("mass_kgm2 = 0.012", "mass_kgm2 = 0.002"),
        ("damping_nms_rad = 0.1               #", "damping_nms_rad = 0.02              #"),
    )
    made = rig(tmp_path, *SLIPPERY, *changes)
    parts = []
    for _ in range(30):
        asked = {"arm_count": int(made.command["arm_count"][0]) + 1, "epoch": int(made.state["epoch"][0])}
        parts.append(made.run(0.05, **asked))
    ticks = np.concatenate(parts)
    active = ticks["state"] == State.ACTIVE
    assert active.any()
    assert not active[-200:].any(), "a fault stopped it"
    assert ticks["injected_damping_nms_rad"][active].max() > 0.0
    assert ticks["energy_port_j"].min() > -3.0 * 0.02


def test_a_contact_that_rings_is_damped_before_the_account_is_short(tmp_path):
    """Five times the stiffness that was promised; without the watch it is thrown at 2 rad/s and stopped."""
    changes = (
        *hand(600.0, 0.0, 0.02, 0.5),
        ("mass_kgm2 = 0.012", "mass_kgm2 = 0.004"),
        ("damping_nms_rad = 0.1               #", "damping_nms_rad = 0.05              #"),
    )
    made = rig(tmp_path, *SLIPPERY, *changes)
    made.arm()
    ticks = made.run(6.0)
    assert set(ticks["state"]) == {State.ACTIVE}
    assert ticks["energy_port_j"].min() > -0.02
    assert np.abs(ticks["velocity_rad_s"]).max() < 0.5
    assert ticks["injected_damping_nms_rad"].max() > 1.0


@pytest.mark.parametrize("frequency_hz", [0.5, 2.0])
def test_in_a_hand_that_moves_as_hands_do_nothing_is_damped(tmp_path, frequency_hz):
    made = rig(tmp_path, *hand(20.0, 0.1, 0.2, frequency_hz))
    made.arm()
    ticks = made.run(6.0)
    assert not ticks["injected_damping_nms_rad"].any()


def test_nobody_holds_it_and_it_stays(tmp_path):
    made = rig(tmp_path, ('kind = "sine"\nstiffness', 'kind = "none"\nstiffness'))
    made.arm()
    _, place, _ = lived(made, 10.0)
    assert abs(place[-1] - place[0]) < 0.05


def test_a_stop_brings_it_to_rest_and_it_begins_again_where_the_joint_is(tmp_path):
    made = rig(tmp_path, *QUIET)
    made.arm()
    made.run(0.7)
    ticks, _, _ = lived(made, 0.5, stop_count=1)
    assert ticks["state"][-1] == State.IDLE
    assert not ticks["torque_applied_nm"][-100:].any()
    assert np.array_equal(ticks["proxy_position_rad"][-100:], ticks["position_rad"][-100:])
    again = made.arm()
    assert np.abs(np.diff(again["torque_applied_nm"][:, 0])).max() <= 0.2 + 1e-12, "the gate's rate"


def test_a_world_that_changes_in_motion_makes_no_step(tmp_path):
    made = rig(tmp_path, *QUIET)
    made.arm()
    made.run(0.6)
    before, _, _ = lived(made, 0.05)
    after, _, _ = lived(made, 0.5, environment_kind=Environment.SPRING, environment_stiffness_nm_rad=100.0)
    torque = np.concatenate([before["torque_wanted_nm"][:, 0], after["torque_wanted_nm"][:, 0]])
    assert np.abs(np.diff(torque)).max() <= 0.2, "the gate's rate"
    assert set(after["state"]) == {State.ACTIVE}
