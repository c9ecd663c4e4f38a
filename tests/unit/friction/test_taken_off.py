"""Friction that a drive has taken off the torque already, told by the turns; and friction as a share of two
recorded torques.
"""

import re
from dataclasses import replace

import numpy as np
import pytest

from rtctl.friction.logs.bristle_columns import lugre_bristle
from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.other_readings import doubts
from rtctl.friction.logs.regression import joint_fit
from rtctl.friction.logs.regressors import regressors
from rtctl.friction.logs.taken_off import taken_off
from rtctl.friction.logs.two_shares import with_share_of_two

RATE_HZ = 500.0
INERTIA, VISCOUS, COULOMB = 0.02, 0.05, 0.2
NOISE_NM = 2e-3


def motion(brisk=1.0):
    """Time, position, velocity and acceleration of a few sines."""
    t = np.arange(0, 25, 1 / RATE_HZ)
    waves = [
        (0.5, 2 * np.pi * 0.31 * brisk, 0.1),
        (0.25, 2 * np.pi * 0.83 * brisk, 1.1),
        (0.12, 2 * np.pi * 1.9 * brisk, 2.0),
    ]
    x = sum(a * np.sin(w * t + p) for a, w, p in waves)
    v = sum(a * w * np.cos(w * t + p) for a, w, p in waves)
    return t, x, v, sum(-a * w**2 * np.sin(w * t + p) for a, w, p in waves)


def told_of(bristle_rad, off):
    t, x, v, a = motion()
    friction = COULOMB * (lugre_bristle(x, bristle_rad) if bristle_rad else np.sign(v))
    torque = INERTIA * a + VISCOUS * v + friction - off * COULOMB * np.sign(v)
    torque += np.random.default_rng(1).normal(0, NOISE_NM, len(t))
    return taken_off([AxisLog(RATE_HZ, x, torque, "log", "0" * 64)], 20.0, 0.03, "log")


@pytest.mark.parametrize("off", [0.5, 0.8])
def test_friction_that_is_taken_off_is_told_with_how_much(off):
    told, untold = told_of(0.01, off)
    found = re.search(r"log: (\S+) N m of the Coulomb friction.* would be (\S+) N m", told[0])
    assert float(found[1]) == pytest.approx(off * COULOMB, rel=0.1)
    assert float(found[2]) == pytest.approx(COULOMB, rel=0.05)
    assert untold == ()


def test_bristles_alone_are_no_compensation():
    assert told_of(0.01, 0.0) == ((), ())
    assert told_of(0.03, 0.1) == ((), ())


@pytest.mark.parametrize("off", [0.0, 0.8])
def test_what_turns_over_at_once_cannot_be_told_from_its_compensation(off):
    told, untold = told_of(0.0, off)
    assert told == ()
    assert "taken off the torque already" in untold[0]


def of_two(motor_share, hand_share, servo):
    """Signals of a joint that a hand moves and a motor, by `servo` of its damping, and the hand's torque on
    their rows.
    """
    t, x, v, a = motion(brisk=1.6)
    wanted = INERTIA * a + VISCOUS * v + COULOMB * np.sign(v)
    motor = servo(t, v)
    s, hand = np.sign(v), wanted - motor
    for _ in range(60):  # the hand gives what friction takes besides
        hand = wanted + s * (motor_share * np.abs(motor) + hand_share * np.abs(hand)) - motor
    noise = np.random.default_rng(2).normal(0, NOISE_NM, (2, len(t)))
    of_both = regressors(AxisLog(RATE_HZ, x, motor + hand + noise.sum(axis=0), "two", "0" * 64))
    of_hand = regressors(AxisLog(RATE_HZ, x, hand + noise[0], "two", "0" * 64))
    return of_both, of_hand.torque_nm


def pushing(t, _v):
    return 0.4 * np.sin(2 * np.pi * 0.7 * t + 0.4)


@pytest.mark.parametrize(
    ("of", "motor", "hand"), [("both torques", 0.2, 0.2), ("the motor torque", 0.25, 0.0)]
)
def test_a_share_of_two_torques_is_fitted(of, motor, hand):
    signals, external = of_two(motor, hand, pushing)
    shared, told, untold = with_share_of_two(signals, external)
    assert f"friction grows with {of}" in told[0]
    assert untold == ()
    found = joint_fit(shared).symmetric.parameters
    assert found["torque_share"].value == pytest.approx(max(motor, hand), abs=0.01)
    assert found["inertia_kgm2"].value == pytest.approx(INERTIA, rel=0.02)
    assert found["coulomb_nm"].value == pytest.approx(COULOMB, rel=0.03)


def test_two_torques_of_a_joint_without_a_gear_have_no_share():
    signals, external = of_two(0.0, 0.0, pushing)
    assert with_share_of_two(signals, external) == (signals, (), ())


def test_a_motor_that_only_brakes_tells_no_share_and_that_is_said():
    signals, external = of_two(0.0, 0.0, lambda _t, v: -0.1 * v)
    shared, told, untold = with_share_of_two(signals, external)
    assert (shared.share_nm, told) == (None, ())
    assert "is a share of" in untold[0]


def test_the_instant_of_a_motor_that_damps_is_a_doubt_of_the_inertia():
    """Half a period of a damping D is an inertia of half a period times D, and no balance tells them
    apart.
    """
    signals, external = of_two(0.0, 0.0, lambda _t, v: -0.3 * v)
    alone = doubts(signals)
    held_s = 2e-3
    beside = doubts(replace(signals, external_nm=external, held_s=held_s))
    assert beside[0] - alone[0] == pytest.approx(0.3 * held_s, rel=0.05)
