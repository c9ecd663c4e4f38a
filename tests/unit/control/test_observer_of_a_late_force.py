"""The observer behind a late force sensor: its eigenvalues and its choice against the loop in time, written
anew from docs/theory.md 6 alone.
"""

import math
from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pytest

from rtctl.control.disturbance_observer import LATE_MOST
from rtctl.control.proofs import observer_match
from rtctl.control.proofs.drive_in_hand import unknown_gears
from rtctl.control.proofs.less_late import quicker_sensors
from rtctl.control.proofs.observer_loop import Loop, Points, grid
from rtctl.control.proofs.observer_margin import BANDWIDTHS_HZ, judge, modes

RIG = Loop(0.012, 0.05, 1e-3, 0.95, 20.0, stiffness_nm_rad=60.0, damping_nms_rad=0.01)
RAISED = replace(RIG, excess=0.2)
LATE = replace(RIG, delay=2.0, acting_ticks=2, stiffness_nm_rad=20.0)
FREE = replace(RIG, stiffness_nm_rad=0.0, damping_nms_rad=0.0)
SLOWER = [float(hz) for hz in reversed(BANDWIDTHS_HZ) if hz <= 20]
STIFF = (600.0, 0.0, 0.0, 0.0)
HEAVY = (220.0, 0.0, 0.02, 0.0)
STUCK = (80.0, 0.03, 0.006, 250.0)
PARTS = 8


def growth_1_s(loop, hand, seconds=3.0):
    """Rate at which a swing grows: joint, hand and sensor by Runge-Kutta in eighths of a period, the law in
    plain words.
    """
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
        friction = q2 - (1 + loop.excess) * J * w * behind - loop.viscous_nms_rad * w2
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
    [(RIG, 2, 0.0, 0), (RIG, 2, 0.0, 2), (RAISED, 0, 0.0, 2), (LATE, 3, 150.0, 2), (LATE, 0, 60.0, 4)],
)
def test_the_largest_eigenvalue_is_the_growth_in_time(loop, ticks, hz, own, hand):
    loop = replace(loop, sensor_ticks=ticks, sensor_hz=hz, own_ticks=own)
    assert growth_1_s(loop, hand) == pytest.approx(eigen_1_s(loop, hand), abs=0.15, rel=0.02)


def border_gain(loop, hand):
    """Gain at which the largest eigenvalue passes 1."""
    low, high = 0.0, 1.5
    assert eigen_1_s(replace(loop, gain=low), hand) < 0 < eigen_1_s(replace(loop, gain=high), hand)
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if eigen_1_s(replace(loop, gain=middle), hand) > 0 else (middle, high)
    return low


@pytest.mark.parametrize(
    ("loop", "ticks", "hz", "own", "hand"),
    [
        (RIG, 5, 0.0, 0, HEAVY),
        (RIG, 0, 0.0, 3, STIFF),
        (RAISED, 0, 0.0, 4, STIFF),
        (LATE, 0, 0.0, 2, STIFF),
        (RIG, 2, 80.0, 0, HEAVY),
    ],
)
def test_beyond_the_border_of_the_eigenvalues_a_swing_begins_to_grow(loop, ticks, hz, own, hand):
    loop = replace(loop, sensor_ticks=ticks, sensor_hz=hz, own_ticks=own)
    border = border_gain(loop, hand)
    assert growth_1_s(replace(loop, gain=0.95 * border), hand) < 0
    assert growth_1_s(replace(loop, gain=1.05 * border), hand) > 0


@pytest.mark.parametrize(("ticks", "hz"), [(1, 0.0), (2, 0.0), (4, 150.0), (0, 60.0), (10, 0.0)])
def test_what_is_chosen_passes_with_every_quicker_sensor(ticks, hz):
    law = observer_match.tuned(replace(RIG, sensor_ticks=ticks, sensor_hz=hz), SLOWER)
    for one in (law, *quicker_sensors(law)):
        assert judge(one).ok, one
    assert law.bandwidth_hz == 20.0 or ticks == 10


SLOW_SAMPLES = Loop(
    0.00925, 0.0256, 1e-3, 0.5, 20.0, acting_ticks=1, delay=1.0, sample_ticks=5, sensor_hz=150.0,
    sensor_ticks=5, stiffness_nm_rad=4.87, damping_nms_rad=0.0051,
)  # fmt: skip
SLOW_MOTOR = Loop(
    0.021, 0.0319, 1e-3, 0.3, 20.0, acting_ticks=10, delay=10.0, sensor_ticks=10, stiffness_nm_rad=2.59,
    damping_nms_rad=0.0064,
)  # fmt: skip
QUICKER_DRIVES = [
    (SLOW_SAMPLES, {"sample_ticks": 1, "sensor_ticks": 0, "sensor_hz": 0.0}),
    (SLOW_MOTOR, {"delay": 0.0}),
]


