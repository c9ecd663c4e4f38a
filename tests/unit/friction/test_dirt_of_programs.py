"""Dirty logs of other people's programs: right values, or a refusal or a warning that names the cause; most
of them as volume.
"""

import math
import re

import numpy as np
import pytest
from amounts import WHOLE, asked_often
from dirt_of_programs import MORE, of
from dirty_changes import clean
from dirty_logs import identified
from moved_joint import CLEAN, Joint, simulate

from rtctl.errors import DataError
from rtctl.friction.logs.rows_in_turn import hold, require_one_axis
from rtctl.friction.logs.torque_faults import require_on

MENDED = (
    "two axes in turn, apart in time",
    "motor off for a part, exactly 0",
    "a log of 50 Hz held to 500",
    "torque of a bus of 20 Hz",
    "position of a bus of 100 Hz",
    "velocity of a bus of 150 Hz",
    "friction is compensated already",
    "semicolons, decimal commas, thousands",
    "ms of the day past midnight",
    "torque saturates softly, brisk",
    "scale of the position drifts by a fifth",
    "half the gear ratio, with the rig file",
    "torque of a bus of 50 Hz, motor",
    "a torque constant off by 30 %, with the rig file",
    "torque of a device whose clock gains 150 ms",
    "a brake closed for a while, and the motor pushed",
    "torque late by 9.3 ms",
    "a pause of an hour, as summer time begins",
    "position of sixty levels, slow",
    "position of eighty levels",
)


@asked_often
@pytest.mark.parametrize("name", [name for name in MORE if name not in MENDED] if WHOLE else MENDED)
def test_a_log_that_a_program_made_wrong_is_right_or_named(name, tmp_path):
    found = of(name, tmp_path)
    assert not found.wrong() or re.search(MORE[name].cause, found.said), (found.off, found.said)
    if name in MENDED:
        assert MORE[name].cause == "." or re.search(MORE[name].cause, found.said), found.said


def test_rows_that_were_held_give_the_parameters_of_the_log_they_were_made_of(tmp_path):
    for name in ("a log of 50 Hz held to 500", "a log of 250 Hz held to 500", "position of a bus of 100 Hz"):
        found = of(name, tmp_path)
        assert found.code == 0
        assert all(abs(off) < 0.02 for off in found.off.values()), (name, found.off)


def test_rows_of_one_axis_are_not_called_rows_of_two():
    for name in CLEAN:
        require_one_axis("log", clean(name).position)
    t = np.arange(4000) / 1000
    for count in (2, 3, 5):
        axes = np.column_stack([0.3 * np.sin(2 * t + k) + k for k in range(count)]).ravel()
        with pytest.raises(DataError, match=f"{count} axes"):
            require_one_axis("log", axes)


def stood(signal, times):
    """What a log shows of a device that samples every so many rows (fractions too)."""
    taken = np.floor(np.arange(len(signal)) / times) * times
    return np.interp(taken, np.arange(len(signal)), signal)


@pytest.mark.parametrize("times", [2, 2.5, 10 / 3, 10, 33.3])
def test_a_hold_is_told_with_its_period_and_what_it_hid_is_found_again(times):
    t = np.arange(20_000) / 1000
    moved = 0.5 * np.sin(2 * t)
    turn = round(3.25 * 1000 * np.pi)
    moved = np.concatenate([moved[:turn], np.full(3000, moved[turn]), moved[turn:-3000]])  # a rest
    count = 2 * np.pi / 40_000
    seen = np.round(stood(moved, times) / count) * count
    found = hold(seen)
    assert found.times == pytest.approx(times, rel=1e-4)
    off = (found.between(seen, 1000 * t) - moved)[: -math.ceil(times)]  # nothing is known behind the last one
    assert off.std() < 2 * count
    assert np.abs(off).max() < 0.1 * np.abs(seen - moved).max() + count
    assert found.with_it(np.round(4 * stood(t, times)), 1000 * t), "a torque of few levels beside it"
    assert found.with_it(t, 1000 * t) is None


