"""How many of the last 1000 ticks had some mark: an exact sliding count in sixteen words."""

from __future__ import annotations

import numpy as np

from rtctl.control.jit import compiled
from rtctl.control.records import MARK_WORDS

TICKS = 1000
"""Length of the window."""

_BITS = 63
assert MARK_WORDS * _BITS >= TICKS, "the sign bit of each word stays free"


@compiled
def push(words: np.ndarray, tick: int, marked: bool) -> int:
    """Write the mark of `tick` over the one 1000 ticks ago; returns how much the count changed (-1, 0, 1).

    Parameters
    ----------
    words : int array, shape (MARK_WORDS,)
        Zeroed before the first tick.
    tick : int
        Ticks counted one by one from 0."""
    place = tick % TICKS
    word = place // _BITS
    bit = np.int64(1) << np.int64(place % _BITS)
    before = words[word] & bit != 0
    if marked:
        words[word] |= bit
    else:
        words[word] &= ~bit
    return int(marked) - int(before)
