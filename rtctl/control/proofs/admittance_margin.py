"""Is an admittance display stable with every hand of its box and in every linear world? What hand, what mass
would be?

Pure functions of numbers, on `admittance_loop` (eigenvalues over a grid) and `admittance_proof` (between its
points). A joint that sticks on its bristles is judged apart (`admittance_sticking`)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rtctl.control.proofs import admittance_proof
from rtctl.control.proofs.admittance_loop import (
    AdmittanceLoop,
    Points,
    eigenvalues,
    fine_worlds,
    grid,
    spectral_radii,
)
from rtctl.control.proofs.admittance_proof import Proof

GROWS_1_S = 1e-3
"""What grows more slowly than this counts as standing: a joint that nothing holds stands where it is put."""

_ROUNDING = 2e-8
"""Error of an eigenvalue of 1 that is double, as of a virtual mass that nothing damps."""

RINGS_HZ = 2.0
DAMPED_1_S = 20.0
"""As in `observer_margin`: slower motion is no vibration, and what dies by 1/e in 50 ms is damped enough."""

RUBS = (0.1, 0.3, 1.0, 3.0, 10.0)  # found by two certified rigs that swung on from .7 and .5 N m s/rad (2.13)
"""Dry friction as damping, in velocity gains: a friction of .25 N m on a gain of 2 N m s/rad at 1.6 to .016
rad/s."""

_HEAVIEST = 64.0
_STEPS = 18
"""Masses and dampings tried: up to so many times the present or the joint's, in so many steps."""
_SOFTEST_HAND, _STIFFEST_HAND = 0.5, 1e5
_LEAST_DAMPING, _MOST_DAMPING = 1e-3, 20.0
"""Hands and virtual dampings of a search, N m/rad and N m s/rad of a joint of the usual size; of any other in
proportion."""
_HALVINGS = 10
_CONFIRMS = 16
"""A step of a search for a mass is 1.5, halved ten times: to less than .1 %. Sixteen moves of 3 % go as far
as one such step: what does not pass by then was no bound of a stretch, and nothing is advised."""
_WORLDS = 24
"""Springs of the worlds that a search tries: by a factor of 1.8."""
_FINE_WORLDS = 150
"""And that confirm what it found: by a factor of 1.1, for a spring between two of the search's may bear 7 %
less."""


@dataclass(frozen=True)
class Finding:
    """What the grid says of a loop."""

    radius: float
    """Largest |eigenvalue| of one period."""
    kept: float
    """Least damping of a vibration, as a share of what virtual mass, hand and world would keep by
    themselves."""
    at: str
    """The hand, joint and world of the worst point."""
    points: int
    ok: bool
    """Stable at every point."""


def edge(loop: AdmittanceLoop) -> float:
    """|eigenvalue| of one period up to which a motion counts as one that does not grow."""
    return 1 + max(GROWS_1_S * loop.period_s, _ROUNDING)


def judge(loop: AdmittanceLoop) -> Finding:
    """The worst of the grid, a joint that slides."""
    at = grid(replace(loop, bristle_nm_rad=0.0))  # a joint that sticks has a judge of its own
    return worst_of(loop, at.beside(fine_worlds(loop, only_stiffest=False)))


def judge_rubbing(loop: AdmittanceLoop, *, some: bool = False) -> tuple[Finding, float]:
    """The worst with dry friction taken for damping of every size, and that damping, N m s/rad; `some`: of
    the stiffest hands and of those that have no spring.

    Notes
    -----
    Dry friction F takes out of a sine of speed amplitude V as much as a damping 4 F/(pi V) does (its
    describing function), from nothing at high speeds to all where it nearly stops. Where the loop grows at
    one of them, a slower motion grows and a quicker one dies: joint, mass and hand swing on at that V. Only
    speeds are left out at which that is more than ten velocity gains."""
    at = fine_worlds(loop, only_stiffest=False, count=_WORLDS)
    at = at[np.flatnonzero((at.k_h == 0) | (at.k_h == at.k_h.max()))] if some else at
    dampings = [by * loop.velocity_gain_nms_rad for by in RUBS]
    tried = [
        replace(loop, viscous_nms_rad=loop.viscous_nms_rad + more, bristle_nm_rad=0.0) for more in dampings
    ]
    found = [(worst_of(one, at), more) for one, more in zip(tried, dampings, strict=True)]
    return max(found, key=lambda one: math.inf if math.isnan(one[0].radius) else one[0].radius)


