"""The worst passive hand for a sampled loop, and whether a coupling is stable in it (docs/theory.md 2.11).

Lossless masses on springs, chosen so that hand and joint together resonate at the first N odd multiples of
the Nyquist frequency, where sampling folds the device's response onto one place:

    J s + Z_h = J prod_n (s^2 + w_n^2) / (s prod_m (s^2 + p_m^2))
    w_n = (2n - 1) pi / T,   w_m < p_m < w_m+1

In partial fractions this is a spring to ground and N - 1 masses on springs, all positive. The state is in
root energy coordinates, in which the network is a rotation and the exact step well conditioned at any N."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rtctl.control.jit import compiled


@dataclass(frozen=True)
class Hand:
    """Joint and hand over one step: q' = step q + push u, joint angle = angle q, joint speed = speed q."""

    step: np.ndarray
    push: np.ndarray
    angle: np.ndarray
    speed: np.ndarray


def worst(inertia: float, damping: float, T: float, modes: int, parts: int = 1) -> Hand:
    """Hand of `modes` resonances on a joint of this inertia (kg m^2) and damping (N m s/rad).

    Parameters
    ----------
    T : float
        Control period, s.
    parts : int
        The step is this part of the period."""
    # odd multiples: sampling folds them all onto one place, where their responses add up
    w2 = ((2 * np.arange(1, modes + 1) - 1) * math.pi / T) ** 2
    # w_m < p_m < w_m+1, as a lossless network has them, for any number; where between them makes no odds: at
    # each resonance the joint answers with 1/b, whatever share of 1/J the p leave it. Not at the even
    # multiples themselves: a mass that swings a whole number of times in a period stands still in all samples
    p2 = ((2 * np.arange(1, modes) - 0.06) * math.pi / T) ** 2
    return network(inertia, damping, T / parts, w2, p2)


def network(inertia: float, damping: float, T: float, w2: np.ndarray, p2: np.ndarray) -> Hand:
    """Joint and hand over a step T with these squared resonances w2, rising, and poles of the hand's
    impedance p2 between them."""
    from scipy.linalg import expm

    modes = len(w2)
    ground = inertia * w2[0] * math.prod(w2[1:] / p2)
    # residues of the partial fractions, positive since resonances and poles take turns
    springs = [
        inertia * (w2[0] - one) / -one * (w2[n + 1] - one) * _ratio(w2[1:], p2, n) for n, one in enumerate(p2)
    ]
    size = 2 * modes
    a = np.zeros((size + 1, size + 1))
    root_j = math.sqrt(inertia)
    rate = math.sqrt(ground) / root_j
    a[0, 1], a[1, 0] = rate, -rate
    a[1, 1] = -damping / inertia
    for n, (spring, one) in enumerate(zip(springs, p2, strict=True)):
        stretch, moving = 2 + 2 * n, 3 + 2 * n
        to_joint, own = math.sqrt(spring) / root_j, math.sqrt(one)
        a[stretch, moving], a[moving, stretch] = own, -own
        a[stretch, 1], a[1, stretch] = -to_joint, to_joint
    # the torque as one state more that stays: its exponential is the exact step of a torque that is held
    a[1, size] = 1 / root_j
    exact = expm(a * T)
    angle, speed = np.zeros(size), np.zeros(size)
    angle[0], speed[1] = 1 / math.sqrt(ground), 1 / root_j
    return Hand(exact[:size, :size].copy(), exact[:size, size].copy(), angle, speed)


def _ratio(w2: np.ndarray, p2: np.ndarray, n: int) -> float:
    """Product of (w_m^2 - p_n^2) / (p_m^2 - p_n^2) over the other resonances, paired so that it stays near
    1."""
    others = np.arange(len(p2)) != n
    return float(np.prod((w2[others] - p2[n]) / (p2[others] - p2[n])))


