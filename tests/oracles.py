"""Formulas that no program computes, of docs/theory.md 2.12, 2.13, 4, 5.1 and 5.4: what tests hold the law
and its proofs to.
"""

from __future__ import annotations

import math

import numpy as np

from rtctl.control.proofs.admittance_loop import AdmittanceLoop
from rtctl.control.proofs.stability import require_coupling


def admittance_mass_min(J: float, b: float, K_v: float, T: float, b_a: float = 0.0) -> float:
    """Least virtual inertia an admittance display may render, kg m^2.

    Parameters
    ----------
    J, b : float
        Device inertia, kg m^2, and damping, N m s/rad.
    K_v : float
        Gain of the inner velocity loop, N m s/rad.
    b_a : float
        Virtual damping rendered beside the inertia, N m s/rad.

    Notes
    -----
    Dual of the impedance display, docs/theory.md 2.12. With D = b + K_v, g = 2J/T, c and s the cosine and
    sine of theta, Llewellyn's condition is, for all theta,
    ``m_a >= T/2 { K_v/(2D) [ (D^2c^2 + g^2)/(sqrt(D^2c^2 + g^2s^2) + D c^2) + g ] - b_a/s^2 }``.
    For b_a = 0 it binds at theta -> 0: ``T K_v/8 (1 + g/D)^2``.
    """
    require_coupling(K_v, b_a, T)
    D, g = b + K_v, 2 * J / T
    if b_a == 0:
        return T * K_v / 8 * (1 + g / D) ** 2

    def bound(s2: np.ndarray) -> np.ndarray:
        c2 = 1 - s2
        root = np.sqrt(D * D * c2 + g * g * s2)
        bracket = (D * D * c2 + g * g) / (root + D * c2) + g
        return T / 2 * (K_v / (2 * D) * bracket - b_a / s2)

    grid = np.geomspace(1e-10, 1.0, 20001)
    best = int(np.argmax(bound(grid)))
    fine = np.linspace(grid[max(best - 1, 0)], grid[min(best + 1, grid.size - 1)], 20001)
    return max(0.0, float(np.max(bound(fine))))


def hand_max_continuous(m: float, b_v: float, J: float, b: float, K_v: float) -> float:
    """Stiffness of a hand (a spring alone) at which a display without lag and K_p begins to grow, N m/rad;
    infinite from `mass_min_continuous` on.
    """
    D = b + K_v
    lacks = J * K_v - m * D
    return math.inf if lacks <= 0 else b_v * D * (m * D + b_v * J) / (m * lacks)


def impedance_continuous(loop: AdmittanceLoop, s: np.ndarray) -> np.ndarray:
    """What a hand feels of a display without lags, N m s/rad: (Js + b + K)(ms + b_v)/(ms + b_v + K), K =
    K_v + K_p/s.
    """
    K = loop.velocity_gain_nms_rad + loop.position_gain_nm_rad / s
    mass = loop.mass_kgm2 * s + loop.virtual_damping_nms_rad
    joint = loop.inertia_kgm2 * s + loop.viscous_nms_rad
    return np.asarray((joint + K) * mass / (mass + K))


def runaway_speed(F_c: float, b_v: float, gain: float, overestimate: float = 1.0) -> float:
    """Speed a free device runs away to under Coulomb over-compensation, rad/s; 0 if it does not
    (docs/theory.md 5.1).

    `overestimate` is the model's Coulomb friction over the true one.
    """
    return max(0.0, (gain * overestimate - 1) * F_c / b_v)


def tanh_speed_min(gain: float, friction_at_rest_nm: float, damping_nms_rad: float) -> float:
    """Least speed scale of a tanh feed-forward that does not hunt at rest, rad/s (docs/theory.md 5.4).

    `damping_nms_rad` is bristle damping, viscous damping and the hand's: sigma1 + sigma2 + b_hand.
    """
    return gain * friction_at_rest_nm / damping_nms_rad


def series_po_pc(
    force: np.ndarray, velocity: np.ndarray, w: np.ndarray, alpha: np.ndarray, f1: np.ndarray
) -> None:
    """Hannaford-Ryu series observer and controller over a whole recording (impedance causality).

    Parameters
    ----------
    force, velocity : array, shape (n,)
        f2 (opposing) of the environment and v2 of the port.
    w, alpha, f1 : array, shape (n,)
        Written: observed power sum W, damping, and force after the controller.

    Notes
    -----
    W(n) = W(n-1) + f2 v2 + alpha(n-1) v2(n-1)^2; alpha(n) = -W/v2^2 if W < 0 and v2 != 0 else 0;
    f1 = f2 + alpha v2 (Hannaford and Ryu 2002).
    """
    total = 0.0
    injected = 0.0
    for n in range(len(force)):
        v = velocity[n]
        total += force[n] * v + injected
        damping = -total / (v * v) if total < 0.0 and v != 0.0 else 0.0
        injected = damping * v * v
        w[n] = total
        alpha[n] = damping
        f1[n] = force[n] + damping * v


def parallel_po_pc(
    force: np.ndarray, velocity: np.ndarray, w: np.ndarray, beta: np.ndarray, v1: np.ndarray
) -> None:
    """Parallel form (admittance causality): the dual of `series_po_pc`, with beta = 1/alpha acting on f2."""
    series_po_pc(velocity, force, w, beta, v1)
