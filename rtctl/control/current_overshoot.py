"""Whether the current exceeds the steps of the test pulse by more than it may: by the likelihood of loops of
second order (docs/theory.md 11.2).

The largest of some samples told it before, and in noise of a tenth of the pulse half of the loops that
exceed their steps by a fifth passed; of the same pulses this finds .71 (decision 0176)."""

from __future__ import annotations

import math

from rtctl.control.current_fit import FINE, HALF_OF_LAG, LAG_RATIO, LAGS, SHIFTS, fit, lag_of, latest_shift
from rtctl.control.jit import compiled
from rtctl.control.records import Record

FEWEST_FOR_OVERSHOOT = 10
"""Shorter parts (loops below 500 Hz) tell none."""

BEYOND = (0.05, 0.12, 0.22, 0.4)
MOST = 0.95
"""Overshoots that are tried beyond what may be, and the largest of all."""

SURELY = 17.0
"""So many variances more must be left by the best loop that exceeds its steps by no more than it may."""

UNEVEN = 0.4
"""And the square of this share of the overshoot that may be: what the row of lags and delays leaves of it."""

LESS = 0.6
NEAR = 3.5
"""A second overshoot of those is tried, this share of the most; and the lags of the others within this
factor."""

NOISE_PEAKS = 5.0
"""So many standard deviations of the noise are no overshoot of held samples."""

LAID_OVER = 6.0
"""Variance of three steps laid over one another, weighted 1, -2, 1, in those of a sample."""


@compiled
def _rung(s: Record, axis: int, n: int, lag: float, overshoot: float) -> None:
    """The sent step behind a loop of second order of this lag that exceeds it so far, as samples show it.

    Notes
    -----
    With its time constants 1/(a -+ j w) a sample is
    ``y_k = 2 e^-a cos(w) y_(k-1) - e^-2a y_(k-2) + S_1 u_k + (S_2 - (1 + 2 e^-a cos w) S_1) u_(k-1)``,
    where ``S_t = 1 - e^(-a t) (cos w t + (a/w) sin w t)`` answers a step and u_k is sent in tick k."""
    turn = -math.pi / math.log(overshoot)
    decay = 2.0 / (lag * (1.0 + turn * turn))
    w, kept = decay * turn, math.exp(-decay)
    first = 1.0 - kept * (math.cos(w) + math.sin(w) / turn)
    second = 1.0 - kept * kept * (math.cos(2.0 * w) + math.sin(2.0 * w) / turn)
    back = 2.0 * kept * math.cos(w)
    late = second - (1.0 + back) * first
    sent = torque = before = s.answer_before_nm[axis]
    for k in range(n):
        now = s.answer_sent_nm[axis, k]
        torque, before = back * torque - kept * kept * before + first * now + late * sent, torque
        s.answer_model_nm[axis, k], sent = torque, now


@compiled
def _at_ringing(
    s: Record, axis: int, n: int, lag: float, overshoot: float, latest: int, found: tuple[float, float]
) -> tuple[float, float]:
    """(squares left, lag) of a loop of this lag and overshoot, if it is better than what was found."""
    _rung(s, axis, n, lag, overshoot)
    first = max(latest - SHIFTS // 2 - int(HALF_OF_LAG * lag), 0)
    for shift in range(first, min(first + SHIFTS, n - 2)):
        left = fit(s, axis, n, lag, shift, math.inf)[0]
        if left < found[0]:
            found = (left, lag)
    return found


@compiled
def _ringing(s: Record, axis: int, n: int, overshoot: float, latest: int, near: float) -> tuple[float, float]:
    """(squares left, lag) of the best loop that exceeds its steps so far, its lag within NEAR of `near` (0:
    any)."""
    found = (math.inf, 0.0)
    for i in range(1, LAGS):
        lag = lag_of(i)
        if near == 0.0 or near / NEAR < lag < near * NEAR:
            found = _at_ringing(s, axis, n, lag, overshoot, latest, found)
    return found


@compiled
def _peaks(s: Record, axis: int, n: int, most_nm: float, deviation_nm: float) -> bool:
    """True when means of 1, 2 and 4 samples surely exceed that of the last quarter of the step by more than
    `most_nm`."""
    y, last, end = s.answer_measured_nm[axis], n // 4, 0.0
    for k in range(n - last, n):
        end += y[k] / last
    for width in (1, 2, 4):
        total = 0.0
        for k in range(n):
            total += y[k] - (y[k - width] if k >= width else 0.0)
            peak = total / width - NOISE_PEAKS * deviation_nm / math.sqrt(width)
            if k + 1 >= width and peak > end + most_nm:
                return True
    return False


@compiled
def overshoots(s: Record, p: Record, axis: int, n: int, best: float, step: float) -> bool:
    """True when the current surely exceeds a step of `step` by more than it may; the best lag leaves `best`.

    Notes
    -----
    The ratio of likelihoods of the loops that exceed it by more and of those that do not. The noise is that
    of the part in which nothing was sent, as what a lag leaves has the overshoot itself in it. Held samples
    are stairs, which ring as little as they lag: of them the largest decides."""
    most, ticks = p.current_overshoot_limit[axis], p.arming_ticks
    if not most > 0.0 or n < FEWEST_FOR_OVERSHOOT:
        return False
    mean = s.answer_rest_nm[axis] / ticks
    squares = max(s.answer_rest_nm2[axis] - ticks * mean * mean, 0.0)
    variance = LAID_OVER * squares / (ticks - 1)
    if p.proof_age_ticks[axis] > 0:
        return _peaks(s, axis, n, most * step, math.sqrt(variance))
    latest = latest_shift(s, axis, n)
    found = _ringing(s, axis, n, most, latest, 0.0)
    lag = found[1]
    # lags between those of the row for these alone: what is refused is no matter of the row
    for over in (most, LESS * most):
        for i in range(2 * FINE + 1):
            found = _at_ringing(s, axis, n, lag * LAG_RATIO ** (i / FINE - 1.0), over, latest, found)
    least = min(best, found[0]) - SURELY * variance - (UNEVEN * most * step) ** 2
    for beyond in BEYOND:
        over = min(most + beyond, MOST)
        if least > 0.0 and _ringing(s, axis, n, over, latest, lag)[0] < least:
            return True
    return False
