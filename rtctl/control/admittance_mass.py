"""The least virtual inertia of an admittance display, the dual of the impedance display's passivity margin (docs/theory.md 2.12)."""

from __future__ import annotations

import numpy as np

from rtctl.control.stability import require_coupling


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
