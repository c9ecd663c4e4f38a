"""The worst hand and the worst world for a sampled loop behind delay and lag, by sums of their own over the
aliases.

The hand resonates with the joint at every frequency that sampling folds onto the one where the margin is
least, each resonance beside its alias by what gives the joint the phase there that hurts most; the world is
the lossless one with the worst phase. Behind an elastic joint it is the hand that cancels, at that frequency,
what spring and link would damp."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rtctl.simulation.campaign_linear_rig import Law, Plant, behind_a_joint, network

MODES = 9
# of the sum of 1/w^2 over all, T^2/(4 sin^2 theta), what lies beyond is sin^2(theta)/299, .34 % at most
_ALIASES = 60


@dataclass(frozen=True)
class Loop:
    """Period in s, delay and lag in ticks, coupling, damping that is guaranteed."""

    T: float
    delay: float
    tau: float
    k_c: float
    b_c: float
    b: float

    def aliases(self, theta: np.ndarray, count: int = _ALIASES) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies that sampling folds onto theta = w T/2, and what delay and lag do there."""
        w = (2 * theta / self.T)[:, None] + 2 * np.pi * np.arange(-count, count + 1) / self.T
        return w, np.exp(-1j * w * self.delay * self.T) / (1 + 1j * w * self.tau * self.T)

    def coupling(self, theta: np.ndarray) -> np.ndarray:
        """Impedance of the coupling."""
        return np.asarray(self.b_c + self.k_c * self.T / (1 - np.exp(-2j * theta)))


def _sampling(theta: np.ndarray, T: float) -> np.ndarray:
    return np.asarray((1 - np.exp(-2j * theta)) ** 2 / T**2)


def worst_place(loop: Loop) -> float:
    """Theta at which the loop needs the most damping."""
    theta = np.linspace(0.01, 1.54, 200)  # 0 and pi/2 have no width
    w, A = loop.aliases(theta)
    S0, S1, S2 = (1 / w**2).sum(axis=1), (A / w**2).sum(axis=1), (np.abs(A) ** 2 / w**2).sum(axis=1)
    # no lossless world changes it: to the admittance of the coupling it adds an imaginary part
    g = (1 / loop.coupling(theta)).real
    need = (np.sqrt(S2 / S0) + (_sampling(theta, loop.T) * S1).real) / (2 * g)
    return float(theta[int(np.argmax(need))])


def worst_rig(loop: Loop, J: float, theta: float) -> tuple[Plant, Law]:
    """A rigid joint of inertia J in the worst hand, and the worst world, at theta."""
    at = np.array([theta])
    w, A = loop.aliases(at)
    S0, S1, S2 = ((one / w**2).sum() for one in (np.ones_like(w), A, np.abs(A) ** 2))
    admittance, E = 1 / loop.coupling(at)[0], _sampling(at, loop.T)[0]
    g = admittance.real
    # its phase is that of g + j(...) with g > 0: within a quarter turn to either side
    chi = np.linspace(-1.55, 1.55, 2001)
    turned = np.exp(1j * chi) * E * S1
    inside = np.maximum(abs(E) ** 2 * S0 * S2 - turned.imag**2, 0)  # of rounding
    worst = float(chi[int(np.argmax(np.cos(chi) * (turned.real + np.sqrt(inside))))])
    s = -g * math.tan(worst) - admittance.imag  # 1/Z = 1/Z_c + j s has the phase -worst
    # lossless by Tustin's rule: a spring's admittance is +j tan(theta) times its own, a mass's -j over it
    law = Law(
        loop.k_c,
        loop.b_c,
        tustin_spring=max(s, 0.0) / math.tan(theta),
        tustin_mass=max(-s, 0.0) * math.tan(theta),
    )
    return _folded_hand(loop, J, theta, math.cos(worst) / g * np.exp(1j * worst) * E, S1), law


def _folded_hand(loop: Loop, J: float, theta: float, c: complex, S1: complex) -> Plant:
    """Hand on a rigid joint whose resonances are folded onto theta, with the worst phase at each."""
    w, A = (one[0] for one in loop.aliases(np.array([theta]), MODES))
    near = np.argsort(np.abs(w))[:MODES]
    w, A = w[near], A[near]
    phase = np.angle(2 * loop.b - c * S1) - np.angle(c * A)
    half = (phase / 2 + np.pi / 2) % np.pi - np.pi / 2  # tan has the period pi
    reactance = np.clip(-loop.b * np.tan(half), -20 * loop.b, 20 * loop.b) * np.sign(w)
    at = np.abs(w)
    # between the resonances, as a lossless network has them; where is free, and the middle is far from both
    p2 = (0.5 * (at[1:] + at[:-1])) ** 2
    slope = [2 * J * np.prod((np.delete(at, i) ** 2 - one**2) / (p2 - one**2)) for i, one in enumerate(at)]
    # a resonance below 0 is none
    shifted = np.sort(np.maximum(at - reactance / np.array(slope), 1e-3 * at[0]))
    return network(J, loop.b, shifted**2, p2)


def worst_elastic(w: float, k: float, dampings: tuple[float, float, float], link_inertia: float) -> Plant:
    """A motor behind a joint, in the hand that leaves it the least damping at the frequency w, and in
    resonance there.

    `dampings` are those of motor, joint and link. The inertia of the motor is what resonates."""
    b_m, b_j, b_l = dampings
    Y_j = 1 / (b_j + k / (1j * w))
    centre, radius = Y_j + 1 / (2 * b_l), 1 / (2 * b_l)
    seen = (np.conj(centre) - radius) / (abs(centre) ** 2 - radius**2)  # least real part of 1/(Y_j + Y_l)
    X = float((1 / (1 / seen - Y_j)).imag)
    # a tenth more than what resonates by itself: the hand's spring, which takes the rest, must be one
    inertia = max(link_inertia, 1.1 * X / w)
    link = network(inertia, b_l, np.array([(inertia * w - X) * w / inertia]), np.array([]))
    return behind_a_joint(link, -float(seen.imag) / w, b_m, k, b_j)
