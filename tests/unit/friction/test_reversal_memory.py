"""What memory of a turn is worth in a log, on joints simulated here whose bristles are known."""

import numpy as np
import pytest
from simulated_bristles import log, lugre, maxwell_slip, rigid, stop

from rtctl.friction.logs.bristle_columns import lugre_bristle
from rtctl.friction.logs.dynamics import CUTOFF_HZ, AxisLog, smooth
from rtctl.friction.logs.reversal_memory import TURNS_MIN, WORTH, TurnRows, reversals_of_logs
from rtctl.friction.logs.turns import made_ready


def rungs(found):
    return {rung.name: rung for rung in found.rungs}


@pytest.mark.parametrize(("bristles", "own"), [(stop, "stop"), (lugre, "lugre"), (maxwell_slip, "maxwell")])
def test_memory_leaves_less_than_half_of_what_a_curve_of_speed_leaves_near_turns(bristles, own):
    found = reversals_of_logs([log(bristles, 1e-3, stribeck=0.3, seconds=16.0)])
    told = rungs(found)
    assert min(told[name].gain for name in ("stop", "lugre", "maxwell")) > 0.45
    assert told["maxwell"].gain > 0.8, "any bristles are springs of several lengths"
    assert 0.7e-3 < told[own].parameter < 1.45e-3 * 1.3
    assert found.chosen in ("stop", "lugre", "maxwell")
    assert 0 < told[own].gain_standard_error < 0.1


@pytest.mark.parametrize("count_rad", [1e-6, 1e-4])
def test_where_there_are_no_bristles_memory_is_worth_nothing(count_rad):
    found = reversals_of_logs([log(rigid, 1.0, count_rad=count_rad, seconds=16.0)])
    assert found.chosen == "speed", found
    assert max(rung.gain for rung in found.rungs) < WORTH


@pytest.mark.parametrize(("own", "made"), [("lag", {"lag_s": 0.01}), ("acceleration", {"rising": 0.3})])
def test_friction_that_is_other_when_the_speed_rises_is_told_by_what_it_follows(own, made):
    found = reversals_of_logs([log(rigid, 1.0, stribeck=1.0, count_rad=1e-6, seconds=16.0, **made)])
    told = rungs(found)
    assert found.chosen == own
    assert told[own].gain > max(0.4, 5 * told[own].gain_standard_error)
    if own == "lag":
        assert told["lag"].parameter == pytest.approx(0.01, abs=0.005)


def test_what_is_told_is_of_rows_that_were_not_fitted_to():
    """A fit to noise leaves less than the noise in the rows fitted to, and more than it in others."""
    whole, left = log(rigid, 1.0, count_rad=1e-6, seconds=8.0), []
    for seed in range(3):
        noise = np.random.default_rng(seed).standard_normal(len(whole.torque_nm))
        alone = AxisLog(whole.rate_hz, whole.position_rad, noise, "made", "0" * 64)
        heard = np.std(smooth(noise, whole.rate_hz, CUTOFF_HZ))
        left += [rung.rms_nm / heard for rung in reversals_of_logs([alone]).rungs]
    assert np.mean(left) > 1.0


def test_turns_that_are_all_within_one_block_tell_nothing():
    """What was fitted where nothing turns gave errors of 1e139 N m where something did."""
    rate, rng = 1000.0, np.random.default_rng(0)
    t = np.arange(0, 30, 1 / rate)
    burst = (t > 18) & (t < 19)
    v = np.where(burst, 0.5 * np.sin(2 * np.pi * 10 * (t - 18) + 0.5), 0.05)
    torque = 0.05 * v + 0.25 * np.sign(v) + 0.01 * rng.standard_normal(len(t))
    made = AxisLog(rate, np.cumsum(v) / rate, torque, "made", "0" * 64)
    assert made_ready(made, CUTOFF_HZ, 0.03).turns > TURNS_MIN
    assert reversals_of_logs([made]) is None


def test_a_zero_and_a_difference_between_directions_are_told_apart_by_no_rounding():
    """A session of a lever of TU/e: 4.3 N m were left of .05, by two halves of 6e5 N m."""
    rng, n = np.random.default_rng(0), 400
    direction, block = np.sign(np.sin(np.arange(n) / 10 + 0.05)), np.arange(n) // 100
    direction[50] = 0.0  # turning back, in one half alone
    noise = 0.002 * rng.standard_normal(n)
    ends = 1e-7 * rng.standard_normal(n)  # what a filter leaves of a column
    sides = np.column_stack([np.maximum(direction, 0) + ends, np.minimum(direction, 0)])
    rows = TurnRows(
        parts=(None,),
        torque_nm=0.3 + 0.05 * direction + noise,
        motion=rng.standard_normal((n, 2)),
        offsets=np.ones((n, 1)),
        near=np.ones(n, bool),
        block=block,
    )
    left = rows.judged(lambda _part, _value: sides, [0.0]).residual_nm
    assert np.abs(left).max() < 5 * 0.002 + 0.05


@pytest.mark.parametrize("offset_nm", [0.3, -2.0])
def test_stretches_have_offsets_of_their_own(offset_nm):
    whole = log(lugre, 1e-3)
    half = len(whole.position_rad) // 2

    def cut(offset):
        return [
            AxisLog(whole.rate_hz, whole.position_rad[rows], whole.torque_nm[rows] + more, "made", "0" * 64)
            for rows, more in ((slice(half), 0.0), (slice(half, None), offset))
        ]

    one, two = (reversals_of_logs(cut(offset)) for offset in (0.0, offset_nm))
    assert [rung.near_nm for rung in two.rungs] == pytest.approx([rung.near_nm for rung in one.rungs], 1e-6)


@pytest.mark.parametrize("seconds", [0.3, 2.0])
def test_few_turns_tell_nothing(seconds):
    found = reversals_of_logs([log(stop, 1e-3, seconds=seconds)])
    assert found is None or found.turns >= TURNS_MIN


@pytest.mark.parametrize("column", ["position_rad", "torque_nm"])
def test_nan_tells_nothing(column):
    broken = log(stop, 1e-3)
    getattr(broken, column)[4000] = np.nan
    assert reversals_of_logs([broken]) is None


def test_a_lugre_bristle_softens_on_its_way():
    bent = lugre_bristle(np.linspace(0, 3, 301), 1.0)
    assert bent[100] == pytest.approx(1 - np.exp(-1))
    assert bent[300] == pytest.approx(1 - np.exp(-3))
