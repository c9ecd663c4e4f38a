"""A current loop of second order against the later and stronger one of first order that it is judged as."""

import math

import numpy as np
import pytest

from rtctl.control.proofs.overshoot import damping_ratio, later_s, peak_gain
from rtctl.control.proofs.stability import Between, damping_needed_between

THETA = np.linspace(1e-3, np.pi / 2, 400)


def answer(share, bandwidth, w):
    """Second-order loop of this overshoot and bandwidth (-3 dB), rad a tick, at the frequencies w."""
    z = damping_ratio(share)
    own = bandwidth / math.sqrt(1 - 2 * z * z + math.sqrt((1 - 2 * z * z) ** 2 + 1))
    return 1 / (1 - (w / own) ** 2 + 2j * z * w / own)


def needed(share, bandwidth, delay, k_c, b_c):
    """Damping that the loop asks for, by sums over its aliases (docs/theory.md 2.4), of a period of 1."""
    w = 2 * THETA + 2 * np.pi * np.arange(-60, 61)[:, None]
    A = answer(share, bandwidth, w)
    S0 = 0.25 / np.sin(THETA) ** 2
    S1, S2 = (A * np.exp(-1j * w * delay) / w**2).sum(0), (abs(A) ** 2 / w**2).sum(0)
    W = np.sqrt(S2 / S0) + ((1 - np.exp(-2j * THETA)) ** 2 * S1).real
    K, B = k_c / 2, b_c + k_c / 2
    return np.max(W * (B**2 + (K / np.tan(THETA)) ** 2)) / (2 * B)


def judged(share, bandwidth, delay, k_c, b_c):
    gain, hz = peak_gain(share), bandwidth / (2 * math.pi)
    late = Between(delay + later_s(share, hz), hz)
    return damping_needed_between(gain * k_c, gain * b_c, 1.0, late)


@pytest.mark.parametrize(
    ("share", "bandwidth", "delay", "k_c", "b_c"),
    [
        (0.0432, 0.7, 1.6, 1.0, 0.0),
        (0.095, 1.5, 1.6, 0.2, 1.0),
        (0.254, 0.7, 0.3, 1.0, 0.1),
        (0.35, 0.7, 0.3, 1.0, 0.0),
        (0.35, 3.0, 1.0, 0.1, 1.0),
    ],
)
def test_a_loop_that_overshoots_needs_no_more_than_what_it_is_judged_as(share, bandwidth, delay, k_c, b_c):
    most = judged(share, bandwidth, delay, k_c, b_c)
    found = needed(share, bandwidth, delay, k_c, b_c)
    assert found <= most * (1 + 1e-4)
    # and more than the first-order loop of its bandwidth, so that the overshoot must be said
    assert found > damping_needed_between(k_c, b_c, 1.0, Between(delay, bandwidth / (2 * math.pi)))


@pytest.mark.parametrize("share", [0.01, 0.05, 0.16, 0.35])
def test_overshoot_and_gain_are_those_of_the_loop(share):
    z = damping_ratio(share)
    # the step's first peak is half a period of the damped vibration after it
    assert math.exp(-math.pi * z / math.sqrt(1 - z * z)) == pytest.approx(share)
    largest = np.max(abs(answer(share, 1.0, np.linspace(1e-3, 3, 3000))))
    assert peak_gain(share) == pytest.approx(max(largest, 1.0), rel=1e-5)


def test_without_an_overshoot_or_a_lag_nothing_is_later():
    assert (peak_gain(0.0), later_s(0.0, 100.0), later_s(0.1, 0.0)) == (1.0, 0.0, 0.0)
