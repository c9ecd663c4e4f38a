"""What a remote proxy does against a hand that rests: where it may move the joint, what it pays, how fast it
follows.
"""

import math

import pytest
from held_rig import HAND_NM_RAD, follow, held_rig
from law_rig import B, LawRig, Plant, T

from rtctl.control.vocabulary import State


@pytest.mark.parametrize("seconds", [0.1, 0.3, 1.0])
def test_a_remote_proxy_may_move_the_joint_against_a_resting_hand(seconds):
    rig, plant = held_rig()
    follow(rig, plant, lambda k: 0.1 * min(1.0, k * T / seconds), 2000)
    assert rig.mode is State.ACTIVE
    assert plant.x == pytest.approx(0.1 * 60 / 65, rel=0.1)
    assert rig["energy_port_j"] >= 0.0


def test_a_remote_proxy_whose_motion_nobody_pays_for_stays_where_it_is():
    rig, plant = held_rig()
    rig.params["renderer_store_j"] = rig.state["renderer_store_j"] = 0.0
    rig.params["renderer_power_w"] = 0.0
    follow(rig, plant, lambda k: 0.2 * min(1.0, k * T / 0.3), 2000, velocity=3.0)
    assert rig.mode is State.ACTIVE
    assert rig["proxy_position_rad"] == rig["torque_applied_nm"] == plant.x == 0.0


def test_a_renderer_that_shakes_the_hand_gives_it_its_store_and_power_and_is_not_stopped():
    rig, plant = held_rig()
    given = 0.0
    for k in range(1500):
        given += pulled(rig, plant, 0.4 * math.sin(2 * math.pi * 3 * k * T), HAND_NM_RAD)
        assert given <= 0.1 + 1.0 * T * k + 0.03
    assert given > 0.7
    assert rig.mode is State.ACTIVE


def test_a_remote_proxy_waits_where_the_torque_limit_ends_and_not_beyond():
    rig, _ = held_rig()
    for _ in range(300):
        rig.command["target_position_rad"] = 5.0
        rig.request("target_count")
        rig.tick(0.0)
    assert rig["proxy_position_rad"] == pytest.approx(3.0 / 60, rel=0.02)
    assert rig["proxy_position_rad"] <= 3.0 / 60
    rig.command["target_position_rad"] = 0.0
    rig.request("target_count")
    rig.run(6)
    assert rig["proxy_position_rad"] == 0.0


def test_the_damper_of_a_remote_proxy_follows_no_velocity_beyond_what_the_joint_may_have_nor_one_unpaid():
    rig, _ = held_rig()
    torques = []
    for velocity in (10.0, 1e6):  # v_max, and far beyond
        rig.command["target_velocity_rad_s"] = velocity
        rig.command["target_position_rad"] = 0.0
        rig.state["renderer_store_j"] = 0.1
        rig.request("target_count")
        torques.append(rig.tick(0.0)["coupling_torque_nm"])
    assert torques == [pytest.approx(0.01 * 10.0)] * 2
    left = 1e-5
    rig.params["renderer_power_w"] = 0.0
    rig.state["renderer_store_j"] = left
    rig.request("target_count")
    paid = rig.tick(0.0)["coupling_torque_nm"] ** 2 / 0.01 * T  # b v^2 T
    assert 0.2 * left < paid <= left


def pulled(rig, plant, target, stiffness=0.0):
    """One tick of a remote target (NaN: silence) and a resting hand; J that left the device for the hand."""
    if not math.isnan(target):
        rig.command["target_position_rad"] = target
        rig.request("target_count")
    rig.tick(plant.x)
    torque, x = rig["torque_applied_nm"], plant.x
    dx = plant.advance(torque - stiffness * x) - x
    return torque * dx - B * dx * dx / T  # less what the device's own damping takes


@pytest.mark.parametrize("silent_ticks", [0, 40])
def test_a_renderer_that_winds_its_proxy_up_while_little_is_felt_pays_for_it_when_the_authority_rises(
    silent_ticks,
):
    """Arming and each return from a silence were granted all that was stored by then: 11.8 J in 8 s too
    much.
    """
    rig = LawRig(coupling_stiffness_nm_rad=60.0, torque_limit_nm=20.0, torque_rate_nm=0.2)
    rig.params["renderer_power_w"] = 0.2
    rig.environment("remote", target_position_rad=0.0, target_velocity_rad_s=0.0).run(30)
    rig.command["epoch"] = rig.state["epoch"]
    rig.request("arm_count", "target_count")
    plant, given = Plant(damping=0.6), 0.0
    for k in range(1500):
        silent = 0 <= k % 300 - 200 < silent_ticks
        given += pulled(rig, plant, math.nan if silent else plant.x + 0.4)
        assert given <= 0.1 + 0.2 * T * k + 0.03
    assert rig.mode in (State.ACTIVE, State.HOLD)
    assert given > 0.1


def test_a_target_that_jumps_is_followed_no_faster_than_the_joint_may_move():
    rig, plant = held_rig()
    before = 0.0
    for k in range(300):
        if k % 17 == 0:
            rig.command["target_position_rad"] = 0.3 * (-1) ** (k // 17)
            rig.request("target_count")
        rig.tick(plant.x)
        assert abs(rig["proxy_position_rad"] - before) <= 10.0 * T * (1 + 1e-9)
        before = rig["proxy_position_rad"]


def test_a_target_whose_program_falls_silent_is_extrapolated_no_further_than_the_hold():
    rig, _ = held_rig()
    rig.request("target_count")
    rig.command["target_velocity_rad_s"] = 0.5
    hold = int(rig.params["target_hold_ticks"][0])
    reached = [rig.tick()["proxy_position_rad"] for _ in range(hold + 20)]
    assert reached[-1] == pytest.approx(0.5 * T * hold)
    assert max(reached) == reached[-1]
