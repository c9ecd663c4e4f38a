"""Does an admittance ring on a joint that dry friction holds, and how fast is the hand shaken then?

Pure functions of numbers, on `admittance_loop`. Within its presliding dry friction is a spring, to which the
servo pushes what the hand's force makes of the virtual mass, and the hand's mass answers by its acceleration.
What grows there grows until the bristles slide, and friction takes out what is fed (docs/theory.md 2.13): of
a swing of a presliding lengths friction is the spring k n'(a) and the damping k n''(a)/w,

    cos phi = 1 - 2/a,     n' = (phi - sin phi cos phi)/pi,     n'' = sin^2 phi/pi

which is the describing function of a spring that slides at its end. No other friction of that stiffness and
size takes less out of a swing so small."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from rtctl.control.proofs.admittance_loop import AdmittanceLoop, Points, eigenvalues, grid, spectral_radii
from rtctl.control.proofs.admittance_margin import Finding, edge, worst_among

SOFTER = (0.0625, 0.25)
"""Softer bristles of a joint that sticks, as shares of those told: friction may be less than its peak."""

SWINGS = (1.0, 1.5, 2.0, 3.0, 5.0, 8.0, 13.0, 21.0, 34.0)
"""Amplitudes tried, in presliding lengths. Upwards from 1, as a swing that begins at rest grows, until one
does not: from there none comes to a larger one that would grow again."""

_HALVINGS = 5
"""Between two of them: to 1.5 %."""

_FOLLOWED = 12
"""Points that grow, of each bristle stiffness, whose swing is followed: the quickest to grow, and as many of
the highest frequency."""

_DAMPINGS = 24
_LEAST_DAMPING, _MOST_DAMPING = 0.02, 30.0
"""How many dampings at rest are tried, from which to which, N m s/rad of a joint of the usual size; of any
other in proportion."""
_MORE = 1.5
"""What just does not grow would ring for many seconds."""


@dataclass(frozen=True)
class Sticking:
    """What is found of a joint that sticks."""

    finding: Finding
    speed_rad_s: float
    """Speed of the joint, RMS, at which the largest swing stands; 0 where none grows."""
    at: str
    """The hand, joint and world of that."""


def judge_stuck(loop: AdmittanceLoop) -> Finding:
    """The worst of the grid for a joint that sticks (`bristle_nm_rad` > 0), on softer and stiffer bristles
    than told."""
    found = [worst_among(one, *_spectrum(one, share)) for share, one in _tried(loop)]
    return max(found, key=lambda one: math.inf if math.isnan(one.radius) else one.radius)


def sticking(loop: AdmittanceLoop) -> Sticking:
    """The worst of the grid, and how fast the joint is shaken there."""
    found = judge_stuck(loop)
    if found.ok:
        return Sticking(found, 0.0, "")
    worst, at = 0.0, found.at
    for share, one in _tried(loop):
        # stiffer bristles slide sooner, with the same friction; softer ones are those of a smaller friction,
        # which slides after the same way
        length = loop.presliding_rad / max(share, 1.0)
        for point in _followed(one, share):
            speed = length * _swing(one, point)
            if speed > worst:
                worst, at = speed, point.words(one, 0)
    return Sticking(found, worst, at)


def calming_rest_damping(loop: AdmittanceLoop) -> float:
    """Damping of the mass on a joint that sticks with which nothing grows there, and half more, N m s/rad; 0:
    none of those tried.

    Searched at the points that grow without it, and confirmed at all."""
    weak = [(one, _growing(one, share)[0]) for share, one in _tried(replace(loop, rest_damping_nms_rad=0.0))]
    for damping in (loop.size * np.geomspace(_LEAST_DAMPING, _MOST_DAMPING, _DAMPINGS)).tolist():
        if all(_rests(replace(one, rest_damping_nms_rad=damping), at) for one, at in weak):
            found = _MORE * damping
            # half more may be too much elsewhere
            return found if judge_stuck(replace(loop, rest_damping_nms_rad=found)).ok else 0.0
    return 0.0


def _rests(loop: AdmittanceLoop, at: Points) -> bool:
    return at.size == 0 or bool(spectral_radii(loop, at).max() <= edge(loop))


def _tried(loop: AdmittanceLoop) -> list[tuple[float, AdmittanceLoop]]:
    """Shares of the bristles told, in steps of four, and the loop with them."""
    stiffer = [4.0**n for n in range(round(math.log(loop.bristles_to, 4)) + 1)]
    return [
        (share, replace(loop, bristle_nm_rad=share * loop.bristle_nm_rad)) for share in (*SOFTER, *stiffer)
    ]


def _points(loop: AdmittanceLoop, share: float) -> Points:
    """Hands and worlds of the grid while the joint sticks; on bristles that are not as told those of hands
    without damping, which decide."""
    at = grid(loop)
    return at[np.flatnonzero((at.bristle > 0) & ((share == 1.0) | (at.b_h == 0)))]


@lru_cache(maxsize=8)
def _spectrum(loop: AdmittanceLoop, share: float) -> tuple[Points, np.ndarray]:
    """The points and their eigenvalues, not to be written to: those that grow are followed once it is known
    that some do."""
    at = _points(loop, share)
    return at, eigenvalues(loop, at)


def _growing(loop: AdmittanceLoop, share: float) -> tuple[Points, np.ndarray]:
    """Points that grow while the joint sticks, and the eigenvalue of each that does."""
    at, z = _spectrum(loop, share)
    worst = z[np.arange(at.size), np.argmax(np.abs(z), axis=1)]
    grows = np.flatnonzero(~(np.abs(worst) <= edge(loop)))
    return at[grows], worst[grows]


def _followed(loop: AdmittanceLoop, share: float) -> list[Points]:
    """Some of these, one by one: the quickest to grow, and those of the highest frequency."""
    at, z = _growing(loop, share)
    chosen = {
        *np.argsort(-np.abs(z))[:_FOLLOWED].tolist(),
        *np.argsort(-np.abs(np.angle(z)))[:_FOLLOWED].tolist(),
    }
    return [at[one] for one in sorted(chosen)]


def spring_and_loss(swing: float) -> tuple[float, float]:
    """N' and n'' of a swing of so many presliding lengths; below 1 a spring."""
    phi = math.acos(1.0 - 2.0 / max(swing, 1.0))
    return (phi - math.sin(phi) * math.cos(phi)) / math.pi, math.sin(phi) ** 2 / math.pi


