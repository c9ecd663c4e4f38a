"""What friction feed-forward leaves of the device's passivity, from sampled friction curves.

Pure functions. Curves are arrays over one common grid of speeds `v`, rising, of one direction:

========  ===========  =================================================================
v         rad/s        speed, v[0] >= 0
F_lo      N m          friction the device surely has at that speed
ff        N m          most the feed-forward may give at that speed
b_c, k_c               damping (N m s/rad) and stiffness (N m/rad) of the virtual coupling
T         s            control period
Delta     rad          one encoder count
c_1       N m s/rad    slope of the two lines
========  ===========  =================================================================

docs/theory.md 5. NaN in a curve gives NaN, which passes no `>= 0`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


def secant_damping(v: np.ndarray, F_lo: np.ndarray, ff: np.ndarray) -> tuple[float, float]:
    """Damping guaranteed whatever the speed, N m s/rad, and the speed where it is least, rad/s.

    Notes
    -----
    b_sec = min over v > 0 of (F_lo - ff)/v, docs/theory.md 5.2: then (F - ff) v >= b_sec v^2, so it takes the
    place of b in the passivity margins. Grid points at v = 0 are left out."""
    # at v = 0 the quotient has no value: what a joint at rest may be given is the account's (5.8)
    moving = v > 0
    secant = (F_lo[moving] - ff[moving]) / v[moving]
    at = int(np.argmin(secant))
    return float(secant[at]), float(v[moving][at])


def slope_damping(v: np.ndarray, F: np.ndarray, ff: np.ndarray) -> float:
    """Least local damping, N m s/rad: min over v of d/dv (F - ff); negative means stick-slip may start."""
    return float(np.min(np.diff(F - ff) / np.diff(v)))


def gain_max(v: np.ndarray, F_lo: np.ndarray, F_hat: np.ndarray, b_need: float) -> float:
    """Largest share of the whole curve that may be fed forward, 0 to 1: min (F_lo - b_need v)/Fhat
    (docs/theory.md 5.2).

    It is the whole curve, as the papers compensate it. The law leaves the viscous part to the joint
    (`compensation_limit.feedforward_limit`), so a gain above this one may pass, and one below it does."""
    return float(np.clip(np.min((F_lo - b_need * v) / F_hat), 0.0, 1.0))


@dataclass(frozen=True)
class TwoLine:
    """Result of the two-line test: margin (N m) and slope c_1 (N m s/rad)."""

    margin_nm: float
    slope_nms_rad: float


def two_line_margin(
    v: np.ndarray, F_lo: np.ndarray, ff: np.ndarray, *, k_c: float, b_c: float, T: float, Delta: float
) -> TwoLine:
    """Torque left between a line above the feed-forward and a line below the friction.

    At least 0: passive for every passive hand, whatever sign or delay error the feed-forward has, with the
    encoder's quantisation.

    Notes
    -----
    docs/theory.md 5.3: c_0 = max_v (ff - c_1 v), c_a = min_v (F_lo - (b_c + k_c T/2 + c_1) v),
    margin = c_a - c_0 - k_c Delta/2 - b_c Delta/T - c_1 Delta/T, best over c_1 >= 0. The margin is concave
    in c_1, and each c_1 is a valid certificate, so halving on the sign of its slope cannot err towards
    unsafe."""
    if np.isnan(F_lo).any() or np.isnan(ff).any():  # argmax and argmin would choose it or not
        return TwoLine(np.nan, np.nan)
    need = b_c + k_c * T / 2

    def at(c: float) -> tuple[TwoLine, float]:
        above = ff - c * v
        below = F_lo - (need + c) * v
        j, i = int(np.argmax(above)), int(np.argmin(below))
        c_0, c_a = float(above[j]), float(below[i])
        # a count may make the law see a speed of Delta/T that is none: b_c and the line of slope c answer it
        margin = c_a - c_0 - k_c * Delta / 2 - (b_c + c) * Delta / T
        return TwoLine(margin, c), float(v[j] - v[i] - Delta / T)

    # concave in c_1: where the margin falls from the first on, 0 is the best slope
    low = 0.0
    best, slope = at(low)
    if slope <= 0:
        return best
    high = 1.0
    while at(high)[1] > 0 and high < 1e12:  # 1e12: two lines may part for ever
        high *= 2
    for _ in range(80):
        middle = 0.5 * (low + high)
        found, slope = at(middle)
        # each c_1 is a certificate: the best ever seen
        best = max(best, found, key=lambda line: line.margin_nm)
        low, high = (middle, high) if slope > 0 else (low, middle)
    return best
