"""Closed forms against a frequency sweep, and real loops against the bound they promise."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from rtctl.control.proofs.stability import (
    damping_needed_adams_hannaford,
    damping_needed_sampled_data,
    k_max_adams_hannaford,
    k_max_sampled_data,
)

T = 1e-3
_THETA = np.linspace(0, np.pi / 2, 200_001)[1:]
_COSINE = np.linspace(0, 1, 200_001)


def _sweep_sampled_data(k_c, b_c, d):
    K, B = k_c * T / 2, b_c + k_c * T / 2
    return np.max(np.sin((1 + d) * _THETA) ** 2 * (B**2 + (K / np.tan(_THETA)) ** 2)) / B


stiffness = st.floats(0.1, 1000)
damping = st.floats(0, 1)


@settings(max_examples=60, deadline=None)
@given(k_c=stiffness, b_c=damping, d=st.integers(0, 1))
def test_sampled_data_closed_forms_equal_a_fine_sweep(k_c, b_c, d):
    assert np.isclose(
        damping_needed_sampled_data(k_c, b_c, T, d), _sweep_sampled_data(k_c, b_c, d), rtol=2e-6
    )


@settings(max_examples=30, deadline=None)
@given(k_c=stiffness, b_c=damping, d=st.integers(2, 20))
def test_the_swept_bound_is_never_below_a_finer_sweep(k_c, b_c, d):
    needed, fine = damping_needed_sampled_data(k_c, b_c, T, d), _sweep_sampled_data(k_c, b_c, d)
    assert fine <= needed <= 1.0001 * fine


@settings(max_examples=60, deadline=None)
@given(k_c=stiffness, b_c=damping)
def test_the_adams_hannaford_closed_form_equals_a_fine_sweep(k_c, b_c):
    K, B, c = k_c * T / 2, b_c + k_c * T / 2, _COSINE
    swept = np.max(B**2 * c * (1 - c) + K**2 * c**3 / (1 + c)) / (2 * B)
    assert np.isclose(damping_needed_adams_hannaford(k_c, b_c, T), swept, rtol=2e-6)


@settings(max_examples=60, deadline=None)
@given(b=st.floats(1e-3, 1), share=st.floats(0, 0.99), d=st.integers(0, 3))
def test_the_papers_test_never_asks_more_than_the_exact_one(b, share, d):
    b_c = share * b
    assert k_max_sampled_data(b, b_c, T, d) <= k_max_adams_hannaford(b, b_c, T) * (1 + 1e-9)


@settings(max_examples=60, deadline=None)
@given(b=st.floats(1e-3, 1), share=st.floats(0, 0.99), d=st.integers(0, 3))
def test_more_delay_never_allows_more_stiffness(b, share, d):
    b_c = share * b
    assert k_max_sampled_data(b, b_c, T, d + 1) <= k_max_sampled_data(b, b_c, T, d) * (1 + 1e-9)


@settings(max_examples=80, deadline=None)
@given(
    b=st.floats(0.01, 0.2),
    share=st.floats(0, 0.9),
    d=st.integers(0, 3),
    mass=st.floats(1e-4, 10),
    hand=st.floats(0, 1e5),
    world=st.one_of(st.just(np.inf), st.floats(0.01, 1e5)),
)
def test_a_loop_at_its_bound_is_stable_with_any_lossless_hand_and_spring_world(
    b, share, d, mass, hand, world
):
    b_c = share * b
    k_c = 0.999 * k_max_sampled_data(b, b_c, T, d)
    assert _radius(b, k_c, b_c, d, mass, hand, world) <= 1 + 1e-7


def _radius(b, k_c, b_c, d, mass, hand, world):
    """Largest pole of mass and hand spring under the coupling to a grounded spring of the virtual world.

    Coupling force f_k = k_c (x - w) + b_c (dx - dw)/T = world * w, solved for w; u = -f, d ticks late.
    """
    A = np.array([[0, 1, 0], [-hand / mass, -b / mass, 1 / mass], [0, 0, 0]])
    step = expm(A * T)
    r = b_c / T
    # w_k = ((k_c + r) x_k - r x_{k-1} + r w_{k-1}) / (k_c + r + world); a rigid world has w = 0
    gain = 0.0 if np.isinf(world) else 1 / (k_c + r + world)
    w = gain * np.array([k_c + r, 0, -r, r])  # of state x, v, x_{k-1}, w_{k-1}
    f = np.array([k_c + r, 0, -r, r]) - (k_c + r) * w
    n = 4 + d  # then the d torques still under way, oldest first
    M = np.zeros((n, n))
    force = np.zeros(n)
    force[:4] = -f
    applied = force if d == 0 else np.eye(n)[4]
    M[:2, :2] = step[:2, :2]
    M[:2] += np.outer(step[:2, 2], applied)
    M[2, 0] = 1
    M[3, :4] = w
    for i in range(d):
        M[4 + i] = force if i == d - 1 else np.eye(n)[5 + i]
    return np.abs(np.linalg.eigvals(M)).max()


def test_the_loop_check_itself_sees_instability():
    # just above the bound the worst hand of docs/theory.md 2.11, resonant at Nyquist, must leave the circle
    b, b_c, mass = 0.05, 0.01, 0.1
    hand = mass * (np.pi / T) ** 2
    assert _radius(b, 1.05 * 103.37, b_c, 0, mass, hand, np.inf) > 1 + 1e-6
