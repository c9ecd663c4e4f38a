"""Gain and offset of the current as motion shows them: bounds, confidence, two windows in a row."""

import numpy as np
import pytest
from test_running_delay import LIMIT, Motor, motion, shown

from rtctl.control.vocabulary import Fault

WINDOW = 1000


def judged(sent, measured, **params):
    motor = Motor(proof_ticks=9.0, **params)
    at = motor.run(sent, measured)
    return motor, at


@pytest.mark.parametrize("delay", [0, 3])
@pytest.mark.parametrize(
    ("gain", "off"), [(0.6, True), (0.72, False), (1.0, False), (1.28, False), (1.5, True)]
)
def test_a_gain_has_both_bounds_and_is_judged_in_the_second_window(gain, off, delay):
    sent = motion(4000)
    motor, at = judged(sent, shown(sent, delay, gain, noise=0.005))
    assert at == (2 * WINDOW if off else -1)
    assert motor.fault == (Fault.CURRENT if off else 0)
    assert motor.state["running_gain"][0, 0] == pytest.approx(gain, abs=0.02)


@pytest.mark.parametrize(("share", "off"), [(-0.15, True), (-0.09, False), (0.09, False), (0.15, True)])
@pytest.mark.parametrize("hz", [1.5, 0.0])
def test_so_has_an_offset_also_where_no_torque_tells_it_from_a_gain(share, off, hz):
    sent = motion(4000, hz=hz) if hz else np.zeros(4000)
    _, at = judged(sent, sent + share * LIMIT)
    assert (at == 2 * WINDOW) is off
    assert (at == -1) is not off


def test_what_a_steady_torque_leaves_open_is_not_claimed():
    sent = np.full(4000, 0.5)
    most = 0.3 * 0.5 + 0.1 * LIMIT
    assert judged(sent, sent - 0.98 * most)[1] == -1, "gain and offset may both be within their bounds"
    assert judged(sent, sent - 1.02 * most)[1] == 2 * WINDOW


def test_one_window_that_is_off_is_none():
    sent = motion(5000)
    measured = shown(sent, 0)
    measured[1000:2000] *= 0.5
    assert judged(sent, measured)[1] == -1


def test_noise_is_no_gain():
    for seed in range(5):
        sent = motion(6000, amplitude=0.02, seed=seed)
        assert judged(sent, shown(sent, 1, noise=0.05, seed=seed))[1] == -1


def test_where_no_proof_bounds_a_delay_the_current_is_watched_all_the_same():
    sent = motion(4000)
    motor = Motor(proof_ticks=0.0)
    assert motor.run(sent, shown(sent, 0, 0.5)) == 2 * WINDOW
    assert not motor.known