def judge_stiffest(loop: AdmittanceLoop) -> Finding:
    """The worst of the box's stiffest hands without damping in springs of all stiffnesses, a joint that
    slides."""
    return worst_of(loop, fine_worlds(loop, only_stiffest=True))


def worst_of(loop: AdmittanceLoop, at: Points) -> Finding:
    """The worst of some points."""
    return worst_among(loop, at, eigenvalues(loop, at))


def worst_among(loop: AdmittanceLoop, at: Points, z: np.ndarray) -> Finding:
    """The worst of some points of which the eigenvalues are there already."""
    size = np.abs(z)
    radius, kept = size.max(axis=1), _kept(loop, at, z)
    stable = bool(radius.max() <= edge(loop))  # NaN is not
    worst = int(np.argmin(kept) if stable else np.argmax(radius))  # the nearest to it, or what is beyond
    return Finding(float(radius.max()), float(kept.min()), at.words(loop, worst), at.size, stable)


def _kept(loop: AdmittanceLoop, at: Points, z: np.ndarray) -> np.ndarray:
    """Damping of the least damped vibration of every point, as a share of the ideal one's; 1 where none is
    less."""
    rings = np.abs(np.angle(z)) > 2 * math.pi * RINGS_HZ * loop.period_s
    ring = np.where(rings, np.abs(z), 0.0).max(axis=1)
    with np.errstate(divide="ignore"):
        rate = -np.log(ring) / loop.period_s
    mass = loop.mass_kgm2 + at.m_h
    alone = (loop.virtual_damping_nms_rad + at.b_h + at.b_e) / (2 * mass)  # of a mass on a spring: b/(2 m)
    return np.minimum(rate / np.clip(alone, 1e-3, DAMPED_1_S), 1.0)  # what dies in 50 ms is damped enough


def proof(loop: AdmittanceLoop) -> Proof:
    """That it is stable between the points, too, as long as the joint slides."""
    return admittance_proof.prove(replace(loop, bristle_nm_rad=0.0))


def passes_stiffest(loop: AdmittanceLoop, *, world: bool = True, worlds: int = _WORLDS) -> bool:
    """Stable with the stiffest hands, that have no damping, in some worlds or in none: a search goes by
    these, as they decide most, and what it finds is confirmed by more worlds and by `judge`."""
    slides = replace(loop, bristle_nm_rad=0.0)
    at = fine_worlds(slides, only_stiffest=True, count=worlds)
    at = at if world else at[np.flatnonzero(at.k_e == 0)]
    return bool(spectral_radii(slides, at).max() <= edge(loop))


def largest_hand(loop: AdmittanceLoop, *, world: bool = True) -> float:
    """Stiffness N m/rad up to which every hand passes, in any world (`world`) or in free motion; 1e5 of a
    usual joint if none is too stiff.

    The softest hands first: what passes is the stretch up to the first that does not."""

    def passes(k_h: float) -> bool:
        box = replace(loop.box, stiffness_nm_rad=k_h)
        return passes_stiffest(replace(loop, box=box), world=world)

    low = 0.0
    if not passes(low):
        return 0.0
    # a box may be stiffer than all that is tried
    most = max(_STIFFEST_HAND * loop.size, loop.box.stiffness_nm_rad)
    for k_h in np.geomspace(_SOFTEST_HAND * loop.size, most, _STEPS):
        if not passes(float(k_h)):
            found = _between(passes, low, float(k_h))
            return _confirmed(loop, found, 0.97, _with_hand) if world else found
        low = float(k_h)
    return most


SENSORS_HZ = (2000.0, 10.0)
"""Own low-passes of a force sensor that are tried, from the quickest to the slowest."""


