"""A hand that moves a helped joint pays for some of its friction, and the observer feeds no vibration; what
is not so loses its help (control.paying, control.feeding).
"""

import math

import numpy as np
import pytest
from law_rig import LEVER, B, J, LawRig, T, of_rows

from rtctl.control.feeding import BANK_RAD as FED_RAD
from rtctl.control.feeding import TURN_S, unfed_share
from rtctl.control.paying import BANK_RAD, LEAST, OWED_BANKS, paid_share
from rtctl.control.resting import REST_HZ
from rtctl.control.velocity import lowpass_alpha
from rtctl.control.vocabulary import Display, Policy, State

PAID, UNFED = of_rows(paid_share), of_rows(unfed_share)
F = 0.2


class Joint:
    """One that goes where the test says in `times`, s, while the hand, the friction and the observer do what
    it says.
    """

    def __init__(self, **state):
        self.rig = LawRig(paying_nm=F, rest_alpha=lowpass_alpha(REST_HZ, T))
        self.rig.state["state"] = int(State.INIT)
        PAID(self.rig.now, self.rig.state, self.rig.params, 0, 1)
        UNFED(self.rig.state, self.rig.params, 0, 1)
        self.rig.state["state"] = int(State.ACTIVE)
        for name, value in state.items():
            self.rig.state[name] = value

    def paid(self, position, hand, friction=F, every=1):
        """The shares left; `hand` and `friction` N m, functions of the tick's number between two samples."""
        state, shares = self.rig.state, []
        for k in range(1, len(position)):
            fresh = k % every == 0
            if fresh:
                state["position_before_rad"], state["position_rad"] = position[k - every], position[k]
                state["hand_torque_before_nm"] = hand[k - every]
                state["friction_credit_j"] = friction * abs(position[k] - position[k - every])
            shares.append(PAID(self.rig.now, state, self.rig.params, 0, every if fresh else 0))
        return np.array(shares)

    def fed(self, speed, observer, side=1.0):
        """The shares left of the observer at these speeds, rad/s, and torques of it, N m."""
        state, shares = self.rig.state, []
        state["bristle_share"] = side
        for v, torque in zip(speed, observer, strict=True):
            state["position_before_rad"], state["position_rad"] = 0.0, v * T
            state["fed_sent_nm"] = torque
            state["rest_ticks"] = 0 if v else state["rest_ticks"] + 1
            shares.append(UNFED(state, self.rig.params, 0, 1))
            state["ticks"] += 1
        return np.array(shares)


def swung(hz, speed, seconds):
    time = T * np.arange(round(seconds / T))
    return speed / (2 * math.pi * hz) * (1.0 - np.cos(2 * math.pi * hz * time))


def torque_of(position, friction_left):
    """What a hand has to do so that the joint goes there: its inertia, and what is left of the friction."""
    acceleration = np.zeros_like(position)
    acceleration[1:-1] = (position[2:] - 2 * position[1:-1] + position[:-2]) / T**2
    return J * acceleration + friction_left * np.sign(np.gradient(position))


@pytest.mark.parametrize(("hz", "speed"), [(0.5, 0.9), (4.8, 0.25), (0.1, 0.03)])
@pytest.mark.parametrize("every", [1, 3])
def test_who_pays_for_some_of_the_friction_is_helped_whole_whatever_the_inertia_lends(hz, speed, every):
    position = swung(hz, speed, 3.0 / hz)
    assert np.all(Joint().paid(position, torque_of(position, 2 * LEAST * F), every=every) > 0.98)


def test_a_swing_that_nobody_feeds_loses_its_help():
    position = swung(4.8, 0.25, 4.0)
    shares = Joint().paid(position, torque_of(position, 0.0))
    assert shares[0] == 1.0
    assert shares[-1] < 0.02


def test_help_does_not_come_and_go_in_step_with_a_ring_whose_inertia_is_another_than_was_said():
    position = swung(14.4, 1.0, 3.0)
    joint = Joint()
    joint.rig.params["inertia_kgm2"] = 1.5 * J
    shares = joint.paid(position, torque_of(position, 0.02))[-140:]
    assert shares.min() > 0.1
    assert np.ptp(shares) < 0.1


def test_help_is_back_as_soon_as_somebody_pays_and_the_debt_has_a_bound():
    position = swung(1.0, 0.5, 20.0)
    joint = Joint()
    assert joint.paid(position, torque_of(position, -0.5 * F))[-1] < 0.01
    assert float(joint.rig.state["paid_j"][0, 0]) == pytest.approx(-OWED_BANKS * F * BANK_RAD)
    assert joint.paid(position[:2000], torque_of(position, F)[:2000])[-1] > 0.95


def test_torque_of_a_world_that_moves_the_joint_is_paid_for():
    joint = Joint(paid_push_nm=0.5 * F)
    joint.rig.now["coupling_torque_nm"] = 0.5 * F
    assert np.all(joint.paid(0.3 * T * np.arange(1000), np.zeros(1000))[1:] > 0.9)


