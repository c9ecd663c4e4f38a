"""Margins of the two-port: the oracle table, the closed forms against a sweep, and poles of real loops."""

import math

import numpy as np
import pytest
from oracles import admittance_mass_min
from scipy.linalg import expm

from rtctl.control.proofs.stability import (
    Between,
    coupling_ring,
    damping_needed_adams_hannaford,
    damping_needed_sampled_data,
    felt_stiffness,
    k_max_adams_hannaford,
    k_max_sampled_data,
    margin_adams_hannaford,
    margin_sampled_data,
    recommended_coupling,
)

T = 1e-3

# b, b_c, k_max: sampled data without delay, with one tick, Adams-Hannaford (docs/theory.md 2.11)
ORACLES = [
    (0.05, 0.0, 100, 25, 400),
    (0.05, 0.005, 90, 32.6556, 409.7618),
    (0.05, 0.01, 80, 37.4815, 419.0890),
    (0.05, 0.02, 60, 36.9455, 436.6432),
    (0.05, 0.03, 40, 29.2562, 452.4510),
    (0.05, 0.04, 20, 16.9449, 462.0293),
    (0.1, 0.0, 200, 50, 800),
    (0.1, 0.02, 160, 74.9630, 838.1780),
    (0.1, 0.05, 100, 67.5131, 889.8979),
]


@pytest.mark.parametrize(("b", "b_c", "exact", "delayed", "paper"), ORACLES)
def test_largest_stiffness_equals_the_oracle_table(b, b_c, exact, delayed, paper):
    assert k_max_sampled_data(b, b_c, T, 0) == pytest.approx(exact, abs=1e-9)
    assert k_max_sampled_data(b, b_c, T, 1) == pytest.approx(delayed, abs=6e-5)
    assert k_max_adams_hannaford(b, b_c, T) == pytest.approx(paper, abs=6e-5)


@pytest.mark.parametrize(("b_c", "paper"), [(0.10, 450.4456), (0.25, 266.6591), (0.35, 96.0995)])
def test_adams_hannaford_interior_branch_equals_the_oracles(b_c, paper):
    assert k_max_adams_hannaford(0.05, b_c, T) == pytest.approx(paper, abs=6e-5)


def test_limits_of_the_adams_hannaford_test_are_eight_times_the_damping():
    assert k_max_adams_hannaford(0.05, 0.0, T) == pytest.approx(8 * 0.05 / T)
    assert margin_adams_hannaford(0.05, 0.0, 8 * 0.05, T) == pytest.approx(0, abs=1e-15)


@pytest.mark.parametrize("d", [0, 1, 2, 3, 7, 20])
def test_the_largest_stiffness_passes_and_a_little_more_does_not(d):
    k = k_max_sampled_data(0.05, 0.01, T, d)
    assert margin_sampled_data(0.05, k * (1 - 1e-9), 0.01, T, d) >= 0
    assert margin_sampled_data(0.05, k * (1 + 1e-6), 0.01, T, d) < 0


@pytest.mark.parametrize("d", [2, 3, 8])
def test_without_coupling_damping_the_delayed_bound_is_the_known_closed_form(d):
    # sin^2(n theta)/sin^2(theta) is largest, n^2, at theta -> 0: k_c <= 2 b / (T (1+d)^2)
    assert k_max_sampled_data(0.05, 0.0, T, d) == pytest.approx(2 * 0.05 / (T * (1 + d) ** 2), rel=1e-5)


@pytest.mark.parametrize("d", [0, 1, 3])
def test_a_coupling_damper_alone_may_be_as_large_as_the_devices_damping(d):
    assert damping_needed_sampled_data(0.0, 0.03, T, d) == pytest.approx(0.03, rel=1e-5)


def test_no_coupling_needs_no_damping():
    assert margin_sampled_data(0.0, 0.0, 0.0, T, 1) == 0.0
    assert margin_adams_hannaford(0.0, 0.0, 0.0, T) == 0.0


def test_no_stiffness_passes_when_the_coupling_damps_more_than_the_device():
    assert k_max_sampled_data(0.05, 0.06, T) == 0.0
    assert k_max_sampled_data(-0.01, 0.0, T, 1) == 0.0
    assert k_max_adams_hannaford(-0.01, 0.0, T) == 0.0


@pytest.mark.parametrize("d", [0, 1, 2])
def test_nan_damping_passes_no_test(d):
    assert not margin_sampled_data(math.nan, 10, 0.01, T, d) >= 0
    assert not margin_adams_hannaford(math.nan, 10, 0.01, T) >= 0
    assert k_max_sampled_data(math.nan, 0.01, T, d) == 0.0
    assert k_max_adams_hannaford(math.nan, 0.01, T) == 0.0
    assert recommended_coupling(math.nan, T, d) == (0.0, 0.0)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -1.0])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_coupling_or_period_that_is_no_number_is_refused(bad, place):
    arguments = [10.0, 0.01, T]
    arguments[place] = bad
    for needed in (damping_needed_sampled_data, damping_needed_adams_hannaford):
        with pytest.raises(ValueError, match=("k_c", "b_c", "T")[place]):
            needed(*arguments)


