"""A joint that rests or only bends its bristles follows the hand's torque ever more slowly; one that slides
does not.
"""

import math

import numpy as np
import pytest
from law_rig import COUNT, LawRig, T, of_rows

from rtctl.control import resting
from rtctl.control.assistance import CREEP_RAD_S
from rtctl.control.disturbance_observer import observe_friction
from rtctl.control.feedforward import advance_gate, advance_intent, friction_direction
from rtctl.control.resting import (
    BENT_S,
    CALMING_S,
    FORGOTTEN_S,
    HELD_AFTER_S,
    HELD_S,
    OBSERVER_TIMES,
    REST_COUNTS,
    REST_HZ,
    REST_S,
    REST_SHARE,
    advance_rest,
    calm_speed,
    held_part,
    while_bent,
    while_resting,
)
from rtctl.control.velocity import lowpass_alpha
from rtctl.control.vocabulary import Display, Policy

REST = of_rows(advance_rest)
QUICK = 0.27
SLOW = lowpass_alpha(REST_HZ, T)
OBSERVER = {"observer_alpha": lowpass_alpha(20.0, T), "observer_smooth_alpha": lowpass_alpha(80.0, T)}


def made(**params):
    return LawRig(
        rest_alpha=SLOW, friction_intent_alpha=QUICK, friction_gate_alpha=QUICK, **OBSERVER, **params
    )


def seen_at(rig, positions_rad, hand_nm=0.0, bristle_share=1.0, velocity_rad_s=0.1):
    """Let the joint be seen at these angles, one a tick; what `QUICK` becomes for observer and feed-forward
    after the last.
    """
    rig.state["bristle_share"], rig.state["velocity_rad_s"] = bristle_share, velocity_rad_s
    for position in positions_rad:
        rig.state["position_rad"][0, 0] = position
        REST(rig.state, rig.params, 0, hand_nm, 0.0)
    return followed(rig, QUICK)


def followed(rig, alpha):
    one = (rig.state[0], rig.params[0], 0, alpha)
    return while_resting(*one), while_bent(*one, 1.0)


@pytest.mark.parametrize(
    ("rested_s", "observer", "feedforward"),
    [
        (0.1, 3 * SLOW, QUICK),
        (BENT_S, (1 + CALMING_S / BENT_S) * SLOW, QUICK),
        (CALMING_S, 2 * SLOW, SLOW),
        (2.0, 1.1 * SLOW, SLOW),
    ],
)
def test_in_one_place_the_observer_follows_ever_more_slowly_and_the_feedforward_after_a_time(
    rested_s, observer, feedforward
):
    follows = seen_at(made(), [0.0] * round(rested_s / T))
    assert follows == pytest.approx((observer, feedforward), rel=1e-9)


def test_both_follow_as_ever_at_first():
    assert seen_at(made(), [0.0] * 5) == (QUICK, QUICK)


LONG = round(1.0 / T)


def test_flicker_between_two_counts_is_rest_and_a_third_is_motion():
    rig = made()
    assert max(seen_at(rig, [0.0, COUNT] * LONG)) < 1.2 * SLOW
    assert seen_at(rig, [2 * COUNT]) == (QUICK, QUICK)
    assert 1 < REST_COUNTS < 2


def test_what_stays_within_a_share_of_the_presliding_length_rests():
    length_rad = 200 * COUNT
    rig = made(presliding_rad=length_rad)
    within = (REST_SHARE - 0.005) * length_rad
    assert max(seen_at(rig, [0.0, within] * LONG)) < 1.2 * SLOW
    assert seen_at(rig, [(REST_SHARE + 0.005) * length_rad]) == (QUICK, QUICK)


@pytest.mark.parametrize("bristle_share", [0.0, -0.7, 0.999])
def test_on_bent_bristles_it_follows_slowly_wherever_the_joint_goes(bristle_share):
    rig, way = made(), 5 * COUNT * np.arange(round(BENT_S / T) + 1)
    assert seen_at(rig, way[:-1], bristle_share=bristle_share) == (QUICK, QUICK)
    assert seen_at(rig, way[-1:], bristle_share=bristle_share) == (OBSERVER_TIMES * SLOW, SLOW)
    assert seen_at(rig, [0.0], bristle_share=math.copysign(1.0, bristle_share)) == (QUICK, QUICK)


@pytest.mark.parametrize("speed_rad_s", [0.0, 0.99 * CREEP_RAD_S, -0.99 * CREEP_RAD_S, math.nan])
def test_a_joint_that_creeps_with_its_bristles_at_their_end_rests(speed_rad_s):
    rig, way = made(), 5 * COUNT * np.arange(round(BENT_S / T) + 1)
    assert seen_at(rig, way[:-1], velocity_rad_s=speed_rad_s) == (QUICK, QUICK)
    assert seen_at(rig, way[-1:], velocity_rad_s=speed_rad_s) == (OBSERVER_TIMES * SLOW, SLOW)
    assert seen_at(rig, [0.0], velocity_rad_s=-1.01 * CREEP_RAD_S) == (QUICK, QUICK), "until it slides"


def test_a_joint_that_follows_a_slow_mass_does_not_rest_while_it_slides():
    rig, way = made(), 5 * COUNT * np.arange(LONG)
    rig.state["display_kind"] = int(Display.ADMITTANCE)
    assert seen_at(rig, way, velocity_rad_s=0.5 * CREEP_RAD_S) == (QUICK, QUICK)
    assert seen_at(rig, way, bristle_share=0.9) == (OBSERVER_TIMES * SLOW, SLOW)


