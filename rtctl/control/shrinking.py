"""Strokes that shrink are those of a hand that comes to rest: a part of the friction is left to the joint
then.

    peak       largest |v| of the present stroke; it ends where the bristles are bent to the other end
    reference  <- peak + (reference - peak) max(1 - stroke_s/REFERENCE_S, KEPT)  at its end; peak if larger
    wanted     = LEFT_MOST clip((STEADY reference - peak)/((STEADY - SHRUNK) reference), 0, 1)
    share      = 1 - LP wanted                            of feed-forward and observer that is sent

Why. A heavy hand on a soft spring that hardly damps swings out where friction is compensated, and slides back
for seconds from where it was stuck. Within one stroke it cannot be told from a person: in both hands the work
of a stroke is what friction takes. But nobody gives it energy, so its strokes shrink; who moves a joint to
and fro keeps them. So all of the friction may be taken from strokes that stay as fast as they were, and who
comes to rest anyway is braked.

- A slower peak is believed once the joint is slower again by a tenth and by what an encoder cannot tell; a
  faster one at once. Not in the first half of a stroke as long as the one before, while hand and world push
  the joint on: help that turned sooner than soft bristles throws the joint, and they stop it. That dip was
  taken for the end of a stroke of a quarter the speed, and .3 of the help for a hand that comes to rest.
- The reference forgets by strokes, for soft springs swing once in a second or two, and by REFERENCE_S where
  strokes are quick: the viscous damping alone must look like shrinking. In a stroke longer than LONG_S, of
  slow motion after fast, the reference goes to its peak.
- On a joint that creeps or stands it forgets nothing: a hand that holds a spring under tension would be
  helped to slip seconds later.

Less help never breaks a proof: the account, the two lines and the observer's eigenvalues bound it from above.
A virtual mass is braked by its own damping, and its joint must follow: it is helped as ever."""

from __future__ import annotations

import math

from rtctl.control.assistance import CREEP_RAD_S
from rtctl.control.display import is_admittance
from rtctl.control.dry_friction import slides
from rtctl.control.handle import own_rad
from rtctl.control.jit import compiled
from rtctl.control.records import Record
from rtctl.control.resting import is_bent
from rtctl.control.states import is_powered

LEFT_MOST = 0.3
"""Largest share of the help that is taken back."""

STEADY, SHRUNK = 0.75, 0.45
"""A stroke whose peak is this share of the reference is as fast as those before; and one of which LEFT_MOST
is taken back."""

REFERENCE_S, KEPT, LONG_S = 0.5, 0.3, 0.5
"""The reference follows slower strokes so fast, but keeps this share of the difference at each; a stroke is
long after this time."""

FALLEN, COUNT_S = 0.9, 0.01
"""A peak is over when the speed is below this share of it, less one encoder count in this time."""

EASE_S = 0.05
"""Time constant with which help goes and comes back."""


@compiled
def _forget_strokes(s: Record, axis: int) -> None:
    s.stroke_peak_rad_s[axis] = s.stroke_reference_rad_s[axis] = 0.0
    s.stroke_side[axis] = s.stroke_s[axis] = 0.0
    s.stroke_wanted[axis] = s.stroke_left[axis] = s.stroke_before_s[axis] = 0.0


@compiled
def _end_stroke(s: Record, axis: int) -> None:
    """Let the reference follow the peak of the stroke that ends; begin another."""
    peak = s.stroke_peak_rad_s[axis]
    above = max(s.stroke_reference_rad_s[axis] - peak, 0.0)
    # c = 1 - t/.5 s: viscous damping alone must look like shrinking, to 1/(1 - .5 s/tau) (5.11)
    s.stroke_reference_rad_s[axis] = peak + above * max(1.0 - s.stroke_s[axis] / REFERENCE_S, KEPT)
    s.stroke_before_s[axis] = s.stroke_s[axis]
    s.stroke_peak_rad_s[axis] = s.stroke_s[axis] = 0.0


@compiled
def _advance_stroke(s: Record, p: Record, axis: int, speed: float) -> None:
    """Find where a stroke ends, and age it and the reference while the joint moves. `speed` in rad/s, >=
    0."""
    if not slides(s, axis):
        return
    side = 1.0 if s.bristle_share[axis] > 0.0 else -1.0
    if side != s.stroke_side[axis]:
        _end_stroke(s, axis)
        s.stroke_side[axis] = side
    if not speed > own_rad(p, axis, CREEP_RAD_S):  # who creeps ages nothing
        return
    s.stroke_s[axis] += p.period_s
    above = s.stroke_reference_rad_s[axis] - s.stroke_peak_rad_s[axis]
    if s.stroke_s[axis] > LONG_S and above > 0.0:
        s.stroke_reference_rad_s[axis] -= p.period_s / REFERENCE_S * above


@compiled
def _is_over(t: Record, s: Record, p: Record, axis: int, speed: float) -> bool:
    """True when the peak of the stroke is behind the joint: it is slower, and not pushed on in the first half
    of the stroke, or it rests."""
    # less a count in 10 ms: a slow peak may be nothing but the encoder's steps
    if not speed < FALLEN * s.stroke_peak_rad_s[axis] - p.count_rad[axis] / COUNT_S:
        return False
    if s.stroke_s[axis] >= min(0.5 * s.stroke_before_s[axis], LONG_S) or is_bent(s, p, axis):
        return True
    push = (t.hand_torque_nm[axis] + t.coupling_torque_nm[axis]) * s.stroke_side[axis]
    return not push > p.friction_gate_deadband_nm[axis]


@compiled
def steady_share(t: Record, s: Record, p: Record, axis: int) -> float:
    """Advance the strokes of the state; return the share of the help that is left, 1 - LEFT_MOST to 1.

    A velocity that is no number changes nothing. Nothing is remembered without power."""
    if not is_powered(s.state) or is_admittance(s, axis):
        _forget_strokes(s, axis)
        return 1.0
    speed = abs(t.velocity_rad_s[axis])
    if math.isfinite(speed):
        _advance_stroke(s, p, axis, speed)
        peak = s.stroke_peak_rad_s[axis] = max(s.stroke_peak_rad_s[axis], speed)
        reference, wanted = s.stroke_reference_rad_s[axis], 0.0
        if reference > own_rad(p, axis, CREEP_RAD_S):  # below, a reference means nothing
            short = (STEADY * reference - peak) / ((STEADY - SHRUNK) * reference)
            wanted = LEFT_MOST * min(max(short, 0.0), 1.0)
        # more help at once, less when it is sure
        if _is_over(t, s, p, axis, speed) or wanted < s.stroke_wanted[axis]:
            s.stroke_wanted[axis] = wanted
    s.stroke_left[axis] += min(p.period_s / EASE_S, 1.0) * (s.stroke_wanted[axis] - s.stroke_left[axis])
    return 1.0 - s.stroke_left[axis]