def test_a_negative_delay_is_refused():
    with pytest.raises(ValueError, match="d must be finite and not negative"):
        damping_needed_sampled_data(10, 0.01, T, -1)


@pytest.mark.parametrize("d", [0, 1, 2, 4])
def test_the_recommended_coupling_leaves_the_wanted_share_of_damping(d):
    k_c, b_c = recommended_coupling(0.05, T, Between(d), share=0.7, damping_share=0.2)
    assert b_c == pytest.approx(0.2 * 0.7 * 0.05)
    assert margin_sampled_data(0.05, k_c, b_c, T, d) == pytest.approx(0.3 * 0.05, rel=1e-6)
    if d == 0:
        assert k_c == pytest.approx(2 * 0.8 * 0.7 * 0.05 / T)


def test_felt_stiffness_is_the_series_of_coupling_and_environment():
    assert felt_stiffness(60.0, 30.0) == pytest.approx(20.0)
    assert felt_stiffness(0.0, 30.0) == 0.0
    assert felt_stiffness(60.0, 0.0) == 0.0


def test_the_ring_is_that_of_a_mass_on_the_coupling():
    assert coupling_ring(0.012, 0.05, 48.0, 0.01) == pytest.approx((63.2456, 0.0395285), rel=1e-5)
    assert coupling_ring(0.012, 0.05, 0.0, 0.0) == (0.0, math.inf)


@pytest.mark.parametrize(
    ("K_v", "b_a", "m_a"),
    [
        (0.5, 0.0, 0.124525),
        (0.5, 0.05, 0.069415),
        (0.5, 0.2, 0.041660),
        (2.0, 0.0, 0.040369),
        (2.0, 0.05, 0.031180),
        (2.0, 0.2, 0.024609),
        (5.0, 0.0, 0.020682),
        (5.0, 0.05, 0.018240),
        (5.0, 0.2, 0.016258),
    ],
)
def test_least_admittance_mass_equals_the_oracles(K_v, b_a, m_a):
    assert admittance_mass_min(0.012, 0.05, K_v, T, b_a) == pytest.approx(m_a, abs=1.1e-6)


# ---- independent check: poles of the closed loop (docs/theory.md 2.11) -----------------------------
def _spectral_radius(k_c: float, b_c: float, b: float, modes: int, mass: float) -> float:
    """Device damping b, a lossless hand resonant at the first odd multiples of Nyquist, a rigid wall.

    Exact zero-order hold of the continuous part; u = -(k_c x_k + b_c (x_k - x_{k-1})/T).
    """
    w2 = ((2 * np.arange(modes) + 1) * np.pi / T) ** 2
    n = 2 * modes
    A, Bu = np.zeros((n, n)), np.zeros((n, 1))
    for i in range(modes):
        A[2 * i, 2 * i + 1] = 1
        A[2 * i + 1, 2 * i] = -w2[i]
        A[2 * i + 1, 1::2] -= b / mass
        Bu[2 * i + 1, 0] = 1 / mass
    # balance position against velocity, or the exponential loses its digits
    scale = np.ones(n)
    scale[0::2] = np.pi / T
    A = A * scale[:, None] / scale[None, :]
    Bu = Bu * scale[:, None]
    C = np.zeros((1, n))
    C[0, 0::2] = T / np.pi
    big = expm(np.block([[A, Bu], [np.zeros((1, n + 1))]]) * T)
    Ad, Bd = big[:n, :n], big[:n, n:]
    closed = np.block([[Ad - Bd @ C * (k_c + b_c / T), Bd * b_c / T], [C, np.zeros((1, 1))]])
    return float(np.abs(np.linalg.eigvals(closed)).max())


@pytest.mark.parametrize(
    ("modes", "expected"), [(1, 103.3701), (2, 91.0330), (3, 87.1748), (4, 85.3077), (5, 84.2096)]
)
def test_poles_leave_the_circle_where_theory_says_and_never_below_the_bound(modes, expected):
    b, b_c, low, high = 0.05, 0.01, 60.0, 140.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        if _spectral_radius(middle, b_c, b, modes, mass=0.1) > 1:
            high = middle
        else:
            low = middle
    s_n = 8 / np.pi**2 * sum(1 / (2 * n - 1) ** 2 for n in range(1, modes + 1))
    assert (2 * b / T) / s_n - 2 * b_c / T == pytest.approx(expected, abs=6e-5)
    assert low == pytest.approx(expected, rel=2e-3)
    assert low > k_max_sampled_data(b, b_c, T)
