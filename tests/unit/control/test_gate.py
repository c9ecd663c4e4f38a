import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from law_rig import LawRig

from rtctl.control.gate import (
    WINDOW_S,
    encoded_fits,
    gate_torque,
    push_window,
    window_flag,
    window_limit,
)
from rtctl.control.vocabulary import Fault, GateFlag, State

LIMITS = {"limit": 2.0, "allowed": 2.0, "rate": 0.1, "v_limit": 10.0, "enabled": True}


def gate(wanted, previous=0.0, velocity=0.0, **changed):
    limits = {**LIMITS, **changed}
    torque, flags = gate_torque(
        wanted,
        previous,
        velocity,
        limits["limit"],
        limits["allowed"],
        limits["rate"],
        limits["v_limit"],
        limits["enabled"],
    )
    return torque, GateFlag(int(flags))


def test_each_intervention_has_its_flag():
    assert gate(0.05) == (0.05, GateFlag(0))
    assert gate(3.0, previous=1.95) == (2.0, GateFlag.ABSOLUTE)
    assert gate(-3.0, previous=-1.95) == (-2.0, GateFlag.ABSOLUTE)
    assert gate(2.0, previous=1.95) == (2.0, GateFlag(0))
    assert gate(1.0) == (0.1, GateFlag.RATE)
    assert gate(0.1) == (0.1, GateFlag(0))
    assert gate(-1.0, previous=0.5) == (0.4, GateFlag.RATE)
    assert gate(3.0) == (0.1, GateFlag.ABSOLUTE | GateFlag.RATE)
    assert gate(1.0, enabled=False) == (0.0, GateFlag.DISABLED)
    assert gate(math.nan) == (0.0, GateFlag.NOT_FINITE)
    assert gate(math.inf) == (0.0, GateFlag.NOT_FINITE)
    assert gate(0.05, velocity=math.nan) == (0.0, GateFlag.NOT_FINITE)


def test_an_allowed_share_bounds_the_torque_and_is_reached_by_the_rate_from_above():
    assert gate(1.0, previous=0.45, allowed=0.5) == (0.5, GateFlag.SHARE)
    assert gate(-1.0, previous=-0.45, allowed=0.5) == (-0.5, GateFlag.SHARE)
    assert gate(1.0, previous=1.0, allowed=0.5) == (pytest.approx(0.9), GateFlag.SHARE)
    assert gate(0.2, previous=1.0, allowed=0.5) == (pytest.approx(0.9), GateFlag.RATE)
    assert gate(1.0, previous=0.05, allowed=0.0) == (0.0, GateFlag.SHARE)
    assert gate(1.0, previous=0.05, allowed=math.nan) == (0.0, GateFlag.SHARE)
    assert gate(1.0, previous=0.05, allowed=-1.0) == (0.0, GateFlag.SHARE)


def test_small_limits_are_sound_limits():
    assert gate(0.4, previous=0.39, limit=0.5, allowed=0.5, rate=0.05) == (0.4, GateFlag(0))
    assert gate(0.6, previous=0.49, limit=0.5, allowed=0.5, rate=0.05) == (0.5, GateFlag.ABSOLUTE)


def test_above_an_allowed_share_the_torque_falls_in_both_directions_by_the_share_alone():
    assert gate(1.0, previous=1.0, allowed=0.5) == (pytest.approx(0.9), GateFlag.SHARE)
    assert gate(-1.0, previous=-1.0, allowed=0.5) == (pytest.approx(-0.9), GateFlag.SHARE)


def test_the_slack_of_a_memory_ends_at_a_billionth_and_never_leaves_the_gate():
    assert gate(2.0, previous=2.0 * (1.0 + 1e-9))[1] == GateFlag(0)
    assert gate(-2.0, previous=-2.0 * (1.0 + 1e-9))[1] == GateFlag(0)
    assert gate(2.0, previous=2.0 * (1.0 + 2e-9))[1] == GateFlag.VIOLATION
    assert gate(2.0, previous=2.0 * (1.0 + 1e-10), rate=1e-12) == (2.0, GateFlag.RATE)
    assert gate(-2.0, previous=-2.0 * (1.0 + 1e-10), rate=1e-12) == (-2.0, GateFlag.RATE)


def test_what_does_no_work_is_not_cut_above_the_speed_limit():
    assert gate(0.0, velocity=10.1) == (0.0, GateFlag(0))
    assert gate(-0.05, velocity=10.1) == (-0.05, GateFlag(0)), "braking, however little"
    assert gate(0.05, velocity=-10.1) == (0.05, GateFlag(0))
    assert gate(0.05, velocity=0.0, v_limit=math.nan) == (0.05, GateFlag(0))
    assert gate(0.01, velocity=10.1) == (0.0, GateFlag.OVERSPEED)


