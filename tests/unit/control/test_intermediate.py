"""What a 60 Hz program sets, and what a remote proxy does, against a hand that rests."""

import math

import numpy as np
import pytest
from law_rig import J, LawRig, Plant, T

from rtctl.control.environments.changes import MOTION_SHARE, gate_room
from rtctl.control.vocabulary import Fault, State


def pressed_by_a_jump(rate_nm, store_j=0.1, face_rad=-0.03, power_w=1.0):
    """A wall's face jumps behind a joint that rests: coupling torques of the ticks that follow, N m."""
    rig = LawRig(coupling_stiffness_nm_rad=60.0, torque_rate_nm=rate_nm).arm()
    rig.params["renderer_store_j"], rig.params["renderer_power_w"] = store_j, power_w
    rig.environment("wall", environment_stiffness_nm_rad=500.0, environment_center_rad=0.5)
    rig.command["environment_side"] = 1
    rig.run(20)
    rig.command["environment_center_rad"] = face_rad
    return np.array([rig.tick()["coupling_torque_nm"] for _ in range(600)])


@pytest.mark.parametrize("rate_nm", [0.1, 0.2])
def test_a_wall_whose_face_jumps_onto_the_hand_presses_gradually(rate_nm):
    torques = pressed_by_a_jump(rate_nm, face_rad=-0.015)
    assert np.abs(np.diff(torques, prepend=0.0)).max() <= 0.2 * rate_nm * (1 + 1e-6)
    assert torques[-1] == pytest.approx(-0.015 * 500 * 60 / 560, rel=1e-3)


def test_a_jump_presses_no_harder_than_the_gate_can_take_back_when_the_joint_is_let_go():
    series = 500 * 60 / 560
    for rate_nm in (0.02, 0.05):
        most = MOTION_SHARE * rate_nm / T * math.sqrt(J / series)
        assert -pressed_by_a_jump(rate_nm)[-1] == pytest.approx(most, rel=0.02)
    assert -pressed_by_a_jump(1.0, face_rad=-0.2)[-1] == pytest.approx(3.0, rel=0.02)  # the limit


@pytest.mark.parametrize("power_w", [0.0, 0.02])
def test_a_store_without_energy_presses_at_the_power_alone(power_w):
    torques = pressed_by_a_jump(0.2, store_j=1e-3, power_w=power_w)
    stored_j = torques**2 / (2 * 500 * 60 / 560)
    ticks = np.arange(1, len(torques) + 1)
    assert (stored_j <= 1e-3 + power_w * T * ticks + 1e-9).all()
    assert (stored_j[20:] > 0.5 * (1e-3 + power_w * T * ticks[20:])).all()


def test_a_change_of_kind_passes_through_nothing_to_feel():
    rig = LawRig(coupling_stiffness_nm_rad=60.0, torque_rate_nm=0.05).arm()
    rig.environment("spring", environment_stiffness_nm_rad=100.0, environment_center_rad=0.0)
    for k in range(40):
        rig.tick(1e-3 * k)
    rig.environment("wall", environment_center_rad=0.02).command["environment_side"] = 1
    kinds, least = [], math.inf
    for _ in range(400):
        rig.tick()
        if kinds and kinds[-1] != rig["environment_kind"]:
            least = min(least, abs(rig["coupling_torque_nm"]))
        kinds.append(rig["environment_kind"])
    assert kinds == sorted(kinds)
    assert {1.0, 2.0} == set(kinds)
    assert least <= 0.1


def moving(speed_rad_s, rate_nm=0.05):
    """A joint that a hand moves steadily through free space; rig and a function that goes on for a tick."""
    rig = LawRig(coupling_stiffness_nm_rad=60.0, torque_rate_nm=rate_nm).arm()
    x = 0.0

    def on():
        nonlocal x
        x += speed_rad_s * T
        return rig.tick(x)

    for _ in range(30):
        on()
    return rig, on


def test_what_appears_before_a_fast_joint_is_as_stiff_as_the_gate_can_follow_and_stiffens_as_it_slows():
    felt = {}
    for speed in (0.1, 2.0):
        rig, on = moving(speed)
        rig.environment("wall", environment_stiffness_nm_rad=1e4, environment_center_rad=1.0)
        rig.command["environment_side"] = 1
        for _ in range(50):
            on()
        k = float(rig.state["world_stiffness_nm_rad"][0, 0])
        felt[speed] = 60 * k / (60 + k)
    assert felt[0.1] == pytest.approx(60, rel=0.01)
    assert felt[2.0] == pytest.approx(MOTION_SHARE * 0.05 / T / 2.0, rel=0.05)
    for _ in range(50):
        rig.tick()  # it rests
    assert float(rig.state["world_stiffness_nm_rad"][0, 0]) == 1e4


def test_a_world_of_another_kind_grows_where_it_belongs_and_not_where_the_last_one_was():
    rig = LawRig(coupling_stiffness_nm_rad=60.0).arm()
    for k in range(60):
        rig.tick(1e-3 * k)
    assert rig.state["world_center_rad"][0, 0] == 0.0
    rig.environment("wall", environment_stiffness_nm_rad=1e4, environment_center_rad=1.0)
    rig.command["environment_side"] = 1
    assert [rig.tick()["coupling_torque_nm"] for _ in range(50)] == [0.0] * 50


