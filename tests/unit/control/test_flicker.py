"""Readings that flicker among a few counts are taken for their mean; whatever else is read is answered as it
is.
"""

import math

import numpy as np
import pytest
from law_rig import COUNT, LawRig, T

from rtctl.check.verdicts_of_loop import FLICKER_COUNTS
from rtctl.control.flicker import EASE_S, HELD_AFTER, WIDE, steady_reading
from rtctl.control.vocabulary import State
from rtctl.friction.guarantee import RELEASE_COUNTS

PLACE = 1234


class Encoder:
    """One that reads what the test says, in counts, tick by tick; `at` gives the positions taken, in
    counts.
    """

    def __init__(self, holds=1.0, state=State.ACTIVE, program=0):
        self.rig = LawRig(flicker_held=holds)
        self.rig.state["state"], self.rig.state["program_kind"] = int(state), program
        self._read(PLACE, restart=True)

    def _read(self, counts, restart=False):
        taken = steady_reading(self.rig.state[0], self.rig.params[0], 0, counts * COUNT, restart)
        self.rig.state["position_rad"] = taken
        return taken / COUNT

    def at(self, counts):
        return np.array([self._read(PLACE + one) for one in counts]) - PLACE


def between(low, high, ticks, swings):
    """To and fro: so many ticks at each."""
    return ([low] * ticks + [high] * ticks) * swings


def test_a_flicker_between_two_counts_stands_still():
    taken = Encoder().at(between(0, 1, 10, 50))
    assert np.ptp(taken[:500]) > 0.9
    assert np.ptp(taken[600:]) == 0.0


@pytest.mark.parametrize("share", [0.25, 0.5, 0.75])
def test_it_stands_where_the_readings_are_on_the_average(share):
    low = round(20 * (1 - share))
    taken = Encoder().at(([0] * low + [1] * (20 - low)) * 40)
    assert taken[-1] == pytest.approx(share, abs=0.13)
    assert 0.0 < taken[-1] < 1.0


@pytest.mark.parametrize("counts", [1, 2, 3])
def test_readings_up_to_three_counts_apart_are_a_flicker(counts):
    swing = [*range(counts + 1), *range(counts - 1, 0, -1)]
    taken = Encoder().at([one for one in swing for _ in range(3)] * 150)
    assert np.ptp(taken[-60:]) == 0.0
    assert 0.0 < taken[-1] < counts


def test_a_swing_over_more_counts_is_answered_as_it_is_read():
    swing = np.round(0.5 * (WIDE + 2) * np.sin(2 * math.pi * 20 * T * np.arange(2000)))
    np.testing.assert_allclose(Encoder().at(swing), swing, atol=1e-9)


def test_motion_one_way_is_answered_as_it_is_read_however_slow():
    slow = np.repeat(np.arange(200), 17)
    np.testing.assert_allclose(Encoder().at(slow), slow, atol=1e-9)


def test_a_hand_that_turns_back_twice_within_a_count_is_answered_as_it_is_read():
    turned = between(0, 1, 5, 2)
    np.testing.assert_allclose(Encoder().at(turned), turned, atol=1e-9)


def test_what_is_left_when_a_flicker_ends_goes_slowly():
    encoder = Encoder()
    held = encoder.at(between(0, 1, 5, 100))[-1]
    away = encoder.at(np.repeat(np.arange(2, 60), 5))
    steps = np.diff(np.concatenate(([held], away)))
    assert np.max(np.abs(steps)) < 1.2, "no more than a count at once, and what goes of the gap"
    later = round(5 * EASE_S / T)
    assert abs(away[later] - (2 + later // 5)) < 0.03


def test_it_is_held_until_a_count_further_away_is_read():
    encoder = Encoder()
    held = encoder.at(between(0, 1, 5, 100))[-1]
    assert np.all(encoder.at([2] * 500 + [-1] * 500) == held)
    assert encoder.at([3])[0] != held


@pytest.mark.parametrize(
    "encoder",
    [
        {"holds": 0.0},
        {"state": State.HOLD},
        {"state": State.ARMING},
        {"state": State.STOPPING},
        {"program": 1},
    ],
    ids=str,
)
def test_a_joint_that_friction_may_not_hold_or_that_nothing_couples_is_read_as_it_is(encoder):
    flicker = between(0, 1, 10, 20)
    np.testing.assert_allclose(Encoder(**encoder).at(flicker), flicker, atol=1e-9)


def test_a_noisy_encoder_in_slow_motion_is_answered_as_it_is_read():
    """A flicker takes its time: a joint that moves on by 10 counts a second goes by none of it."""
    noise = np.random.default_rng(1).integers(-1, 2, 4000)
    moving = np.floor(10 * T * np.arange(4000)) + noise
    np.testing.assert_allclose(Encoder().at(moving), moving, atol=1e-9)


def test_a_noisy_encoder_at_rest_stands_still():
    noise = np.random.default_rng(1).integers(-1, 2, 4000)
    taken = Encoder().at(noise)
    assert np.ptp(taken[700:]) == 0.0
    assert abs(taken[-1]) < 0.3


def test_neither_the_begin_nor_the_end_of_a_flicker_is_a_motion():
    """What an admittance is told of the velocity is what the reading moved, and nothing while it is held."""
    encoder = Encoder()
    readings = [*between(0, 2, 10, 40), *range(2, 40)]
    before, held = 0.0, False
    for reading, last in zip(readings, [0, *readings], strict=False):
        taken = float(encoder.at([reading])[0])
        seen = taken - before - encoder.rig.state["reading_slip_rad"][0, 0] / COUNT
        now = bool(encoder.rig.state["reading_turns"][0, 0] >= HELD_AFTER)
        assert seen == pytest.approx(0.0 if now else reading - last, abs=1e-6)
        before, held = taken, held or now
    assert held
    assert encoder.rig.state["reading_gap_rad"][0, 0] != 0.0


def test_what_check_counts_on_is_what_the_law_does():
    """`rtctl check` has these as numbers of its own: reading a report must not load the compiler."""
    assert FLICKER_COUNTS == WIDE / 2
    assert RELEASE_COUNTS == WIDE + 0.5


def test_a_sample_that_is_no_number_ends_no_flicker_and_nothing_of_it_stays():
    rig = LawRig(flicker_held=1.0)
    rig.arm()
    for reading in between(0, 1, 5, 100):
        rig.tick(position=reading * COUNT)
    held = rig.state["position_rad"][0, 0]
    assert 0.0 < held < COUNT
    rig.tick(position=math.nan)
    rig.tick(position=0.0)
    assert rig.state["position_rad"][0, 0] == held
    assert rig.state["reading_turns"][0, 0] == HELD_AFTER
