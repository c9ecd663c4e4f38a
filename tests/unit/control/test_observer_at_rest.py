"""What of the friction observer's torque is sent while the joint rests, and beside a virtual mass."""

import math

import pytest
from law_rig import LawRig, T

from rtctl.control.disturbance_observer import _beside_a_mass, _turning
from rtctl.control.velocity import lowpass_alpha
from rtctl.control.vocabulary import Display


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
