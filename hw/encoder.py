"""Counters of finite width: what the wire carries, and the endless count behind it.

An encoder's counter of `bits` bits starts over after 2**bits counts. `unwrap` follows it through any
number of turns in both directions, as long as less than half the range passes between two samples."""

from __future__ import annotations

import math

import numpy as np

from hw.jit import compiled

ENCODER_STATE = 2
"""Words (int64) of state of one unwrapped counter: whether it has started, and its count. Zeros to begin."""


ANGLE_STATE = 2
"""Words (float64) of state of one angle that starts over: the last one, NaN to begin, and how often it
has."""


@compiled
def beyond(value: float, period: float, state: np.ndarray) -> bool:
    """Whether an angle lies further from the last one than one that starts over after `period` can."""
    # half a period that it may turn, and one that it starts over by; NaN, before the first, is beyond nothing
    return bool(abs(value - state[0]) > 1.5 * period)


@compiled
def follow(value: float, period: float, state: np.ndarray) -> float:
    """Endless angle of one that starts over after `period` and shows `value` (finite, not `beyond`) now.

    As `unwrap`, for any period: less than half of it may pass between two samples. `state`, float64 of shape
    (ANGLE_STATE,), is changed in place."""
    if not math.isnan(state[0]):
        # a step of nearly a whole period is a start over, forwards or backwards
        # counted in whole turns, not added up: a sum of periods would gather their rounding
        state[1] -= round((value - state[0]) / period)
    state[0] = value
    return float(value + state[1] * period)


@compiled
def wrap(count: int, bits: int) -> int:
    """What a signed counter of `bits` bits (2 to 62) shows: `count` brought into [-2**(bits-1),
    2**(bits-1))."""
    half = 1 << (bits - 1)
    # moved up by half and back: the mask alone would leave negative counts unsigned
    return ((count + half) & (2 * half - 1)) - half


@compiled
def unwrap(raw: int, bits: int, state: np.ndarray) -> int:
    """Endless count of a counter that shows `raw` now.

    Parameters
    ----------
    raw : int
        The reading, signed or unsigned: only its low `bits` bits count once started.
    bits : int
        Width of the counter, 2 to 62: the sums below stay within 64.
    state : array of int64, shape (ENCODER_STATE,)
        Zeros before the first reading; changed in place.

    Returns
    -------
    int
        int64 count. The first reading is taken as it is; each later one is the count nearest to the last
        that shows the same bits. Exactly half a range away it is the lower one."""
    if state[0] == 0:
        state[0] = 1
        state[1] = raw
    else:
        state[1] += wrap(raw - state[1], bits)
    return int(state[1])


class Modulo:
    """As `follow`, outside compiled code: an angle that starts over after `period`, such as 360 degrees.

    Between two samples it may turn by less than half the period. A step of more than one and a half periods
    is none of this device: it gives NaN and is forgotten."""

    __slots__ = ("_last", "_period", "_turns")

    def __init__(self, period: float) -> None:
        # a negative scale turns the sign of angle and period alike
        self._period = abs(period)
        self._last = math.nan
        self._turns = 0

    @property
    def state(self) -> tuple[float, int]:
        """Last angle, NaN before the first one, and how often it has started over: as `follow` keeps them."""
        return self._last, self._turns

    @state.setter
    def state(self, state: tuple[float, int]) -> None:
        self._last, self._turns = state

    def __call__(self, value: float) -> float:
        """The angle on its endless axis; the first one is `value` itself."""
        step = value - self._last
        # false for NaN, which the branch below sorts out
        if abs(step) <= 1.5 * self._period:
            self._turns -= round(step / self._period)
        # not the first one (NaN equals nothing), or no number at all
        elif self._last == self._last or value - value != 0.0:  # too far, or not finite
            return math.nan
        self._last = value
        return value + self._turns * self._period