def test_a_hold_goes_on_while_rows_are_lost():
    t = np.arange(20_000) / 1000
    moved = 0.5 * np.sin(2 * t + 0.3)
    kept = np.random.default_rng(3).uniform(size=len(t)) > 0.03
    kept[8000:8503] = False
    at, seen = 1000 * t[kept], stood(moved, 10)[kept]
    found = hold(seen, at)
    assert found.times == pytest.approx(10, rel=1e-4)
    near = (at < 7990) | (at > 8520)  # in the gap nothing is known
    assert np.abs(found.between(seen, at) - moved[kept])[near][:-20].max() < 1e-3


def test_a_hold_by_another_programs_timer_is_told_though_it_comes_unevenly():
    t = np.arange(20_000) / 1000
    moved = 0.5 * np.sin(2 * t + 0.3)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        begins = np.arange(-rng.integers(0, 10), 20_000, 10)
        came = begins + rng.integers(0, 4, len(begins))
        last = np.searchsorted(came, np.arange(20_000), side="right") - 1
        seen = moved[np.clip(begins[np.clip(last, 0, None)], 0, None)]
        found = hold(seen)
        assert found.times == pytest.approx(10, rel=1e-3)
        assert np.abs(found.between(seen, 1000 * t) - moved)[30:-30].max() < 0.001  # a row of the way


def test_a_slow_encoder_or_a_rest_is_no_hold():
    rng = np.random.default_rng(1)
    signal = rng.normal(size=300)
    assert hold(np.repeat(signal, 4)).times == pytest.approx(4)
    assert hold(signal) is None
    assert hold(np.concatenate([signal, np.full(600, signal[-1])])) is None, "a joint at rest"
    assert hold(np.repeat(signal, rng.integers(1, 6, 300))) is None
    jumps = np.repeat(np.cumsum(np.abs(signal)), rng.integers(5, 60, 300))
    assert hold(np.round(jumps / 0.1) * 0.1) is None, "it sticks and slips"
    t = np.arange(20_000) / 1000
    for counts in (512, 4096, 40_000):
        for speed in (0.05, 0.5, 5.0):
            count = 2 * np.pi / counts
            slow = np.round(speed * np.abs(t % 2 - 1) / count) * count
            assert hold(slow) is None, (counts, speed)


def test_a_motor_whose_torque_is_coarse_is_not_off_where_it_is_rounded_to_zero():
    t = np.arange(5000) / 500
    torque = np.where((t < 4) | (t > 7), 0.5 * np.sin(9 * t) + 0.6, 0.02)
    require_on(np.round(torque / 0.2) * 0.2, np.sin(3 * t), 500.0, "log")


def test_a_joint_that_coasts_is_not_called_moved_by_another():
    """No torque, and the joint runs out: that is friction, and belongs into the log."""
    t = np.arange(2000) / 500
    motor = np.where(t % 2 < 1, 0.5 + 0.01 * np.sin(9 * t), 0.0)
    require_on(motor, np.cumsum(np.where(t % 2 < 1, 1.0, 2 - t % 2)) / 500, 500.0, "log")
    t = np.arange(5000) / 500
    with pytest.raises(DataError, match=r"about 0 for .* from row 2001 on"):
        require_on(np.where((t < 4) | (t > 7), 0.5 * np.sin(9 * t) + 0.6, 0.0), np.sin(3 * t), 500.0, "log")


def test_a_brisk_joint_with_bearings_is_told_that_little_is_friction(tmp_path):
    light = simulate(
        Joint(coulomb=0.008, breakaway=0.0082, viscous=0.002, hand=None, motor=(60.0, 1.5), seed=51)
    )
    found = identified(light, tmp_path)
    assert "little of the torque is friction" in found.said