@pytest.mark.parametrize("name", ["limit", "rate"])
@pytest.mark.parametrize("broken", [math.nan, math.inf, 0.0, -1.0])
@pytest.mark.parametrize("enabled", [True, False])
def test_broken_limits_are_a_violation_even_at_rest(name, broken, enabled):
    assert gate(0.05, enabled=enabled, **{name: broken}) == (0.0, GateFlag.VIOLATION)


@pytest.mark.parametrize("previous", [2.1, -2.1, math.nan, math.inf, -math.inf])
def test_a_memory_beyond_the_limit_is_a_violation(previous):
    assert gate(0.0, previous=previous) == (0.0, GateFlag.VIOLATION)
    assert gate(0.0, previous=previous, enabled=False) == (0.0, GateFlag.VIOLATION)
    assert gate(2.0, previous=2.0 * (1 + 1e-10))[0] == 2.0


@pytest.mark.parametrize("velocity", [10.1, -10.1, math.inf])
def test_the_speed_limit_itself_is_allowed_and_nan_is_no_speed_limit(velocity):
    assert gate(0.1, velocity=10.0) == (0.1, GateFlag(0))
    assert gate(math.copysign(0.1, velocity), velocity=10.0 * math.copysign(1, velocity))[0] != 0.0
    assert gate(0.1, velocity=1.0, v_limit=math.nan) == (0.0, GateFlag.OVERSPEED)


def test_the_encoded_value_must_say_the_torque_and_stay_within_the_limit():
    assert encoded_fits(1.0, 2.0, 0.5, 1.0)
    assert encoded_fits(-1.0, -2.0, 0.5, 1.0)
    assert encoded_fits(0.0, 0.0, 0.0, 1.0)
    assert not encoded_fits(1.0, 2.1, 0.5, 1.0)
    assert not encoded_fits(1.0, -2.0, 0.5, 1.0)
    assert not encoded_fits(1.0, 0.0, 0.0, 1.0)
    assert not encoded_fits(1.1, 2.2, 0.5, 1.0)
    assert not encoded_fits(0.999, 2.0, 0.5, 1.0)
    assert not encoded_fits(1.0 + 5e-10, 2.0 + 1e-9, 0.5, 1.0), "the torque itself has no slack"
    assert not encoded_fits(-1.0 - 5e-10, -2.0 - 1e-9, 0.5, 1.0)
    assert encoded_fits(1.0, 2.0 + 1e-9, 0.5, 1.0)
    assert encoded_fits(0.0, 1e-9, 1.0, 1.0), "a billionth of the limit is the slack"
    assert not encoded_fits(0.0, 1.1e-9, 1.0, 1.0)
    assert encoded_fits(0.0, 1.5e-9, 1.0, 2.0)
    assert not encoded_fits(0.0, 0.7e-9, 1.0, 0.5)
    for broken in (math.nan, math.inf):
        assert not encoded_fits(broken, 0.0, 0.5, 1.0)
        assert not encoded_fits(0.0, broken, 0.5, 1.0)
        assert not encoded_fits(0.0, 0.0, broken, 1.0)


def test_the_window_of_the_continuous_limit_is_a_quarter_of_a_second():
    assert WINDOW_S == 0.25


def test_the_mean_of_the_window_follows_the_magnitude():
    assert push_window(1.0, 2.0, 0.25) == 1.25
    assert push_window(1.0, -2.0, 0.25) == 1.25
    assert push_window(1.0, 0.0, 0.25) == 0.75


def test_the_window_is_flagged_while_it_is_what_bounds_the_torque():
    for torque, flag in ((0.5, GateFlag.WINDOW), (-0.5, GateFlag.WINDOW), (0.49, 0), (-0.49, 0), (0.0, 0)):
        assert window_flag(0.5, torque) == flag


def test_the_window_folds_the_limit_back_on_a_line_through_the_continuous_one():
    assert window_limit(0.0, 2.0, 1.0, 0.01) == 2.0
    assert window_limit(0.8, 2.0, 1.0, 0.01) == 2.0
    assert window_limit(0.9, 2.0, 1.0, 0.01) == pytest.approx(1.5)
    assert window_limit(1.0, 2.0, 1.0, 0.01) == pytest.approx(1.0)
    assert window_limit(1.1, 2.0, 1.0, 0.01) == 0.0
    assert window_limit(5.0, 2.0, 1.0, 0.01) == 0.0
    assert window_limit(5.0, 2.0, 2.0, 0.01) == 2.0
    assert window_limit(0.0, 2.0, 0.01, 0.01) == pytest.approx(1.0)


