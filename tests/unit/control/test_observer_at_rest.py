"""What of the friction observer's torque is sent while the joint rests, to a slow hand, and beside a virtual
mass."""

import math

import pytest
from law_rig import LawRig, T
from test_disturbance_observer import made, observer_torque

from rtctl.control.disturbance_observer import (
    SLOW_HAND_LEFT,
    TARGET_AT_REST,
    _beside_a_mass,
    _turning,
)
from rtctl.control.velocity import lowpass_alpha
from rtctl.control.vocabulary import Display, Policy


def test_a_joint_that_rests_is_sent_the_share_that_it_was_sent_when_it_moved():
    """As a function of the bristles it would be a spring that comes late."""
    rig = LawRig()
    rig.state["bristle_share"] = -0.8
    assert _turning(rig.state[0], rig.params[0], 0) == pytest.approx(0.8)
    rig.state["rest_ticks"] = 100
    for share in (0.1, -0.5, 1.0):
        rig.state["bristle_share"] = share
        assert _turning(rig.state[0], rig.params[0], 0) == pytest.approx(0.8)
    rig.state["rest_ticks"] = 0
    assert _turning(rig.state[0], rig.params[0], 0) == 1.0


def test_where_a_virtual_mass_is_shown_it_goes_and_stays_away():
    """What acts on a joint that sticks it would add to, as an integrator: mass and joint leapt to and fro."""
    rig = LawRig(rest_alpha=lowpass_alpha(2.0, T))

    def after(seconds, display):
        rig.state["display_kind"] = int(display)
        for _ in range(round(seconds / T)):
            share = _beside_a_mass(rig.state[0], rig.params[0], 0)
        return share

    assert after(0.01, Display.IMPEDANCE) == 1.0
    assert after(0.02, Display.ADMITTANCE) == pytest.approx(math.exp(-2 * math.pi * 2.0 * 0.02), rel=1e-4)
    assert after(1.0, Display.ADMITTANCE) < 1e-4


def test_a_slow_hand_is_left_half_of_it_on_top_of_a_feedforward_as_slowly_as_a_gate():
    for policy, pace, left in (
        (Policy.HYBRID, 0.07, 1 - SLOW_HAND_LEFT),
        (Policy.HYBRID, 0.09, 1.0),
        (Policy.OBSERVER, 0.0, 1.0),
    ):
        rig = made(policy, observer_gain=0.9, observer_deadband_nm=0.0, rest_alpha=0.02)
        rig.state["pace_rad_s"], rig.state["bristle_share"] = pace, 1.0
        rig.now["friction_observed_nm"], rig.now["compensation"] = 0.1, 1.0
        sent = [
            observer_torque(rig.now[0], rig.state[0], rig.params[0], rig.model[0], 0, 1) for _ in range(2000)
        ]
        assert sent[0] == pytest.approx(0.9 * TARGET_AT_REST * 0.1, rel=5e-3)
        assert sent[-1] == pytest.approx(left * 0.9 * TARGET_AT_REST * 0.1, rel=1e-3)
