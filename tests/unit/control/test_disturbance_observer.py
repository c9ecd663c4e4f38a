"""The friction observer: what it finds with force sensor, inertia and two low-passes, and what it sends."""

import math

import numpy as np
import pytest
from law_rig import LEVER, B, J, LawRig, T

from rtctl.control.disturbance_observer import (
    HELD_SHARE,
    SLOW_RAD_S,
    SLOW_SHARE,
    SMOOTHING,
    TARGET_AT_REST,
    observer_torque,
)
from rtctl.control.velocity import lowpass_alpha
from rtctl.control.vocabulary import Fault, Policy, State

HZ = 20.0
LATE = 3
"""With it the derivative by a low-pass is that of the samples; 2 pi HZ is some percent more, as if J were."""


def target(speed):
    """Share of the friction that is aimed at, at this speed in rad/s."""
    return 1.0 - SLOW_SHARE * math.exp(-((speed / SLOW_RAD_S) ** 2))


def made(policy=Policy.OBSERVER, hz=HZ, model=False, **params):
    """A rig with an observer, the motion of its joint prescribed."""
    values = {
        "observer_gain": 0.9,
        "observer_alpha": lowpass_alpha(hz, T),
        "observer_bandwidth_rad_s": 2 * math.pi * hz,
        "observer_smooth_alpha": lowpass_alpha(SMOOTHING * hz, T),
        "observer_deadband_nm": 0.0,
        "friction_seen_alpha": lowpass_alpha(5.0, T),
        "friction_seen_max_nm": 9.0,
    }
    rig = LawRig(friction_policy=int(policy), **{**values, **params})
    if model:
        rig.friction()
    rig.command["compensation"] = 1.0
    return rig


def stroke(rig, speed, hand_nm, ticks=600):
    """Move at constant speed under a constant hand torque."""
    rig.force_n[1] = hand_nm / LEVER
    for _ in range(ticks):
        rig.tick(rig.position[0] + speed * T)
    return rig


def settled(speed=0.5, friction_nm=0.2, deadband=0.0, **params):
    """Hand and motor together bear this friction: the hand what the motor leaves it."""
    rig = made(observer_deadband_nm=deadband, **params).arm()
    for _ in range(1500):
        acting = float(rig.state["held_nm"][0, 0, (int(rig.state["ticks"][0]) - 1) % 32])
        hand = math.copysign(friction_nm, speed) + B * speed - acting
        rig.force_n[1] = hand / LEVER
        rig.tick(rig.position[0] + speed * T)
    return rig


@pytest.mark.parametrize("speed", [0.5, -0.5, 0.02])
def test_it_finds_a_constant_friction_without_the_viscous_damping_that_the_joint_keeps(speed):
    rig = settled(speed)
    assert rig["friction_observed_nm"] == pytest.approx(math.copysign(0.2, speed), rel=1e-3)
    assert rig["observer_torque_nm"] == pytest.approx(
        math.copysign(0.9 * target(speed) * 0.2, speed), rel=1e-3
    )
    assert rig["feedforward_torque_nm"] == 0.0
    side = 0 if speed > 0 else 1
    assert rig.state["friction_seen_nm"][0, 0, side] == pytest.approx(0.2, rel=1e-2)
    assert rig.state["friction_seen_nm"][0, 0, 1 - side] == 0.0


def waved(rig, hz=8.0, inertia=J, ticks=800, late=0, sensor_late=0):
    """A hand that bears a sine's inertia and damping and what the motor adds; largest observed, N m."""
    worst, w, sent, hand = 0.0, 2 * math.pi * hz, [0.0] * (late + 2), [0.0] * sensor_late
    for k in range(ticks):
        torque = -inertia * 0.05 * w * w * math.sin(w * k * T) + B * 0.05 * w * math.cos(w * k * T)
        acted = sent[-late] if late else 0.0  # when the law goes by this sample, one tick from now
        hand.append((torque - acted) / LEVER)
        rig.force_n[1] = hand[-1 - sensor_late]
        rig.tick(0.05 * math.sin(w * k * T))
        sent.append(rig["torque_applied_nm"])
        if k > ticks // 2:
            worst = max(worst, abs(rig["friction_observed_nm"]))
    return worst


