"""Does the joint rest, or only bend its bristles? Then what the force sensor says is taken in ever more slowly.

A joint in presliding is held by its bristles as by a spring, and vibrates at 6 Hz or more in whatever hand. Help that
follows the hand's torque, g LP(-k x - m a), lags behind it by a low-pass or two and drives that vibration, at some milliradians
a second within a count of the encoder, at some tens of them in a stiff and heavy hand. The coupling does not see it, and
the account of energy takes seconds or minutes to be emptied by it. So

- `BENT_S` after the joint last slid (the bristles of `dry_friction` at their end; or after it came to one place, within `REST_COUNTS` or
  `REST_SHARE` of the credited presliding length) direction and gate of the feed-forward and the observer follow the hand's torque
  through two low-passes of `REST_HZ`;
- after `REST_S` in one place a velocity that is nothing but the flicker between two counts is none for the observer.

Why two low-passes. One that lags by 90 degrees makes of the help g LP(-k x) the negative damping g k/w times f_rest/f.
Two lag by nearly 180 degrees, which is a slightly softer spring, and the damping taken is 2 (f_rest/f)^3 g k/w.

Why so late. A hand that turns back passes through presliding as well, within some hundredths of a second. The gate stays as open as
it was, and the direction is that of the bristles by then. Low-passes that fell as 1/t from the first tick on took half the help from
a recorded hand that turned back every .2 s (`tests/acceptance/test_real_recordings.py`), and left hands that hold still no quieter.
"""

from __future__ import annotations

import math

from rtctl.control.jit import compiled
from rtctl.control.records import Record

REST_COUNTS = 1.5
"""A joint within so many encoder counts of one place rests: one that flickers between two counts does."""

REST_SHARE = 0.05
"""Or within this share of the credited presliding length, where friction is a spring."""

REST_S = 0.02
"""After so long in one place, flicker is no velocity."""

BENT_S = 0.15
"""So long bristles may bend before it is called rest: through presliding within it is a hand that turns back."""

REST_HZ = 2.0
"""Low-pass of the hand's torque for the help with friction at rest."""


@compiled
def advance_rest(s: Record, p: Record, axis: int, hand: float) -> None:
    """Count the ticks of rest, and take the hand's torque in, N m; what is not finite is so for one tick."""
    moved = s.position_rad[axis] - s.rest_position_rad[axis]
    if abs(moved) <= max(REST_COUNTS * p.count_rad[axis], REST_SHARE * p.presliding_rad[axis]):
        s.rest_ticks[axis] += 1
        s.bent_ticks[axis] += 1
    else:  # or no number
        s.rest_position_rad[axis] = s.position_rad[axis]
        s.rest_ticks[axis] = 0
        s.bent_ticks[axis] = s.bent_ticks[axis] + 1 if abs(s.bristle_share[axis]) < 1.0 else 0
    before = s.calm_hand_nm[axis]
    if not math.isfinite(before):
        before = 0.0
    s.calm_hand_nm[axis] = before + while_bent(s, p, axis, 1.0) * (hand - before)


@compiled
def is_resting(s: Record, p: Record, axis: int) -> bool:
    """True when the joint cannot be told from one that stands."""
    return s.rest_ticks[axis] * p.period_s > REST_S


@compiled
def while_bent(s: Record, p: Record, axis: int, alpha: float) -> float:
    """Low-pass coefficient per tick of what follows the hand's torque, which is `alpha`, 0 to 1, on a joint that slides."""
    return alpha if s.bent_ticks[axis] * p.period_s <= BENT_S else min(alpha, p.rest_alpha[axis])
