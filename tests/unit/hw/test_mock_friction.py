"""Friction of the simulated joint against docs/theory.md 12 and independent oracles."""

import math
from fractions import Fraction

import numpy as np
import pytest

from hw.interface import Rig
from hw.simulators.jit import compiled, records
from hw.simulators.mock_bristles import (
    bristle_gains,
    coupled_step,
    dry_friction,
    implicit_share,
    plastic_share,
    sliding_level,
    static_friction,
)
from hw.simulators.mock_options import MockOptions
from hw.simulators.mock_records import plant_records

J = 0.012
RIG = Rig(
    n_axes=1,
    period_s=1e-3,
    gear_ratio=np.array([80.0]),
    gear_efficiency=np.array([0.72]),
    torque_constant_nm_a=np.array([0.0134]),
    encoder_counts_per_rev=np.array([160_000.0]),
    lever_m=np.array([[0.0, 0.1, 0.0]]),
)


def friction(**fields):
    options = MockOptions.model_validate({"axis": [{"friction": fields}]}).model_dump(mode="json")
    return records(plant_records(options, RIG)[0])[0]


@compiled
def respond(p, amplitude_nm, mean_nm, frequency_hz, h, steps, every, backward=False):
    """Velocity and position under a sinusoidal torque, each `every`-th step; the largest |z| last."""
    out = np.zeros((steps // every, 2))
    x, v, z, a, z_max = 0.0, 0.0, 0.0, 0.0, 0.0
    q = p[0]
    share = implicit_share(0.012, q.bristle_damping_nms_rad[0], q.bristle_stiffness_nm_rad[0], h)
    if backward:
        share = 1.0
    for k in range(steps):
        torque = mean_nm + amplitude_nm * math.sin(2 * math.pi * frequency_hz * (k + share) * h)
        before = v
        v, z, w, _ = coupled_step(v, z, x, a, torque, 0.0, 0.012, h, share, q, 0)
        a = (v - before) / h
        x += h * w
        z_max = max(z_max, abs(z))
        if (k + 1) % every == 0:
            out[(k + 1) // every - 1, 0] = v
            out[(k + 1) // every - 1, 1] = x
    return out, z_max


def params(**fields):
    options = MockOptions.model_validate({"axis": [{"friction": fields}]}).model_dump(mode="json")
    return records(plant_records(options, RIG)[0])


@pytest.mark.parametrize("speed", [0.001, 0.02, 0.0707, 0.1, 0.5, 2.0])
def test_the_static_curve_is_the_formula_of_the_theory(speed):
    expected = 0.25 + 0.10 * math.exp(-((speed / 0.1) ** 2)) + 0.05 * speed
    assert static_friction(speed, 0.0, friction(), 0) == pytest.approx(expected, rel=1e-14)
    assert static_friction(-speed, 0.0, friction(), 0) == pytest.approx(-expected, rel=1e-14)


def test_the_steepest_stribeck_slope_is_the_oracle_at_its_place():
    p, h = friction(), 1e-6
    slopes = {
        v: (static_friction(v + h, 0.0, p, 0) - static_friction(v - h, 0.0, p, 0)) / (2 * h)
        for v in np.arange(0.01, 0.3, 0.0001)
    }
    steepest = min(slopes, key=slopes.get)
    assert slopes[steepest] == pytest.approx(-0.8078, abs=2e-4)
    assert steepest == pytest.approx(0.0707, abs=2e-4)


def test_directions_and_positions_scale_the_curve_as_asked():
    p = friction(scale_negative=1.2, modulation_share=0.1, modulation_period_rad=2.0)
    assert static_friction(-1.0, 0.0, p, 0) == pytest.approx(
        -1.2 * static_friction(1.0, 0.0, p, 0), rel=1e-12
    )
    assert dry_friction(1.0, 0.5, p, 0) == pytest.approx(1.1 * dry_friction(1.0, 0.0, p, 0), rel=1e-12)
    assert dry_friction(1.0, 1.5, p, 0) == pytest.approx(0.9 * dry_friction(1.0, 0.0, p, 0), rel=1e-12)


def test_a_second_speed_and_viscous_friction_that_thins_out_are_the_formula():
    p = friction(second_share=0.4, second_rad_s=0.5, thinning_nms_rad=0.03, thinning_rad_s=0.7)
    for v in (0.0, 0.02, 0.3, 2.0):
        peak = 0.6 * math.exp(-((v / 0.1) ** 2)) + 0.4 * math.exp(-((v / 0.5) ** 2))
        wet = 0.05 * v + 0.03 * v / (1 + (v / 0.7) ** 2)
        assert static_friction(v, 0.0, p, 0) == pytest.approx(0.25 + 0.1 * peak + wet, rel=1e-14)
        assert sliding_level(v, 0.0, 0.0, 0.0, p, 0) == pytest.approx(0.25 + 0.1 * peak, rel=1e-14)


def test_an_exponent_other_than_two_is_honoured():
    p = friction(stribeck_exponent=1.0)
    assert dry_friction(0.2, 0.0, p, 0) == pytest.approx(0.25 + 0.1 * math.exp(-2.0), rel=1e-14)


@pytest.mark.parametrize("model", ["lugre", "elasto_plastic"])
@pytest.mark.parametrize("speed", [0.01, 0.1, -0.3, 2.0])
def test_steady_sliding_gives_the_static_curve(model, speed):
    p = friction(model=model)
    v, z, force = speed, 0.0, 0.0
    h = min(1e-3, 1e-4 / abs(speed))
    for _ in range(round(0.03 / abs(speed) / h)):
        # so heavy that it keeps its speed
        v, z, _, force = coupled_step(v, z, 0.0, 0.0, 0.0, 0.0, 1e9, h, 0.5, p, 0)
    assert v == pytest.approx(speed, rel=1e-6)
    assert force == pytest.approx(static_friction(speed, 0.0, p, 0), rel=1e-6)


def test_the_plastic_share_goes_from_stretching_to_sliding_without_a_step():
    z_ss = 1.4e-3
    assert plastic_share(0.5 * z_ss, 0.1, z_ss, 0.7) == 0.0
    assert plastic_share(0.999 * z_ss, -0.1, z_ss, 0.7) == 0.0, "the bristle relaxes when the motion turns"
    assert plastic_share(z_ss, 0.1, z_ss, 0.7) == 1.0
    assert plastic_share(0.85 * z_ss, 0.1, z_ss, 0.7) == pytest.approx(0.5, abs=1e-12)
    steps = [plastic_share(x * z_ss, 0.1, z_ss, 0.7) for x in np.linspace(0.69, 1.01, 1000)]
    assert np.all(np.diff(steps) >= 0)
    assert np.max(np.diff(steps)) < 2e-3


def test_the_bristle_step_is_the_exact_solution_for_a_constant_speed():
    p, z, v = friction(), 3e-4, 0.2
    g = dry_friction(v, 0.0, p, 0)
    for h in (1e-9, 1e-6, 60e-6, 1e-3, 0.1):
        keep, gain, mean_keep, mean_gain = bristle_gains(250.0 / g, v, h, 1 / h)
        a, z_ss = 250.0 * v / g, g / 250.0
        exact = z_ss + (z - z_ss) * math.exp(-a * h)
        assert keep * z + gain * v == pytest.approx(exact, rel=1e-9)
        average = z_ss - (z - z_ss) * math.expm1(-a * h) / (a * h)
        assert mean_keep * z + mean_gain * v == pytest.approx(average, rel=1e-7)


@pytest.mark.parametrize("q", [0.0, 1e-12, 1e-6, 1e-3, 0.05, 0.1249999, 0.1250001, 0.3, 2.0, 30.0, 800.0])
def test_the_bristle_step_loses_no_digits_however_little_turns_over(q):
    slope, h = 700.0, 1e-4
    keep, gain, mean_keep, mean_gain = bristle_gains(slope, q / (slope * h), h, 1 / h)
    if q < 10.0:  # exactly: the series of each, with as many terms as it takes
        x = Fraction(-slope * (q / (slope * h) * h))
        wanted = [float(sum(x**k / math.factorial(k + n) for k in range(60))) for n in range(3)]
    else:
        wanted = [math.exp(-q), 1 / q, (1 - 1 / q) / q]
    assert keep == pytest.approx(wanted[0], rel=1e-13)
    assert (gain / h, mean_keep) == pytest.approx((wanted[1], wanted[1]), rel=1e-13)
    assert mean_gain / h == pytest.approx(wanted[2], rel=1e-13)


@pytest.fixture(scope="module")
def fine():
    return respond(params(), 0.6, 0.0, 1.0, 1e-6, 2_000_000, 1000)[0]


def velocity_error(fine, h, **how):
    run, _ = respond(params(), 0.6, 0.0, 1.0, h, round(2 / h), round(1e-3 / h), **how)
    return np.sqrt(np.mean((run[:, 0] - fine[:, 0]) ** 2) / np.mean(fine[:, 0] ** 2))


def test_the_backward_step_is_the_one_of_the_theory(fine):
    assert velocity_error(fine, 1e-3, backward=True) == pytest.approx(0.014, rel=0.1), "1.4 % there"
    assert velocity_error(fine, 1e-4, backward=True) == pytest.approx(0.0014, rel=0.1), ".14 % there"


def test_the_step_is_of_second_order(fine):
    coarse, usual = velocity_error(fine, 1e-3), velocity_error(fine, 1e-4)
    assert usual < 3e-5
    assert usual < coarse / 50


@pytest.mark.parametrize("damping", [0.0, 1e-3, 1.0, 1e3, 1e6])
def test_the_implicit_share_is_the_middle_for_fine_steps_and_never_lets_a_step_grow(damping):
    for h in (1e-6, 1e-4, 1e-2, 1.0):
        share = implicit_share(J, damping, 0.0, h)
        r = h * damping / J
        factor = 1 - r / (1 + share * r)
        assert 0.5 <= share < 1
        assert abs(factor) <= 1
        assert factor == pytest.approx((6 - 2 * r) / (6 + 4 * r + r * r), abs=1e-9)


@pytest.mark.parametrize("stiffness", [250.0, 2750.0, 1e5, 1e7])
@pytest.mark.parametrize("h", [1e-6, 60e-6, 1e-3, 0.1])
def test_the_bristle_never_stretches_beyond_break_away(stiffness, h):
    # explicit Euler diverges from sigma0 = 2750 on at 1 ms
    run, z_max = respond(params(bristle_stiffness_nm_rad=stiffness), 30.0, 0.0, 3.0, h, 3000, 1)
    assert np.isfinite(run).all()
    assert z_max <= 0.35 / stiffness * (1 + 1e-12)


def drift_rad(**fields):
    """How far the joint creeps in 9 s under .10 +- .05 N m at 10 Hz: well below break-away (.35)."""
    run, _ = respond(params(**fields), 0.05, 0.10, 10.0, 50e-6, 200_000, 2000)  # a row per period
    return run[-1, 1] - run[9, 1]


def test_lugre_creeps_under_vibration_below_break_away():
    assert drift_rad() == pytest.approx(0.030, rel=0.1), "30 mrad by an independent simulation"


def test_the_elasto_plastic_joint_does_not_creep_under_vibration_below_break_away():
    assert abs(drift_rad(model="elasto_plastic")) < 1e-9


def test_a_quiet_joint_stays_exactly_where_it_is():
    run, z_max = respond(params(), 0.0, 0.0, 1.0, 60e-6, 1000, 1)
    assert np.all(run == 0)
    assert z_max == 0