@settings(deadline=None, max_examples=50)
@given(st.lists(st.floats(0, 3), max_size=300), st.floats(0.01, 2.9))
def test_no_quarter_second_has_a_mean_above_one_and_a_half_continuous_limits(wanted, continuous):
    mean, sent, share = 0.0, [], -math.expm1(-2 * 1e-3 / 0.25)
    for torque in [*wanted, *[3.0] * 400, *wanted]:
        sent.append(min(torque, window_limit(mean, 3.0, continuous, share)))
        mean = push_window(mean, -sent[-1], share)
        assert mean <= continuous * (1 + 1e-12)
    sums = np.cumsum([0.0, *sent])
    assert np.max(sums[250:] - sums[:-250]) / 250 <= 1.5 * continuous * 1.01


def test_a_constant_demand_settles_at_the_continuous_limit_and_never_trips():
    rig = LawRig(torque_continuous_nm=1.0, coupling_stiffness_nm_rad=60.0, energy_budget_j=100.0)
    rig.environment("spring", environment_stiffness_nm_rad=1e6, environment_center_rad=0.05).arm()
    torque = []
    for _ in range(3000):
        rig.tick()
        torque.append(rig["torque_applied_nm"])
    assert rig.mode is State.ACTIVE
    assert max(torque) > 1.5  # short peaks are free
    assert torque[-1] == pytest.approx(1.0, abs=0.01)
    assert int(rig["gate_flags"]) & GateFlag.WINDOW
    assert rig["torque_share"] == pytest.approx(1 / 3, abs=0.01)


def test_more_than_the_window_allows_is_a_fault():
    rig = LawRig(torque_continuous_nm=1.0).arm()
    rig.state["window_mean_nm"] = 1.11
    rig.tick()
    assert rig.faults == Fault.OVERTORQUE
    assert rig.mode is State.STOPPING


@pytest.mark.parametrize(
    ("where", "field", "value"),
    [
        ("params", "torque_limit_nm", math.nan),
        ("params", "torque_limit_nm", 0.0),
        ("params", "torque_rate_nm", -1.0),
        ("state", "torque_applied_nm", 3.1),
        ("state", "torque_applied_nm", -3.1),
        ("params", "gear_ratio", math.nan),
    ],
)
@pytest.mark.parametrize("active", [True, False])
def test_memory_damaged_at_the_gate_locks_out_in_the_same_tick(where, field, value, active):
    rig = LawRig(coupling_stiffness_nm_rad=60.0)
    rig.environment("spring", environment_stiffness_nm_rad=60.0, environment_center_rad=0.01)
    rig = rig.arm() if active else rig.run(10)
    getattr(rig, where)[field] = value
    rig.tick()
    assert rig["torque_applied_nm"] == 0.0
    assert rig["current_command_a"] == 0.0
    if field != "gear_ratio" or active:
        assert rig.mode is State.LOCKOUT
        assert rig["fault_first"] == Fault.GATE.value.bit_length() - 1


def test_a_memory_that_is_not_a_number_cuts_and_locks_out_whatever_came_first():
    rig = LawRig(coupling_stiffness_nm_rad=60.0).arm()
    rig.state["torque_applied_nm"] = math.nan
    rig.tick()
    assert rig["torque_applied_nm"] == 0.0
    assert rig.mode is State.LOCKOUT


@pytest.mark.parametrize("velocity", [10.1, -10.1])
def test_above_the_speed_limit_torque_may_only_brake_and_at_once(velocity):
    push = math.copysign(1.0, velocity)
    assert gate(push, previous=push, velocity=velocity) == (0.0, GateFlag.OVERSPEED)
    assert gate(-push, previous=-push, velocity=velocity) == (-push, GateFlag(0))


def test_one_axis_that_is_not_finite_cuts_every_axis_in_the_same_tick():
    rig = LawRig(n_axes=2, coupling_stiffness_nm_rad=50.0)
    rig.environment("spring", environment_stiffness_nm_rad=10.0).arm()
    rig.tick([0.01, 0.01])
    assert rig.now["torque_applied_nm"][0] == pytest.approx([-0.0833, -0.0833], rel=1e-2)
    rig.state["ramp_step_nm"] = 0.0
    rig.state["proxy_position_rad"][0] = [0.0, math.nan]
    rig.params["coupling_damping_nms_rad"][0, 1] = 1.0
    rig.tick()
    assert rig.now["torque_applied_nm"][0] == pytest.approx([0.0, 0.0], abs=0)
    assert rig.faults & Fault.LAW_NOT_FINITE
    assert rig.mode is State.FAULT
    assert rig["enabled"] == 0.0