def test_the_right_inertia_leaves_nothing_and_a_wrong_one_its_share():
    peak = J * 0.05 * (2 * math.pi * 8) ** 2
    free = {"observer_gain": 0.0, "count_rad": 1e-9, "observer_bandwidth_rad_s": lowpass_alpha(HZ, T) / T}
    assert waved(made(**free).arm()) < 0.005 * peak
    assert waved(made(**{**free, "observer_bandwidth_rad_s": 2 * math.pi * HZ}).arm()) < 0.08 * peak
    passed = 1 / math.sqrt(1 + (8 / HZ) ** 2) / math.sqrt(1 + (8 / HZ / SMOOTHING) ** 2)
    assert waved(made(**free).arm(), inertia=1.5 * J) == pytest.approx(0.5 * peak * passed, rel=0.05)


def excited(late, told, sensor_late=0, own=0):
    """Largest friction found while a coupling pulls at a joint whose torque comes `late` ticks late, and a
    force `sensor_late`.
    """
    rig = made(
        observer_gain=0.0,
        observer_bandwidth_rad_s=lowpass_alpha(HZ, T) / T,
        actuator_delay_ticks=told,
        follow_delay_ticks=late,
        coupling_stiffness_nm_rad=40.0,
        force_limit_n=1e3,
        observer_late_ticks=own,
    )
    rig.environment("spring", environment_stiffness_nm_rad=1e6).arm()
    return waved(rig, late=late, sensor_late=sensor_late)


def test_the_delay_of_the_motor_is_accounted_for():
    assert excited(LATE, LATE) < 0.02
    assert excited(LATE, 0) > 0.1


@pytest.mark.parametrize("late", [1, 2, 7])
def test_torque_and_velocity_are_those_of_the_instant_of_a_force_that_comes_late(late):
    assert excited(LATE, LATE, late, late) < 0.004
    assert excited(LATE, LATE, late, late - 1) > 0.015
    assert excited(LATE, LATE, late, late + 1) > 0.015


def test_the_line_of_velocities_is_as_long_as_that_of_torques_and_holds_nothing_that_is_no_number():
    rig = made(observer_late_ticks=1000, actuator_delay_ticks=1000).arm()
    stroke(rig, 0.5, 0.2)
    assert rig["friction_observed_nm"] == pytest.approx(0.2 - B * 0.5 + rig["observer_torque_nm"], abs=0.02)
    rig.state["force_filtered_nm"] = math.nan
    with np.errstate(invalid="ignore"):
        rig.tick()
    assert not rig.state["observer_moved_rad_s"].any()


def test_a_sample_that_took_two_ticks_is_the_velocity_of_both_for_a_late_force_too():
    every, second = (made(observer_gain=0.0, hz=5.0, observer_late_ticks=3).arm() for _ in range(2))
    for k in range(60):
        place = 2.0 * (k * T) ** 2
        every.tick(place)
        second.tick(**({"fresh": False} if k % 2 == 0 else {"position": place}))
    assert every["friction_observed_nm"] < -1e-3
    assert second["friction_observed_nm"] == pytest.approx(every["friction_observed_nm"], rel=0.15)


@pytest.mark.parametrize("bias_nm", [0.0029, -0.0029])
def test_a_bias_below_the_dead_band_makes_no_torque_at_rest_and_one_above_only_the_rest(bias_nm):
    rig = stroke(made(observer_deadband_nm=0.003).arm(), 0.0, bias_nm)
    assert rig["friction_observed_nm"] == pytest.approx(bias_nm, rel=1e-3)
    assert rig["observer_torque_nm"] == 0.0
    assert rig["torque_applied_nm"] == 0.0
    rig = settled(deadband=0.003, friction_nm=0.2)
    assert rig["observer_torque_nm"] == pytest.approx(0.9 * (target(0.5) * 0.2 - 0.003), rel=1e-3)


