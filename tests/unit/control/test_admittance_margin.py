"""The admittance display's closed loop: matrices against a fine integration in time, oracles of theory, and
the proof.
"""

from dataclasses import replace

import numpy as np
import pytest
from oracles import hand_max_continuous, impedance_continuous
from scipy.linalg import expm

from rtctl.control import virtual_mass
from rtctl.control.jit import records
from rtctl.control.proofs import admittance_margin
from rtctl.control.proofs.admittance_loop import AdmittanceLoop, Box, points, spectral_radii
from rtctl.control.proofs.admittance_sticking import judge_stuck
from rtctl.control.proofs.drive_in_hand import resonance
from rtctl.control.records import new_records
from rtctl.control.velocity import lowpass_alpha
from rtctl.control.vocabulary import Display, Environment, State
from tests.bench import admittance
from tests.bench.admittance import certified, diverging, growth_in_time, share_at_which_one_grows

T = 1e-3
RIG = AdmittanceLoop(
    0.012, 0.05, T, 0.03, 0.3, 2.0, force_lowpass_hz=150.0, velocity_lowpass_hz=100.0, delay=1.0
)
"""The rig of the oracles, with a mass and a damping that pass in every world."""

ELASTIC = replace(RIG, joints=(resonance(0.012, 40.0),), link_viscous_nms_rad=0.02)
LATE = replace(RIG, delay=1.6, lag_hz=200.0, position_gain_nm_rad=8.0, intake_lowpass_hz=300.0)
RARE = replace(RIG, delay=2.0, sample_ticks=3, position_gain_nm_rad=8.0, mass_kgm2=0.06)
AT_LINK = replace(ELASTIC, encoder="link", delay=0.3, position_gain_nm_rad=3.0)


def random_points(rng, count, bristle=0.0):
    """Hands and worlds that hold the joint, so that the slowest root is not one of a joint that nothing
    holds.
    """
    rows = [
        (
            600 * rng.random() + 2,
            rng.random() * rng.integers(2),
            0.02 * rng.random(),
            bristle,
            0,
            10 ** (4 * rng.random()),
            0.3 * rng.random(),
        )
        for _ in range(count)
    ]
    return points(rows)


@pytest.mark.parametrize(
    "loop",
    [
        RIG,
        replace(RIG, mass_kgm2=0.006, position_gain_nm_rad=1.0),
        LATE,
        RARE,
        ELASTIC,
        AT_LINK,
        replace(RIG, sensor_hz=60.0),
        replace(LATE, sensor_hz=200.0, sensor_ticks=2),
        replace(RIG, sensor_ticks=5),
        replace(ELASTIC, sensor_hz=90.0),
    ],
)
def test_the_largest_eigenvalue_is_the_growth_of_a_fine_integration(loop):
    rng = np.random.default_rng(1)
    at = random_points(rng, 12, 0.0).beside(random_points(rng, 12, 250.0))
    if loop.position_gain_nm_rad == 0:  # then the joint and the virtual mass are not held to each other
        at = replace(at, b_e=at.b_e + 0.1)
    assert growth_in_time(loop, at) == pytest.approx(spectral_radii(loop, at), abs=4e-3)


def test_the_integration_knows_growth_from_decay():
    hands = points([(k, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0) for k in (0.9 * 602.4, 1.1 * 602.4)])
    thin = replace(RIG, mass_kgm2=0.012, virtual_damping_nms_rad=0.05)
    dies, grows = growth_in_time(thin, hands)
    assert dies < 1 < grows


# Oracles of theory
# ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("K_v", "least"), [(0.5, 0.01091), (2.0, 0.01171), (5.0, 0.01188)])
def test_the_continuous_bound(K_v, least):
    assert admittance_margin.mass_min_continuous(0.012, 0.05, K_v) == pytest.approx(least, rel=5e-4)


@pytest.mark.parametrize("K_v", [0.5, 2.0, 5.0])
def test_at_the_continuous_bound_the_felt_impedance_turns(K_v):
    s = 1j * np.geomspace(0.1, 1e5, 2000)
    least = admittance_margin.mass_min_continuous(0.012, 0.05, K_v)
    for share, passive in ((1.001, True), (0.999, False)):
        loop = AdmittanceLoop(0.012, 0.05, T, share * least, 0.0, K_v)
        assert (impedance_continuous(loop, s).real.min() >= 0) == passive


@pytest.mark.parametrize(("K_p", "K_i", "passive"), [(1.25, 0.0, True), (100.0, 2000.0, False)])
def test_the_linear_display_of_keemink(K_p, K_i, passive):
    """Feedback alone: mass 2 displayed by a mass of 10, damped by 5, before the sensor; 2 behind it, which
    adds no real part.
    """
    s = 1j * np.geomspace(1e-3, 1e4, 4000)
    loop = AdmittanceLoop(10.0, 5.0, T, 2.0, 0.0, K_p, K_i)
    real = impedance_continuous(loop, s).real
    assert (real.min() >= -1e-9) == passive


