"""Steady state, break-away and friction of a window, on signals whose truth is known; what ended a motion."""

import math

import numpy as np
import pytest
from identified import CONFIG, SMALL

from rtctl.control.vocabulary import State
from rtctl.errors import FaultError
from rtctl.identify.late_ticks import ran_late
from rtctl.identify.motion import Motion, Order
from rtctl.identify.settings import rig_of
from rtctl.identify.tick_readings import break_away, break_away_row, is_steady, measure, peak_nm
from rtctl.rig_file.config import load
from rtctl.tick import new_ticks

T = 1e-3
COUNT = 2 * math.pi / 160_000


def encoder(position):
    return np.floor(np.asarray(position) / COUNT) * COUNT


def ticks(position, torque, **fields):
    rows = new_ticks(len(position))
    rows["tick"] = np.arange(len(position))
    rows["position_rad"][:, 0] = position
    rows["motor_torque_nm"][:, 0] = torque
    for name, value in fields.items():
        rows[name] = value
    return rows


def window(n=200, speed=0.1, drift=0.0, noise=0.0, level=0.3, seed=0):
    time = np.arange(n) * T
    random = np.random.default_rng(seed)
    return encoder(speed * time), level + drift * time / (n * T) + noise * random.standard_normal(n)


def steady(position, torque, speed=0.1):
    return is_steady(position, torque, T, speed, COUNT)


def test_constant_torque_at_the_wanted_speed_is_steady():
    assert steady(*window(noise=0.004))


@pytest.mark.parametrize("drift", [0.02, -0.02])
def test_a_torque_that_still_changes_is_not(drift):
    assert not steady(*window(drift=drift))
    assert not steady(*window(drift=drift, noise=0.004))


def test_a_window_too_noisy_to_tell_is_not():
    assert not steady(*window(noise=0.3))


def test_another_speed_is_not():
    assert not steady(*window(), speed=0.12)
    assert not steady(*window(), speed=-0.1)


@pytest.mark.parametrize("part", [0, 1])
def test_nan_is_never_steady(part):
    signals = window()
    signals[part][-1] = math.nan
    assert not steady(*signals)


def test_too_few_ticks_are_not():
    assert not steady(*window(n=12))


def test_a_settling_bristle_is_steady_only_after_its_time_constant():
    time = np.arange(4000) * T
    torque = 0.35 - 0.1 * np.exp(-time / 0.3)
    position = encoder(0.005 * time)
    seen = [
        k
        for k in range(800, 4000, 50)
        if is_steady(position[k - 800 : k], torque[k - 800 : k], T, 0.005, COUNT)
    ]
    assert seen
    first = seen[0]
    assert abs(torque[first - 800 : first].mean() - 0.35) < 0.005


def test_friction_is_motor_torque_less_bias_and_inertia_times_acceleration():
    time = np.arange(100) * T
    rows = ticks(
        encoder(0.5 * time + 0.5 * 2.0 * time**2),
        0.3 + 0.008 + 0.012 * 2.0,
        hand_torque_nm=0.001,
        force_n=[0.1, 0.2, 0.3],
        temperature_c=31.0,
    )
    found = measure(rows, 0, T, 0.012, 0.008)
    assert found.torque_nm == pytest.approx(0.3, abs=1e-3)
    assert found.acceleration_rad_s2 == pytest.approx(2.0, abs=0.05)
    assert found.velocity_rad_s == pytest.approx(0.6, abs=2e-3)
    assert found.force_n == pytest.approx((0.1, 0.2, 0.3))
    assert (found.hand_torque_nm, found.temperature_c) == pytest.approx((0.001, 31.0))
    rows["temperature_c"] = np.nan
    assert measure(rows, 0, T, 0.012, 0.008).temperature_c is None, (
        "no thermometer, which JSON has no NaN for"
    )


def test_one_late_tick_in_a_hundred_is_borne_and_two_are_not():
    missed, woke = ticks(np.zeros(99), 0.0), ticks(np.zeros(100), 0.0)
    for at, found in ((50, False), (70, True)):
        missed["tick"][at:] += 1
        woke["wakeup_ns"][at] = 501_000
        assert (ran_late(missed, T), ran_late(woke, T)) == (found, found)


def test_slots_left_out_are_time_that_passed():
    time = np.arange(200) * T
    rows = ticks(encoder(0.5 * time), 0.3)
    few = rows[np.arange(200) % 7 != 3]
    assert measure(few, 0, T, 0.012, 0.0).velocity_rad_s == pytest.approx(0.5, abs=2e-3)


@pytest.mark.parametrize("late", [1, 8])
def test_slots_left_out_near_one_end_of_a_window_make_no_acceleration_of_a_speed(late):
    rows = ticks(np.zeros(100), 0.25)
    rows["tick"][70:] += late
    rows["position_rad"][:, 0] = 2.0 * T * (rows["tick"] - rows["tick"][0])
    found = measure(rows, 0, T, 0.012, 0.0)
    assert found.acceleration_rad_s2 == pytest.approx(0.0, abs=1e-6)
    assert found.torque_nm == pytest.approx(0.25), "one slot made 14 % of it, eight all"


def ramp(slip_at_s=4.0, slope=0.05, creep_rad_s=0.0005, sign=1):
    time = np.arange(5000) * T
    slipping = np.clip(time - slip_at_s, 0, None)
    return sign * (creep_rad_s * time + 2.0 * slipping**2), sign * slope * time


@pytest.mark.parametrize("sign", [1, -1])
def test_break_away_is_the_torque_where_the_joint_began_to_slide(sign):
    position, torque = ramp(sign=sign)
    rows = ticks(encoder(position), torque + 0.007)
    found = break_away(rows, 0, T, COUNT, 0.007, 0.0)
    assert found.torque_nm == pytest.approx(sign * 0.2, abs=2e-3)


