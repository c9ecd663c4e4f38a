"""Friction that changes while the rig runs: a script over time, and the motor's temperature."""

from __future__ import annotations

import numpy as np

from hw.simulators.jit import compiled

# friction of 0 would divide by 0 in the bristle's share of break-away
LEAST, MOST = 0.05, 20.0
"""Bounds of both factors, whatever a script says."""


@compiled
def between(time_s: float, times: np.ndarray, values: np.ndarray, count: int) -> float:
    """Piecewise linear: the first value before the first time, the last one after the last."""
    if time_s <= times[0]:
        return float(values[0])
    for k in range(1, count):
        if time_s < times[k]:
            share = (time_s - times[k - 1]) / (times[k] - times[k - 1])
            return float(values[k - 1] + share * (values[k] - values[k - 1]))
    return float(values[count - 1])


@compiled
def temperature(time_s: float, p: np.record, axis: int) -> float:
    """The motor's temperature, C."""
    if p.warm_count[axis] == 0:
        return float(p.temperature_c)
    return between(time_s, p.warm_s[axis], p.warm_c[axis], p.warm_count[axis])


@compiled
def drifted(s: np.record, p: np.record, axis: int, time_s: float) -> tuple[float, float]:
    """Factors of dry and of viscous friction at `time_s` after the first tick; the state keeps them to be
    seen."""
    dry, viscous = 1.0, 1.0
    if p.drift_count[axis] > 0:
        dry = between(time_s, p.drift_s[axis], p.drift_dry[axis], p.drift_count[axis])
        viscous = between(time_s, p.drift_s[axis], p.drift_viscous[axis], p.drift_count[axis])
    if p.warm_count[axis] > 0:
        warmer_c = temperature(time_s, p, axis) - p.drift_reference_c[axis]
        dry *= 1.0 + p.dry_per_c[axis] * warmer_c
        viscous *= 1.0 + p.viscous_per_c[axis] * warmer_c
    dry, viscous = min(max(dry, LEAST), MOST), min(max(viscous, LEAST), MOST)
    s.dry_factor[axis], s.viscous_factor[axis] = dry, viscous
    return dry, viscous
