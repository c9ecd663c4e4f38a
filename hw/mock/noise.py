"""Random numbers of the simulated rig: all state in its record, the same bit for bit everywhere.

References
----------
Blackman, Vigna: Scrambled linear pseudorandom number generators, 2021 (xoshiro256+).
Marsaglia, Bray: A convenient method for generating normal variables, 1964 (polar method).
"""

from __future__ import annotations

import math

import numpy as np

from hw.mock.jit import compiled

_1 = np.uint64(1)
_10 = np.uint64(10)
_17 = np.uint64(17)
_19 = np.uint64(19)
_45 = np.uint64(45)
_63_BITS = np.uint64(2**63 - 1)
_UNIT = 2.0**-53


@compiled
def uniform(rng: np.ndarray) -> float:
    """Next number in [0, 1) from the four words `rng`, which it advances.

    Notes
    -----
    xoshiro256+, but the output adds the words without their lowest bits, modulo 2^63: the sum then cannot
    overflow 64 bits, which plain Python (compilation switched off) would warn about.
    """
    total = ((rng[0] >> _1) + (rng[3] >> _1)) & _63_BITS
    t = rng[1] << _17
    rng[2] ^= rng[0]
    rng[3] ^= rng[1]
    rng[1] ^= rng[2]
    rng[0] ^= rng[3]
    rng[2] ^= t
    rng[3] = (rng[3] << _45) | (rng[3] >> _19)
    return float(total >> _10) * _UNIT


@compiled
def normal(s: np.record) -> float:
    """Next standard normal number from the plant state `s`, which it advances."""
    if s.normal_spare_ready == 1:
        s.normal_spare_ready = 0
        return float(s.normal_spare)
    a, b, q = 0.0, 0.0, 0.0
    while q <= 0.0 or q >= 1.0:
        a = 2.0 * uniform(s.rng) - 1.0
        b = 2.0 * uniform(s.rng) - 1.0
        q = a * a + b * b
    scale = math.sqrt(-2.0 * math.log(q) / q)
    s.normal_spare = b * scale
    s.normal_spare_ready = 1
    return a * scale
