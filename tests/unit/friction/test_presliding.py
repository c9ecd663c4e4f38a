"""Presliding length from break-away ramps, on ramps whose bristles are known."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rtctl.friction.presliding import SHORTEST_SHARE, Presliding, bend_of, presliding, ramp_of, together

T = 1e-3
COUNT = 2 * math.pi / 160_000
BREAK_AWAY_NM = 0.35
ASSUMED_RAD = 5e-3


def ramp(length_rad, *, bend, sign=1, count_rad=COUNT, noise_nm=0.004, chatter_rad=0.0, seed=0):
    """Count changes of a ramp at .05 N m/s; bend 1 is LuGre at rest, 0 an ideal spring that yields at
    once.
    """
    random = np.random.default_rng(seed)
    torque = np.arange(0, BREAK_AWAY_NM, 0.05 * T)
    share = np.clip(torque / BREAK_AWAY_NM, 0, 1 - 1e-9)
    bent = length_rad * (share + bend * (-np.log1p(-share) - share))
    position = random.uniform(-9, 9) + sign * bent + chatter_rad * random.standard_normal(len(torque))
    seen = sign * torque + noise_nm * random.standard_normal(len(torque))
    return ramp_of(np.floor(position / count_rad) * count_rad, seen, sign * BREAK_AWAY_NM, count_rad, T)


def ramps(length_rad, n=20, **how):
    found = [ramp(length_rad, sign=1 if k % 2 else -1, seed=k, **how) for k in range(n)]
    return [one for one in found if one]


@pytest.mark.parametrize("bend", [0.0, 1.0])
@pytest.mark.parametrize("length_rad", [0.35e-3, 1.4e-3, 7e-3])
def test_the_length_is_break_away_over_the_initial_slope_however_the_bristles_soften(length_rad, bend):
    found = presliding(ramps(length_rad, bend=bend))
    assert found.length_rad == pytest.approx(length_rad, rel=0.02)
    assert found.spread_rad < 0.03 * length_rad
    assert found.ramps == 20


def test_the_bend_tells_lugre_from_an_ideal_spring():
    assert bend_of(ramps(1.4e-3, bend=1.0)) == pytest.approx(1.0, abs=0.05)
    assert bend_of(ramps(1.4e-3, bend=0.0)) == pytest.approx(0.0, abs=0.05)


def test_a_count_that_chatters_is_taken_half_way():
    found = presliding(ramps(1.4e-3, bend=1.0, chatter_rad=0.5 * COUNT))
    assert found.length_rad == pytest.approx(1.4e-3, rel=0.03)


def test_ramps_that_differ_show_in_the_spread():
    mixed = [ramp(length, bend=0.0, seed=k) for k, length in enumerate([1e-3, 1.2e-3] * 10)]
    found = presliding(mixed)
    assert found.length_rad == pytest.approx(1.1e-3, rel=0.02)
    assert found.spread_rad == pytest.approx(np.std([1e-3, 1.2e-3] * 10, ddof=1), rel=0.1)


@pytest.mark.parametrize("bend", [0.0, 1.0])
@pytest.mark.parametrize("counts", [1.5, 2.5])
def test_a_length_of_few_counts_is_found_from_their_mean_over_many_ramps(counts, bend):
    found = presliding(ramps(1.4e-3, n=80, bend=bend, count_rad=1.4e-3 / counts))
    assert found.length_rad == pytest.approx(1.4e-3, rel=0.2)
    assert found.length_rad + found.spread_rad > 1.4e-3


def test_an_encoder_too_coarse_to_tell_the_slope_tells_nothing():
    assert presliding(ramps(1.4e-3, n=20, bend=1.0, count_rad=100 * 1.4e-3)) is None
    assert presliding([]) is None
    assert presliding(ramps(1.4e-3, n=1, bend=1.0)) is None
    assert presliding(ramps(1.4e-3, n=1, bend=1.0), ASSUMED_RAD) is None
    assert presliding(ramps(1.4e-3, n=4, bend=1.0, count_rad=4e-3), ASSUMED_RAD) is None


@pytest.mark.parametrize("bend", [0.0, 1.0])
@pytest.mark.parametrize("counts", [0.02, 0.3, 0.6, 0.9])
def test_a_joint_that_bends_less_than_the_encoder_tells_is_told_how_long_at_most(counts, bend):
    how = {"bend": bend, "count_rad": 0.8e-3}
    for n in (2, 7):
        found = presliding(ramps(0.8e-3 * counts, n=n, **how), ASSUMED_RAD)
        assert found.at_most
        assert found.ramps == n
        assert max(0.8e-3 * counts, SHORTEST_SHARE * ASSUMED_RAD) < found.length_rad < ASSUMED_RAD
    assert "at most" in str(found)


def test_no_ramp_by_itself_moves_more_than_the_bound_says():
    """One place that is softer than all others: it is the joint's, too."""
    mixed = [*ramps(1e-6, n=12, bend=0.0), ramp(1e-3, bend=0.0, seed=5)]
    assert presliding(mixed, ASSUMED_RAD).length_rad > 1e-3


def test_a_joint_of_an_encoder_however_fine_is_told_no_less_than_was_tried_with_hands():
    rigid = ramps(1e-9, bend=0.0, count_rad=1e-6)
    assert presliding(rigid, ASSUMED_RAD) == Presliding(SHORTEST_SHARE * ASSUMED_RAD, 0.0, 20)


def test_a_length_that_is_found_is_the_same_whatever_is_assumed():
    known = ramps(1.4e-3, bend=1.0)
    assert presliding(known, ASSUMED_RAD) == presliding(known)


@pytest.mark.parametrize("which", [0, 1])
def test_a_ramp_with_nan_tells_nothing(which):
    signals = [np.arange(7000) * COUNT / 50, np.arange(7000) * 0.05 * T]
    assert ramp_of(*signals, BREAK_AWAY_NM, COUNT, T) is not None
    signals[which][100] = math.nan
    assert ramp_of(*signals, BREAK_AWAY_NM, COUNT, T) is None


def test_nan_for_break_away_tells_nothing():
    assert ramp_of(np.arange(7000) * COUNT / 50, np.arange(7000) * 0.05 * T, math.nan, COUNT, T) is None


def test_groups_put_together_are_as_all_their_ramps():
    random = np.random.default_rng(1)
    groups = [random.normal(1.0e-3, 5e-5, 7), random.normal(1.2e-3, 9e-5, 12)]
    parts = [Presliding(float(np.mean(one)), float(np.std(one, ddof=1)), len(one)) for one in groups]
    found, every = together(parts), np.concatenate(groups)
    assert found.length_rad == pytest.approx(np.mean(every))
    assert found.spread_rad == pytest.approx(np.std(every, ddof=1))
    assert found.ramps == 19
    assert together([]) is None
    assert together([*parts, Presliding(3e-3, 0.0, 9)]) == found


def test_of_bounds_alone_the_longest_holds():
    both = together([Presliding(1e-3, 0.0, 6), Presliding(2e-3, 0.0, 4)])
    assert both == Presliding(2e-3, 0.0, 10)
    assert both.at_most


def test_a_ramp_that_jumped_two_counts_in_one_tick_spoils_no_other():
    """Two counts at one torque have no slope: 0/0 of one ramp made the mean of all NaN."""
    known = ramps(0.002, bend=1.0)
    jumped = replace(
        known[0], position_rad=known[0].position_rad[:2], share=np.full(2, known[0].share.mean())
    )
    found = presliding([*known, jumped])
    assert found is not None
    assert found.length_rad == pytest.approx(presliding(known).length_rad)
