"""What the current's answer to the test pulse tells: delay, lag, gain and offset of the torque.

The three steps of the pulse (0 to +tau, +tau to -tau, -tau to 0) are laid over one another, weighted 1, -2,
1: an offset cancels, and what is left is one step of the torque sent and the answer to it, `RESPONSE` ticks
long. The answer is taken to be the sent step times a gain, delayed, behind a first-order lag; a sample shows
the current at its instant. For every lag of a row and every whole delay, gain and fraction of the delay
follow by least squares (`current_fit`).

A sampled current cannot tell a small lag from a fraction of a period of delay, and none at all shows a delay
of .9 as a delay of 0. What is reported is therefore the *least* total delay (delay + lag) that the answer
allows: among all fits that noise allows beside the best one. A delay that it calls too long surely is."""

from __future__ import annotations

import math

from rtctl.control.current_fit import (
    FINE,
    HALF_OF_LAG,
    LAG_RATIO,
    LAGS,
    SHIFTS,
    fit,
    lag_of,
    lagged,
    latest_shift,
)
from rtctl.control.current_overshoot import overshoots
from rtctl.control.detectors import held_torque
from rtctl.control.jit import compiled
from rtctl.control.records import RESPONSE, Record
from rtctl.control.vocabulary import Fault

_F_CURRENT = int(Fault.CURRENT)
_F_DELAY = int(Fault.DELAY)

SHORTEST = 5
"""Parts of the pulse shorter than this many ticks (loops below 250 Hz) measure nothing."""

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
    lagged(s, axis, n, lag)
    # with a lag the step comes as late by less delay
    first = max(latest - SHIFTS // 2 - int(HALF_OF_LAG * lag), 0)
    for shift in range(first, min(first + SHIFTS, n - 2)):
        left, gain, total = fit(s, axis, n, lag, shift, most)
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
    latest = latest_shift(s, axis, n)
    found = (math.inf, 0.0, math.inf, 0.0)
    for i in range(LAGS):
        found = _at_lag(s, axis, n, lag_of(i), latest, most, found)
    if best_lag > 0.0:
        for i in range(1, 2 * FINE):
            found = _at_lag(s, axis, n, best_lag * LAG_RATIO ** (i / FINE - 1.0), latest, most, found)
    return found


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
    if overshoots(s, p, axis, n, best, step):
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
