"""The velocity that a device measures: when it is believed, what uses it, what never looks at it."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from law_rig import COUNT, LEVER, LawRig, T

from rtctl.control import device_velocity as judged
from rtctl.control.device_velocity import SLACK_COUNTS, WINDOW_TICKS
from rtctl.control.feedforward import friction_feedforward
from rtctl.control.vocabulary import DeviceVelocity, Fault, Policy, State

TOLERANCE = 1.0
V_MAX = 10.0
CHECKED = {"device_velocity_kind": int(DeviceVelocity.CHECK), "device_tolerance_rad_s": TOLERANCE}
USED = {**CHECKED, "device_velocity_kind": int(DeviceVelocity.USE)}


def armed(**params):
    rig = LawRig(**{**CHECKED, **params})
    rig.now["device_velocity_rad_s"] = 0.0
    return rig.arm()


def counted(angle):
    return np.floor(angle / COUNT) * COUNT


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1.501 * V_MAX, -1.501 * V_MAX])
def test_what_is_not_finite_or_out_of_range_is_a_fault_at_the_third_sample(bad):
    rig = armed().run(2, device_velocity_rad_s=bad)
    assert (rig.mode, rig.faults) == (State.ACTIVE, Fault(0))
    rig.tick(device_velocity_rad_s=bad)
    assert (rig.mode, rig.faults) == (State.FAULT, Fault.VELOCITY)
    assert rig["torque_applied_nm"] == 0.0


def test_one_good_sample_begins_the_count_anew():
    rig = armed()
    for _ in range(10):
        rig.run(2, device_velocity_rad_s=math.nan)
        rig.tick(device_velocity_rad_s=0.0)
    assert (rig.mode, rig.faults) == (State.ACTIVE, Fault(0))


def test_a_missed_sample_neither_proves_nor_disproves():
    rig = armed().run(2, device_velocity_rad_s=math.nan)
    rig.run(2, fresh=False, device_velocity_rad_s=math.nan)
    assert rig.faults == Fault(0)
    rig.tick(device_velocity_rad_s=math.nan)
    assert rig.faults == Fault.VELOCITY


def test_it_is_a_fault_of_every_axis_that_is_checked_and_of_no_other():
    rig = LawRig(
        2, **{**CHECKED, "device_velocity_kind": [int(DeviceVelocity.RECORD), int(DeviceVelocity.CHECK)]}
    )
    rig.now["device_velocity_rad_s"] = 0.0
    assert rig.run(50, device_velocity_rad_s=[math.nan, 0.0]).faults == Fault(0)
    assert rig.run(3, device_velocity_rad_s=[math.nan, math.nan]).faults == Fault.VELOCITY


def steady(error, speed=2.0, ticks=400):
    """Ticks from the beginning of a steady error until the fault; None without one."""
    rig = armed()
    for k in range(60):
        rig.tick(counted(speed * T * k), device_velocity_rad_s=speed)
    assert rig.faults == Fault(0)
    for k in range(60, 60 + ticks):
        if rig.tick(counted(speed * T * k), device_velocity_rad_s=speed + error).faults & Fault.VELOCITY:
            return k - 59
    return None


def bound():
    return TOLERANCE + SLACK_COUNTS * COUNT / (WINDOW_TICKS * T)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_steady_error_within_the_tolerance_is_borne_for_ever_and_twice_the_bound_is_found(sign):
    assert steady(sign * TOLERANCE) is None
    assert steady(sign * (bound() + 2 * COUNT / (WINDOW_TICKS * T))) is not None
    assert steady(sign * 2.0 * (bound() + COUNT / (WINDOW_TICKS * T))) <= 11 + 3


def test_an_encoder_that_stands_still_while_the_joint_moves_is_found():
    rig, speed = armed(), 3.0
    for k in range(60):
        rig.tick(counted(speed * T * k), device_velocity_rad_s=speed)
    ticks = next(k for k in itertools.count(1) if rig.tick(device_velocity_rad_s=speed).faults)
    assert rig.faults == Fault.VELOCITY
    assert ticks <= math.log(1 / (1 - bound() / speed)) * WINDOW_TICKS + 3


@pytest.mark.parametrize("wrong", [-1.0, 0.0, 57.3, 1 / 60])
def test_a_wrong_sign_unit_or_gear_is_found_once_the_joint_moves(wrong):
    rig, speed = armed(), 2.0
    faults = Fault(0)
    for k in range(100):
        faults |= rig.tick(counted(speed * T * k), device_velocity_rad_s=wrong * speed).faults
    assert faults & Fault.VELOCITY


@pytest.mark.parametrize("fresh", [True, False])
def test_slots_without_a_sample_count_in_the_sum(fresh):
    """Every other slot is skipped, or its sample is missed: the travel is of both."""
    rig, speed = armed(device_tolerance_rad_s=0.3), 5.0
    for k in range(1, 60):
        if not fresh:
            rig.tick(fresh=False, device_velocity_rad_s=math.nan)
        rig.tick(counted(speed * 2 * T * k), skipped=int(fresh), device_velocity_rad_s=speed)
        assert not rig.faults & Fault.VELOCITY


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.floats(-100.0, 100.0), min_size=20, max_size=120),
    st.floats(-0.4, 0.4),
    st.integers(0, 4),
    st.lists(st.integers(1, 3), min_size=120, max_size=120),
)
def test_what_the_tolerance_allows_never_trips_whatever_the_motion(accelerations, error, delay, gaps):
    """The statement of the module: error e, delay D and acceleration a within e + a (D + m T / 2)."""
    most = 100.0 * (delay + 1.5) * T + 0.4
    rig = LawRig(**{**CHECKED, "device_tolerance_rad_s": most, "velocity_limit_rad_s": 1e3})
    speeds, angles = [0.0] * (delay + 1), [0.0]
    for wanted in accelerations:
        speeds.append(speeds[-1] + wanted * T)
        angles.append(angles[-1] + 0.5 * (speeds[-1] + speeds[-2]) * T)
    at, faults = 0, Fault(0)
    for gap in gaps:
        at += gap
        if at >= len(angles):
            break
        late = speeds[at]  # of `delay` ticks ago: speeds has that many leading zeros
        faults |= rig.tick(counted(angles[at]), skipped=gap - 1, device_velocity_rad_s=late + error).faults
        assert abs(rig.state["device_gap_rad"][0, 0]) <= WINDOW_TICKS * T * most + COUNT * (1 + 1e-9)
    assert not faults & Fault.VELOCITY


def test_a_sum_of_before_does_not_outlive_a_restart():
    rig = armed()
    rig.run(5, device_velocity_rad_s=5.0)
    assert rig.state["device_gap_rad"][0, 0] > 0.02
    rig.tick(link_faults=4, device_velocity_rad_s=0.0)  # unplugged
    rig.tick(1.0, device_velocity_rad_s=0.0)
    assert rig.state["device_gap_rad"][0, 0] == 0.0


@pytest.mark.parametrize("speed", [9.0, -9.0])
def test_a_joint_that_moves_when_the_encoder_begins_is_no_gap(speed):
    """No travel of before is known: the first sample must not count as one the encoder did not see."""
    rig = LawRig(**{**CHECKED, "device_tolerance_rad_s": 0.3})
    for k in range(100):
        rig.tick(counted(speed * T * k), device_velocity_rad_s=speed)
        assert abs(rig.state["device_gap_rad"][0, 0]) <= COUNT * (1 + 1e-9)
        assert rig.faults == Fault(0)


def test_a_velocity_out_of_range_is_implausible_from_the_first_sample_on():
    rig = LawRig(**CHECKED)
    assert rig.tick(device_velocity_rad_s=math.inf).state["device_doubt_ticks"][0, 0] == 1


def limit_at(rig, velocity, direction):
    """Most that the proofs let the feed-forward have at this velocity of the encoder, N m."""
    rig.now["velocity_rad_s"] = velocity
    rig.state["friction_stop"] = direction
    friction_feedforward(rig.now[0], rig.state[0], rig.params[0], rig.model[0], 0, 0.0, velocity)
    return abs(rig["feedforward_torque_nm"])


@settings(max_examples=100, deadline=None)
@given(
    st.floats(-5.0, 5.0),
    st.one_of(st.floats(-6.0, 6.0), st.just(0.0)),
    st.sampled_from([-1.0, 1.0]),
    st.sampled_from([Policy.STOP, Policy.SIGN, Policy.TANH, Policy.DEADBAND]),
)
def test_an_error_of_the_device_only_takes_compensation_away(encoder, device, direction, policy):
    """|tau_ff| is at most that of the whole direction at the encoder's speed: the proofs' premise."""
    rig = LawRig(friction_policy=int(Policy.STOP), friction_viscous_gain=0.7, friction_ungated_cap_nm=1.0)
    rig.friction(stribeck=0.6)
    rig.now["compensation"] = 1.0
    most = limit_at(rig, encoder, direction)
    rig.params["friction_policy"] = int(policy)
    friction_feedforward(rig.now[0], rig.state[0], rig.params[0], rig.model[0], 0, 0.0, device)
    assert abs(rig["feedforward_torque_nm"]) <= most
    if policy == Policy.STOP and abs(device) <= 4.0:
        own = abs(rig["feedforward_torque_nm"])
        rig.now["velocity_rad_s"] = device
        friction_feedforward(rig.now[0], rig.state[0], rig.params[0], rig.model[0], 0, 0.0, device)
        assert own == min(most, abs(rig["feedforward_torque_nm"])), "and no more than the error asks for"


def test_a_model_that_is_not_finite_at_the_encoders_velocity_is_a_fault():
    rig = LawRig(friction_policy=int(Policy.STOP)).friction()
    rig.now["compensation"], rig.now["velocity_rad_s"], rig.state["friction_stop"] = 1.0, 3.5, 1.0
    rig.model["coefficient"][..., 100:200, 0] = math.nan
    fault = friction_feedforward(rig.now[0], rig.state[0], rig.params[0], rig.model[0], 0, 0.0, 0.5)
    assert (fault, rig["feedforward_torque_nm"]) == (Fault.LAW_NOT_FINITE, 0.0)


def feedforward(kind, device, speed=0.5, policy=Policy.TANH):
    params = {
        **USED,
        "device_velocity_kind": int(kind),
        "device_tolerance_rad_s": 0.3,
        "friction_tanh_rad_s": 0.2,
    }
    rig = LawRig(friction_policy=int(policy), **params).friction()
    rig.now["device_velocity_rad_s"] = 0.0
    rig.arm()
    for k in range(100):
        rig.tick(speed * T * (k + 1), device_velocity_rad_s=speed)
    rig.tick(speed * T * 101, device_velocity_rad_s=device)
    return rig


@pytest.mark.parametrize(
    ("device", "taken"),
    [
        (0.5, 0.5),
        (0.6, 0.6),
        (0.3, 0.3),
        (0.9, 0.8),
        (-4.0, 0.2),
        (5.0, 0.8),
        (5.5, 0.5),
        (-5.0, 0.5),
        (15.0, 0.5),
        (math.nan, 0.5),
        (-math.inf, 0.5),
    ],
)
def test_what_the_feed_forward_uses_lies_within_the_tolerance_of_the_encoders(device, taken):
    rig = feedforward(DeviceVelocity.USE, device)
    assert rig["velocity_rad_s"] == pytest.approx(0.5, rel=1e-3)
    assert rig["friction_sign"] == pytest.approx(math.tanh(taken / 0.2), rel=1e-3)


@pytest.mark.parametrize("kind", [DeviceVelocity.RECORD, DeviceVelocity.CHECK])
def test_only_recorded_or_checked_it_changes_nothing_else_of_the_tick(kind):
    plain, other = feedforward(DeviceVelocity.RECORD, 0.5), feedforward(kind, 0.6)
    for name in plain.now.dtype.names:
        if name != "device_velocity_rad_s":
            assert plain.now[name].tobytes() == other.now[name].tobytes(), name


def test_an_implausible_sum_is_not_used_though_the_sample_itself_is_in_range():
    rig = armed(**USED, friction_policy=int(Policy.SIGN)).friction()
    for _ in range(3):
        rig.tick(device_velocity_rad_s=14.0)
    assert rig["friction_sign"] == 0.0


@pytest.mark.parametrize("device", [-9.0, 0.0, 9.0])
def test_gate_overspeed_and_observer_look_at_the_encoder_alone(device):
    """Two rigs whose encoder and hand show the same: all they do but the feed-forward is the same."""
    shown = []
    for value in (8.0, device):
        rig = LawRig(**{**USED, "device_tolerance_rad_s": 100.0}, velocity_limit_rad_s=8.0)
        rig.now["device_velocity_rad_s"] = 0.0
        rig.environment("damper", environment_damping_nms_rad=0.05).arm()
        rig.force_n[1] = 0.2 / LEVER
        rows = []
        for k in range(200):
            rig.tick(0.00005 * k * k, device_velocity_rad_s=value)
            rows.append(rig.now.copy())
        shown.append(np.concatenate(rows))
    one, other = shown
    assert (one["faults"] & int(Fault.OVERSPEED)).any()
    for name in one.dtype.names:
        if name != "device_velocity_rad_s":
            assert one[name].tobytes() == other[name].tobytes(), name


def test_no_fault_without_samples_in_a_row_as_many_as_make_a_stale_one():
    rig = LawRig(**CHECKED)
    s, p, t = rig.state[0], rig.params[0], rig.now[0]
    t["device_velocity_rad_s"] = math.nan
    for k in range(1, 4):
        _, fault = judged.device_velocity(t, s, p, 0, 1, 0.0)
        assert fault == (Fault.VELOCITY if k >= 3 else 0)
    _, fault = judged.device_velocity(t, s, p, 0, 0, 0.0)
    assert fault == Fault.VELOCITY, "it lasts while nothing better comes"


@pytest.mark.parametrize(("encoder", "device"), [(4.6, 4.3), (4.3, 4.6), (4.6, 4.6)])
def test_beyond_the_trained_range_by_either_velocity_there_is_no_feed_forward(encoder, device):
    """The model ends at 4 rad/s and has faded out at 4.5."""
    rig = feedforward(DeviceVelocity.USE, device, speed=encoder)
    assert rig["feedforward_torque_nm"] == 0.0
    assert rig["friction_model_nm"] == 0.0
    assert feedforward(DeviceVelocity.USE, 4.3, speed=4.3)["feedforward_torque_nm"] > 0.0
