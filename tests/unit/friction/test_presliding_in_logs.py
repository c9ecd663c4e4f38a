"""Presliding length from the turns of a log, on joints simulated here whose bristles are known."""

import itertools

import numpy as np
import pytest
from simulated_bristles import BIAS, COULOMB, RATE_HZ, log, lugre, maxwell_slip, stop

from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.presliding_in_logs import TURNS_MIN, presliding_of_logs
from rtctl.friction.logs.turns import stop_operator


@pytest.mark.parametrize("length_rad", [3e-4, 3e-3])
@pytest.mark.parametrize("stribeck", [0.0, 0.5])
@pytest.mark.parametrize("bristles", [stop, lugre, maxwell_slip])
def test_the_length_is_break_away_over_stiffness_whatever_the_bristles(bristles, stribeck, length_rad):
    found = presliding_of_logs([log(bristles, length_rad, stribeck=stribeck)])
    # of break-away, which is the peak; of a quick turn it is that of Coulomb friction
    true = length_rad * (1 + stribeck)
    assert 0.7 * length_rad < found.length_rad < 1.45 * true
    assert 1.5 * (found.length_rad + 2 * found.spread_rad) > true, "what is credited is no shorter"
    assert found.ramps >= 20


def with_pauses(whole, pause_s=0.7):
    """The same motion with a stop at every turn, in which the hand presses on: a joint that sticks stays
    where it is.
    """
    held = round(pause_s * RATE_HZ)
    travel = np.convolve(whole.position_rad, np.ones(50) / 50, mode="same")
    turns = np.flatnonzero(np.diff(np.sign(np.diff(travel))) != 0)[1:-1]
    position, torque = [], []
    for before, after in itertools.pairwise([0, *turns, len(travel)]):
        position += [whole.position_rad[before:after], np.full(held, whole.position_rad[after - 1])]
        pressed = -0.9 * COULOMB * np.sign(whole.torque_nm[after - 1] - BIAS)
        torque += [whole.torque_nm[before:after], np.full(held, BIAS + pressed)]
    return AxisLog(RATE_HZ, np.concatenate(position), np.concatenate(torque), "made", "0" * 64)


@pytest.mark.parametrize("length_rad", [3e-4, 3e-3])
def test_a_joint_that_stands_says_nothing_of_a_turn(length_rad):
    whole = log(stop, length_rad, seconds=20.0)
    found, paused = presliding_of_logs([whole]), presliding_of_logs([with_pauses(whole)])
    assert 0.7 * found.length_rad < paused.length_rad < 2.2 * found.length_rad


def test_a_length_that_the_encoder_does_not_show_is_known_to_be_no_longer():
    found = presliding_of_logs([log(stop, 1e-5, count_rad=1e-3)])
    assert found.spread_rad == 0.0
    assert 1e-5 < found.length_rad < 2e-3
    assert str(found).startswith("at most ")


def test_few_turns_seen_by_a_coarse_encoder_leave_more_doubt_than_many():
    few, many = (presliding_of_logs([log(lugre, 3e-3, seconds=s, count_rad=1e-3)]) for s in (3.0, 20.0))
    assert few.spread_rad > 1.4 * many.spread_rad > 0.0


def test_stretches_of_a_log_count_together():
    whole = log(lugre, 1e-3, seconds=20.0)
    half = len(whole.position_rad) // 2
    parts = [
        AxisLog(RATE_HZ, whole.position_rad[rows], whole.torque_nm[rows] + offset, "made", "0" * 64)
        for rows, offset in ((slice(half), 0.0), (slice(half, None), 0.3))
    ]
    one, two = presliding_of_logs([whole]), presliding_of_logs(parts)
    assert two.length_rad == pytest.approx(one.length_rad, rel=0.3)
    assert two.ramps >= 0.8 * one.ramps


def one_way(seconds=12.0):
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    return AxisLog(RATE_HZ, 0.5 * t, np.full(len(t), COULOMB), "made", "0" * 64)


@pytest.mark.parametrize(
    "tells_nothing",
    [
        log(stop, 1e-3, torque=False),
        log(stop, 1e-3, seconds=0.3),
        one_way(),
        AxisLog(RATE_HZ, np.zeros(9000), np.full(9000, 0.1), "made", "0" * 64),
    ],
    ids=["no torque", "short", "no turn", "stands"],
)
def test_a_log_that_does_not_tell_says_nothing(tells_nothing):
    assert presliding_of_logs([tells_nothing]) is None


@pytest.mark.parametrize("column", ["position_rad", "torque_nm"])
def test_nan_tells_nothing(column):
    broken = log(stop, 1e-3)
    getattr(broken, column)[4000] = np.nan
    assert presliding_of_logs([broken]) is None


@pytest.mark.parametrize("amplitude_rad", [0.002, 0.008])
def test_a_second_in_which_the_joint_hardly_moves_takes_no_length_from_the_rest(amplitude_rad):
    """The end of a log behind a gap: 18 of 36 logs of such a joint told no length any more."""
    whole = log(stop, 4e-3, stribeck=0.3, seconds=10.0)
    t = np.arange(1000) / RATE_HZ
    hardly = AxisLog(
        RATE_HZ, amplitude_rad * np.sin(12 * t), COULOMB * np.cos(12 * t) + BIAS, "end", "0" * 64
    )
    assert presliding_of_logs([whole, hardly]) == presliding_of_logs([whole])
    # of many turns it is not left out: the bristles of a joint that hardly does more are its own
    t = np.arange(5000) / RATE_HZ
    many = AxisLog(RATE_HZ, 0.008 * np.sin(40 * t), COULOMB * np.cos(40 * t) + BIAS, "end", "0" * 64)
    assert presliding_of_logs([whole, many]) != presliding_of_logs([whole])


def test_a_length_needs_turns():
    assert presliding_of_logs([log(stop, 1e-3, seconds=1.2)]) is None
    assert TURNS_MIN > 2


def test_the_stop_operator_bends_then_slides_and_turns_over_twice_its_length():
    path = np.concatenate([np.linspace(0, 3, 31), np.linspace(3, 0, 31)[1:]])
    bent = stop_operator(path, 1.0)
    assert bent[5] == pytest.approx(0.5)
    assert bent[30] == 1.0
    assert bent[40] == pytest.approx(0.0, abs=1e-12)
    assert bent[50] == bent[-1] == -1.0