@pytest.mark.parametrize("speed_rad_s", [0.1, -0.3, 3.0])
def test_a_joint_that_moves_never_rests(speed_rad_s):
    rig = made()
    for tick in range(300):
        angle = round(speed_rad_s * T * tick / COUNT) * COUNT
        assert seen_at(rig, [angle]) == (QUICK, QUICK)


def test_what_is_slower_than_rest_stays_so():
    rig = made()
    seen_at(rig, [0.0] * LONG)
    assert followed(rig, SLOW / 10) == (SLOW / 10, SLOW / 10)


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
    """Half of what `read` swings in the last period when the hand's torque swings by 5 mN m, like its
    gate.
    """
    values = []
    for tick in range(LONG):
        hand = 0.005 * (1 + math.sin(2 * math.pi * hz * tick * T))
        REST(rig.state, rig.params, 0, hand, 0.0)
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
    assert seen_at(rig, [math.nan], hand_nm=math.nan) == (QUICK, QUICK)
    assert math.isnan(rig.state["calm_hand_nm"][0, 0])
    seen_at(rig, [1.0], hand_nm=0.1)
    assert rig.state["calm_hand_nm"][0, 0] == 0.1, "the next number counts at once"


def test_the_torque_of_the_world_is_taken_in_as_the_hands():
    rig = made()
    rig.state["bristle_share"] = 1.0
    for world_nm, seen_nm in ((0.3, 0.3), (math.nan, 0.0), (-0.2, -0.2)):
        REST(rig.state, rig.params, 0, 0.0, world_nm)
        assert rig.state["calm_world_nm"][0, 0] == pytest.approx(seen_nm)
    rig.state["bent_ticks"] = LONG
    REST(rig.state, rig.params, 0, 0.0, 0.3)
    assert rig.state["calm_world_nm"][0, 0] == pytest.approx(-0.2 + 0.5 * SLOW)


@pytest.mark.parametrize(
    ("rested_s", "held"), [(0.0, 0.0), (HELD_AFTER_S, 0.0), (HELD_AFTER_S + 0.3 * HELD_S, 0.3), (60.0, 1.0)]
)
def test_a_joint_that_has_not_moved_on_for_long_is_held_and_never_one_that_follows_a_mass(rested_s, held):
    rig = made()
    rig.state["bent_ticks"] = round(rested_s / T)
    assert held_part(rig.state[0], rig.params[0], 0) == pytest.approx(held)
    rig.state["display_kind"] = int(Display.ADMITTANCE)
    assert held_part(rig.state[0], rig.params[0], 0) == 0.0


SPEED = of_rows(calm_speed)


@pytest.mark.parametrize(("ticks", "long_s"), [("rest_ticks", REST_S), ("bent_ticks", BENT_S)])
def test_a_joint_that_rests_or_only_bends_is_read_at_its_largest_speed_of_late(ticks, long_s):
    rig = made()
    assert SPEED(rig.state, rig.params, 0, 0.3) == 0.3
    assert SPEED(rig.state, rig.params, 0, 0.1) == 0.1  # while it moves the present one
    rig.state[ticks] = round(2 * long_s / T)
    assert SPEED(rig.state, rig.params, 0, 0.004) == pytest.approx(0.1, rel=0.01)
    for _ in range(round(FORGOTTEN_S / T)):
        last = SPEED(rig.state, rig.params, 0, 0.0)
    assert last == pytest.approx(0.1 / math.e, rel=0.01)
    assert SPEED(rig.state, rig.params, 0, 0.2) == 0.2


SEEN = of_rows(resting.speed_seen)


@pytest.mark.parametrize(("ticks", "long_s"), [("rest_ticks", REST_S), ("bent_ticks", BENT_S)])
def test_a_joint_that_stands_has_no_speed_for_the_help(ticks, long_s):
    rig = made()
    assert SEEN(rig.state, rig.params, 0, -0.05) == -0.05
    rig.state[ticks] = round(2 * long_s / T)
    assert SEEN(rig.state, rig.params, 0, -0.05) == 0.0
    assert math.isnan(SEEN(rig.state, rig.params, 0, math.nan))
    rig.state["display_kind"] = int(Display.ADMITTANCE)
    assert (SEEN(rig.state, rig.params, 0, 0.05) == 0.05) == (ticks == "bent_ticks"), "it follows its mass"


@pytest.mark.parametrize("bent", [False, True])
def test_on_bent_bristles_the_direction_is_the_hands_however_fast_they_bend(bent):
    rig = made(friction_policy=int(Policy.HYBRID), friction_blend_rad_s=0.08, friction_intent_nm=0.1)
    rig.state["friction_stop"], rig.state["friction_intent_nm"] = -1.0, 0.05
    rig.state["bent_ticks"] = round(2 * BENT_S / T) if bent else 0
    way = friction_direction(rig.state[0], rig.params[0], 0, 1.0, 0)
    assert way == pytest.approx(0.5 if bent else -1.0)
    assert friction_direction(rig.state[0], rig.params[0], 0, 0.0, 0) == pytest.approx(0.5)


def test_of_a_speed_that_is_no_number_nothing_stays():
    rig = made()
    rig.state["rest_ticks"] = round(2 * REST_S / T)
    assert math.isnan(SPEED(rig.state, rig.params, 0, math.nan))
    assert SPEED(rig.state, rig.params, 0, 0.01) == 0.01