@pytest.mark.parametrize(("declared", "real"), QUICKER_DRIVES)
def test_what_is_chosen_passes_with_a_drive_that_is_less_late_than_declared(declared, real, monkeypatch):
    law = observer_match.tuned(declared, SLOWER)
    assert judge(law).ok
    assert judge(replace(law, **real)).ok
    monkeypatch.setattr(observer_match, "less_late", quicker_sensors)
    law = observer_match.tuned(declared, SLOWER)
    assert all(judge(one).ok for one in (law, *quicker_sensors(law)))
    assert not judge(replace(law, **real)).ok


def test_more_delay_takes_more_excess_and_then_bandwidth_and_never_more_than_half_of_the_delay():
    laws = [observer_match.tuned(replace(RIG, sensor_ticks=ticks), SLOWER) for ticks in range(11)]
    assert (laws[0].own_ticks, laws[0].excess, laws[0].bandwidth_hz) == (0, 0.0, 20.0)
    assert all(law.own_ticks <= math.ceil(law.sensor_ticks / 2) for law in laws)
    assert laws[10].bandwidth_hz < 20.0
    assert all(later.bandwidth_hz <= law.bandwidth_hz for law, later in pairwise(laws))


def test_what_is_no_number_is_not_chosen_as_enough():
    law = observer_match.tuned(replace(RIG, viscous_nms_rad=math.nan, sensor_ticks=2), [20.0, 10.0])
    assert (law.bandwidth_hz, law.excess) == (10.0, observer_match.EXCESSES[-1])


@pytest.mark.parametrize("hand", [STIFF, HEAVY], ids=["stiff", "heavy"])
def test_left_over_lateness_is_damping_as_the_theory_has_it(hand):
    """docs/theory.md 6.4: c = J w |QS| [(excess + w_q T/2) sin phi - w e T cos phi], whatever spring and mass
    the hand has.
    """
    k_h, _, m_h, _ = hand
    mass, J, T = RIG.inertia_kgm2 + m_h, RIG.inertia_kgm2, RIG.period_s
    w = math.sqrt(k_h / mass)
    for excess, ticks, own in ((0.0, 1, 0), (0.0, 2, 2), (0.2, 2, 2), (0.1, 1, 2)):
        loop = replace(FREE, excess=excess, sensor_ticks=ticks, own_ticks=own)
        passed = 1 / (1 + 1j * w / (2 * math.pi * 20)) / (1 + 1j * w / (2 * math.pi * 80))
        phi = -np.angle(passed) + w * T * (own + 0.5)
        raised = excess + math.pi * 20 * T
        c = 0.95 * J * w * abs(passed) * (raised * math.sin(phi) - w * (ticks - own) * T * math.cos(phi))
        points = Points(*(np.array([value]) for value in (*hand, 0.0, 0.0)))
        left = -2 * mass * math.log(float(modes(loop, points)[1][0])) / T
        assert left - loop.viscous_nms_rad == pytest.approx(c, abs=0.2 * abs(c) + 0.02), (excess, ticks, own)


def chosen_of_all(loop, bandwidths_hz, gears):
    """The observer that every loop looked at to the end, with every sensor and at every undamped hand, leaves
    as the best.
    """
    at = grid(loop)
    undamped = np.flatnonzero((at.b_h == 0.0) & (at.bristle == 0.0))
    late = observer_match.late_ticks(loop)
    owns = sorted({min(math.ceil(late * part), LATE_MOST) for part in (0.0, 0.125, 0.25, 0.375, 0.5)})
    for hz, excess in product(bandwidths_hz, observer_match.EXCESSES):
        shares = {}
        for own in owns:
            one = replace(loop, bandwidth_hz=hz, excess=excess, own_ticks=own)
            found = [judge(behind, undamped) for behind in (one, *quicker_sensors(one))]
            shares[one] = min(each.kept for each in found) if all(each.ok for each in found) else -1.0
        for one, share in sorted(shares.items(), key=lambda each: (-each[1], each[0].own_ticks)):
            if share >= 0.4 and observer_match.bears(one, gears):
                return one
    return None


@pytest.mark.parametrize(
    ("ticks", "hz", "gears"),
    [(3, 0.0, ()), (2, 150.0, ()), (0, 60.0, ()), (4, 0.0, unknown_gears(0.012, 0.0))],
)
def test_no_loop_that_is_left_out_would_have_been_chosen(ticks, hz, gears):
    loop = replace(RIG, sensor_ticks=ticks, sensor_hz=hz)
    wanted = chosen_of_all(loop, SLOWER[:4], gears)
    assert wanted is not None
    assert observer_match.tuned(loop, SLOWER[:4], gears) == wanted
