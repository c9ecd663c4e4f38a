"""Help with dry friction that turns with the virtual mass: swings that it feeds, by the describing function
and beside a joint in time.
"""

from dataclasses import replace

import numpy as np

from rtctl.control.proofs import admittance_margin
from rtctl.control.proofs.admittance_help import judge_help, largest_help
from rtctl.control.proofs.admittance_loop import AdmittanceLoop, Box
from rtctl.control.velocity import lowpass_alpha

T = 1e-3
HELPED = AdmittanceLoop(
    0.012, 0.05, T, 0.0455, 0.057, 1.57, force_lowpass_hz=176.0, velocity_lowpass_hz=107.0, sensor_ticks=4,
    feedforward=1.0, feedforward_lowpass_hz=24.6,
    told_viscous_nms_rad=0.05, bristle_nm_rad=271.0, presliding_rad=1.44e-3, box=Box(90.0, 0.37, 0.0064),
    help_share=0.69, help_turns_rad=1.15e-3,
)  # fmt: skip
"""By a campaign, on bristles of 2000 N m/rad: a hand of 90 N m/rad swung on by 16 to 20 mrad, 6.6 Hz, .27
rad/s, with the help of a learned model."""


def test_help_that_turns_with_the_mass_before_the_joint_keeps_a_hand_swinging():
    assert admittance_margin.judge_rubbing(HELPED)[0].ok
    assert judge_help(replace(HELPED, help_share=0.0)).ok
    found = judge_help(HELPED)
    assert not found.ok
    assert found.at.startswith("hand of 90 N m/rad, 0 N m s/rad")
    most = largest_help(HELPED)
    assert 0 < most < 0.6
    assert judge_help(replace(HELPED, help_share=most)).ok


class Coulomb:
    """The law's lines written anew beside a rigid joint of dry friction F, in parts of a period; the help
    turns over `TURNS_RAD` of the mass's motion.
    """

    TURNS_RAD = 1.15e-3

    def __init__(self, loop, hand, friction_nm, speed_rad_s):
        self.loop, (self.k_h, self.m_h), self.F = loop, hand, friction_nm
        self.v_r = self.v = speed_rad_s
        self.x = self.a = self.turned = self.before = self.ahead = self.felt = self.v_hat = 0.0
        self.forces = [0.0] * (loop.sensor_ticks + 1)

    def tick(self):
        """Torque that is sent."""
        loop, T = self.loop, self.loop.period_s
        self.forces = [*self.forces[1:], -self.k_h * self.x - self.m_h * self.a]
        self.felt += lowpass_alpha(loop.force_lowpass_hz, T) * (self.forces[0] - self.felt)
        self.v_hat += lowpass_alpha(loop.velocity_lowpass_hz, T) * ((self.x - self.before) / T - self.v_hat)
        self.before, last = self.x, self.v_r
        self.v_r = (loop.mass_kgm2 * last + T * self.felt) / (
            loop.mass_kgm2 + T * loop.virtual_damping_nms_rad
        )
        asked = loop.inertia_kgm2 * (self.v_r - last) / T + loop.told_viscous_nms_rad * self.v_r - self.felt
        self.ahead += lowpass_alpha(loop.feedforward_lowpass_hz, T) * (asked - self.ahead)
        self.turned = np.clip(self.turned + T * self.v_r / self.TURNS_RAD, -1, 1)
        helped = loop.help_share * self.F * self.turned
        return loop.velocity_gain_nms_rad * (self.v_r - self.v_hat) + loop.feedforward * self.ahead + helped

    def run(self, seconds, parts=40):
        """Largest speed in the last half second."""
        loop, speeds = self.loop, []
        h, inertia = loop.period_s / parts, loop.inertia_kgm2 + self.m_h
        for _ in range(round(seconds / loop.period_s)):
            sent = self.tick()
            for _ in range(parts):
                v = self.v + h * (sent - self.k_h * self.x - loop.viscous_nms_rad * self.v) / inertia
                v -= np.clip(v, -h * self.F / inertia, h * self.F / inertia)
                self.a, self.v = (v - self.v) / h, v
                self.x += h * self.v
            speeds.append(abs(self.v))
        return max(speeds[-round(0.5 / loop.period_s) :])


def test_less_help_lets_it_come_to_rest_and_the_present_does_not():
    """Help that turns as soon as the mass does would let it rest, too: the way over which it turns is what
    keeps it swinging.
    """
    most = largest_help(HELPED)
    swings = {share: Coulomb(replace(HELPED, help_share=share), (90.0, 0.0064), 0.3,
        0.6) for share in (HELPED.help_share, most)}  # fmt: skip
    assert swings[HELPED.help_share].run(3.0) > 0.5
    assert swings[most].run(3.0) < 0.1
