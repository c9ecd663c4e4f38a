"""What the current's answer to the test pulse tells: delay, lag, gain and offset of the torque.

The three steps of the pulse (0 to +tau, +tau to -tau, -tau to 0) are laid over one another, weighted 1, -2,
1: an offset cancels, and what is left is one step of the torque sent and the answer to it, `RESPONSE` ticks
long. The answer is taken to be the sent step times a gain, delayed, behind a first-order lag; a sample shows
the current at its instant. For every lag of a row and every whole delay, gain and fraction of the delay
follow by least squares (`_fit`).

A sampled current cannot tell a small lag from a fraction of a period of delay, and none at all shows a delay
of .9 as a delay of 0. What is reported is therefore the *least* total delay (delay + lag) that the answer
allows: among all fits that noise allows beside the best one. A delay that it calls too long surely is."""

from __future__ import annotations

import math

from rtctl.control.detectors import held_torque
from rtctl.control.jit import compiled
from rtctl.control.records import RESPONSE, Record
from rtctl.control.vocabulary import Fault

_F_CURRENT = int(Fault.CURRENT)
_F_DELAY = int(Fault.DELAY)

SHORTEST = 5
"""Parts of the pulse shorter than this many ticks (loops below 250 Hz) measure nothing."""

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

SETTLING_LAGS = 2.0
"""The answer must have come, but for e^-2 of the step, two ticks before its end: of a wrong sign it would
seem to come just behind it."""

ALLOWANCE = 12.0
FLOOR_SHARE = 0.02
"""A fit beside the best one is possible while the squares it leaves exceed the best one's by no more than
ALLOWANCE variances of the noise, plus the square of FLOOR_SHARE of the step (quantised currents, a current
loop that is not first order)."""

NOISE_SHARE = 0.25
"""Noise above this share of the step: nothing is measured."""

GAIN_ERRORS = 3.0
"""So many standard errors the gain must be outside of its bounds."""

FEWEST_FOR_OVERSHOOT = 10
"""Shorter parts (loops below 500 Hz) tell none."""

BEYOND = (0.05, 0.12, 0.22, 0.4)
"""Overshoots that are tried beyond what is declared."""

SURELY = 17.0
"""So many variances more must be left by the best loop that exceeds its steps by no more than it may."""

UNEVEN = 0.4
"""And the square of this share of the overshoot that may be: what the row of lags and delays leaves of it."""

LESS = 0.6
NEAR = 3.5
"""Of those a second overshoot is tried, this share of the most; and the lags of the others within this
factor."""

LAID_OVER = 6.0
"""Variance of three steps laid over one another, weighted 1, -2, 1, in those of a sample."""

TOLERANCE_TICKS = 0.1
"""By this much a measured delay may exceed the proof's: what the row of lags resolves."""


@compiled
def forget(s: Record, axis: int) -> None:
    """Nothing is measured yet: before the first tick of a test."""
    for k in range(RESPONSE):
        s.answer_sent_nm[axis, k] = 0.0
        s.answer_measured_nm[axis, k] = 0.0
    s.answer_before_nm[axis] = s.answer_gap_nm[axis] = 0.0
    s.answer_rest_nm[axis] = s.answer_rest_nm2[axis] = 0.0
    s.answer_late_count[axis] = s.answer_count[axis] = s.running_count[axis] = 0
    s.running_known_count[axis] = 0


@compiled
def keep(s: Record, p: Record, axis: int, measured: float, sent_ticks: int, skipped: int) -> None:
    """Take this tick's torque by the current, `measured`, after `sent_ticks` ticks of the test were sent."""
    n = max(p.arming_ticks, 1)
    part, k = (sent_ticks - 1) // n, (sent_ticks - 1) % n
    sent = held_torque(s, axis, 1)
    s.answer_gap_nm[axis] += measured - sent  # over all four parts: +tau and -tau cancel
    if skipped > 0:
        s.answer_late_count[axis] += 1
    if part == 0:  # before the first step there is no answer to lay over
        s.answer_rest_nm[axis] += measured
        s.answer_rest_nm2[axis] += measured * measured
    if part == 0 or k >= RESPONSE:
        return
    weight = -2.0 if part == 2 else 1.0
    s.answer_sent_nm[axis, k] += weight * sent
    s.answer_measured_nm[axis, k] += weight * measured
    if k == 0:
        s.answer_before_nm[axis] += weight * held_torque(s, axis, 2)  # of each step what it starts from


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
def _lagged(s: Record, axis: int, n: int, lag: float) -> None:
    """The sent step behind a lag of so many ticks, without delay, as samples show it."""
    kept = math.exp(-1.0 / lag) if lag > 0.0 else 0.0
    # it begins settled at what was sent before the step
    torque = s.answer_before_nm[axis]
    for k in range(n):
        torque = kept * torque + (1.0 - kept) * s.answer_sent_nm[axis, k]
        s.answer_model_nm[axis, k] = torque


