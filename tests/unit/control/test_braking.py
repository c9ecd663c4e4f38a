"""A hand that brakes the joint it moves is not helped with friction."""

import math

import pytest
from law_rig import LEVER, LawRig, T

from rtctl.control.braking import unbraked_share
from rtctl.control.resting import BENT_S, REST_S
from rtctl.control.vocabulary import Display, Policy

DEADBAND_NM, WIDTH_NM = 0.002, 0.015


def left(hand_nm, bristle_share=1.0, ticks=300, coupling_torque_nm=0.0, **state):
    """Share of the help that is left after `ticks` of this torque of the hand."""
    rig = LawRig()
    rig.now["hand_torque_nm"], rig.now["coupling_torque_nm"] = hand_nm, coupling_torque_nm
    rig.state["bristle_share"] = bristle_share
    for name, value in state.items():
        rig.state[name] = value
    for _ in range(ticks):
        share = unbraked_share(rig.now[0], rig.state[0], rig.params[0], 0)
    return share


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_friction_comes_back_in_proportion_to_how_the_hand_brakes(way):
    assert left(-way * (DEADBAND_NM + 0.5 * WIDTH_NM), way) == pytest.approx(0.5)
    assert left(-way * 0.1, way) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("hand_nm", [0.0, 0.1, math.nan])
def test_a_hand_that_moves_the_joint_or_is_not_there_is_helped_whole(way, hand_nm):
    assert left(way * hand_nm, way) == 1.0


def test_a_bias_within_the_dead_band_of_the_gate_brakes_nothing():
    assert left(-DEADBAND_NM) == 1.0


def test_a_hand_that_gives_way_to_a_virtual_spring_brakes_nothing():
    assert left(-0.1, coupling_torque_nm=0.12) == 1.0
    assert left(0.1, coupling_torque_nm=-0.2) == pytest.approx(0.0, abs=1e-9), (
        "nor does one that a spring overcomes push"
    )


def test_on_bent_bristles_nobody_knows_the_direction():
    assert left(-0.1, bristle_share=0.99) == 1.0


def test_nobody_brakes_a_joint_that_stands():
    assert left(-0.1, rest_ticks=round(REST_S / T) + 1) == 1.0


def test_the_joint_of_a_virtual_mass_is_helped_to_follow_a_mass_that_is_braked():
    assert left(-0.1, display_kind=int(Display.ADMITTANCE)) == 1.0


def test_it_comes_through_the_low_pass_of_the_gate_and_goes_again():
    assert left(-0.1, ticks=1) == pytest.approx(0.9)
    rig = LawRig()
    rig.state["bristle_share"], rig.state["friction_brake"] = 1.0, 1.0
    rig.now["hand_torque_nm"] = math.nan
    for _ in range(300):
        share = unbraked_share(rig.now[0], rig.state[0], rig.params[0], 0)
    assert share == pytest.approx(1.0), "a torque that is no number does not keep the help away"


@pytest.mark.parametrize("speed_rad_s", [0.5, -0.5])
def test_the_law_sends_no_help_to_a_hand_that_brakes(speed_rad_s):
    rig = LawRig(friction_policy=int(Policy.HYBRID)).friction().arm()
    helped = []
    for hand_nm in (0.1, -0.1):
        rig.force_n[1] = math.copysign(hand_nm, hand_nm * speed_rad_s) / LEVER
        for _ in range(200):
            rig.tick(rig.position + speed_rad_s * T)
        helped.append(rig["feedforward_torque_nm"])
    assert helped[0] == pytest.approx(math.copysign(0.225, speed_rad_s), rel=1e-2)
    assert abs(helped[1]) < 1e-6


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_hand_that_pulls_back_a_joint_that_sticks_is_helped_before_it_gives_way(way):
    """Dry friction that does not bend at all: helped only from then on, a hand of 2.6 N m/rad was thrown by 3
    rad/s.
    """
    rig = LawRig(friction_policy=int(Policy.HYBRID)).friction().arm()
    for hand_nm, speed_rad_s, ticks in ((0.1, 0.5, 200), (-0.1, 0.0, round(BENT_S / T) - 20)):
        rig.force_n[1] = way * hand_nm / LEVER
        for _ in range(ticks):
            rig.tick(rig.position + way * speed_rad_s * T)
    assert rig.state["bristle_share"][0, 0] == way
    assert rig["feedforward_torque_nm"] == pytest.approx(-way * 0.9 * 0.35, rel=1e-2)
