"""Is the disturbance observer stable with every hand of a box? Eigenvalues of `observer_loop`, over a grid.

Pure functions of numbers. What is shown holds at the points of the grid, and by the share of damping that
each vibration must keep a little beyond, not for sure between them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from rtctl.control.proofs.drive_in_hand import frequency_hz
from rtctl.control.proofs.eigenvalues import eigenvalues_of_each
from rtctl.control.proofs.observer_loop import Loop, Points, grid, matrices

TOLERANCE = 1e-6
"""An eigenvalue of 1 is a joint that stands where it is put. The routine errs by 2e-13 (decision 0097); what
grows by a millionth a period needs a quarter of an hour at 1 kHz to grow by e."""

KEPT_LEAST = 0.25
"""Least share that is left of what damps a vibration without the observer: room for what lies between the
points."""

RINGS_HZ = 2.0
"""Slower motion is no vibration: the observer makes a joint yield more slowly where it makes it yield
more."""

DAMPED_1_S = 20.0
"""A vibration that dies as fast as this without the observer counts as one that dies so fast: 1/e in 50
ms."""

GAINS = tuple(round(0.98 - 0.02 * n, 2) for n in range(49))
BANDWIDTHS_HZ = (1, 2, 3, 5, 7, 10, 12, 15, 17, 20, 22, 25, 27, 30, 35, 40, 50, 60, 80, 100)
"""What is tried for a remedy: what passes is no single stretch, as a slower filter lags more."""


SENSORS_HZ = tuple(round(float(hz), 1) for hz in np.geomspace(2000.0, 8.0, 26))
"""Own low-passes of a force sensor that are tried, from the quickest to the slowest."""


@dataclass(frozen=True)
class Finding:
    """What the grid says of a loop."""

    radius: float
    """Largest |eigenvalue| of one period."""
    kept: float
    """Least share that is left of the damping of a vibration; 1 where none is damped less."""
    at: str
    """The hand, joint and state of the worst point, in words."""
    points: int
    worst: int
    """Which of the points judged that is."""

    @property
    def ok(self) -> bool:
        """Stable everywhere, and no vibration much less damped than without the observer; NaN is neither."""
        return self.radius <= 1 + TOLERANCE and self.kept >= KEPT_LEAST


def modes(loop: Loop, points: Points) -> tuple[np.ndarray, np.ndarray]:
    """Largest |eigenvalue| of one period at every point, and that of its vibrations; infinite where it is no
    number."""
    M = matrices(loop, points)
    good = np.isfinite(M).all(axis=(1, 2))
    z = np.full(M.shape[:2], np.inf, dtype=complex)
    if good.any():
        z[good] = eigenvalues_of_each(M[good])
    size = np.abs(z) ** (1 / loop.sample_ticks)
    # an eigenvalue turns over a whole frame
    rings = np.abs(np.angle(z)) > 2 * math.pi * RINGS_HZ * loop.period_s * loop.sample_ticks
    return size.max(axis=1), np.where(rings, size, 0.0).max(axis=1)


def _kept(loop: Loop, points: Points, alone: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Largest |eigenvalue| and share of damping kept, at every point; `alone`: the vibrations' |eigenvalue|
    without the observer."""
    radius, ring = modes(loop, points)
    with np.errstate(divide="ignore", invalid="ignore"):
        rate, before = -np.log(ring) / loop.period_s, -np.log(alone) / loop.period_s
        # a vibration that dies by less than 1e-3/s counts as one of that: 0 would leave nothing to divide by,
        # and a growing one nothing to compare with
        share = rate / np.clip(before, 1e-3, DAMPED_1_S)
    return radius, np.where(ring > 0, share, 1.0)


def _alone(loop: Loop) -> np.ndarray:
    """Largest |eigenvalue| of vibrations without the observer, at every point of the grid: then nothing goes
    by the force or by how it is used."""
    return _vibrations(
        replace(loop, gain=0.0, bandwidth_hz=1.0, excess=0.0, sensor_hz=0.0, sensor_ticks=0, own_ticks=0)
    )


@lru_cache(maxsize=256)
def _vibrations(loop: Loop) -> np.ndarray:
    """Largest |eigenvalue| of vibrations at every point of the grid, not to be written to; asked once for all
    sensors, gains and bandwidths that are tried."""
    return modes(loop, grid(loop))[1]


