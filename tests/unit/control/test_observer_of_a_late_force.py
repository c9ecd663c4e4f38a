"""The observer behind a late force sensor: its eigenvalues and its choice against the loop in time, written anew from docs/theory.md 6 alone."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rtctl.control.proofs import observer_match
from rtctl.control.proofs.observer_loop import Loop, Points
from rtctl.control.proofs.observer_margin import BANDWIDTHS_HZ, KEPT_LEAST, judge, modes

RIG = Loop(0.012, 0.05, 1e-3, 0.95, 20.0, stiffness_nm_rad=60.0, damping_nms_rad=0.01)
LATE = replace(RIG, delay=2.0, acting_ticks=2, stiffness_nm_rad=20.0)
STIFF = (600.0, 0.0, 0.0, 0.0)
HEAVY = (220.0, 0.0, 0.02, 0.0)
STUCK = (80.0, 0.03, 0.006, 250.0)
PARTS = 8


def growth_1_s(loop, hand, seconds=3.0):
    """Rate at which a swing grows: joint, hand and sensor by Runge-Kutta in eighths of a period, the law in plain words."""
    T, g, J, w = loop.period_s, loop.gain, loop.inertia_kgm2, 2 * math.pi * loop.bandwidth_hz
    k_h, b_h, m_h, bristle = hand
    own = loop.viscous_nms_rad + 0.04 * math.sqrt(bristle * J)
    cut, delay, ago = 2 * math.pi * loop.sensor_hz, round(loop.delay), loop.own_ticks

    def pressed(x, v, u):
        a = (u - (own + b_h) * v - (k_h + bristle) * x) / (J + m_h)
        return a, -(m_h * a + b_h * v + k_h * x)

    def step(x, v, f, u, h):
        def rates(x, v, f):
            a, tau = pressed(x, v, u)
            return v, a, cut * (tau - f)

        a1, b1, c1 = rates(x, v, f)
        a2, b2, c2 = rates(x + h / 2 * a1, v + h / 2 * b1, f + h / 2 * c1)
        a3, b3, c3 = rates(x + h / 2 * a2, v + h / 2 * b2, f + h / 2 * c2)
        a4, b4, c4 = rates(x + h * a3, v + h * b3, f + h * c3)
        return (
            x + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4),
            v + h / 6 * (b1 + 2 * b2 + 2 * b3 + b4),
            f + h / 6 * (c1 + 2 * c2 + 2 * c3 + c4),
        )

    quick, slow = 1 - math.exp(-4 * w * T), 1 - math.exp(-w * T)
    x, v, f, before = 1e-3, 0.0, 0.0, 1e-3
    sent, shown, moved, path = [0.0] * 40, [0.0] * 40, [0.0] * 40, []  # the newest last
    q1 = q2 = w1 = w2 = 0.0
    for _ in range(round(seconds / T)):
        shown.append(f if cut else pressed(x, v, sent[-1 - delay])[1])
        moved.append((x - before) / T)
        before = x
        q1 += quick * (sent[-1 - loop.acting_ticks - ago] + shown[-2 - loop.sensor_ticks] - q1)
        w1 += quick * (moved[-1 - ago] - w1)
        behind = w1 - w2
        q2 += slow * (q1 - q2)
        w2 += slow * behind
        friction = q2 - J * w * behind - loop.viscous_nms_rad * w2
        sent.append(g * friction - loop.stiffness_nm_rad * x - loop.damping_nms_rad * moved[-1])
        for _ in range(PARTS):
            x, v, f = step(x, v, f, sent[-1 - delay], T / PARTS)
        path.append(x)
    quarter = len(path) // 4
    early, last = np.abs(path[quarter : 2 * quarter]), np.abs(path[3 * quarter :])
    return math.log(last.max() / early.max()) / (2 * quarter * T)


def eigen_1_s(loop, hand):
    """The same by the largest eigenvalue."""
    points = Points(*(np.array([value]) for value in (*hand, 0.0, 1.0)))
    return math.log(float(modes(loop, points)[0][0])) / loop.period_s


@pytest.mark.parametrize("hand", [STIFF, HEAVY, STUCK], ids=["stiff", "heavy", "stuck"])
@pytest.mark.parametrize(
    ("loop", "ticks", "hz", "own"),
    [(RIG, 2, 0.0, 0), (RIG, 2, 0.0, 2), (RIG, 0, 0.0, 2), (LATE, 3, 150.0, 2), (LATE, 0, 60.0, 4)],
)
def test_the_largest_eigenvalue_is_the_growth_in_time(loop, ticks, hz, own, hand):
    loop = replace(loop, sensor_ticks=ticks, sensor_hz=hz, own_ticks=own)
    assert growth_1_s(loop, hand) == pytest.approx(eigen_1_s(loop, hand), abs=0.15, rel=0.02)


def border_hz(loop, hand):
    """Bandwidth at which the largest eigenvalue passes 1, Hz."""
    low, high = 1.0, 100.0
    assert eigen_1_s(replace(loop, bandwidth_hz=low), hand) < 0 < eigen_1_s(replace(loop, bandwidth_hz=high), hand)  # fmt: skip
    for _ in range(30):
        middle = math.sqrt(low * high)
        grows = eigen_1_s(replace(loop, bandwidth_hz=middle), hand) > 0
        low, high = (low, middle) if grows else (middle, high)
    return low


@pytest.mark.parametrize(
    ("loop", "ticks", "hz", "own", "hand"),
    [(RIG, 3, 0.0, 0, HEAVY), (RIG, 0, 0.0, 3, STIFF), (LATE, 0, 0.0, 2, STIFF), (RIG, 2, 80.0, 0, HEAVY)],
)
def test_beyond_the_border_of_the_eigenvalues_a_swing_begins_to_grow(loop, ticks, hz, own, hand):
    loop = replace(loop, sensor_ticks=ticks, sensor_hz=hz, own_ticks=own)
    border = border_hz(loop, hand)
    assert growth_1_s(replace(loop, bandwidth_hz=0.95 * border), hand) < 0
    assert growth_1_s(replace(loop, bandwidth_hz=1.05 * border), hand) > 0


@pytest.mark.parametrize(("ticks", "hz"), [(1, 0.0), (2, 0.0), (4, 150.0), (0, 60.0), (10, 0.0)])
def test_what_is_chosen_passes_with_every_quicker_sensor(ticks, hz):
    declared = replace(RIG, sensor_ticks=ticks, sensor_hz=hz)
    own, bandwidth_hz = observer_match.chosen(declared, [hz for hz in reversed(BANDWIDTHS_HZ) if hz <= 20])
    law = replace(declared, own_ticks=own, bandwidth_hz=bandwidth_hz)
    for one in observer_match.sensors(law):
        assert judge(one).ok, (own, bandwidth_hz, one.sensor_ticks, one.sensor_hz)


def test_what_the_observer_adds_is_one_function_of_the_frequency_whatever_the_hand():
    loop = replace(RIG, sensor_ticks=2, sensor_hz=150.0, own_ticks=1, stiffness_nm_rad=0.0, damping_nms_rad=0.0)
    for omega in (40.0, 90.0, 150.0):
        added = float(observer_match.added_damping(loop, np.array([omega]))[0])
        for m_h in (0.0, 0.006):
            mass = loop.inertia_kgm2 + m_h
            hand = Points(*(np.array([one]) for one in (mass * omega**2, 0.0, m_h, 0.0, 0.0, 0.0)))
            ring = float(modes(loop, hand)[1][0])
            left = -2 * mass * math.log(ring) / loop.period_s
            assert left - loop.viscous_nms_rad == pytest.approx(added, abs=0.15 * abs(added) + 0.004)


def test_without_a_late_sensor_nothing_is_delayed_or_slowed():
    assert observer_match.chosen(RIG, [20.0, 10.0]) == (0, 20.0)
    assert observer_match.kept(RIG) > 1.0
    assert observer_match.kept(replace(RIG, sensor_ticks=3)) < KEPT_LEAST
    assert not observer_match.kept(replace(RIG, gain=math.nan)) >= KEPT_LEAST
