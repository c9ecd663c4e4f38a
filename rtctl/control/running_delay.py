"""The delay of the torque as ordinary motion shows it, in ACTIVE.

Over windows of about a second, torque sent u and measured i (both behind the same low-pass of 16 ms, so that
what lies between them is small and noise smaller) are compared by least squares:

    u - i = delay du + (1 - gain) u - offset,        du: change of u per tick

for a torque that changes little within the delay; a first-order lag counts as delay. Both are of the tick of
the sample where samples are old by declaration, and the proof is of that age, too (docs/theory.md 11.3). An
estimate counts only where the motion shows it: with a standard error below MOST_ERROR_TICKS, which counts one
independent sample per two time constants of the low-pass, and a residual of a thousandth of the torque limit
at the least. Only a delay that leaves the proof by more than three of those errors, in two windows in a row,
is DELAY. What the same windows say of gain and offset is `running_current`'s."""

from __future__ import annotations

import math

from rtctl.control.current_answer import leaves_proof
from rtctl.control.detectors import held_torque
from rtctl.control.jit import compiled, inlined
from rtctl.control.records import Record
from rtctl.control.running_current import judge_current
from rtctl.control.running_window import moments, of_mean, regression
from rtctl.control.vocabulary import State

_ACTIVE = int(State.ACTIVE)

WINDOW_S = 1.0
LOWPASS_S = 0.016
MOST_ERROR_TICKS = 0.5
"""Worse known than this a delay is not judged: the reserve of a proof is a fraction of a tick (60 N m/rad
and .01 N m s/rad on a damping of .05 are covered up to .41 at 1 kHz)."""

ERRORS = 3.0
FLOOR_SHARE = 1e-3
"""Least residual, as a share of the torque limit: a simulated current leaves none, and with an error of 0
rounding would be a fault."""

LEAST_GAIN = 0.3
"""The slope is delay times gain, so that a gain near 0 would divide it into any delay."""

BAD_WINDOWS = 2


@compiled
def _restart(s: Record, axis: int) -> None:
    for k in range(9):
        s.running_sums[axis, k] = 0.0
    s.running_ticks[axis] = 0


@compiled
def _estimate(s: Record, axis: int, share: float, floor: float) -> tuple[float, float]:
    """(delay, its standard error) of the window, ticks; an infinite error where the motion does not show
    it."""
    slope, rest, left, area = regression(s, axis)
    gain = 1.0 - rest
    if area == 0.0 or not gain >= LEAST_GAIN:  # a dead current has no delay: that is CURRENT
        return 0.0, math.inf
    variance = of_mean(left, s.running_ticks[axis], floor, share)
    uu = moments(s, axis)[5]
    return slope / gain, math.sqrt(variance * uu / area) / gain


@inlined
def running_fault(t: Record, s: Record, p: Record, axis: int, skipped: int) -> int:
    """Follow the torque of one axis; DELAY while its delay has left the proof of the coupling, CURRENT while
    it is another."""
    # of the first tick the torque is ARMING's
    if p.follow_kind[axis] == 0 or s.state != _ACTIVE or s.ticks_in_state == 0:
        s.running_bad_count[axis] = s.running_gap_count[axis] = 0
        s.running_ticks[axis] = -1  # the low-passes begin at the present torque, not at 0
        return 0
    # a current as old as declared shows what was sent then; what was sent since differs by more than its age
    # explains, as the coupling relaxes in ticks without a sample
    age = min(s.sample_age_ticks, p.proof_age_ticks[axis])
    sent, measured = held_torque(s, axis, 1 + age), t.motor_torque_nm[axis]
    if skipped > 0 or s.running_ticks[axis] < 0:  # a gap is no change per tick
        _restart(s, axis)
        s.running_sent_nm[axis], s.running_measured_nm[axis] = sent, measured
        return 0
    share = min(p.period_s / LOWPASS_S, 1.0)
    d = share * (sent - s.running_sent_nm[axis])
    s.running_sent_nm[axis] += d
    s.running_measured_nm[axis] += share * (measured - s.running_measured_nm[axis])
    u = s.running_sent_nm[axis]
    e = u - s.running_measured_nm[axis]
    sums = s.running_sums[axis]
    sums[0] += d
    sums[1] += u
    sums[2] += e
    sums[3] += d * d
    sums[4] += d * u
    sums[5] += u * u
    sums[6] += d * e
    sums[7] += u * e
    sums[8] += e * e
    s.running_ticks[axis] += 1
    if s.running_ticks[axis] * p.period_s < WINDOW_S:
        return 0
    return _judge(s, p, axis, share)


@compiled
def _judge(s: Record, p: Record, axis: int, share: float) -> int:
    """At the end of a window."""
    floor = FLOOR_SHARE * p.torque_limit_nm[axis]
    delay, error = _estimate(s, axis, share, floor)
    other = judge_current(s, p, axis, floor, share)
    _restart(s, axis)
    # the count of bad windows stays: one that shows nothing excuses nothing
    if not (error <= MOST_ERROR_TICKS and p.proof_delay_s[axis] > 0.0):
        return other
    s.running_delay[axis] = delay
    s.running_count[axis] = 1
    # the proof is of delay and age together
    fault = leaves_proof(p, axis, delay + p.proof_age_ticks[axis] - ERRORS * error)
    s.running_bad_count[axis] = s.running_bad_count[axis] + 1 if fault else 0
    return other | fault if s.running_bad_count[axis] >= BAD_WINDOWS else other