@pytest.mark.parametrize(
    ("m", "b_v", "K_v", "formula", "sampled"),
    [(0.006, 0.02, 2.0, 7.324, 7.374), (0.009, 0.05, 2.0, 39.09, 39.67), (0.004, 0.1, 0.5, 12.303, 12.316)],
)
def test_the_stiffest_hand_without_lag(m, b_v, K_v, formula, sampled):
    assert hand_max_continuous(m, b_v, 0.012, 0.05, K_v) == pytest.approx(formula, rel=5e-4)
    loop = AdmittanceLoop(0.012, 0.05, 2e-5, m, b_v, K_v, box=Box(600.0, 0.0, 0.0))
    assert admittance_margin.largest_hand(loop, world=False) == pytest.approx(sampled, rel=2e-3)


FIVE = ((0.006, 0.02), (0.006, 0.3), (0.009, 0.05), (0.012, 0.05), (0.024, 0.05))


@pytest.mark.parametrize(
    ("m", "b_v", "stiffest"),
    [(*one, k) for one, k in zip(FIVE, (13.77, 142.85, 149.6, 602.4, 1686.7), strict=True)],
)
def test_the_stiffest_hand_of_five_rigs(m, b_v, stiffest):
    """With the law's own low-passes; found once more by `growth_in_time` below."""
    loop = replace(RIG, mass_kgm2=m, virtual_damping_nms_rad=b_v, box=Box(600.0, 0.0, 0.0))
    assert admittance_margin.largest_hand(loop, world=False) == pytest.approx(stiffest, rel=2e-3)


def test_the_stiffest_hand_of_five_rigs_in_time():
    for (m, b_v), stiffest in zip(FIVE, (13.77, 142.85, 149.6, 602.4, 1686.7), strict=True):
        loop = replace(RIG, mass_kgm2=m, virtual_damping_nms_rad=b_v)
        hands = points([(share * stiffest, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0) for share in (0.95, 1.05)])
        dies, grows = growth_in_time(loop, hands, ticks=900)
        assert dies < 1.0 < grows


# What is told beside it
# -----------------------------------------------------------------------------------------------


def test_the_smallest_mass_and_the_least_damping_pass_and_a_little_less_does_not():
    thin = replace(RIG, mass_kgm2=0.02, virtual_damping_nms_rad=0.05)
    assert not admittance_margin.judge(thin).ok
    mass = admittance_margin.smallest_mass(thin)
    damping = admittance_margin.least_damping(thin)
    assert admittance_margin.judge(replace(thin, mass_kgm2=mass)).ok
    assert not admittance_margin.judge(replace(thin, mass_kgm2=0.93 * mass)).ok
    assert admittance_margin.judge(replace(thin, virtual_damping_nms_rad=damping)).ok
    assert not admittance_margin.judge(replace(thin, virtual_damping_nms_rad=0.9 * damping)).ok


def test_a_joint_that_sticks_is_judged_apart():
    rough = replace(RIG, bristle_nm_rad=250.0)
    assert admittance_margin.judge(rough).ok
    assert not judge_stuck(rough).ok
    assert admittance_margin.proof(rough).proved


def test_dry_friction_keeps_a_weak_servo_with_a_spring_swinging_and_neither_without():
    """Found by holding certified rigs in hands: .41 rad/s for as long as it was held."""
    weak = AdmittanceLoop(
        0.012, 0.05, 1e-3, 0.038, 0.08, 0.56, 12.5, force_lowpass_hz=150.0, velocity_lowpass_hz=100.0,
        box=Box(10.0, 0.2, 0.004),
    )  # fmt: skip
    assert admittance_margin.judge(weak).ok
    found, damping = admittance_margin.judge_rubbing(weak)
    assert not found.ok
    assert damping >= 0.3 * 0.56
    assert admittance_margin.judge_rubbing(replace(weak, position_gain_nm_rad=0.0))[0].ok
    assert admittance_margin.judge_rubbing(replace(weak, position_gain_nm_rad=1.0))[0].ok


def test_the_damping_kept_is_of_what_the_virtual_mass_would_keep():
    found = admittance_margin.judge(RIG)
    assert 0 < found.kept < 1
    assert found.points > 4000


# Certified rigs in time
# -----------------------------------------------------------------------------------------------


def test_a_random_rig_that_is_proved_does_not_diverge_in_any_hand_or_world():
    rng = np.random.default_rng(4)
    (loop,) = certified(rng, 1)
    assert diverging(loop, admittance.random_points(rng, loop, 80), ticks=600) == 0


def test_a_hand_a_tenth_stiffer_than_the_stiffest_that_passes_makes_a_rigid_joint_grow():
    assert 0.97 <= share_at_which_one_grows(RIG, ticks=2400) <= 1.1