def judge(loop: Loop, chosen: np.ndarray | None = None) -> Finding:
    """The worst of the grid, or of its points of these numbers."""
    points, alone = grid(loop), _alone(loop)
    if chosen is not None:
        points, alone = points[chosen], alone[chosen]
    radius, kept = _kept(loop, points, alone)
    return _finding(loop, points, radius, kept)


def _finding(loop: Loop, points: Points, radius: np.ndarray, kept: np.ndarray) -> Finding:
    unstable = radius.max() > 1 + TOLERANCE
    worst = int(np.argmax(radius)) if unstable else int(np.argmin(kept))
    return Finding(
        float(radius.max()), min(float(kept.min()), 1.0), _words(loop, points, worst), points.size, worst
    )


def _words(loop: Loop, points: Points, at: int) -> str:
    k_h, b_h, m_h, bristle, joint, coupled = (float(column[at]) for column in points.columns())
    one = loop.joints[int(joint)]
    hz = frequency_hz(loop.inertia_kgm2, one)
    return (
        f"hand of {k_h:.3g} N m/rad, {b_h:g} N m s/rad, {m_h:g} kg m^2, "
        f"{'stuck' if bristle else 'sliding'}, {'on the coupling' if coupled else 'free'}, "
        f"{f'joint of {hz:.3g} Hz' if hz else 'rigid joint'}"
    )


def first_passing(loop: Loop, tried: Iterable[tuple[float, float]]) -> tuple[float, float] | None:
    """First pair of gain and bandwidth that passes. The points that are worst as things are come first: they
    decide most."""
    radius, kept = _kept(loop, grid(loop), _alone(loop))
    # twice what must be kept: another gain or bandwidth moves the weakest point, and one that is missed here
    # is found by the whole grid below, at its price
    weak = np.flatnonzero((radius > 1 + TOLERANCE) | (kept < 2 * KEPT_LEAST))
    for gain, bandwidth_hz in tried:
        other = replace(loop, gain=gain, bandwidth_hz=bandwidth_hz)
        if (weak.size == 0 or judge(other, weak).ok) and judge(other).ok:
            return gain, bandwidth_hz
    return None


def slowest_sensor(loop: Loop) -> float:
    """Own low-pass of the force sensor down to which the observer passes, Hz; 0: the slowest tried passes,
    infinite: not even the quickest.

    Searched at the points that are weak with some sensor, and confirmed at all."""
    points = grid(loop)
    alone = _alone(loop)
    weak = np.zeros(points.size, dtype=bool)
    # four, from quick to slow: which points are weak changes with what the sensor turns by
    for hz in SENSORS_HZ[4::7]:
        radius, kept = _kept(replace(loop, sensor_hz=hz), points, alone)
        weak |= (radius > 1 + TOLERANCE) | (kept < 2 * KEPT_LEAST)
    chosen = np.flatnonzero(weak)
    some, some_alone = points[chosen], alone[chosen]

    def passes(hz: float) -> bool:
        if chosen.size == 0:
            return True
        return _passes_everywhere(loop, hz, some, some_alone)

    held = 0
    while held < len(SENSORS_HZ) and passes(SENSORS_HZ[held]):  # the stretch down to the first that fails
        held += 1
    whole = held == len(SENSORS_HZ)
    # the points that were not weak with those four may be so with another: from here on all are asked
    while held > 0 and not _passes_everywhere(loop, SENSORS_HZ[held - 1], points, alone):
        held, whole = held - 1, False
    if held == 0:
        return math.inf
    return 0.0 if whole else SENSORS_HZ[held - 1]


def _passes_everywhere(loop: Loop, sensor_hz: float, points: Points, alone: np.ndarray) -> bool:
    radius, kept = _kept(replace(loop, sensor_hz=sensor_hz), points, alone)
    return bool(radius.max() <= 1 + TOLERANCE and kept.min() >= KEPT_LEAST)


def largest_gain(loop: Loop) -> float:
    """Largest gain of `GAINS`, up to the present one, that passes at this bandwidth; 0 if none does."""
    found = first_passing(loop, ((gain, loop.bandwidth_hz) for gain in GAINS if gain <= loop.gain))
    return found[0] if found else 0.0


def nearest_bandwidth(loop: Loop) -> float:
    """The one of `BANDWIDTHS_HZ` nearest to the present that passes at this gain, Hz; 0 if none does."""
    near = sorted(BANDWIDTHS_HZ, key=lambda hz: abs(math.log(hz / loop.bandwidth_hz)))
    found = first_passing(loop, ((loop.gain, float(hz)) for hz in near))
    return found[1] if found else 0.0
