"""How much delay the proof of a coupling covers: what the measured delay is compared with while the rig runs.

Pure functions of numbers, at the start of a run; symbols as in `stability`, and

======  =============  ==================================================================
delta   1              delay from a sample to its torque at the motor, in periods, fractional
======  =============  ==================================================================

A first-order lag of tau behind the delay is counted as a delay of tau: that asks at least as much damping
as the lag does, to within 2 % (over a grid in the tests), and the two are hard to tell apart in what a
sampled current shows."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

MOST_TICKS = 20.0
"""Longest delay that is looked at, periods: what a rig file may declare."""

RESOLUTION_TICKS = 0.002

_THETA, _PHI = 384, 48
"""Points over the frequencies, and around the disc of what coupling and environment can be."""


def damping_needed_delayed(k_c: float, b_c: float, T: float, delta: float) -> float:
    """Least device damping with which the sampled loop is passive behind `delta` periods of delay, N m s/rad.

    Notes
    -----
    docs/theory.md 2.4, without a lag. The coupling Zp = B - i K cot(theta), in series with
    any passive environment, is anything in the disc ``r (1 + e^(i phi))``, r = |Zp|^2/(2 Re Zp). With
    delta = k + f, z = e^(2 i theta) and ``x = -(1 - 1/z)^2/(4 sin^2) ((1-f) z^-k + f z^-(k+1))``, every Z of
    it asks ``b >= (sqrt(|Z|^2 - Im(Z x)^2) - Re(Z x))/2``. For whole delays this is (SD-1), that is
    `stability.damping_needed_sampled_data`."""
    K = k_c * T / 2
    B = b_c + K
    if B == 0:
        return 0.0
    theta = np.linspace(0.0, np.pi / 2, _THETA + 1)[1:, None]
    phi = np.linspace(-np.pi, np.pi, _PHI, endpoint=False)[None, :]
    k = math.floor(delta)
    f = delta - k
    x = np.exp(-2j * theta * (1 + k)) * (1 - f + f * np.exp(-2j * theta))
    Z = (B * B + (K / np.tan(theta)) ** 2) / (2 * B) * (1 + np.exp(1j * phi))
    y = Z * x
    asked = np.sqrt(np.maximum(np.abs(Z) ** 2 - y.imag**2, 0.0)) - y.real
    return float(np.max(asked) / 2)


@lru_cache(maxsize=256)
def delay_covered_ticks(b: float, k_c: float, b_c: float, T: float, declared_ticks: float) -> float:
    """Largest delay up to which this coupling stays proven, periods; never less than the declared one.

    Parameters
    ----------
    b : float
        Guaranteed damping of the device, N m s/rad.
    declared_ticks : float
        Delay the rig file declares. Where the coupling is not even proven there, that is another test's to
        refuse; here the declared delay is what a measured one may not exceed.

    Notes
    -----
    Past its least value, in the first quarter of a period, the damping needed rises with the delay, so the
    bound is found by halving."""

    def passes(delta: float) -> bool:
        return damping_needed_delayed(k_c, b_c, T, delta) <= b

    low, high = declared_ticks, max(MOST_TICKS, declared_ticks)
    if not passes(low):
        return low
    if passes(high):
        return high
    while high - low > RESOLUTION_TICKS:  # what is returned passes: `low`
        middle = 0.5 * (low + high)
        low, high = (middle, high) if passes(middle) else (low, middle)
    return low
