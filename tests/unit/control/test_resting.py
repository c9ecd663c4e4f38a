"""A joint that rests, as far as its encoder can tell, follows the hand's torque slowly; one that moves does not."""

import math

import numpy as np
import pytest
from law_rig import COUNT, LawRig, T

from rtctl.control.disturbance_observer import observe_friction
from rtctl.control.feedforward import advance_intent
from rtctl.control.resting import REST_COUNTS, REST_HZ, REST_S, advance_rest, calmed
from rtctl.control.velocity import lowpass_alpha

QUICK = 0.27
SLOW = lowpass_alpha(REST_HZ, T)


def made():
    return LawRig(rest_alpha=SLOW, friction_intent_alpha=QUICK)


def seen_at(rig, positions_rad):
    """Let the joint be seen at these angles, one a tick; the coefficient that `QUICK` becomes after the last."""
    for position in positions_rad:
        rig.state["position_rad"][0, 0] = position
        advance_rest(rig.state[0], rig.params[0], 0)
    return calmed(rig.state[0], rig.params[0], 0, QUICK)


REST_TICKS = math.ceil(REST_S / T)


@pytest.mark.parametrize(("ticks", "alpha"), [(REST_TICKS, QUICK), (REST_TICKS + 1, SLOW), (5000, SLOW)])
def test_it_rests_after_a_while_in_one_place(ticks, alpha):
    assert seen_at(made(), [0.0] * ticks) == alpha


def test_flicker_between_two_counts_is_rest_and_a_third_is_motion():
    rig = made()
    assert seen_at(rig, [0.0, COUNT] * 100) == SLOW
    assert seen_at(rig, [2 * COUNT]) == QUICK
    assert 1 < REST_COUNTS < 2


@pytest.mark.parametrize("speed_rad_s", [0.01, -0.1, 3.0])
def test_a_joint_that_moves_never_rests(speed_rad_s):
    rig = made()
    for tick in range(300):
        angle = round(speed_rad_s * T * tick / COUNT) * COUNT
        assert seen_at(rig, [angle]) == QUICK


def test_what_is_quieter_than_rest_stays_so():
    rig = made()
    seen_at(rig, [0.0] * 100)
    assert calmed(rig.state[0], rig.params[0], 0, SLOW / 10) == SLOW / 10


def ripple_of(rig, read):
    """Greatest of `read` in the last of two seconds when the hand's torque swings by 1 N m at 53 Hz."""
    values = []
    for tick in range(2000):
        hand = math.sin(2 * math.pi * 53 * tick * T)
        rig.state["hand_torque_before_nm"][0, 0] = hand
        rig.now["hand_torque_nm"][0, 0] = hand
        advance_rest(rig.state[0], rig.params[0], 0)
        values.append(read(rig, hand))
    return float(np.max(np.abs(values[1000:])))


def intent(rig, hand):
    advance_intent(rig.state[0], rig.params[0], 0, hand)
    return float(rig.state["friction_intent_nm"][0, 0])


def friction(rig, _hand):
    observe_friction(rig.now[0], rig.state[0], rig.params[0], 0, 1)
    return float(rig.now["friction_observed_nm"][0, 0])


@pytest.mark.parametrize("read", [intent, friction])
def test_a_vibration_within_one_count_is_hardly_followed(read):
    observer = {"observer_alpha": lowpass_alpha(20.0, T), "observer_smooth_alpha": lowpass_alpha(80.0, T)}
    resting = LawRig(rest_alpha=SLOW, friction_intent_alpha=QUICK, **observer)
    moving = LawRig(rest_alpha=1.0, friction_intent_alpha=QUICK, **observer)
    assert ripple_of(resting, read) < 0.3 * ripple_of(moving, read)


def test_no_number_is_motion():
    rig = made()
    seen_at(rig, [0.0] * 100)
    assert seen_at(rig, [math.nan]) == QUICK