# The law itself
# -------------------------------------------------------------------------------------------------------


def _law(loop, k_e):
    """Records of an axis that is displayed by `virtual_mass`, on a spring of stiffness k_e."""
    p, s, c, _ = (records(array)[0] for array in new_records(1))
    p["period_s"], s["display_kind"][0] = loop.period_s, Display.ADMITTANCE
    p["inertia_kgm2"][0], p["viscous_nms_rad"][0] = loop.inertia_kgm2, loop.told_viscous_nms_rad
    p["mass_kgm2"][0] = s["mass_kgm2"][0] = loop.mass_kgm2
    p["mass_damping_nms_rad"][0] = s["mass_damping_nms_rad"][0] = loop.virtual_damping_nms_rad
    p["mass_forward"][0] = loop.feedforward
    p["mass_forward_alpha"][0] = lowpass_alpha(loop.feedforward_lowpass_hz, loop.period_s)
    p["mass_force_alpha"][0] = lowpass_alpha(loop.force_lowpass_hz, loop.period_s)
    p["servo_velocity_alpha"][0] = lowpass_alpha(loop.velocity_lowpass_hz, loop.period_s)
    p["servo_velocity_gain_nms_rad"][0] = loop.velocity_gain_nms_rad
    p["servo_position_gain_nm_rad"][0] = loop.position_gain_nm_rad
    p["torque_limit_nm"][0] = p["torque_rate_nm"][0] = p["velocity_limit_rad_s"][0] = 1e9
    p["watch_floor_nm"] = 1e9  # the matrices know no watch
    s["state"], s["authority"], s["proxy_set_count"][0] = State.ACTIVE, 1.0, 1
    kind = Environment.SPRING if k_e > 0 else Environment.FREE
    c["environment_kind"][0] = s["world_kind"][0] = kind
    c["environment_stiffness_nm_rad"][0] = s["world_stiffness_nm_rad"][0] = k_e
    return p, s, c


def _growth_of_the_law(loop, k_h, m_h, k_e, ticks=1500):
    """Growth per tick of law and joint, the joint exact between samples."""
    p, s, c = _law(loop, k_e)
    M = loop.inertia_kgm2 + m_h
    A = np.array([[0.0, 1.0, 0.0], [-k_h / M, -loop.viscous_nms_rad / M, 1 / M], [0.0, 0.0, 0.0]])
    step, whole = expm(A * loop.period_s), int(loop.delay)
    y, before = np.array([1.0, 0.0, 0.0]), 1.0
    s["proxy_position_rad"][0] = -0.5  # not with the joint: no motion at rest is left out
    sent, sizes = [0.0] * (whole + 1), []
    for _ in range(ticks):
        force = -m_h * float(A[1] @ y) - k_h * y[0]
        s["position_rad"][0] = y[0]
        torque = virtual_mass.servo_torque(s, p, c, 0, 1, (y[0] - before) / loop.period_s, force, False)
        before, sent = y[0], [*sent[1:], torque]
        y = step @ np.array([y[0], y[1], sent[0]])
        sizes.append(abs(y[0]) + abs(s["proxy_position_rad"][0]) + 0.01 * abs(y[1]))
    early, late = (max(sizes[a : a + ticks // 6]) for a in (ticks // 3, 5 * ticks // 6))
    return (late / early) ** (1 / (ticks // 2))


@pytest.mark.parametrize(
    ("changes", "hand"),
    [
        ({}, (300.0, 0.0, 40.0)),
        ({"position_gain_nm_rad": 8.0}, (600.0, 0.004, 1000.0)),
        (
            {"mass_kgm2": 0.012, "virtual_damping_nms_rad": 0.05, "position_gain_nm_rad": 5.0},
            (150.0, 0.0, 300.0),
        ),
        ({"delay": 2.0, "mass_kgm2": 0.006, "position_gain_nm_rad": 2.0}, (60.0, 0.01, 0.0)),
        ({"feedforward": 1.0, "feedforward_lowpass_hz": 30.0, "mass_kgm2": 0.03}, (60.0, 0.0, 0.0)),
        (
            {
                "feedforward": 0.7,
                "feedforward_lowpass_hz": 80.0,
                "told_viscous_nms_rad": 0.04,
                "mass_kgm2": 0.008,
                "delay": 2.0,
            },
            (300.0, 0.01, 40.0),
        ),
    ],
)
def test_the_largest_eigenvalue_is_the_growth_of_the_law(changes, hand):
    loop = replace(RIG, **changes)
    k_h, m_h, k_e = hand
    at = points([(k_h, 0.0, m_h, 0.0, 0.0, k_e, 0.0)])
    assert _growth_of_the_law(loop, k_h, m_h, k_e) == pytest.approx(spectral_radii(loop, at)[0], abs=2e-3)
