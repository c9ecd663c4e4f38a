"""Does the joint rest, or only bend its bristles? Then what the force sensor says is taken in ever more
slowly.

A joint in presliding is held by its bristles as by a spring, and vibrates at 6 Hz or more in whatever hand.
Help that follows the hand's torque, g LP(-k x - m a), lags behind it by a low-pass or two and drives that
vibration, at some milliradians a second within a count of the encoder, at some tens of them in a stiff and
heavy hand. The coupling does not see it, and the account of energy takes seconds or minutes to be emptied by
it. So

- `BENT_S` after the joint last slid (the bristles of `dry_friction` at their end) faster than `CREEP_RAD_S`,
  or came to one place, direction and gate of the feed-forward follow the hand's torque through two low-passes
  of `REST_HZ`;
- the observer, which takes the inertia into account where it sees the motion and whose loop is proved
  (`observer_margin`), does so through low-passes of `OBSERVER_TIMES` that, and on a joint that stays in one
  place (within `REST_COUNTS` or `REST_SHARE` of the credited presliding length) for a time t, where it sees
  no motion, of `REST_HZ` (1 + `CALMING_S`/t) at once;
- after `REST_S` in one place a velocity that is nothing but the flicker between two counts is none for the
  observer.

Why a joint that creeps rests. A hand that holds it under tension bends its bristles to their end, tenths of a
milliradian in seconds. Help that followed its torque at once then made an elastic joint vibrate at 45 Hz,
four seconds after it had come to rest, and kept up the ring of a mass on a stiff hand for as long as the
motor slid by a little. An admittance moves its mass as slowly as it likes, and the joint must follow.

Why two low-passes. One that lags by 90 degrees makes of the help g LP(-k x) the negative damping g k/w times
f_rest/f. Two lag by nearly 180 degrees, which is a slightly softer spring, and the damping taken is
2 (f_rest/f)^3 g k/w.

Why so late. A hand that turns back passes through presliding as well, within some hundredths of a second. The
gate stays as open as it was, and the direction is that of the bristles by then. Low-passes that fell as 1/t
from the first tick on took half the help from a recorded hand that turned back every .2 s
(`tests/acceptance/test_real_recordings.py`), and left hands that hold still no quieter. An observer as slow
as the feed-forward lets a joint creep that a hand holds under tension, until it slips seconds later; one as
quick as ever keeps up a vibration of a stiff and heavy hand on soft bristles for as long."""

from __future__ import annotations

import math

from rtctl.control.assistance import CREEP_RAD_S
from rtctl.control.display import is_admittance
from rtctl.control.dry_friction import slides
from rtctl.control.handle import own_rad
from rtctl.control.jit import compiled
from rtctl.control.pace import advance_pace
from rtctl.control.records import Record

REST_COUNTS = 1.5
"""A joint within so many encoder counts of one place rests: one that flickers between two counts does."""

REST_SHARE = 0.05
"""Or within this share of the credited presliding length, where friction is a spring."""

REST_S = 0.02
"""After so long in one place, flicker is no velocity."""

BENT_S = 0.15
"""So long bristles may bend before it is called rest: through presliding within it is a hand that turns
back."""

REST_HZ = 2.0
"""Low-pass of the hand's torque for the help with friction at rest."""

OBSERVER_TIMES = 3.0
"""The observer's is so many times that on bent bristles."""

FORGOTTEN_S = 1.0
"""Time in which the largest speed of a joint that rests is forgotten, by 1/e: long against a vibration."""

CALMING_S = 0.2
"""After so long in one place the observer's is still twice that."""

HELD_AFTER_S, HELD_S = 0.5, 1.0
"""A joint that has not moved on for the first time begins to be held, and is after the second besides."""


@compiled
def _moves_on(s: Record, p: Record, axis: int) -> bool:
    """True when the joint slides, and faster than it creeps; a joint that follows a virtual mass when it
    slides at all."""
    creep_rad_s = own_rad(p, axis, CREEP_RAD_S)
    # a mass may be as slow as its hand likes, and its joint must follow (5.7)
    return slides(s, axis) and (abs(s.velocity_rad_s[axis]) > creep_rad_s or is_admittance(s, axis))


