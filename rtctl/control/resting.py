"""Is the joint at rest, as far as anybody can tell? Then what the force sensor says is taken in ever more slowly.

A joint that rests in a hand may vibrate within some counts of its encoder, at some milliradians a second, driven by help
that follows the hand's torque. The coupling does not see it, the account of energy takes minutes to be emptied by it, and
the observer cannot take the joint's inertia into account. So while a joint stays near one place, within `REST_COUNTS` or
`REST_SHARE` of the credited presliding length,

- all that follows the hand's torque (direction, gate, observer) does so through two low-passes, whose frequency falls
  with the time at rest t as `REST_HZ` (1 + `CALMING_S`/t);
- after `REST_S`, a velocity that is nothing but the flicker between two counts is none for the observer.

Why two low-passes. A resting joint is held by its bristles as well, so it vibrates at 6 Hz or more in whatever hand. Help
g LP(-k x) that lags by 90 degrees, as behind one low-pass, is the negative damping g k/w times f_rest/f. Behind two it
lags by nearly 180 degrees, which is a slightly softer spring, and the damping taken is 2 (f_rest/f)^3 g k/w.

Why ever more slowly. A hand that turns back passes through rest as well. It bends the bristles by the next counts within
some hundredths of a second, while the low-passes are quick, and rest is over.
"""

from __future__ import annotations

import math

from rtctl.control.jit import compiled
from rtctl.control.records import Record

REST_COUNTS = 1.5
"""A joint within so many encoder counts of one place may rest: one that flickers between two counts does."""

REST_SHARE = 0.1
"""Or within this share of the credited presliding length, where friction is a spring."""

REST_S = 0.02
"""After so long in one place, flicker is no velocity."""

REST_HZ = 2.0
"""Low-pass of the hand's torque for the help with friction after a long rest."""

CALMING_S = 0.2
"""After so long it is still twice that."""


@compiled
def advance_rest(s: Record, p: Record, axis: int, hand: float) -> None:
    """Count the ticks since the joint last moved, and take the hand's torque in, N m; what is not finite is so for one tick."""
    _count(s, p, axis)
    before = s.calm_hand_nm[axis]
    if not math.isfinite(before):
        before = 0.0
    s.calm_hand_nm[axis] = before + calmed(s, p, axis, 1.0) * (hand - before)


@compiled
def _count(s: Record, p: Record, axis: int) -> None:
    moved = s.position_rad[axis] - s.rest_position_rad[axis]
    if abs(moved) <= max(REST_COUNTS * p.count_rad[axis], REST_SHARE * p.presliding_rad[axis]):
        s.rest_ticks[axis] += 1
        return
    s.rest_position_rad[axis] = s.position_rad[axis]
    s.rest_ticks[axis] = 0


@compiled
def is_resting(s: Record, p: Record, axis: int) -> bool:
    """True when the joint cannot be told from one that stands."""
    return s.rest_ticks[axis] * p.period_s > REST_S


@compiled
def calmed(s: Record, p: Record, axis: int, alpha: float) -> float:
    """Low-pass coefficient per tick of what follows the hand's torque: `alpha`, 0 to 1, of a joint that moves."""
    rested_s = s.rest_ticks[axis] * p.period_s
    return alpha if rested_s == 0.0 else min(alpha, p.rest_alpha[axis] * (1.0 + CALMING_S / rested_s))