def test_while_the_bristles_turn_half_of_it_comes_on_top_of_a_hybrid_direction():
    for policy, half in ((Policy.HYBRID, 0.5), (Policy.OBSERVER, 1.0), (Policy.STOP_GATED, 1.0)):
        for share, left in ((0.0, half), (0.5, half), (-0.75, 0.5 + 0.5 * half), (1.0, 1.0)):
            rig = made(policy, observer_gain=0.9, observer_deadband_nm=0.0)
            rig.state["pace_rad_s"] = 1.0
            rig.state["bristle_share"], rig.now["friction_observed_nm"], rig.now["compensation"] = (
                share,
                0.1,
                1.0,
            )
            torque = observer_torque(rig.now[0], rig.state[0], rig.params[0], rig.model[0], 0, 1)
            assert torque == pytest.approx(left * 0.9 * TARGET_AT_REST * 0.1), (policy, share)


@pytest.mark.parametrize("speed", [0.0, 0.01, 0.5])
def test_more_of_the_friction_is_left_to_a_joint_that_has_not_moved_on_for_long(speed):
    rig = made(Policy.OBSERVER)
    rig.now["friction_observed_nm"], rig.now["compensation"], rig.now["velocity_rad_s"] = 0.1, 1.0, speed
    moves = SLOW_SHARE * math.exp(-((speed / SLOW_RAD_S) ** 2))
    for ticks, left in ((0, moves), (10_000, SLOW_SHARE + HELD_SHARE)):
        rig.state["bent_ticks"] = ticks
        asked = observer_torque(rig.now[0], rig.state[0], rig.params[0], rig.model[0], 0, 1)
        assert asked == pytest.approx(0.9 * (1.0 - left) * 0.1)


@pytest.mark.parametrize("pull_nm", [0.01, 0.03])
def test_a_pull_that_stays_is_not_helped_ever_more(pull_nm):
    """Of a joint that sticks the observer sees its own torque: what it comes to against a pull, and how long
    the pull has been there.
    """
    rig = made(observer_gain=0.95, rest_alpha=lowpass_alpha(2.0, T)).arm()
    sent = [float(stroke(rig, 0.0, pull_nm, 500)["observer_torque_nm"]) for _ in range(12)]
    all_of_it = 0.95 * TARGET_AT_REST
    left = 0.95 * (TARGET_AT_REST - HELD_SHARE)
    assert max(sent) < 0.6 * all_of_it / (1 - all_of_it) * pull_nm
    assert sent[-1] == pytest.approx(left / (1 - left) * pull_nm, rel=0.1)


@pytest.mark.parametrize("speed", [0.5, -0.5])
def test_it_fills_only_what_the_feed_forward_leaves(speed):
    rig = made(Policy.TANH, model=True, friction_ungated_cap_nm=0.15).arm()
    rig = stroke(rig, speed, math.copysign(0.05, speed))
    observed, forward = rig["friction_observed_nm"], rig["feedforward_torque_nm"]
    assert abs(forward) == pytest.approx(0.15, rel=1e-3)
    assert rig["observer_torque_nm"] == pytest.approx(0.9 * (target(speed) * observed - forward), rel=1e-2)


def test_with_the_feed_forward_it_keeps_under_the_cap():
    rig = stroke(made(Policy.TANH, model=True, friction_cap_nm=0.25).arm(), 0.5, 0.6)
    assert rig["feedforward_torque_nm"] == pytest.approx(0.225, rel=1e-3)
    assert rig["observer_torque_nm"] == pytest.approx(0.025, rel=1e-3)
    rig.force_n[1] = -60.0 / LEVER * 0.08
    assert rig.run(30)["feedforward_torque_nm"] + rig["observer_torque_nm"] >= -0.25


