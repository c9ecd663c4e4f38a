"""How much delay a coupling's proof covers: the row of docs/theory.md 2.11, and the whole-tick test."""

import math

import numpy as np
import pytest

from rtctl.control.proofs.delay_cover import MOST_TICKS, delay_covered_ticks
from rtctl.control.proofs.stability import Between, damping_needed_between, damping_needed_sampled_data

T = 1e-3


@pytest.mark.parametrize(
    ("delta", "k_max"),
    [(0, 80), (0.1, 88.9), (0.25, 72.7), (0.5, 54.6), (0.75, 44.3), (1, 37.48), (1.5, 26.8), (2, 21.46)],
)
def test_the_table_of_greatest_stiffnesses_is_met(delta, k_max):
    assert damping_needed_sampled_data(0.997 * k_max, 0.01, T, delta) <= 0.05
    assert damping_needed_sampled_data(1.005 * k_max, 0.01, T, delta) > 0.05


def by_the_disc(k_c, b_c, delta, theta):
    """The damping needed, from every impedance of coupling and world at half angles (docs/theory.md 2.4):
    the delay mixes its two whole neighbours, and no sum over aliases is made.
    """
    K, k = k_c * T / 2, math.floor(delta)
    B, f = b_c + K, delta - k
    x = np.exp(-2j * theta * (1 + k)) * (1 - f + f * np.exp(-2j * theta))
    around = 1 + np.exp(1j * np.linspace(-np.pi, np.pi, 256, endpoint=False))
    Z = ((B * B + (K / np.tan(theta)) ** 2) / (2 * B))[:, None] * around
    y = Z * x[:, None]
    return np.max(np.sqrt(np.maximum(np.abs(Z) ** 2 - y.imag**2, 0.0)) - y.real) / 2


@pytest.mark.parametrize("declared", [0.0, 1.0, 7.0])
@pytest.mark.parametrize(("k_c", "b_c"), [(30.0, 0.01), (0.35, 0.0), (0.15, 0.003)])
def test_the_delay_covered_is_covered_at_every_frequency(k_c, b_c, declared):
    """At 20 ticks a sweep of 384 frequencies asked 2 % too little."""
    covered = delay_covered_ticks(0.05, k_c, b_c, T, declared)
    needed = by_the_disc(k_c, b_c, covered, np.geomspace(1e-4, np.pi / 2, 3000))
    if declared < covered < MOST_TICKS:
        assert 0.997 * 0.05 <= needed <= 0.05
    assert needed <= 0.05 or covered == declared


def lagged(k_c, b_c, lag_s, aliases=200):
    """The damping needed with a first-order lag and no delay, from the sums over the aliases themselves."""
    theta = np.linspace(0, np.pi / 2, 201)[1:]
    S0, S1, S2 = (T / 2) ** 2 / np.sin(theta) ** 2, 0, 0
    for n in range(-aliases, aliases + 1):
        w = 2 * theta / T + 2 * np.pi * n / T
        A = 1 / (1 + 1j * w * lag_s)
        S1, S2 = S1 + A / w**2, S2 + np.abs(A) ** 2 / w**2
    law = -((1 - np.exp(-2j * theta)) ** 2) / T**2
    K, B = k_c * T / 2, b_c + k_c * T / 2
    around = 1 + np.exp(1j * np.linspace(-np.pi, np.pi, 64, endpoint=False))
    Z = ((B * B + (K / np.tan(theta)) ** 2) / (2 * B))[:, None] * around
    a = Z * (law * S1)[:, None]
    most = np.abs(Z) ** 2 * (np.abs(law) ** 2 * S0 * S2)[:, None]
    return np.max(np.sqrt(np.maximum(most - a.imag**2, 0)) - a.real) / 2


@pytest.mark.parametrize("lag_ticks", [0.03, 0.1, 0.318, 0.796, 1.0, 2.0, 6.0])
@pytest.mark.parametrize(("k_c", "b_c"), [(40.0, 0.01), (80.0, 0.001), (10.0, 0.04)])
def test_a_lag_asks_no_more_than_as_much_delay(lag_ticks, k_c, b_c):
    assert damping_needed_sampled_data(k_c, b_c, T, lag_ticks) >= 0.975 * lagged(k_c, b_c, lag_ticks * T)


def test_the_delay_covered_is_the_largest_that_passes():
    for k_c in (20.0, 37.0, 60.0, 79.0):
        covered = delay_covered_ticks(0.05, k_c, 0.01, T, 0.0)
        assert (
            damping_needed_sampled_data(k_c, 0.01, T, covered)
            <= 0.05
            < damping_needed_sampled_data(k_c, 0.01, T, covered + 0.01)
        )
    assert delay_covered_ticks(0.05, 37.48, 0.01, T, 1.0) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(("k_c", "b_c", "n", "delay"), [(11.7, 0.01, 2, 2.59), (7.4, 0.01, 3, 3.75)])
def test_of_a_sample_that_is_held_no_more_is_covered_than_its_own_proof_covers(k_c, b_c, n, delay):
    covered = delay_covered_ticks(0.05, k_c, b_c, T, 0.0, n)
    assert covered - (n - 1) == pytest.approx(delay, abs=0.02)
    held = [Between(delay=covered - (n - 1) + more, sample_ticks=n) for more in (0.0, 0.01)]
    asked = [damping_needed_between(k_c, b_c, T, between) for between in held]
    assert asked[0] <= 0.05 < asked[1]
    assert covered < delay_covered_ticks(0.05, k_c, b_c, T, 0.0) - 0.1, "as a delay it would be covered"
    assert delay_covered_ticks(math.nan, k_c, b_c, T, 1.5, n) == 1.5


def test_never_less_than_declared_never_beyond_what_is_looked_at():
    assert delay_covered_ticks(0.05, 200.0, 0.01, T, 2.0) == 2.0, "not proven at all: another test refuses it"
    assert delay_covered_ticks(math.nan, 20.0, 0.01, T, 1.5) == 1.5
    assert delay_covered_ticks(0.05, 0.0, 0.0, T, 0.0) == MOST_TICKS
    assert delay_covered_ticks(0.05, 0.001, 0.0, T, 3.0) == MOST_TICKS
