"""Dampings left by friction feed-forward and the two-line test, against the tables of docs/theory.md 5."""

import math

import numpy as np
import pytest
from oracles import runaway_speed, tanh_speed_min

from rtctl.control.compensation_limit import feedforward_limit
from rtctl.control.proofs.friction_passivity import (
    gain_max,
    secant_damping,
    slope_damping,
    two_line_margin,
)

V = np.linspace(0, 2, 20001)
F = 0.25 + 0.1 * np.exp(-((V / 0.1) ** 2)) + 0.05 * V
NONE = np.zeros_like(V)


@pytest.mark.parametrize(
    ("kappa", "kappa_v", "secant", "slope"),
    [
        (0.0, 0.0, 0.175, -0.8078),
        (0.8, 0.0, 0.075, -0.1216),
        (0.9, 0.0, 0.0625, -0.0358),
        (1.0, 0.0, 0.05, 0.05),
        (0.9, 0.9, 0.0175, -0.0808),
        (1.0, 1.0, 0.0, 0.0),
    ],
)
def test_effective_dampings_equal_the_oracle_table(kappa, kappa_v, secant, slope):
    ff = feedforward_limit(F, 0.05 * V, kappa, kappa_v, 1.0, math.inf)
    assert secant_damping(V, F, ff)[0] == pytest.approx(secant, abs=1e-9)
    assert slope_damping(V, F, ff) == pytest.approx(slope, abs=6e-5)


def test_the_worst_stribeck_slope_lies_at_the_speed_theory_gives():
    slopes = np.diff(F) / np.diff(V)
    assert V[np.argmin(slopes)] == pytest.approx(0.1 / math.sqrt(2), abs=2e-4)


def test_over_compensation_leaves_negative_secant_damping():
    ff = feedforward_limit(1.2 * F, 0.05 * V, 1.0, 0.0, 1.0, math.inf)
    assert secant_damping(V, F, ff)[0] < 0


@pytest.mark.parametrize(
    ("counts", "kappa", "cap", "margin"),
    [
        (160000, 0.9, math.inf, -0.0611),
        (160000, 0.9, 0.225, 0.0289),
        (160000, 0.7, math.inf, 0.0089),
        (160000, 0.6, math.inf, 0.0439),
        (160000, 0.5, math.inf, 0.0789),
        (2000, 0.9, 0.225, -0.0641),
        (2000, 0.5, math.inf, -0.0141),
    ],
)
def test_two_line_margins_equal_the_oracles(counts, kappa, cap, margin):
    ff = feedforward_limit(F, 0.05 * V, kappa, 0.0, 1.0, cap)
    found = two_line_margin(V, F, ff, k_c=50, b_c=0.005, T=1e-3, Delta=2 * math.pi / counts)
    assert found.margin_nm == pytest.approx(margin, abs=6e-5)


@pytest.mark.parametrize(("counts", "needed"), [(160000, 0.0012), (2000, 0.094)])
def test_the_encoder_asks_the_dry_friction_of_the_theory(counts, needed):
    # constant friction, no feed-forward: the margin is the friction minus what quantisation asks
    v = np.array([0.0])
    margin = two_line_margin(
        v, np.array([0.2]), np.array([0.0]), k_c=50, b_c=0.005, T=1e-3, Delta=2 * math.pi / counts
    ).margin_nm
    assert 0.2 - margin == pytest.approx(needed, rel=0.03)


def test_the_two_line_slope_is_the_best_of_a_sweep():
    F_lo, ff = 0.02 + 0.3 * V, 0.01 + 0.2 * V  # a slope above 0 must pay off here
    coupling = {"k_c": 50, "b_c": 0.005, "T": 1e-3, "Delta": 4e-5}
    found = two_line_margin(V, F_lo, ff, **coupling)

    def at(c):
        need = 0.005 + 50 * 5e-4 + c
        return np.min(F_lo - need * V) - np.max(ff - c * V) - 50 * 2e-5 - (0.005 + c) * 0.04

    sweep = max(at(c) for c in np.linspace(0, 1, 2001))
    assert found.slope_nms_rad > 0
    assert found.margin_nm >= sweep - 1e-12
    assert found.margin_nm == pytest.approx(at(found.slope_nms_rad))


@pytest.mark.parametrize("broken", [0, 1])
def test_nan_in_a_curve_passes_no_two_line_test(broken):
    curves = [F.copy(), 0.5 * F]
    curves[broken][7] = math.nan
    margin = two_line_margin(V, *curves, k_c=50, b_c=0.005, T=1e-3, Delta=4e-5).margin_nm
    assert not margin >= 0
    assert not secant_damping(V, *curves)[0] >= 0
    assert not gain_max(V, curves[0], curves[1], 0.03) >= 0


def test_coulomb_over_compensation_runs_away_to_the_oracle_speed():
    assert runaway_speed(0.25, 0.05, 0.9, 1.25) == pytest.approx(0.625)
    assert runaway_speed(0.25, 0.05, 0.9, 1.0) == 0.0


def test_the_tanh_speed_is_about_the_theorys_figure():
    assert tanh_speed_min(0.9, 0.35, 1.05) == pytest.approx(0.3)


def test_the_largest_gain_leaves_just_the_needed_damping():
    kappa = gain_max(V, F - 0.01, F, 0.03)
    left = (F - 0.01 - kappa * F)[1:] / V[1:]
    assert left.min() == pytest.approx(0.03, rel=1e-6)
    assert gain_max(V, F - 1.0, F, 0.03) == 0.0


def test_the_feed_forward_never_pushes_backwards_and_keeps_its_cap():
    ff = feedforward_limit(F - 0.3, 0.05 * V, 0.9, 0.0, 1.0, 0.02)
    assert ff.min() == 0.0
    assert ff.max() <= 0.02