def test_energy_that_softening_gives_back_does_not_pay_for_a_longer_way():
    """Beyond the torque limit a softer spring with a farther centre gives out more, though it stores less."""
    rig = LawRig(coupling_stiffness_nm_rad=60.0, torque_limit_nm=1.0).arm()
    rig.params["renderer_power_w"] = 0.0
    rig.environment("spring", environment_stiffness_nm_rad=30.0)
    for k in range(300):
        rig.tick(1e-3 * k)  # 6 N m, of which the gate lets 1 through
    rig.state["renderer_store_j"] = 0.0
    rig.environment("spring", environment_stiffness_nm_rad=5.0, environment_center_rad=-3.0)
    rig.run(1000)
    assert float(rig.state["world_stiffness_nm_rad"][0, 0]) == 5.0
    assert float(rig.state["world_center_rad"][0, 0]) == 0.0


def spring_jumps(after_ticks):
    """A free joint whose spring jumps away so many ticks after arming, while the authority still rises."""
    rig = LawRig(coupling_stiffness_nm_rad=50.0)
    rig.params["soft_start_ticks"] = 500
    rig.environment("spring", environment_stiffness_nm_rad=10.0).run(40)
    rig.command["epoch"] = rig.state["epoch"]
    rig.request("arm_count")
    plant, active, least = Plant(), 0, math.inf
    for _ in range(1500):
        rig.tick(plant.x)
        plant.advance(rig["torque_applied_nm"])
        active += rig.mode is State.ACTIVE
        least = min(least, rig["energy_port_j"])
        if active == after_ticks:
            rig.command["environment_center_rad"] = 0.3
    return rig, least


@pytest.mark.parametrize("after_ticks", [1, 250, 450, 499, 501])
def test_a_change_of_environment_right_after_arming_is_no_alarm(after_ticks):
    rig, least = spring_jumps(after_ticks)
    assert rig.mode is State.ACTIVE
    assert least >= -1e-3


@pytest.mark.parametrize("name", ["stiffness_nm_rad", "damping_nms_rad", "center_rad", "pitch_rad"])
@pytest.mark.parametrize("kind", ["free", "spring", "detents", "remote"])
def test_a_number_that_is_not_finite_cuts_whatever_the_kind_and_is_no_way_around_the_store(name, kind):
    rig = LawRig(coupling_stiffness_nm_rad=60.0).arm()
    in_force = rig.state["world_center_rad"][0, 0]
    rig.environment(kind, target_position_rad=0.0, target_velocity_rad_s=0.0)
    rig.request("target_count")
    rig.command[f"environment_{name}"] = math.nan
    rig.tick()
    assert rig.faults & Fault.LAW_NOT_FINITE
    assert rig["torque_applied_nm"] == 0.0
    assert rig.state["world_center_rad"][0, 0] == in_force


def test_a_wall_that_recedes_is_left_behind_at_half_the_rate_of_the_gate():
    rig = LawRig(coupling_stiffness_nm_rad=60.0, torque_rate_nm=0.1)
    rig.environment("wall", environment_stiffness_nm_rad=500.0).arm()
    rig.command["environment_side"] = 1
    for k in range(20):
        rig.tick(1e-3 * k)
    rig.run(50)
    pressed = rig["coupling_torque_nm"]
    rig.command["environment_center_rad"] = 1.0
    torques = np.array([rig.tick()["coupling_torque_nm"] for _ in range(60)])
    assert torques[0] == pytest.approx(pressed + 0.05, rel=1e-6)
    assert torques[-1] == 0.0
    assert rig.state["world_center_rad"][0, 0] == 1.0


def in_detents(center_rad, pitch_rad=0.2):
    rig = LawRig(coupling_stiffness_nm_rad=60.0, torque_rate_nm=0.2)
    rig.environment("detents", environment_stiffness_nm_rad=20.0, environment_center_rad=center_rad)
    rig.command["environment_pitch_rad"] = pitch_rad
    return rig.arm()


@pytest.mark.parametrize(("center_rad", "pitch_rad"), [(0.03, 0.2), (0.0, 0.3), (-0.02, 0.3)])
def test_detents_that_shift_or_spread_press_gradually_and_end_as_if_they_had_been_there(
    center_rad, pitch_rad
):
    rig, there = in_detents(0.01), in_detents(center_rad, pitch_rad)
    rig.run(20)
    before = rig["coupling_torque_nm"]
    rig.command["environment_center_rad"], rig.command["environment_pitch_rad"] = center_rad, pitch_rad
    torques = np.array([rig.tick()["coupling_torque_nm"] for _ in range(400)])
    assert np.abs(np.diff(torques, prepend=before)).max() <= 0.5 * 0.2 * (1 + 1e-6)
    there.run(400)
    assert torques[-1] == pytest.approx(there["coupling_torque_nm"], abs=1e-6)


def test_nothing_bounds_the_room_of_a_world_without_stiffness():
    rig = LawRig(coupling_stiffness_nm_rad=60.0)
    assert gate_room(rig.state[0], rig.params[0], 0, 0.0) == math.inf


def test_a_damper_has_no_place_and_no_stiffness_to_feel():
    rig = LawRig(coupling_stiffness_nm_rad=60.0)
    rig.environment("damper", environment_damping_nms_rad=0.1, environment_stiffness_nm_rad=50.0).arm()
    rig.environment("damper", environment_center_rad=0.5, environment_stiffness_nm_rad=5.0)
    assert [rig.tick()["coupling_torque_nm"] for _ in range(100)] == [0.0] * 100
    assert rig.state["world_center_rad"][0, 0] == 0.5
