"""The worst passive hand and the worst passive environment for a loop with delay (docs/theory.md 2.3).

(SD-1) binds at an angle theta = w T / 2 inside (0, pi/2]. There the worst hand resonates with the joint at
every frequency that sampling folds onto w, so that the joint answers with 1/b at each; and the worst
environment is the lossless one, a mass or a spring, that turns the torque of coupling and environment against
the velocity most:

    min over s of Re(e^(-j phi) / (g + j s)) = (cos phi - 1) / (2 g)
    phi = 2 (1 + d) theta,  g = Re(1 / Z_c)

Both elements are discrete by Tustin's rule, which keeps them lossless: Z = (2 m / T)(z - 1)/(z + 1), or
(k T / 2)(z + 1)/(z - 1)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rtctl.control.proofs import stability
from rtctl.experiments.worst_hand import Hand, network

UNSTABLE = 1e-7
"""A pole this far outside the unit circle counts: the lossless elements lie on it."""

# hundredths above the proven stiffness, where the first unstable one is to be told; below it none should be
SEARCHED = (0.25, 0.5, 0.75, 0.9, 0.95, *(1 + 0.01 * k for k in range(31)))
"""Shares of the proven stiffness that are tried, rising."""


@dataclass(frozen=True)
class Environment:
    """Admittance 1/Z_e of a lossless environment: `spring` (z-1)/(z+1) + `mass` (z+1)/(z-1), one of them
    0."""

    spring: float
    mass: float


def folded_hand(inertia: float, damping: float, T: float, theta: float, modes: int) -> Hand:
    """Hand whose `modes` resonances with the joint are the first that sampling folds onto `theta`.

    Parameters
    ----------
    inertia, damping
        Of the joint, kg m^2 and N m s/rad.
    theta
        In (0, pi/2), rad."""
    w, around = 2 * theta / T, 2 * math.pi / T
    resonances = np.sort([abs(w + n * around) for n in range(-modes, modes + 1)])[:modes]
    # any place between two resonances makes a lossless hand
    between = 0.5 * (resonances[:-1] + resonances[1:])
    return network(inertia, damping, T, resonances**2, between**2)


def worst_environment(k_c: float, b_c: float, T: float, delay: int, theta: float) -> Environment:
    """The lossless environment behind the coupling that is worst at `theta`."""
    z = np.exp(2j * theta)
    coupling = (z - 1) / ((b_c + k_c * T) * z - b_c)
    half = (math.pi - 2 * theta * (1 + delay)) / 2
    half = (half + math.pi / 2) % math.pi - math.pi / 2  # tan has the period pi
    s = float(coupling.real * math.tan(half) - coupling.imag)
    return Environment(s / math.tan(theta), 0.0) if s >= 0 else Environment(0.0, -s * math.tan(theta))


def largest_pole(hand: Hand, k_c: float, b_c: float, T: float, delay: int, environment: Environment) -> float:
    """Largest magnitude among the poles of joint, hand, coupling, environment and `delay` ticks."""
    # (b_c + k_c T) z - b_c over z - 1: spring and damper by the backward difference, as the law has them
    numerator, denominator = _impedance(b_c + k_c * T, b_c, environment)
    direct, filter_states = numerator[0], len(denominator) - 1
    n = len(hand.angle)
    place, first, late = n, n + 1, n + 1 + filter_states
    loop = np.zeros((late + delay, late + delay))
    velocity = np.zeros(late + delay)
    velocity[:n], velocity[place] = hand.angle / T, -1 / T
    torque = direct * velocity
    torque[first:late] += numerator[1:] - denominator[1:] * direct
    loop[:n, :n] = hand.step
    loop[place, :n] = hand.angle
    loop[first, first:late] = -denominator[1:]
    loop[first] += velocity
    for i in range(1, filter_states):
        loop[first + i, first + i - 1] = 1.0
    # without a delay the torque is felt in its own step, and with one it waits in a row of states
    if delay == 0:
        loop[:n] += np.outer(hand.push, -torque)
    else:
        loop[:n, late + delay - 1] -= hand.push
        loop[late] = torque
        for i in range(1, delay):
            loop[late + i, late + i - 1] = 1.0
    return float(np.abs(np.linalg.eigvals(loop)).max())


def _impedance(a: float, b_c: float, environment: Environment) -> tuple[np.ndarray, np.ndarray]:
    """Coupling and environment in series, torque over velocity: numerator and denominator in z, the latter
    monic."""
    top, one_less, one_more = np.array([a, -b_c]), np.array([1.0, -1.0]), np.array([1.0, 1.0])
    if environment.mass > 0:
        numerator = np.polymul(top, one_less)
        denominator = np.polyadd(np.polymul(one_less, one_less), environment.mass * np.polymul(one_more, top))
    else:
        numerator = np.polymul(top, one_more)
        denominator = np.polymul(one_less, one_more + environment.spring * top)
    return np.asarray(numerator) / denominator[0], np.asarray(denominator) / denominator[0]


def first_unstable_share(
    inertia: float, damping: float, T: float, b_c: float, delay: int, modes: int, angles: np.ndarray
) -> float:
    """Least unstable k_c over the proven k_c, over the worst hand and environment at every angle; inf if none
    in reach."""
    proven = stability.k_max_sampled_data(damping, b_c, T, delay)
    least = math.inf
    # the proven stiffness makes the environment: at the one that is tried it would be another for each share
    for theta in angles:
        # once for all stiffnesses: it depends on the angle alone
        hand = folded_hand(inertia, damping, T, float(theta), modes)
        environment = worst_environment(proven, b_c, T, delay, float(theta))
        for share in SEARCHED:
            if share >= least:  # another angle has done worse already
                break
            if largest_pole(hand, share * proven, b_c, T, delay, environment) > 1 + UNSTABLE:
                least = share
    return least