def _swing(loop: AdmittanceLoop, at: Points) -> float:
    """RMS speed over presliding length, 1/s, of the largest swing that still grows at one point: the largest
    of `SWINGS`, and from there on by halves of what is left up to the first that does not."""
    grows = dies = w = 0.0
    for swing in SWINGS:
        found = _ring_rad_s(loop, at, swing, w)
        if found == 0.0:
            dies = swing
            break
        grows, w = swing, found
    # the swing stands between both, up to 1.6 times the one that grows, and is as much faster
    for _ in range(_HALVINGS if grows * dies > 0 else 0):
        middle = math.sqrt(grows * dies)
        found = _ring_rad_s(loop, at, middle, w)
        grows, dies, w = (middle, dies, found) if found > 0 else (grows, middle, w)
    return grows * w / math.sqrt(2.0)


def _ring_rad_s(loop: AdmittanceLoop, at: Points, swing: float, w: float) -> float:
    """Frequency of what grows in a swing of so many presliding lengths, rad/s, where a smaller one grew at
    `w` (0: none did); 0: nothing does."""
    spring, loss = spring_and_loss(swing)
    rubbed = loop.viscous_nms_rad + (loss * loop.bristle_nm_rad / w if w > 0 else 0.0)
    z = eigenvalues(replace(loop, viscous_nms_rad=rubbed), replace(at, bristle=at.bristle * spring))[0]
    worst = z[np.argmax(np.abs(z))]
    return 0.0 if abs(worst) <= edge(loop) else float(np.abs(np.log(worst))) / loop.period_s