@compiled
def _lag_of(i: int) -> float:
    return 0.0 if i == 0 else LAG_FIRST * LAG_RATIO ** (i - 1)


@compiled
def _fit(s: Record, axis: int, n: int, lag: float, shift: int, most: float) -> tuple[float, float, float]:
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
def _latest_shift(s: Record, axis: int, n: int) -> int:
    """Whole delay with which the step without any lag fits best."""
    _lagged(s, axis, n, 0.0)
    best, found = math.inf, 0
    for shift in range(n - 2):  # two ticks at least must show the step settled
        left = _fit(s, axis, n, 0.0, shift, math.inf)[0]
        if left < best:
            best, found = left, shift
    return found


@compiled
def _at_lag(
    s: Record,
    axis: int,
    n: int,
    lag: float,
    latest: int,
    most: float,
    found: tuple[float, float, float, float],
) -> tuple[float, float, float, float]:
    """(squares left, gain, delay, lag) of this lag's best whole delay around `latest`, if it is better than
    what was found, else that."""
    _lagged(s, axis, n, lag)
    # with a lag the step comes as late by less delay
    first = max(latest - SHIFTS // 2 - int(HALF_OF_LAG * lag), 0)
    for shift in range(first, min(first + SHIFTS, n - 2)):
        left, gain, total = _fit(s, axis, n, lag, shift, most)
        # least squares first; then, within noise, the least delay
        better = total < found[2] if most < math.inf else left < found[0]
        if left <= most and better:
            found = (left, gain, total, lag)
    return found


@compiled
def _least_delay(
    s: Record, axis: int, n: int, most: float, best_lag: float
) -> tuple[float, float, float, float]:
    """(squares left, gain, delay, lag) of the least total delay among the fits that leave at most `most`;
    `best_lag` is the best one's.

    With `most` infinite: of the best fit."""
    latest = _latest_shift(s, axis, n)
    found = (math.inf, 0.0, math.inf, 0.0)
    for i in range(LAGS):
        found = _at_lag(s, axis, n, _lag_of(i), latest, most, found)
    if best_lag > 0.0:
        for i in range(1, 2 * FINE):
            found = _at_lag(s, axis, n, best_lag * LAG_RATIO ** (i / FINE - 1.0), latest, most, found)
    return found


@compiled
def _at_ringing(
    s: Record, axis: int, n: int, lag: float, overshoot: float, latest: int, found: tuple[float, float]
) -> tuple[float, float]:
    """(squares left, lag) of a loop of this lag and overshoot, if it is better than what was found."""
    _rung(s, axis, n, lag, overshoot)
    first = max(latest - SHIFTS // 2 - int(HALF_OF_LAG * lag), 0)
    for shift in range(first, min(first + SHIFTS, n - 2)):
        left = _fit(s, axis, n, lag, shift, math.inf)[0]
        if left < found[0]:
            found = (left, lag)
    return found


@compiled
def _ringing(s: Record, axis: int, n: int, overshoot: float, latest: int, near: float) -> tuple[float, float]:
    """(squares left, lag) of the best loop that exceeds its steps so far, its lag within NEAR of `near` (0:
    any)."""
    found = (math.inf, 0.0)
    for i in range(1, LAGS):
        lag = _lag_of(i)
        if near == 0.0 or near / NEAR < lag < near * NEAR:
            found = _at_ringing(s, axis, n, lag, overshoot, latest, found)
    return found


@compiled
def _overshoots(s: Record, p: Record, axis: int, n: int, best: float, step: float) -> bool:
    """True when the current surely exceeds a step of `step` by more than it may; the best lag leaves `best`.

    Notes
    -----
    The ratio of likelihoods of the loops that exceed it by more and of those that do not. The noise is that
    of the part in which nothing was sent, as what a lag leaves has the overshoot itself in it."""
    most, ticks = p.current_overshoot_limit[axis], p.arming_ticks
    if not most > 0.0 or n < FEWEST_FOR_OVERSHOOT:
        return False
    mean = s.answer_rest_nm[axis] / ticks
    squares = max(s.answer_rest_nm2[axis] - ticks * mean * mean, 0.0)
    variance = LAID_OVER * squares / (ticks - 1)
    latest = _latest_shift(s, axis, n)
    found = _ringing(s, axis, n, most, latest, 0.0)
    lag = found[1]
    # lags between those of the row for these alone: what is refused is no matter of the row
    for over in (most, LESS * most):
        for i in range(2 * FINE + 1):
            found = _at_ringing(s, axis, n, lag * LAG_RATIO ** (i / FINE - 1.0), over, latest, found)
    least = min(best, found[0]) - SURELY * variance - (UNEVEN * most * step) ** 2
    for beyond in BEYOND:
        if least > 0.0 and _ringing(s, axis, n, most + beyond, latest, lag)[0] < least:
            return True
    return False


@compiled
def conclude(s: Record, p: Record, axis: int) -> int:
    """After the last tick of the test: write the `answer_` results; CURRENT and DELAY as they are found."""
    ticks = p.arming_ticks
    n = min(ticks, RESPONSE)
    height = s.answer_sent_nm[axis, n - 1] - s.answer_before_nm[axis]
    if ticks < SHORTEST or s.answer_late_count[axis] > 0 or not height > 0.0:
        return 0
    best, gain, delay, lag = _least_delay(s, axis, n, math.inf, 0.0)
    variance = best / (n - 3)  # gain, delay and lag are fitted
    step = gain * height
    offset = s.answer_gap_nm[axis] / (4 * ticks)  # told by the mean of the whole test, fit or none
    fault = 0 if abs(offset) <= p.current_offset_nm[axis] else _F_CURRENT
    settled = delay + SETTLING_LAGS * lag <= n - 2
    if not (settled and variance <= (NOISE_SHARE * step) ** 2):
        return fault
    floor = (FLOOR_SHARE * step) ** 2
    _, _, delay, lag = _least_delay(s, axis, n, best + ALLOWANCE * variance + floor, lag)
    s.answer_count[axis] = 1
    s.answer_delay[axis], s.answer_lag[axis] = delay, lag
    s.answer_gain[axis], s.answer_offset_nm[axis] = gain, offset
    error = GAIN_ERRORS * math.sqrt(variance / n) / (0.5 * height)
    if not abs(gain - 1.0) <= p.current_gain_error[axis] + error:
        fault |= _F_CURRENT
    if _overshoots(s, p, axis, n, best, step):
        fault |= _F_CURRENT
    return fault | leaves_proof(p, axis, delay)


@compiled
def report(t: Record, s: Record, axis: int) -> None:
    """What has been measured of the actuator into the tick; NaN where nothing was."""
    known = s.answer_count[axis] > 0
    t.arming_delay_ticks[axis] = s.answer_delay[axis] if known else math.nan
    t.arming_lag_ticks[axis] = s.answer_lag[axis] if known else math.nan
    t.arming_gain[axis] = s.answer_gain[axis] if known else math.nan
    t.arming_offset_nm[axis] = s.answer_offset_nm[axis] if known else math.nan
    t.running_delay_ticks[axis] = s.running_delay[axis] if s.running_count[axis] > 0 else math.nan
    running = s.running_known_count[axis] > 0
    t.running_gain[axis] = s.running_gain[axis] if running else math.nan
    t.running_offset_nm[axis] = s.running_offset_nm[axis] if running else math.nan


@compiled
def leaves_proof(p: Record, axis: int, delay: float) -> int:
    """DELAY when so many ticks of delay are more than the proof of the coupling covers."""
    covered = p.proof_delay_s[axis]
    if not covered > 0.0:
        return 0
    return 0 if (delay - TOLERANCE_TICKS) * p.period_s <= covered else _F_DELAY