def slowest_sensor(loop: AdmittanceLoop) -> float:
    """Own low-pass of the force sensor down to which all that is tried passes, Hz; 0: the slowest tried
    passes, infinite: not even the quickest.

    The quickest first: what passes is the stretch down to the first that does not. Confirmed by the grid, and
    with dry friction."""

    def passes(hz: float) -> bool:
        return passes_stiffest(replace(loop, sensor_hz=hz))

    quicker = 0.0
    for hz in np.geomspace(*SENSORS_HZ, _STEPS):
        if not passes(float(hz)):
            found = _between(passes, quicker, float(hz)) if quicker > 0 else float(hz)
            return _confirmed(loop, found, 1.03, _with_sensor) or math.inf
        quicker = float(hz)
    return 0.0


def smallest_mass(loop: AdmittanceLoop) -> float:
    """Least virtual mass from which on, up to 64 times the joint's inertia, all that is tried passes, kg m^2;
    0 if none does."""
    masses = np.geomspace(loop.inertia_kgm2 / 16, loop.inertia_kgm2 * _HEAVIEST, _STEPS)
    heavier = None
    for mass in masses[::-1]:  # from the heaviest: what passes need not be one stretch
        if not passes_stiffest(with_mass(loop, float(mass))):
            if heavier is None:
                continue  # so heavy that the filters outweigh it: lighter may do
            found = _between(lambda m: passes_stiffest(with_mass(loop, m)), heavier, float(mass))
            return _confirmed(loop, found, 1.03, with_mass)
        heavier = float(mass)
    return heavier or 0.0


def least_damping(loop: AdmittanceLoop) -> float:
    """Least virtual damping, no less than the present, that passes, N m s/rad; 0 if none does."""
    present = max(loop.virtual_damping_nms_rad, _LEAST_DAMPING * loop.size)
    low = present
    for damping in np.geomspace(present, max(_MOST_DAMPING * loop.size, 4 * present), _STEPS):
        if passes_stiffest(replace(loop, virtual_damping_nms_rad=float(damping))):
            found = _between(
                lambda b: passes_stiffest(replace(loop, virtual_damping_nms_rad=b)), float(damping), low
            )
            return _confirmed(loop, found, 1.03, _with_damping)
        low = float(damping)
    return 0.0


def _with_hand(loop: AdmittanceLoop, k_h: float) -> AdmittanceLoop:
    return replace(loop, box=replace(loop.box, stiffness_nm_rad=k_h))


def with_mass(loop: AdmittanceLoop, mass: float) -> AdmittanceLoop:
    """With the share that is sent ahead of a mass below the joint's
    (`admittance_table.AdmittanceTable.sent_ahead`)."""
    # m/J of it is sent ahead of a lighter mass (14.2)
    now, then = (min(1.0, one / loop.inertia_kgm2) for one in (loop.mass_kgm2, mass))
    return replace(loop, mass_kgm2=mass, feedforward=loop.feedforward * then / now)


def _with_sensor(loop: AdmittanceLoop, hz: float) -> AdmittanceLoop:
    return replace(loop, sensor_hz=hz)


def _with_damping(loop: AdmittanceLoop, damping: float) -> AdmittanceLoop:
    return replace(loop, virtual_damping_nms_rad=damping)


def _confirmed(
    loop: AdmittanceLoop,
    value: float,
    step: float,
    with_value: Callable[[AdmittanceLoop, float], AdmittanceLoop],
) -> float:
    """The value, moved away from what fails until the whole grid passes, too; 0 if it does not."""
    for _ in range(_CONFIRMS):
        one = with_value(loop, value)
        if passes_stiffest(one, worlds=_FINE_WORLDS) and judge(one).ok:
            return value
        value *= step
    return 0.0


def _between(passes: Callable[[float], bool], good: float, bad: float) -> float:
    """The good end of what lies between, after some halvings."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if passes(middle) else (good, middle)
    return good


def mass_min_continuous(J: float, b: float, K_v: float) -> float:
    """Virtual mass from which on a display without lag, K_p b = 0, is passive with any hand and world, kg
    m^2.

    Notes
    -----
    J K_v/(b + K_v) (docs/theory.md 2.13). The inertia before the sensor bounds it: no gain renders less."""
    return J * K_v / (b + K_v)
