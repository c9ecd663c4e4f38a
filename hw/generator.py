"""Random numbers of simulated devices: all state in four words, the same bit for bit everywhere.

References
----------
Blackman, Vigna: Scrambled linear pseudorandom number generators, 2021 (xoshiro256+).
Steele, Lea, Flood: Fast splittable pseudorandom number generators, 2014 (splitmix64)."""

from __future__ import annotations

import numpy as np

from hw.jit import compiled

_1 = np.uint64(1)
_10 = np.uint64(10)
_17 = np.uint64(17)
_19 = np.uint64(19)
_45 = np.uint64(45)
_63_BITS = np.uint64(2**63 - 1)
_UNIT = 2.0**-53


def seed_words(seed: int) -> np.ndarray:
    """Four words of generator state from `seed` by splitmix64."""
    mask, words, z = (1 << 64) - 1, [], seed & ((1 << 64) - 1)
    for _ in range(4):
        # never four zeros, whatever the seed: a generator of zeros stays there
        z = (z + 0x9E3779B97F4A7C15) & mask
        # mixed: neighbouring seeds would else give neighbouring states
        x = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
        x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & mask
        words.append(x ^ (x >> 31))
    return np.array(words, np.uint64)


@compiled
def uniform(rng: np.ndarray) -> float:
    """Next number in [0, 1) from the four words `rng`, which it advances.

    Notes
    -----
    xoshiro256+, but the output adds the words without their lowest bits, modulo 2^63: the sum then cannot
    overflow 64 bits, which plain Python (compilation switched off) would warn about."""
    total = ((rng[0] >> _1) + (rng[3] >> _1)) & _63_BITS  # the lowest bits are its weakest; 53 are used
    t = rng[1] << _17
    rng[2] ^= rng[0]
    rng[3] ^= rng[1]
    rng[1] ^= rng[2]
    rng[0] ^= rng[3]
    rng[2] ^= t
    rng[3] = (rng[3] << _45) | (rng[3] >> _19)
    return float(total >> _10) * _UNIT
