"""A joint that rests or only bends its bristles follows the hand's torque ever more slowly; one that slides does not."""

import math

import numpy as np
import pytest
from law_rig import COUNT, LawRig, T

from rtctl.control.disturbance_observer import observe_friction
from rtctl.control.feedforward import advance_gate, advance_intent
from rtctl.control.resting import (
    BENT_S,
    REST_COUNTS,
    REST_HZ,
    REST_S,
    REST_SHARE,
    advance_rest,
    while_bent,
)
from rtctl.control.velocity import lowpass_alpha

QUICK = 0.27
SLOW = lowpass_alpha(REST_HZ, T)
OBSERVER = {"observer_alpha": lowpass_alpha(20.0, T), "observer_smooth_alpha": lowpass_alpha(80.0, T)}


def made(**params):
    return LawRig(
        rest_alpha=SLOW, friction_intent_alpha=QUICK, friction_gate_alpha=QUICK, **OBSERVER, **params
    )


def seen_at(rig, positions_rad, hand_nm=0.0, bristle_share=1.0):
    """Let the joint be seen at these angles, one a tick; what `QUICK` becomes after the last."""
    rig.state["bristle_share"] = bristle_share
    for position in positions_rad:
        rig.state["position_rad"][0, 0] = position
        advance_rest(rig.state[0], rig.params[0], 0, hand_nm)
    return while_bent(rig.state[0], rig.params[0], 0, QUICK)


@pytest.mark.parametrize(
    ("rested_s", "follows"), [(0.01, QUICK), (BENT_S, QUICK), (BENT_S + T, SLOW), (2.0, SLOW)]
)
def test_a_joint_that_rests_follows_as_ever_at_first_and_then_slowly(rested_s, follows):
    assert seen_at(made(), [0.0] * round(rested_s / T)) == follows


LONG = round(1.0 / T)


def test_flicker_between_two_counts_is_rest_and_a_third_is_motion():
    rig = made()
    assert seen_at(rig, [0.0, COUNT] * LONG) == SLOW
    assert seen_at(rig, [2 * COUNT]) == QUICK
    assert 1 < REST_COUNTS < 2


def test_what_stays_within_a_share_of_the_presliding_length_rests():
    length_rad = 200 * COUNT
    rig = made(presliding_rad=length_rad)
    within = (REST_SHARE - 0.005) * length_rad
    assert seen_at(rig, [0.0, within] * LONG) == SLOW
    assert seen_at(rig, [(REST_SHARE + 0.005) * length_rad]) == QUICK


@pytest.mark.parametrize("bristle_share", [0.0, -0.7, 0.999])
def test_on_bent_bristles_it_follows_slowly_wherever_the_joint_goes(bristle_share):
    rig, way = made(), 5 * COUNT * np.arange(round(BENT_S / T) + 1)
    assert seen_at(rig, way[:-1], bristle_share=bristle_share) == QUICK
    assert seen_at(rig, way[-1:], bristle_share=bristle_share) == SLOW
    assert seen_at(rig, [0.0], bristle_share=math.copysign(1.0, bristle_share)) == QUICK


@pytest.mark.parametrize("speed_rad_s", [0.1, -0.3, 3.0])
def test_a_joint_that_moves_never_rests(speed_rad_s):
    rig = made()
    for tick in range(300):
        angle = round(speed_rad_s * T * tick / COUNT) * COUNT
        assert seen_at(rig, [angle]) == QUICK


def test_what_is_slower_than_rest_stays_so():
    rig = made()
    seen_at(rig, [0.0] * LONG)
    assert while_bent(rig.state[0], rig.params[0], 0, SLOW / 10) == SLOW / 10


def intent(rig, _hand):
    advance_intent(rig.state[0], rig.params[0], 0, rig.state["calm_hand_nm"][0, 0])
    return float(rig.state["friction_intent_nm"][0, 0])


def gate(rig, _hand):
    return advance_gate(rig.state[0], rig.params[0], 0, rig.state["calm_hand_nm"][0, 0])


def friction(rig, hand):
    rig.state["hand_torque_before_nm"][0, 0] = hand
    observe_friction(rig.now[0], rig.state[0], rig.params[0], 0, 1)
    return float(rig.now["friction_observed_nm"][0, 0])


def ripple_of(rig, read, hz):
    """Half of what `read` swings in the last period when the hand's torque swings by 5 mN m, like its gate."""
    values = []
    for tick in range(LONG):
        hand = 0.005 * (1 + math.sin(2 * math.pi * hz * tick * T))
        advance_rest(rig.state[0], rig.params[0], 0, hand)
        values.append(read(rig, hand))
    return float(np.ptp(values[-round(1 / (hz * T)) :])) / 2


@pytest.mark.parametrize("read", [intent, gate, friction])
def test_a_vibration_at_rest_is_followed_through_two_low_passes(read):
    hz = 24.0
    one = 1.4 * REST_HZ / hz  # the observer ends with a third low-pass, which takes part of the rest
    moving = LawRig(**OBSERVER, friction_intent_alpha=QUICK, friction_gate_alpha=QUICK)
    assert ripple_of(made(), read, hz) < 1.5 * one**2 * ripple_of(moving, read, hz)


def speed_seen(resting_ticks):
    """What a flicker of one count makes of the friction observed, N m, after so many ticks in one place."""
    rig = made(inertia_kgm2=0.012, observer_bandwidth_rad_s=2 * math.pi * 20)
    seen_at(rig, [0.0] * resting_ticks)
    seen_at(rig, [COUNT])
    rig.now["velocity_difference_rad_s"] = COUNT / T
    observe_friction(rig.now[0], rig.state[0], rig.params[0], 0, 1)
    return float(rig.now["friction_observed_nm"][0, 0])


def test_flicker_of_a_resting_joint_is_no_velocity():
    assert speed_seen(math.ceil(REST_S / T) + 1) == 0.0
    assert speed_seen(5) < 0.0


def test_no_number_is_motion_and_lasts_for_one_tick():
    rig = made()
    seen_at(rig, [0.0] * 100, hand_nm=0.1)
    assert seen_at(rig, [math.nan], hand_nm=math.nan) == QUICK
    assert math.isnan(rig.state["calm_hand_nm"][0, 0])
    seen_at(rig, [1.0], hand_nm=0.1)
    assert rig.state["calm_hand_nm"][0, 0] == 0.1, "the next number counts at once"
