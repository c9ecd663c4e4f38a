"""An admittance on a joint that dry friction holds: what grows within its presliding, how fast that shakes
the hand, and the damping that calms it.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from rtctl.control import virtual_mass
from rtctl.control.jit import records
from rtctl.control.proofs import admittance_sticking
from rtctl.control.proofs.admittance_loop import AdmittanceLoop, Box, points, spectral_radii
from rtctl.control.proofs.admittance_sticking import (
    calming_rest_damping,
    judge_stuck,
    spring_and_loss,
    sticking,
)
from rtctl.control.proofs.drive_in_hand import BRISTLE_DAMPING_SHARE
from rtctl.control.records import new_records
from rtctl.control.velocity import lowpass_alpha
from rtctl.control.vocabulary import Display, Environment, State

T = 1e-3
HEAVY = AdmittanceLoop(
    0.012, 0.05, T, 0.03, 0.1, 2.0, force_lowpass_hz=150.0, velocity_lowpass_hz=100.0, delay=1.0,
    bristle_nm_rad=250.0, presliding_rad=1.4e-3,
    rest_hz=virtual_mass.MASS_REST_HZ, box=Box(100.0, 0.5, 0.015),
)  # fmt: skip
"""Stable while it slides; while it sticks its mass rings on a virtual spring, in a heavy hand that nothing
else holds."""
WORST = (0.0, 0.015, 250.0)
"""Stiffness and mass of that hand, and the spring."""


class Stuck:
    """The law beside a rigid joint whose friction is a spring up to `most_nm`, then slides; in parts of a
    period.
    """

    def __init__(self, loop, hand=WORST, most_nm=math.inf, rest_rad=math.inf, seen=1.0):
        self.loop, (self.k_h, self.m_h, k_e), self.most, self.seen = loop, hand, most_nm, seen
        self.p, self.s, self.c, _ = (records(array)[0] for array in new_records(1))
        p, s, c = self.p, self.s, self.c
        p["period_s"], p["inertia_kgm2"][0], p["viscous_nms_rad"][0] = loop.period_s, loop.inertia_kgm2, 0.0
        p["mass_kgm2"][0] = s["mass_kgm2"][0] = loop.mass_kgm2
        p["mass_damping_nms_rad"][0] = s["mass_damping_nms_rad"][0] = loop.virtual_damping_nms_rad
        p["mass_force_alpha"][0] = lowpass_alpha(loop.force_lowpass_hz, loop.period_s)
        p["servo_velocity_alpha"][0] = lowpass_alpha(loop.velocity_lowpass_hz, loop.period_s)
        p["servo_velocity_gain_nms_rad"][0] = loop.velocity_gain_nms_rad
        p["mass_rest_nms_rad"][0], p["mass_rest_rad"][0] = loop.rest_damping_nms_rad, min(rest_rad, 1e6)
        p["mass_rest_alpha"][0] = lowpass_alpha(loop.rest_hz, loop.period_s)
        p["torque_limit_nm"][0] = p["torque_rate_nm"][0] = p["velocity_limit_rad_s"][0] = 1e9
        p["watch_floor_nm"] = 1e9
        s["state"], s["authority"], s["proxy_set_count"][0] = State.ACTIVE, 1.0, 1
        s["display_kind"][0] = Display.ADMITTANCE
        kind = Environment.SPRING if k_e > 0 else Environment.FREE
        c["environment_kind"][0] = s["world_kind"][0] = kind
        c["environment_stiffness_nm_rad"][0] = s["world_stiffness_nm_rad"][0] = k_e
        self.x = self.v = self.a = self.z = self.before = 0.0
        self.sent = [0.0] * (int(loop.delay) + 1)

    def run(self, seconds, parts=20):
        """Speeds at the ticks, rad/s."""
        loop, speeds = self.loop, []
        k, M, h = loop.bristle_nm_rad, loop.inertia_kgm2 + self.m_h, loop.period_s / parts
        b = loop.viscous_nms_rad + 2 * BRISTLE_DAMPING_SHARE * math.sqrt(k * loop.inertia_kgm2)
        for _ in range(round(seconds / loop.period_s)):
            force = -self.m_h * self.a - self.k_h * self.x
            shown = self.s["position_rad"][0] = self.seen * self.x
            difference = (shown - self.before) / loop.period_s
            torque = virtual_mass.servo_torque(self.s, self.p, self.c, 0, 1, difference, force, False)
            self.before, self.sent = shown, [*self.sent[1:], float(torque)]
            for _ in range(parts):
                self.a = (self.sent[0] - k * self.z - b * self.v - self.k_h * self.x) / M
                self.v += h * self.a
                self.x += h * self.v
                self.z = min(max(self.z + h * self.v, -self.most / k), self.most / k)
            speeds.append(self.v)
        return np.array(speeds)


def growth(rig, seconds=1.2):
    """Growth per tick, of a small push on."""
    rig.s["mass_velocity_rad_s"][0] = 1e-6
    speeds = np.abs(rig.run(seconds))
    part = len(speeds) // 4
    early, late = speeds[part : 2 * part].max(), speeds[3 * part :].max()
    return (late / early) ** (1 / (2 * part))


@pytest.mark.parametrize("damping", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("hand", [WORST, (50.0, 0.01, 400.0)])
def test_the_largest_eigenvalue_of_a_joint_that_sticks_is_the_growth_of_the_law(damping, hand):
    loop = replace(HEAVY, rest_damping_nms_rad=damping)
    k_h, m_h, k_e = hand
    at = points([(k_h, 0.0, m_h, loop.bristle_nm_rad, 0.0, k_e, 0.0)])
    assert growth(Stuck(loop, hand)) == pytest.approx(spectral_radii(loop, at)[0], abs=1.5e-3)


@pytest.mark.parametrize("swing", [0.5, 1.0, 1.3, 2.0, 6.0])
def test_spring_and_loss_are_the_first_harmonic_of_a_spring_that_slides_at_its_end(swing):
    turn = np.linspace(0, 8 * math.pi, 80_001)
    x, z, torque = swing * np.sin(turn), 0.0, []
    for step in np.diff(x, prepend=0.0):
        z = min(max(z + step, -1.0), 1.0)
        torque.append(z)
    last = slice(-20_000, None)
    first = 2 * np.mean(np.array(torque)[last] * np.exp(-1j * turn[last])) * 1j / swing
    assert spring_and_loss(swing) == pytest.approx((first.real, first.imag), abs=2e-3)


def test_what_grows_on_bristles_is_calmed_by_the_damping_that_is_named():
    found = sticking(HEAVY)
    assert not found.finding.ok
    assert found.speed_rad_s > 0.002
    damping = calming_rest_damping(HEAVY)
    assert damping > 0
    assert judge_stuck(replace(HEAVY, rest_damping_nms_rad=damping)).ok
    assert not judge_stuck(replace(HEAVY, rest_damping_nms_rad=0.5 * damping)).ok
    assert sticking(replace(HEAVY, rest_damping_nms_rad=damping)).speed_rad_s == 0.0


def test_a_swing_between_two_that_are_tried_is_told_as_fast_as_it_stands(monkeypatch):
    """By those tried alone it was told up to 1.3 times too slow."""
    k_h, m_h, k_e = WORST
    at = points([(k_h, 0.0, m_h, HEAVY.bristle_nm_rad, 0.0, k_e, 0.0)])
    told = admittance_sticking._swing(HEAVY, at)
    monkeypatch.setattr(admittance_sticking, "SWINGS", np.geomspace(1.0, 34.0, 200).tolist())
    assert admittance_sticking._swing(HEAVY, at) == pytest.approx(told, rel=0.02)


def test_it_swings_as_fast_as_is_foreseen_and_not_with_the_damping():
    found = sticking(HEAVY)
    most = HEAVY.bristle_nm_rad * HEAVY.presliding_rad
    rig = Stuck(HEAVY, WORST, most)
    rig.s["mass_velocity_rad_s"][0] = 0.2
    speed = float(np.sqrt(np.mean(np.square(rig.run(6.0)[-2000:]))))
    assert speed == pytest.approx(found.speed_rad_s, rel=0.1)
    calm = Stuck(
        replace(HEAVY, rest_damping_nms_rad=calming_rest_damping(HEAVY)),
        WORST,
        most,
        1.5 * HEAVY.presliding_rad,
    )
    calm.s["mass_velocity_rad_s"][0] = 0.2
    assert np.abs(calm.run(6.0)[-2000:]).max() < 1e-3


def test_the_damping_acts_while_the_joint_sticks_and_begins_anew_each_time():
    rig = Stuck(replace(HEAVY, rest_damping_nms_rad=1.0), (0.0, 0.0, 0.0), rest_rad=1e-3)

    def step(x, force):
        rig.s["position_rad"][0] = x
        virtual_mass.servo_torque(rig.s, rig.p, rig.c, 0, 1, (x - rig.before) / T, force, False)
        rig.before = x
        return float(rig.s["mass_velocity_rad_s"][0])

    m, b = HEAVY.mass_kgm2, HEAVY.virtual_damping_nms_rad
    step(0.0, 0.0)
    rig.p["mass_force_alpha"][0] = 1.0
    assert step(0.0, 1.0) == pytest.approx(T / (m + T * (b + 1.0)), rel=1e-6)  # sticks: damped by 1 besides
    held = rig.s["mass_calm_rad_s"][0]
    assert held > 0
    before = step(2e-3, 1.0)  # at the end of its bristles
    assert rig.s["mass_calm_rad_s"][0] == 0.0
    assert step(3e-3, 1.0) == pytest.approx((m * before + T) / (m + T * b), rel=1e-6)
    before = float(rig.s["mass_velocity_rad_s"][0])
    after = step(2.5e-3, 0.0)  # gave way a little, the mass goes on: nothing jumps
    assert after == pytest.approx((m + T * 1.0) * before / (m + T * (b + 1.0)), rel=1e-6)
    step(4e-3, 0.0)
    before = step(4.5e-3, -5.0)  # the mass turns back first
    assert before < 0.0
    after = step(4e-3, 0.0)  # then the joint: sticks again, from a damper at rest
    assert after == pytest.approx(m * before / (m + T * (b + 1.0)), rel=1e-6)


def test_without_a_length_nothing_sticks():
    rig = Stuck(replace(HEAVY, rest_damping_nms_rad=1.0), (0.0, 0.0, 0.0), rest_rad=0.0)
    virtual_mass.servo_torque(rig.s, rig.p, rig.c, 0, 1, 0.0, 0.0, False)
    virtual_mass.servo_torque(rig.s, rig.p, rig.c, 0, 1, 0.0, 1.0, False)
    assert rig.s["mass_calm_rad_s"][0] == 0.0
