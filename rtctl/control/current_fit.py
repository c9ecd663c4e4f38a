"""Fits of the current's answer to the test pulse: a step sent, a gain, a delay of any fraction of a tick, a
lag.

Behind every lag of a row and every whole delay the answer is linear in gain and fraction of the delay
(`fit`)."""

from __future__ import annotations

import math

from rtctl.control.jit import compiled
from rtctl.control.records import Record

LAGS = 20
LAG_FIRST = 0.1
LAG_RATIO = 1.25
"""Lags that are tried, ticks: 0, then nineteen from .1 to 5.55 in this ratio (`FINE`: up to 6.75)."""

FINE = 8
"""And around the one that fits, so many between it and the next: a current loop of 2.7 ticks without noise
looked like one of 2.84, was told so, and refused."""

HALF_OF_LAG = 0.7
SHIFTS = 4
"""A lag reaches half of its step after ln 2 of it: so much shorter is the delay before it, and this many
whole delays around that are tried."""


@compiled
def lagged(s: Record, axis: int, n: int, lag: float) -> None:
    """The sent step behind a lag of so many ticks, without delay, as samples show it."""
    kept = math.exp(-1.0 / lag) if lag > 0.0 else 0.0
    # it begins settled at what was sent before the step
    torque = s.answer_before_nm[axis]
    for k in range(n):
        torque = kept * torque + (1.0 - kept) * s.answer_sent_nm[axis, k]
        s.answer_model_nm[axis, k] = torque


@compiled
def lag_of(i: int) -> float:
    """Lag number i of the row, ticks."""
    return 0.0 if i == 0 else LAG_FIRST * LAG_RATIO ** (i - 1)


@compiled
def fit(s: Record, axis: int, n: int, lag: float, shift: int, most: float) -> tuple[float, float, float]:
    """Best fit of a delay between `shift` and `shift` + 1 ticks before this lag; its least delay within
    `most`.

    Returns
    -------
    left, gain, delay : float
        Sum of squares left over; gain; delay and lag together, ticks. `left` is infinite for no fit.

    Notes
    -----
    With x_m the lagged step m ticks late and kept = e^(-1/lag), an answer m + f ticks late is
    ``w x_m + (1 - w) x_(m+1)``, ``w = (1 - kept^(1-f))/(1 - kept)``: linear in gain w and gain (1 - w). Where
    the best w leaves less than `most` (infinite: the best one is wanted), a larger w, a shorter delay, is
    possible too: the sum of squares grows by ``gain^2 sum (x_m - x_(m+1))^2`` times the square of its
    distance."""
    before, model = s.answer_before_nm[axis], s.answer_model_nm[axis]
    a11 = a12 = a22 = b1 = b2 = total = 0.0
    for k in range(n):
        y = s.answer_measured_nm[axis, k]
        x1 = model[k - shift] if k >= shift else before
        x2 = model[k - shift - 1] if k > shift else before
        a11 += x1 * x1
        a12 += x1 * x2
        a22 += x2 * x2
        b1 += x1 * y
        b2 += x2 * y
        total += y * y
    if not (a11 > 0.0 and b1 > 0.0):  # an answer of the wrong sign has no delay
        return math.inf, 0.0, 0.0
    area = a11 * a22 - a12 * a12  # 0: both delays show the same, as where nothing moves
    if lag > 0.0 and area > 1e-12 * a11 * a22:  # without a lag no sample tells a fraction of a delay
        early, late = (b1 * a22 - b2 * a12) / area, (b2 * a11 - b1 * a12) / area
        if early > 0.0 and late > 0.0:
            gain = early + late
            left = max(total - early * b1 - late * b2, 0.0)
            share = early / gain
            if left < most < math.inf:
                # a larger w is a shorter delay: the least that noise allows
                share = min(share + math.sqrt((most - left) / (a11 - 2.0 * a12 + a22)) / gain, 1.0)
            rest = -lag * math.log(1.0 - share * (1.0 - math.exp(-1.0 / lag)))  # 1 - f
            return left, gain, shift + 1.0 - rest + lag
    return max(total - b1 * b1 / a11, 0.0), b1 / a11, shift + lag


@compiled
def latest_shift(s: Record, axis: int, n: int) -> int:
    """Whole delay with which the step without any lag fits best."""
    lagged(s, axis, n, 0.0)
    best, found = math.inf, 0
    for shift in range(n - 2):  # two ticks at least must show the step settled
        left = fit(s, axis, n, 0.0, shift, math.inf)[0]
        if left < best:
            best, found = left, shift
    return found
