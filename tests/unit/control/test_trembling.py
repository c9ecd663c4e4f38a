"""A joint that goes on turning back more often than a hand can gets no help with friction until a hand moves
it on.
"""

import math

import numpy as np
import pytest
from law_rig import COUNT, LEVER, LawRig, T, of_rows

from rtctl.control.trembling import FORGETTING, GONE_S, MOST_S, ON_RAD, ON_S, TURN_COUNTS, calm_share
from rtctl.control.vocabulary import Display, Policy, State

CALM = of_rows(calm_share)


class Joint:
    """One that is put where the test says, tick by tick."""

    def __init__(self, **state):
        self.rig = LawRig()
        self.rig.state["state"] = int(State.ACTIVE)
        for name, value in state.items():
            self.rig.state[name] = value

    def at(self, positions):
        """The shares of the help that are left, in ticks at these positions."""
        shares = []
        for position in positions:
            self.rig.state["position_rad"] = position
            shares.append(CALM(self.rig.state, self.rig.params, 0))
        return np.array(shares)

    def shaken(self, hz, seconds, amplitude=20 * COUNT):
        return self.at(amplitude * np.sin(2 * np.pi * hz * T * np.arange(round(seconds / T))))


@pytest.mark.parametrize("hz", [9.0, 16.0, 60.0, 150.0])
def test_a_joint_that_shakes_loses_its_help_within_a_second(hz):
    shares = Joint().shaken(hz, 1.0)
    assert shares[0] == 1.0
    assert shares[-1] == 0.0
    assert np.all(np.diff(shares) <= 0.0)


@pytest.mark.parametrize("hz", [0.5, 3.0, 7.5])
def test_a_hand_that_moves_to_and_fro_is_helped_whole(hz):
    assert np.all(Joint().shaken(hz, 2.5, amplitude=0.1) == 1.0)


def test_a_hand_that_rings_on_its_grip_as_the_joint_stops_is_helped_whole():
    joint = Joint()
    for _ in range(4):
        assert np.all(joint.shaken(36.0, 0.2) == 1.0)
        assert np.all(joint.at(np.linspace(0.0, 0.3, 800)) == 1.0)


def test_an_encoder_that_flickers_between_counts_turns_nothing():
    assert np.all(Joint().shaken(100.0, 2.0, amplitude=0.5 * TURN_COUNTS * COUNT) == 1.0)


def test_help_does_not_come_back_at_rest_or_in_a_creep_but_when_a_hand_moves_the_joint_on():
    joint = Joint()
    joint.shaken(60.0, 2.0)
    assert np.all(joint.at(np.zeros(3000)) == 0.0)
    assert np.all(joint.at(np.linspace(0.0, 0.9 * ON_RAD, 3000)) == 0.0)
    shares = joint.at(np.linspace(0.9 * ON_RAD, 0.5, round(MOST_S / FORGETTING / T)))
    assert shares[-1] == 1.0
    assert shares[0] == 0.0
    assert np.diff(shares).max() < 2.5 * T, "at once it is a push that shakes the hand again"


def test_what_is_remembered_has_a_bound():
    joint = Joint()
    joint.shaken(60.0, 3.0)
    assert joint.rig.state["trembled_s"][0, 0] == pytest.approx(MOST_S)
    assert MOST_S > GONE_S


def test_the_joint_of_a_virtual_mass_has_another_watch():
    assert np.all(Joint(display_kind=int(Display.ADMITTANCE)).shaken(60.0, 1.0) == 1.0)


def test_a_position_that_is_no_number_turns_nothing():
    joint = Joint()
    assert np.all(joint.at([math.nan] * 10) == 1.0)
    assert np.all(np.isfinite(joint.shaken(60.0, 0.5)))


def test_what_shook_a_joint_without_power_is_forgotten():
    joint = Joint(state=int(State.INIT))
    assert np.all(joint.shaken(60.0, 1.0) == 1.0)
    assert joint.rig.state["trembled_s"][0, 0] == 0.0


def test_the_law_sends_no_help_to_a_joint_that_trembled_until_it_is_moved_on():
    rig = LawRig(friction_policy=int(Policy.HYBRID)).friction().arm()
    rig.state["trembled_s"], rig.state["turn_s"] = MOST_S, 0.0
    rig.state["turn_rad"] = rig.state["turn_from_rad"] = rig.position
    rig.force_n[1] = 0.1 / LEVER
    helped = []
    for _ in range(round((ON_S + MOST_S / FORGETTING) / T)):
        rig.tick(rig.position + 0.5 * T)
        helped.append(rig["feedforward_torque_nm"])
    assert helped[: round(ON_S / T)] == [0.0] * round(ON_S / T)
    assert helped[-1] == pytest.approx(0.225, rel=1e-2)