def is_stable(hand: Hand, k_c: float, b_c: float, T: float) -> bool:
    """Whether joint, hand and a coupling to a rigid wall are stable: no pole outside the unit circle. No
    delay."""
    n = len(hand.angle)
    b = b_c / T
    loop = np.zeros((n + 1, n + 1))  # state, angle before
    torque = np.append(-(k_c + b) * hand.angle, b)
    loop[:n, :n] = hand.step
    loop[n, :n] = hand.angle
    loop[:n] += np.outer(hand.push, torque)
    return bool(np.abs(np.linalg.eigvals(loop)).max() <= 1.0)


def first_unstable(hand: Hand, b_c: float, T: float, high: float) -> float:
    """Least k_c (N m/rad) that is unstable in this hand, by halving below `high`; `high` if none is."""
    low, top = 0.0, high
    if is_stable(hand, high, b_c, T):
        return high
    # halving finds the least one, since what is stable is so from 0 up to one stiffness (2.11).
    # By stiffness and not by ratio: what is asked is how far above the proven one it lies
    while top - low > 1e-6 * high:
        middle = 0.5 * (low + top)
        low, top = (middle, top) if is_stable(hand, middle, b_c, T) else (low, middle)
    return top


@compiled
def growth(
    step: np.ndarray,
    push: np.ndarray,
    angle: np.ndarray,
    speed: np.ndarray,
    k_c: float,
    b_c: float,
    T: float,
    ticks: int,
    start_rad_s: float,
) -> float:
    """Energy after `ticks` over that after half of them, run in time; infinite beyond all numbers.

    Starts bent, at the speed `start_rad_s` would be a quarter of the first resonance later: a motion that
    began at full speed would be sampled at its zeros only."""
    q = np.zeros(len(angle))
    q[0] = start_rad_s / speed[1]
    before, half = np.dot(angle, q), 0.0
    for k in range(ticks):
        x = np.dot(angle, q)
        torque = -k_c * x - b_c * (x - before) / T
        before = x
        if k == ticks // 2:
            half = np.dot(q, q)
        q = np.dot(step, q) + push * torque
    # a loop that has run off the numbers grows: inf/inf would be no figure, and a maximum passes NaN over
    last = np.dot(q, q)
    return float(last / half) if last < np.inf else np.inf


@compiled
def peak_with_friction(
    step: np.ndarray,
    push: np.ndarray,
    angle: np.ndarray,
    speed: np.ndarray,
    inertia: float,
    friction_nm: float,
    compensated_nm: float,
    k_c: float,
    b_c: float,
    T: float,
    parts: int,
    ticks: int,
    start_rad_s: float,
) -> float:
    """Largest energy in the second half of `ticks` over the largest in the first, with dry friction and its
    compensation.

    `step` and `push` are those of a `parts`-th of a tick. Dry friction holds the joint where it can, and
    never turns it; its compensation has the sign of the last tick's motion, so it is late by a tick at every
    turn. 0 / 0 counts as 0, an energy beyond all numbers as infinite."""
    q = np.zeros(len(angle))
    q[0] = start_rad_s / speed[1]
    before, first, second = np.dot(angle, q), 0.0, 0.0
    for k in range(ticks):
        x = np.dot(angle, q)
        dx = x - before
        before = x
        held = -k_c * x - b_c * dx / T + compensated_nm * (1.0 if dx > 0.0 else (-1.0 if dx < 0.0 else 0.0))
        for _ in range(parts):
            v = np.dot(speed, q)
            # no more than brings it to rest in this part: friction never turns a joint
            stops = inertia * abs(v) * parts / T
            dry = min(friction_nm, stops) * (1.0 if v > 0.0 else -1.0)
            q = np.dot(step, q) + push * (held - dry)
        energy = np.dot(q, q)
        if not energy < np.inf:
            return np.inf
        # peaks, not ends: a late sign hunts about rest, and its energy at one tick says nothing of the next
        if k < ticks // 2:
            first = max(first, energy)
        else:
            second = max(second, energy)
    return float(second / first) if first > 0.0 else 0.0