@compiled
def advance_rest(s: Record, p: Record, axis: int, hand: float, world: float) -> None:
    """Count the ticks of rest, and take the torques of hand and coupling in, N m. A hand's that is not finite
    is so for one tick, a coupling's is none."""
    moved = s.position_rad[axis] - s.rest_position_rad[axis]
    # against where it came to rest, not where it was a tick ago: a slow creep adds up until it is motion
    if abs(moved) <= max(REST_COUNTS * p.count_rad[axis], REST_SHARE * p.presliding_rad[axis]):
        s.rest_ticks[axis] += 1
        s.bent_ticks[axis] += 1
    else:  # or no number
        s.rest_position_rad[axis] = s.position_rad[axis]
        s.rest_ticks[axis] = 0  # a new place
        s.bent_ticks[axis] = 0 if _moves_on(s, p, axis) else s.bent_ticks[axis] + 1
    before = s.calm_hand_nm[axis]
    if not math.isfinite(before):
        before = 0.0
    advance_pace(s, p, axis)
    # the first of two low-passes; the second is the intent's or the gate's
    # 1.0 on a joint that slides: there the low-pass lets all through, and nothing lags
    share = while_bent(s, p, axis, 1.0, 1.0)
    s.calm_hand_nm[axis] = before + share * (hand - before)
    s.calm_world_nm[axis] += share * (world - s.calm_world_nm[axis])
    if not math.isfinite(s.calm_world_nm[axis]):
        s.calm_world_nm[axis] = 0.0


@compiled
def is_resting(s: Record, p: Record, axis: int) -> bool:
    """True when the joint cannot be told from one that stands."""
    return s.rest_ticks[axis] * p.period_s > REST_S


@compiled
def stands(s: Record, p: Record, axis: int) -> bool:
    """True when the joint rests or, beside no virtual mass, only bends its bristles."""
    # a mass that its hand moves slowly bends the bristles as well, and its joint must not be let stand
    return is_resting(s, p, axis) or (is_bent(s, p, axis) and not is_admittance(s, axis))


@compiled
def speed_seen(s: Record, p: Record, axis: int, speed: float) -> float:
    """A speed as the help with friction goes by it, of any sign: none on a joint that stands. What is not
    finite stays.

    There it is a bend of the bristles, or the flicker of an edge that the joint creeps over, and what holds
    the joint is no function of it."""
    return 0.0 if stands(s, p, axis) and math.isfinite(speed) else speed


@compiled
def slides_on(s: Record, p: Record, axis: int) -> bool:
    """True when the joint slides and does not stand: what sticks without bending leaves the bristles at the
    end of its last motion."""
    return slides(s, axis) and not is_resting(s, p, axis)


@compiled
def calm_speed(s: Record, p: Record, axis: int, speed: float) -> float:
    """Speed that the feed-forward's curve is read at, >= 0: on a joint that stands the last that it had, as
    far as that is not forgotten.

    Where friction falls with speed, help that is held up at rest would fall and rise with every bend of the
    bristles, by more than the joint's damping (22 N s/m on a carriage with .3), while what holds the joint is
    no curve of speed there."""
    # what it had while it moved on: the curve is read there until it does so again
    held = s.calm_speed_rad_s[axis]
    # a quicker speed is taken at once: only falls are held
    if stands(s, p, axis) and held > speed:
        held += min(p.period_s / FORGOTTEN_S, 1.0) * (speed - held)
    else:  # or no number
        held = speed
    s.calm_speed_rad_s[axis] = held
    return float(held)


@compiled
def is_bent(s: Record, p: Record, axis: int) -> bool:
    """True when the joint has not moved on for `BENT_S`."""
    return s.bent_ticks[axis] * p.period_s > BENT_S


@compiled
def while_bent(s: Record, p: Record, axis: int, alpha: float, times: float) -> float:
    """Low-pass coefficient per tick, `alpha` (0 to 1) on a joint that slides; `times` that of rest on bent
    bristles."""
    # min: a rig file may be slower still
    return min(alpha, times * p.rest_alpha[axis]) if is_bent(s, p, axis) else alpha


@compiled
def held_part(s: Record, p: Record, axis: int) -> float:
    """0 on a joint that has moved on of late, 1 on one that has not for long; never of an admittance, which
    follows its mass."""
    if is_admittance(s, axis):
        return 0.0
    # a ramp and no switch: what goes by this share must not step
    return min(max(s.bent_ticks[axis] * p.period_s - HELD_AFTER_S, 0.0) / HELD_S, 1.0)


@compiled
def while_resting(s: Record, p: Record, axis: int, alpha: float) -> float:
    """Low-pass coefficient per tick of the observer, which is `alpha`, 0 to 1, on a joint that slides."""
    quick = while_bent(s, p, axis, alpha, OBSERVER_TIMES)
    rest_s = s.rest_ticks[axis] * p.period_s
    # falls as 1/t, at any moment: the help must not step as rest begins
    return quick if rest_s == 0.0 else min(quick, p.rest_alpha[axis] * (1.0 + CALMING_S / rest_s))