@pytest.mark.parametrize("share", [PAID, UNFED])
def test_a_virtual_mass_and_a_joint_without_power_have_full_accounts(share):
    for name, value in (("display_kind", int(Display.ADMITTANCE)), ("state", int(State.INIT))):
        joint = Joint(**{"paid_j": -1.0, "fed_j": -1.0, name: value})
        left = (joint.rig.now, joint.rig.state, joint.rig.params, 0, 1)[0 if share is PAID else 1 :]
        assert share(*left) == 1.0
        assert float(joint.rig.state["paid_j" if share is PAID else "fed_j"][0, 0]) > 0.0


def test_what_is_no_number_leaves_an_empty_account():
    joint = Joint()
    joint.paid(np.array([0.0, math.nan]), np.zeros(2))
    assert joint.rig.state["paid_j"][0, 0] == 0.0
    assert np.isfinite(joint.fed(np.array([0.1, math.nan, 0.1]), np.zeros(3))).all()


def ring(hz, seconds, mean=0.1, amplitude=0.05):
    phase = 2 * math.pi * hz * T * np.arange(round(seconds / T))
    return mean + amplitude * np.sin(phase), np.sin(phase)


@pytest.mark.parametrize("hz", [8.0, 30.0, 100.0])
def test_an_observer_that_takes_more_than_the_damping_of_a_joint_from_a_ring_is_taken_back(hz):
    speed, phase = ring(hz, 2.0)
    assert np.all(Joint().fed(speed, F + 0.5 * B * 0.05 * phase) > 0.99)
    shares = Joint().fed(speed, F + 40.0 * B * 0.05 * phase)
    assert np.all(shares[: round(TURN_S / T)] == 1.0)
    assert shares[-1] < 0.2


def test_an_observer_that_damps_a_ring_and_one_in_a_turn_are_left_alone():
    speed, phase = ring(10.0, 2.0)
    assert np.all(Joint().fed(speed, F - 40.0 * B * 0.05 * phase) == 1.0)
    assert np.all(Joint().fed(speed, F + 40.0 * B * 0.05 * phase, side=0.5) == 1.0)


def test_a_joint_that_stands_as_its_hand_turns_back_is_fed_nothing_by_what_low_passes_remember():
    time = T * np.arange(1000)
    speed = np.where(time < 0.5, np.minimum(0.6, 3.0 * (0.5 - time)), 0.0)
    # on a joint that holds without bending friction turns with the hand's push before the joint does
    observer = F * np.where(time < 0.5, 1.0, np.maximum(1.0 - (time - 0.5) / 0.08, -1.0))
    joint = Joint()
    assert np.all(joint.fed(speed, observer) == 1.0)
    assert np.all(joint.fed(np.full(5, -0.1), np.full(5, -F), side=-1.0) == 1.0)


@pytest.mark.parametrize(("hz", "slips"), [(4.0, 0.2), (30.0, 0.5)])
def test_an_observer_that_pushes_a_joint_on_at_each_slip_is_taken_back(hz, slips):
    phase = np.mod(hz * T * np.arange(4000), 1.0)
    speed = np.where(phase < slips, 0.4 * np.sin(math.pi * phase / slips), 0.0)
    assert Joint().fed(speed, F * (0.6 + speed))[-200:].mean() < 0.5


def test_what_was_fed_is_forgotten_within_seconds():
    joint = Joint(fed_j=-F * FED_RAD)
    shares = joint.fed(np.zeros(6000), np.zeros(6000))
    assert shares[0] < 0.01
    assert shares[-1] > 0.9


def test_the_law_sends_as_much_as_both_leave():
    rig = LawRig(
        friction_policy=int(Policy.HYBRID), observer_gain=0.9, observer_alpha=0.1, observer_smooth_alpha=0.3
    )
    rig.friction().arm()
    rig.force_n[1] = 0.3 / LEVER
    sent = {}
    for owed in ("nothing", "paid_j", "fed_j"):
        for _ in range(400):
            rig.tick(rig.position + 0.5 * T)
        rig.params["paying_nm"], rig.state["paid_j"], rig.state["fed_j"] = F, F * BANK_RAD, F * FED_RAD
        rig.state["paid_left"] = 1.0
        if owed != "nothing":
            rig.state[owed], rig.state["paid_left"] = -1.0, 0.0 if owed == "paid_j" else 1.0
        rig.tick(rig.position + 0.5 * T)
        sent[owed] = rig["feedforward_torque_nm"], rig["observer_torque_nm"]
    assert min(map(abs, sent["nothing"])) > 0.01
    assert sent["paid_j"] == (0.0, 0.0)
    assert abs(sent["fed_j"][0]) > 0.01
    assert sent["fed_j"][1] == 0.0
