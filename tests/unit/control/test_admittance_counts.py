"""Hunting about the counts of an encoder: the describing function, the loop that does not see its joint, and
joints of another make.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from law_rig import COUNT, LawRig, T
from test_admittance_sticking import HEAVY, Stuck, growth

from rtctl.control import virtual_mass
from rtctl.control.flicker import BLIND_HZ, HELD_AFTER, HELD_S, is_blind, steady_reading
from rtctl.control.proofs import admittance_counts
from rtctl.control.proofs.admittance_loop import Swing, eigenvalues, matrices, points
from rtctl.control.velocity import lowpass_alpha
from rtctl.control.vocabulary import State


def seen(counts):
    """Least and largest share of a swing that the readings show, wherever its middle is, by projection on a
    sine.
    """
    sine = np.sin((np.arange(4096) + 0.5) * 2 * math.pi / 4096)
    middles = (np.arange(200) + 0.5) / 200
    read = np.floor(counts * sine + middles[:, None])
    shares = 2 * np.mean(read * sine, axis=1) / counts
    return shares.min(), shares.max()


def test_no_swing_of_more_counts_shows_so_little_or_so_much_of_itself():
    for counts in np.linspace(0.02, 6.0, 300):
        least, most = seen(counts)
        assert all(least > share for share, up_to in admittance_counts.LESS if counts > up_to)
        assert all(most < share + 5e-3 for share, up_to in admittance_counts.MORE if counts > up_to + 0.01)


@pytest.mark.parametrize("hand", [(0.0, 0.015, 250.0), (80.0, 0.004, 400.0), (80.0, 0.0, 100.0)])
def test_the_loop_that_is_proved_is_the_law_while_it_does_not_see_the_joint(hand):
    loop = replace(HEAVY, rest_damping_nms_rad=0.3)
    blind = admittance_counts._blind(loop)
    k_h, m_h, k_e = hand
    at, none = points([(k_h, 0.0, m_h, loop.bristle_nm_rad, 0.0, k_e, 0.0)]), np.zeros(1)
    rig = Stuck(loop, hand, seen=0.0)
    rig.p["mass_blind_alpha"][0] = lowpass_alpha(BLIND_HZ, loop.period_s)
    rig.p["mass_blind_nms_rad"][0] = loop.velocity_gain_nms_rad
    rig.s["reading_turns"][0] = HELD_AFTER
    z = eigenvalues(blind, at, Swing(none, none, none, none))
    assert growth(rig, 3.0) == pytest.approx(np.abs(z).max(), abs=1e-3)


@pytest.mark.parametrize("at_rest", [0.0, 0.5])
def test_a_mass_that_a_leaning_hand_moves_on_is_not_jolted_where_the_joint_is_no_longer_seen(at_rest):
    rig = Stuck(replace(HEAVY, rest_damping_nms_rad=at_rest))
    damping, speed = HEAVY.velocity_gain_nms_rad, 0.2
    rig.p["mass_blind_nms_rad"][0] = damping
    rig.s["mass_velocity_rad_s"][0] = speed
    rig.s["mass_calms_nms_rad"][0], rig.s["mass_calm_rad_s"][0] = at_rest, at_rest and speed
    rig.s["reading_turns"][0] = HELD_AFTER
    assert virtual_mass._rest_damping(rig.s, rig.p, 0) == damping
    assert rig.s["mass_calm_rad_s"][0] == speed
    rig.s["reading_turns"][0] = 0.0
    assert virtual_mass._rest_damping(rig.s, rig.p, 0) == at_rest
    rig.s["mass_bristle_share"][0] = 1.0
    assert virtual_mass._rest_damping(rig.s, rig.p, 0) == 0.0
    assert rig.s["mass_calm_rad_s"][0] == 0.0


def test_the_law_is_blind_while_the_reading_is_held_or_does_not_change():
    rig = LawRig(flicker_held=1.0)
    s, p = rig.state[0], rig.params[0]
    rig.state["state"] = int(State.ACTIVE)
    steady_reading(s, p, 0, 0.0, True)
    for _ in range(round(HELD_S / T)):
        assert not is_blind(s, p, 0)
        steady_reading(s, p, 0, 0.0, False)
    assert is_blind(s, p, 0)
    steady_reading(s, p, 0, COUNT, False)
    assert not is_blind(s, p, 0)
    rig.params["flicker_held"] = 0.0
    for _ in range(2 * round(HELD_S / T)):
        steady_reading(s, p, 0, COUNT, False)
    assert not is_blind(s, p, 0)


@pytest.mark.parametrize("share", [0.3, 1.25])
def test_a_loop_that_sees_a_part_of_the_joint_lies_between_one_that_is_blind_and_one_that_sees_all(share):
    at, blind, sight = admittance_counts._seeing(HEAVY, HEAVY.bristle_nm_rad)
    none = np.zeros(at.size)
    part = matrices(HEAVY, at, Swing(none, none, none, np.full(at.size, share)))
    np.testing.assert_allclose(blind + share * sight, part, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("ticks", [1, 2])
def test_a_reading_that_errs_by_a_sawtooth_moves_the_joint_as_fast_as_is_told(ticks):
    """The loop in time, at the point of the proof and at its speed: first harmonic of what the joint does."""
    loop = replace(HEAVY, rest_damping_nms_rad=0.3, sample_ticks=ticks)
    turns, sample_s = 2 * math.pi * 25.0, ticks * loop.period_s
    _at, blind, sight = admittance_counts._seeing(loop, loop.bristles_to * loop.bristle_nm_rad)
    sees, y, speeds = blind[0] + sight[0], np.zeros(sight.shape[1]), []
    samples = round(2.0 / sample_s)
    for k in range(samples):
        crept = turns * k * sample_s / (2 * math.pi)
        before, y = y[0], sees @ y + sight[0][:, 0] * (math.floor(crept) + 0.5 - crept)
        speeds.append((y[0] - before) / sample_s)
    angle = turns * sample_s * np.arange(samples // 2)
    first = np.abs(np.mean(np.array(speeds[samples // 2 :]) * np.exp(-1j * angle))) * math.sqrt(2.0)
    told = admittance_counts._answered(loop, blind[:1], sight[:1], np.array([[turns]]))[0, 0]
    assert first == pytest.approx(told / (math.pi * math.sqrt(2.0)), rel=0.03)
    assert 1.5 * first <= 1.03 * admittance_counts._crept(loop).counts_1_s, "two of 14 turn over an edge"
    assert admittance_counts._crept(loop).counts_1_s <= admittance_counts.creeping(loop).counts_1_s


def test_a_ring_between_two_of_the_speeds_that_are_tried_is_found():
    """The worst point rings within less than a step of 17 %: by even steps another one was followed, .86 of
    it.
    """
    loop = replace(
        HEAVY,
        mass_kgm2=0.091,
        virtual_damping_nms_rad=0.119,
        velocity_gain_nms_rad=0.57,
        rest_damping_nms_rad=0.3,
    )
    at, blind, sight = admittance_counts._seeing(loop, loop.bristles_to * loop.bristle_nm_rad)
    stiffest = np.flatnonzero((at.k_h == at.k_h.max()) & (at.m_h == 0.0))
    turns = np.broadcast_to(2 * math.pi * np.geomspace(5.0, 200.0, 1000)[:, None], (1000, stiffest.size))
    most = admittance_counts._answered(loop, blind[stiffest], sight[stiffest], turns).max()
    told = admittance_counts._crept(loop).counts_1_s
    assert told == pytest.approx(1.5 / math.pi * most / math.sqrt(2.0), rel=2e-3)


@pytest.mark.parametrize("field", ["inertia_kgm2", "mass_kgm2", "velocity_gain_nms_rad", "bristle_nm_rad"])
def test_a_loop_that_is_no_number_rings_without_bound(field):
    assert admittance_counts.creeping(replace(HEAVY, **{field: math.nan})).counts_1_s == math.inf