@pytest.mark.parametrize("sign", [1, -1])
def test_beyond_the_trained_range_it_fades_out_where_there_is_one(sign):
    def at(speed, model):
        rig = made(model=model, friction_cap_nm=0.3)
        return stroke(rig.arm(), sign * speed, sign * 2.0)["observer_torque_nm"]

    assert at(3.9, True) == at(4.25, False) == at(5.0, False) == pytest.approx(sign * 0.3)
    assert abs(at(4.45, True)) < 0.3
    assert at(4.6, True) == 0.0


def test_the_command_scales_it_and_the_policy_off_ends_it():
    rig = settled()
    full = rig["observer_torque_nm"]
    rig.command["compensation"] = 0.5
    assert rig.tick(rig.position[0] + 0.5 * T)["observer_torque_nm"] == pytest.approx(0.5 * full, rel=1e-2)
    rig.params["friction_policy"] = int(Policy.OFF)
    assert rig.tick(rig.position[0] + 0.5 * T)["observer_torque_nm"] == 0.0


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_torque_that_is_not_a_number_is_a_fault_and_is_forgotten(bad):
    rig = settled()
    rig.state["force_filtered_nm"] = bad  # the sample check would refuse the sensor's own
    with np.errstate(invalid="ignore"):
        rig.tick()
    assert math.isnan(rig["friction_observed_nm"])
    assert rig["torque_applied_nm"] == 0.0
    assert Fault.LAW_NOT_FINITE in rig.faults
    for name in rig.state.dtype.names:
        if "observer" in name or name in ("friction_seen_nm", "friction_observed_nm"):
            assert not rig.state[name].any(), name
    rig.state["force_filtered_nm"] = 0.0
    assert rig.run(3)["friction_observed_nm"] == pytest.approx(0.0, abs=1e-2)
    assert rig.mode is State.FAULT


def test_a_missed_sample_holds_what_was_found_and_its_torque():
    rig = settled()
    found, torque = rig["friction_observed_nm"], rig["observer_torque_nm"]
    assert abs(torque) > 0.1
    rig.tick(fresh=False)
    assert rig["friction_observed_nm"] == found
    assert rig["observer_torque_nm"] == pytest.approx(torque, rel=1e-6)
    rig = made(observer_gain=0.0).arm()
    for k in range(60):
        rig.tick(5.0 * (k * T) ** 2)
    found = rig["friction_observed_nm"]
    assert found == pytest.approx(-10.0 * J, rel=0.3), "a joint that gains speed by itself"
    assert rig.tick(fresh=False)["friction_observed_nm"] == found


def test_a_sample_that_took_two_ticks_counts_as_two():
    every, second = (made(observer_gain=0.0, hz=5.0).arm() for _ in range(2))
    for rig in (every, second):
        rig.force_n[1] = 0.2 / LEVER
    for k in range(40):
        place = 0.3 * T * (k + 1)
        every.tick(place)
        if k % 2 == 0:
            second.tick(fresh=False)
        else:
            second.tick(place)
    assert every["friction_observed_nm"] > 0.05
    assert second["friction_observed_nm"] == pytest.approx(every["friction_observed_nm"], rel=0.05)


def test_friction_is_remembered_in_sliding_only():
    rig = made(observer_gain=0.0).arm()
    rig.params["presliding_rad"] = 0.16
    stroke(rig, 0.5, 0.2, ticks=300)
    assert rig["friction_observed_nm"] > 0.1
    assert not rig.state["friction_seen_nm"].any()
    rig.params["presliding_rad"] = 1e-4
    assert stroke(rig, 0.5, 0.2, ticks=300).state["friction_seen_nm"][0, 0, 0] > 0.1


def test_without_a_coefficient_it_is_off():
    rig = settled(observer_alpha=0.0)
    assert rig["friction_observed_nm"] == rig["observer_torque_nm"] == 0.0
    rig = settled(observer_gain=0.0)
    assert rig["friction_observed_nm"] == pytest.approx(0.2, rel=1e-3), "it may watch without acting"
    assert rig["observer_torque_nm"] == 0.0
