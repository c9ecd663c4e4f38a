"""A hand that moves the joint is not answered by its torque at once, for that shakes it; and how fast is the
hand?

    pace <- LP |v|, `PACE_S`                      slow: pace <= `SLOW_BLENDS` v_b

Help F in the direction and to the share that a hand's torque asks for is a gain from that torque to the
motor's, F/tau_g and more: 7 and 20 on the joints that were measured. Through low-passes of 16 and 50 Hz that
is a loop which rings with an elastic joint or a stiff hand at 30 to 60 Hz, and no eigenvalue covers it, since
it has corners. So

- on a joint that slides the direction is that of the motion, at any pace (`feedforward`): a hand that wants
  to turn back brakes first;
- in the turn of a slow hand the intent goes from there to the hand's torque as slowly as at rest, and in
  every turn only as far as the joint is slow;
- the brake (`braking`) goes by the hand's mean push, through `BRAKE_TIMES` the low-pass of rest: a ring about
  a push that moves the joint brakes nothing. Clipped first, each half period would take help away too late,
  which is negative damping;
- the gate goes by the hand's mean torque, through `MEAN_TIMES` the low-pass of rest, while a hand slides the
  joint on, and opens and closes at `GATE_TIMES` the rate of rest: it neither opens at the peaks of a ring nor
  sinks between them.

In the turns of a brisk hand, which take some hundredths of a second, the intent follows `TURN_TIMES` as fast
as at rest: slower, the hand would be held back, and at once, bristles that are still bent would throw the
joint back. An admittance follows its mass, whose hand is another loop (`admittance_margin`)."""

from __future__ import annotations

import math

from rtctl.control.display import is_admittance
from rtctl.control.jit import compiled
from rtctl.control.records import Record

PACE_S = 0.3
"""Time constant of the mean speed."""

SLOW_BLENDS = 2.5
"""A hand is slow up to so many times the speed v_b below which the direction counts as one of rest:
.2 rad/s."""

MEAN_TIMES = 2.5
"""The hand's mean torque, which opens the gate, follows so many times as fast as the intent at rest, and so
does the share that the brake takes: 5 Hz."""

TURN_TIMES = 10.0
"""In the turn of a brisk hand the intent follows so many times as fast as at rest: 20 Hz."""

BRAKE_TIMES = 2.0
"""The push that the brake goes by, likewise: 4 Hz."""

GATE_TIMES = 0.25
"""The gate of a hand that slides the joint on follows so many times as fast as it closes else, .5 Hz, both
ways: open sooner than it sinks, it saws in step with a ring."""


@compiled
def advance_pace(s: Record, p: Record, axis: int) -> None:
    """Take the speed of this tick in; one that is no number is none."""
    # either way: a hand that goes to and fro is as fast as one that goes on
    speed = abs(s.velocity_rad_s[axis])
    if math.isfinite(speed):  # one NaN would stay in the mean
        s.pace_rad_s[axis] += min(p.period_s / PACE_S, 1.0) * (speed - s.pace_rad_s[axis])


@compiled
def is_slow(s: Record, p: Record, axis: int) -> bool:
    """True where a hand moves the joint slowly, or not at all; never of an admittance."""
    # by the mean and not by the speed of this tick: each turn passes zero, of a brisk hand, too
    return s.pace_rad_s[axis] <= SLOW_BLENDS * p.friction_blend_rad_s[axis] and not is_admittance(s, axis)


@compiled
def eased(p: Record, axis: int, before: float, now: float, times: float) -> float:
    """What follows the hand's torque, `now`, so many times as fast as the intent at rest; nothing where that
    is no number."""
    mean = before + min(times * p.rest_alpha[axis], 1.0) * (now - before)  # 1: a slow loop overshoots
    # empty, and not as before: it begins anew with the next number
    return mean if math.isfinite(mean) else 0.0
