"""Counters of finite width: what the wire carries, and the endless count behind it.

An encoder's counter of `bits` bits starts over after 2**bits counts. `unwrap` follows it through any
number of turns in both directions, as long as less than half the range passes between two samples.
"""

from __future__ import annotations

import numpy as np

from hw.jit import compiled

ENCODER_STATE = 2
"""Words (int64) of state of one unwrapped counter: whether it has started, and its count. Zeros to begin."""


@compiled
def wrap(count: int, bits: int) -> int:
    """What a signed counter of `bits` bits (2 to 32) shows: `count` brought into [-2**(bits-1), 2**(bits-1))."""
    half = 1 << (bits - 1)
    return ((count + half) & (2 * half - 1)) - half


@compiled
def unwrap(raw: int, bits: int, state: np.ndarray) -> int:
    """Endless count of a counter that shows `raw` now.

    Parameters
    ----------
    raw : int
        The reading, signed or unsigned: only its low `bits` bits count once started.
    bits : int
        Width of the counter, 2 to 32.
    state : array of int64, shape (ENCODER_STATE,)
        Zeros before the first reading; changed in place.

    Returns
    -------
    int
        int64 count. The first reading is taken as it is; each later one is the count nearest to the last
        that shows the same bits. Exactly half a range away it is the lower one.
    """
    if state[0] == 0:
        state[0] = 1
        state[1] = raw
    else:
        state[1] += wrap(raw - state[1], bits)
    return int(state[1])
