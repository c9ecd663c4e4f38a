"""Does the help with dry friction keep a hand swinging that an admittance holds? And how much help does not?

Pure functions of numbers, on `admittance_loop`. The help turns with the virtual mass, over a way of it, and
friction with the joint, over its bristles. In a swing of amplitude A both are what the describing function of
a spring that slides at its end makes of them (docs/theory.md 2.16):

    friction   (F/x_s) [n'(A/x_s) + n''(A/x_s) s/w]   on the joint
    help     h (F/x_t) [n'(A/x_t) + n''(A/x_t) s/w]   along the mass"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from rtctl.control.proofs.admittance_loop import AdmittanceLoop, Points, Swing, eigenvalues, fine_worlds
from rtctl.control.proofs.admittance_sticking import spring_and_loss

STIFFNESSES = (0.25, 1.0, 4.0)
"""Bristles tried, as shares of those told."""

SWINGS = (1.5, 2.5, 4.0, 8.0, 16.0, 32.0)
"""Amplitudes tried, in presliding lengths that are credited: of smaller ones the law calls the joint at rest,
and the help hardly turns."""

FASTEST_RAD_S = 2 * math.pi * 12.0
"""Faster the servo hardly has the joint follow, so that joint and mass do not swing alike; that a joint that
sticks may ring so, is a row of its own."""

HELPS = (0.85, 0.7, 0.55, 0.4, 0.25, 0.1)
"""Shares of the present help that are tried where it is too much."""

_CREDITED = 1.5
"""`friction.guarantee.LENGTH_FACTOR`, which no proof may import: x_b of the law is so many lengths."""
_WORLDS = 7
_ROUNDS = 3
_BEGIN_RAD_S = 25.0
_SLOWEST_RAD_S = 3.0
GROWS_1_S = 0.02
"""What grows more slowly is between the points of a describing function, which is good to some hundredths."""


@dataclass(frozen=True)
class Helped:
    """The swing that the help feeds most."""

    growth_1_s: float
    amplitude_rad: float = 0.0
    speed_rad_s: float = 0.0
    """RMS."""
    at: str = ""

    @property
    def ok(self) -> bool:
        """Nothing grows."""
        return self.growth_1_s <= GROWS_1_S


def judge_help(loop: AdmittanceLoop) -> Helped:
    """The swing that grows the most with the help, over hands without damping, worlds, stiffness of the
    bristles and amplitudes."""
    if not _helps(loop):
        return Helped(0.0)
    at = fine_worlds(loop, only_stiffest=False, count=_WORLDS)
    found = [_swing(loop, at, stiff, lengths) for stiff, lengths in product(STIFFNESSES, SWINGS)]
    return max(found, key=lambda one: math.inf if math.isnan(one.growth_1_s) else one.growth_1_s)


def _helps(loop: AdmittanceLoop) -> bool:
    return loop.help_share > 0 and loop.help_turns_rad > 0 and loop.presliding_rad > 0


def largest_help(loop: AdmittanceLoop) -> float:
    """Largest share of the dry friction, of those tried up to the present, with which nothing grows; 0 if
    none."""
    at = fine_worlds(loop, only_stiffest=False, count=_WORLDS)
    tried = list(product(STIFFNESSES, SWINGS))
    for part in HELPS:
        helped = replace(loop, help_share=part * loop.help_share)
        grown = next((one for one in tried if _helps(helped) and not _swing(helped, at, *one).ok), None)
        if grown is None:
            return part * loop.help_share
        tried.sort(key=lambda one: one != grown)  # most that grows with more help grows with less, too
    return 0.0


def _swing(loop: AdmittanceLoop, at: Points, stiff: float, lengths: float) -> Helped:
    """The worst point at an amplitude of so many credited presliding lengths, of those that the help makes
    grow: what grows without it is of other rows."""
    amplitude_rad = _CREDITED * lengths * loop.presliding_rad
    growth, w = _growth(loop, at, stiff, amplitude_rad)
    grows = np.flatnonzero(~(growth <= GROWS_1_S))
    # asked of those alone that grow: most do not, and the second question costs as much as the first
    if grows.size:
        bare, _ = _growth(replace(loop, help_share=0.0), at[grows], stiff, amplitude_rad)
        growth[grows] = np.where(bare > GROWS_1_S, 0.0, growth[grows])
    most = int(np.argmax(growth))
    speed = amplitude_rad * float(w[most]) / math.sqrt(2.0)
    return Helped(float(growth[most]), amplitude_rad, speed, at.words(loop, most))


def _growth(
    loop: AdmittanceLoop, at: Points, stiff: float, amplitude_rad: float
) -> tuple[np.ndarray, np.ndarray]:
    """Growth of every point at one amplitude, 1/s, and its frequency, rad/s: loss and frequency follow each
    other."""
    friction_nm, T = loop.bristle_nm_rad * loop.presliding_rad, loop.period_s
    spring, loss = spring_and_loss(stiff * amplitude_rad / loop.presliding_rad)
    pulls, feeds = spring_and_loss(amplitude_rad / loop.help_turns_rad)
    bristle, helps = stiff * loop.bristle_nm_rad, loop.help_share * friction_nm / loop.help_turns_rad
    held = replace(at, bristle=np.full(at.size, bristle * spring))
    w, growth = np.full(at.size, _BEGIN_RAD_S), np.zeros(at.size)
    for _ in range(_ROUNDS):  # n''/w needs the frequency that it decides: three rounds
        swing = Swing(
            bristle * loss / w, np.full(at.size, helps * pulls), helps * feeds / w, np.ones(at.size)
        )
        z = eigenvalues(loop, held, swing)
        turns = np.abs(np.angle(z))
        # faster, mass and joint do not swing alike, and the two functions say nothing
        swings = np.where((turns > _SLOWEST_RAD_S * T) & (turns < FASTEST_RAD_S * T), np.abs(z), 0.0)
        worst = np.arange(at.size), np.argmax(swings, axis=1)
        size = swings[worst]
        w = np.where(size > 0, turns[worst] / T, w)
        growth = np.where(size > 0, np.log(np.maximum(size, 1e-12)) / T, 0.0)
    return growth, w
