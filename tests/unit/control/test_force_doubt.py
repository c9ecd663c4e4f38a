"""A force sensor that lies, function by function; whole rigs: tests/unit/test_force_that_lies.py."""

import math
from itertools import pairwise

import numpy as np
import pytest
from law_rig import B, LawRig, T, of_rows

from rtctl.control.force_doubt import (
    FROZEN_S,
    IN_A_ROW,
    OFFSET_S,
    SLID_S,
    STAYING_OFFSET_S,
    STAYING_SLID_S,
    clipped_fault,
    frozen_fault,
    offset_fault,
)
from rtctl.control.vocabulary import Fault

FROZEN, OFFSET = of_rows(frozen_fault), of_rows(offset_fault)
FRICTION_NM = 0.3
LIMIT_N = 50.0


def made(**params):
    rig = LawRig(force_used=1, force_answers=1, force_limit_n=LIMIT_N, moment_limit_nm=5.0, **params)
    rig.params["force_step"] = 0.005
    rig.state["screw"][0, 0, 1] = 0.1
    return rig


def moved(rig, path, motor_share=0.0, lively=False):
    """Move the joint along these angles while the force shows 0 (`lively`: a last bit that changes); ticks to
    FORCE_FROZEN.
    """
    for k, (before, here) in enumerate(pairwise(path)):
        dx = here - before
        rig.state["position_before_rad"][0, 0], rig.state["position_rad"][0, 0] = before, here
        rig.state["friction_credit_j"][0, 0] = FRICTION_NM * abs(dx)
        rig.state["wrench"][0, 1] = 1e-4 * (k % 2) if lively else 0.0
        rig.now["velocity_rad_s"] = dx / T
        motor_nm = motor_share * math.copysign(FRICTION_NM + B * abs(dx) / T, dx)
        rig.now["motor_torque_nm"] = motor_nm
        rig.state["torque_applied_nm"] = motor_nm
        if FROZEN(rig.now, rig.state, rig.params, 1, True):
            return k
    return None


THERE_AND_BACK = 0.2 * np.sin(2 * math.pi * np.arange(2000) * T)


def test_a_closed_path_that_nobody_paid_for_is_a_frozen_force_after_half_a_second():
    at = moved(made(), THERE_AND_BACK)
    assert FROZEN_S <= at * T < 1.1
    assert moved(made(), THERE_AND_BACK, lively=True) is None


@pytest.mark.parametrize(
    ("path", "motor_share"),
    [(np.zeros(5000), 0.0), (0.1 * T * np.arange(3000), 0.0), (THERE_AND_BACK, 1.0)],
    ids=["at rest", "one way", "by the motor"],
)
def test_a_value_that_stays_is_none_where_nobody_can_have_moved_the_joint_unseen(path, motor_share):
    assert moved(made(), path, motor_share) is None


@pytest.mark.parametrize("component", range(6))
@pytest.mark.parametrize("sign", [1, -1])
def test_the_third_sample_exactly_at_a_limit_is_clipped(component, sign):
    rig = made()
    rig.state["wrench"][0, component] = sign * (LIMIT_N if component < 3 else 5.0)
    found = [clipped_fault(rig.state[0], rig.params[0], 1) for _ in range(IN_A_ROW)]
    assert found == [0] * (IN_A_ROW - 1) + [Fault.FORCE_CLIPPED]
    rig.state["wrench"][0, component] *= 0.999
    assert clipped_fault(rig.state[0], rig.params[0], 1) == 0


def slid(offset_nm, limit_nm, staying=False):
    """Seconds of sliding, .25 s each way by turns, to a fault of a force that is off by this much, and that
    fault.
    """
    rig = made(friction_seen_alpha=0.03, force_offset_limit_nm=limit_nm)
    rig.now["velocity_difference_rad_s"] = 0.1
    rig.state["friction_seen_nm"][0, 0] = (FRICTION_NM + offset_nm, FRICTION_NM - offset_nm)
    rig.state["same_ticks"] = 10_000 if staying else 0
    for k in range(6000):
        rig.state["bristle_share"] = 1.0 if (k // 250) % 2 == 0 else -1.0
        if fault := OFFSET(rig.now, rig.state, rig.params, 0, 1, True):
            return (k + 1) * T, Fault(fault)
    return None


@pytest.mark.parametrize("offset_nm", [0.15, -0.15])
def test_friction_that_differs_both_ways_is_an_offset_beyond_the_limit_only(offset_nm):
    seconds, found = slid(offset_nm, 0.1)
    assert found == Fault.FORCE_OFFSET
    assert seconds == pytest.approx(2 * SLID_S + OFFSET_S, abs=0.26)
    assert slid(offset_nm, 0.2) is None


@pytest.mark.parametrize("offset_nm", [0.15, -0.15])
def test_of_a_value_that_stays_it_is_frozen_and_found_sooner(offset_nm):
    seconds, found = slid(offset_nm, 0.1, staying=True)
    assert found == Fault.FORCE_FROZEN
    assert seconds == pytest.approx(2 * STAYING_SLID_S + STAYING_OFFSET_S, abs=0.26)


def test_no_number_is_an_offset():
    assert slid(math.nan, 0.1)[1] == Fault.FORCE_OFFSET


def test_an_uneven_joint_whose_friction_swings_by_turns_is_no_offset():
    rig = made(friction_seen_alpha=0.03, force_offset_limit_nm=0.1)
    rig.now["velocity_difference_rad_s"] = 0.1
    for k in range(8000):
        swing = 0.2 * math.copysign(1.0, math.sin(2 * math.pi * k * T))  # half a second each
        rig.state["friction_seen_nm"][0, 0] = (FRICTION_NM + swing, FRICTION_NM - swing)
        rig.state["bristle_share"] = 1.0 if (k // 2000) % 2 == 0 else -1.0
        assert not offset_fault(rig.now[0], rig.state[0], rig.params[0], 0, 1, True)


@pytest.mark.parametrize("resting", [True, False])
def test_friction_seen_under_another_load_is_not_held_against_a_value_that_stays(resting):
    """Forward under load and backward without, then a hand that leans on a wall: the joint flickers between
    counts, or slides one way.
    """
    rig = made(friction_seen_alpha=0.03, force_offset_limit_nm=0.1, count_rad=1e-4)
    rig.state["friction_seen_nm"][0, 0] = (0.6, 0.3)
    rig.state["slid_ticks"], rig.state["same_ticks"] = 5000, 2 * FROZEN_S / T
    rig.state["rest_ticks"] = 1000 if resting else 0
    for k in range(round(2 / T)):
        rig.state["bristle_share"] = -1.0 if resting and k % 2 else 1.0
        rig.now["velocity_difference_rad_s"] = 0.1
        assert not offset_fault(rig.now[0], rig.state[0], rig.params[0], 0, 1, True)
        assert not OFFSET(rig.now, rig.state, rig.params, 0, 1, True)