def slide(damping_nms_rad, slope_nm_s=0.5, dry_nm=2.0, sign=1):
    """A ramp on a joint that damping alone holds back once it slides, until it has gone .02 rad."""
    time = np.arange(8000) * T
    sliding_s = np.clip(time - dry_nm / slope_nm_s, 0, None)
    position = 0.5 * slope_nm_s / damping_nms_rad * sliding_s**2
    ends = int(np.argmax(position > 0.02))
    return sign * position[:ends], sign * slope_nm_s * time[:ends]


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("damping_nms_rad", [0.3, 3.0, 10.0])
def test_what_damping_takes_when_a_slow_slide_is_seen_is_no_break_away(damping_nms_rad, sign):
    position, torque = slide(damping_nms_rad, sign=sign)
    rows = ticks(encoder(position), torque)
    seen = break_away_row(rows["position_rad"][:, 0], 10, 3e-4)
    late_nm = abs(torque[seen + 5]) - 2.0
    assert late_nm == pytest.approx(0.03 * damping_nms_rad, rel=0.05), "what the damping takes by then"
    found = break_away(rows, 0, T, COUNT, 0.0, 0.0)
    assert found.torque_nm == pytest.approx(sign * 2.0, abs=0.04 * late_nm + 2e-3)


def light_slide(slope_nm_s, inertia_kgm2=0.0022, dry_nm=0.02):
    """A quick ramp on a light joint that nothing but its inertia holds back once it slides, until it has gone
    .02 rad.
    """
    time = np.arange(4000) * T
    sliding_s = np.clip(time - dry_nm / slope_nm_s, 0, None)
    position = slope_nm_s / inertia_kgm2 * sliding_s**3 / 6
    ends = int(np.argmax(position > 0.02))
    return position[:ends], slope_nm_s * time[:ends]


@pytest.mark.parametrize("counts", [45_600, 160_000])
@pytest.mark.parametrize("sign", [1, -1])
def test_what_moves_the_inertia_when_the_slide_is_seen_is_no_break_away(counts, sign):
    position, torque = light_slide(0.025)
    step = 2 * math.pi / counts
    rows = ticks(sign * np.floor(position / step) * step, sign * torque)
    late = break_away(rows, 0, T, step, 0.0, 0.0)
    assert abs(late.torque_nm) > 1.05 * 0.02, "what it was without looking at the acceleration"
    found = break_away(rows, 0, T, step, 0.0, 0.0022)
    assert found.torque_nm == pytest.approx(sign * 0.02, rel=0.02)


def test_an_encoder_too_coarse_for_accelerations_leaves_the_mean_before_the_slide():
    position, torque = light_slide(0.025)
    rows = ticks(encoder(position), torque)
    assert math.isnan(peak_nm(position, torque, T, COUNT, 50.0))
    seen = break_away_row(rows["position_rad"][:, 0], 10, 3e-4)
    found = break_away(rows, 0, T, COUNT, 0.0, 50.0)
    assert 0.02 < found.torque_nm <= np.mean(torque[seen - 9 : seen + 1])


@pytest.mark.parametrize(("before_s", "found"), [(0.5, True), (0.2, False), (-0.05, False)])
def test_the_loop_may_not_be_late_about_a_slow_slide(before_s, found):
    position, torque = slide(10.0)
    at = round((2.0 / 0.5 - before_s) / T)
    rows = np.delete(ticks(encoder(position), torque), slice(at, at + 12))
    assert (break_away(rows, 0, T, COUNT, 0.0, 0.0) is not None) is found


@pytest.mark.parametrize(("slots", "found"), [(3, True), (5, False)])
def test_a_slip_beside_late_ticks_gives_no_break_away(slots, found):
    position, torque = ramp()
    rows = np.delete(ticks(encoder(position), torque), slice(4005, 4005 + slots))
    assert (break_away(rows, 0, T, COUNT, 0.0, 0.0) is not None) is found


def test_creep_before_the_slip_is_not_taken_for_it():
    position, _ = ramp(creep_rad_s=0.02)
    began = break_away_row(encoder(position), 10, 8 * COUNT)
    assert began == pytest.approx(4000, abs=15)


def test_a_joint_that_never_slips_gives_no_break_away():
    position, torque = ramp(slip_at_s=9.0)
    assert break_away(ticks(encoder(position), torque), 0, T, COUNT, 0.0, 0.0) is None


def test_a_joint_that_was_not_at_rest_gives_no_break_away():
    time = np.arange(500) * T
    assert break_away(ticks(0.5 * time, 0.05 * time), 0, T, COUNT, 0.0, 0.0) is None


def test_a_ramp_of_a_few_ticks_gives_no_break_away():
    assert break_away(ticks(np.zeros(5), np.zeros(5)), 0, T, COUNT, 0.0, 0.0) is None


def test_a_lurch_that_comes_to_rest_again_is_no_break_away():
    position, torque = ramp()
    position = position + np.where(np.arange(5000) > 1000, 0.002, 0.0)
    found = break_away(ticks(encoder(position), torque), 0, T, COUNT, 0.0, 0.0)
    assert found.torque_nm == pytest.approx(0.2, abs=2e-3)


def test_a_stop_whose_fault_has_gone_by_the_end_of_the_rows_is_still_named():
    motion = Motion(rig_of(load(CONFIG), SMALL), SMALL)
    rows = new_ticks(3, 1)
    rows["fault_first"], rows["state"] = (-1, 27, -1), (State.ACTIVE, State.STOPPING, State.IDLE)
    steps = motion.see(Order())
    next(steps)
    with pytest.raises(FaultError, match="ended by HOST_SILENT: the rig went to IDLE"):
        steps.send(rows)
