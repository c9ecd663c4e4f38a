"""Normal random numbers of the simulated rig: all state in its record.

References
----------
Marsaglia, Bray: A convenient method for generating normal variables, 1964 (polar method)."""

from __future__ import annotations

import math

import numpy as np

from hw.generator import uniform
from hw.simulators.jit import compiled


@compiled
def normal(s: np.record) -> float:
    """Next standard normal number from the plant state `s`, which it advances."""
    if s.normal_spare_ready == 1:
        s.normal_spare_ready = 0
        return float(s.normal_spare)
    a, b, q = 0.0, 0.0, 0.0
    # a point in the circle, its centre left out (log of 0): pi/4 of the tries
    while q <= 0.0 or q >= 1.0:
        a = 2.0 * uniform(s.rng) - 1.0
        b = 2.0 * uniform(s.rng) - 1.0
        q = a * a + b * b
    scale = math.sqrt(-2.0 * math.log(q) / q)
    # two numbers for one logarithm; the state keeps the second, so that a copy of the rig draws alike
    s.normal_spare = b * scale
    s.normal_spare_ready = 1
    return a * scale
