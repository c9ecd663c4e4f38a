"""Dry friction that the joint surely has, and the energy that it surely takes out of a motion.

    h <- clip(h + dx/x_b, -1, 1)                     deflection of the bristles over their length
    credit = F (h_before + h)/2 dx                   J, of one period; below 0 where the bristles push back

Before dry friction slides it is a spring: over the presliding length, some milliradians, it takes energy up
and gives it back at the next turn. F |dx| would call that dissipation, and a joint that vibrates by a few
bristle deflections would be credited what it never lost. h is a stop operator, the simplest element with that
memory. Over a closed motion of amplitude a it has taken 4 F (a - x_b), or nothing below x_b; a Maxwell-slip,
Dahl or LuGre joint with at least this friction and a presliding length of at most x_b has taken no less.
Their difference is therefore bounded by one bent bristle, F x_b/2, for every motion (docs/theory.md 4.2).

F is the larger of two:

- `guaranteed_friction`: the learned curve lowered by all that is known to make it wrong: error, places,
  drift;
- what the force sensor sees of it (`disturbance_observer`) while the joint slides, in the direction of the
  motion: a joint whose friction differs from place to place, or grows with load, takes out what it takes out
  and not what the least place would. It is believed up to `friction_seen_max_nm`, and only in sliding, where
  h is at its end.

What the bristles give back is taken at the friction of rest, the highest of the curve: what was stored in
slow motion is withdrawn in full although the joint has become faster."""

from __future__ import annotations

import math

from rtctl.control.friction_curve import BACKWARD, FORWARD, branch_magnitude
from rtctl.control.jit import compiled, inlined
from rtctl.control.records import Record

SEEN_SHARE = 0.995
"""Share of the friction seen that is credited: a low-passed estimate may be a little high for a moment."""


@compiled
def slides(s: Record, axis: int) -> bool:
    """True when the bristles are at their end, so that the direction of the motion is sure."""
    return abs(s.bristle_share[axis]) >= 1.0


@inlined
def guaranteed_friction(p: Record, model: Record, axis: int, velocity: float) -> float:
    """Dry friction the device surely has at this velocity, N m, >= 0.

    Notes
    -----
    F_lo(v) = Fhat_dry(v) - (min Fhat_dry - friction_floor_nm): the learned curve lowered by the same amount
    (validation error, spread over places, drift) that lowered its minimum to the configured floor. Outside
    the trained range only the floor is guaranteed. NaN counts as outside. Fhat_dry is the curve without its
    viscous part, which is credited by itself with the rig file's b: of the two slopes the larger, so that a
    curve whose slope was learned too low is not credited the difference twice."""
    floor = max(p.friction_floor_nm[axis], 0.0)
    branch = FORWARD if velocity >= 0.0 else BACKWARD
    speed = abs(velocity)
    if floor == 0.0 or not speed <= model.speed_max_rad_s[branch]:
        return floor
    viscous = max(model.viscous_nms_rad[branch], p.viscous_nms_rad[axis])
    dry = branch_magnitude(model, branch, speed) - viscous * speed
    lowered = dry - (model.friction_min_nm[branch] - floor)
    return lowered if lowered > floor else floor


@compiled
def seen_friction(s: Record, p: Record, axis: int, forward: bool) -> float:
    """Friction seen by the force sensor in sliding, as far as it is believed, N m, >= 0; 0 without a
    sensor."""
    if not p.friction_seen_alpha[axis] > 0.0:
        return 0.0
    seen = s.friction_seen_nm[axis, FORWARD if forward else BACKWARD]
    return min(max(SEEN_SHARE * seen, 0.0), p.friction_seen_max_nm[axis])


@compiled
def _finite(energy: float) -> float:
    """`energy`, or 0 where a model that is not finite makes it so: no credit is the safe one."""
    return energy if math.isfinite(energy) else 0.0


@inlined
def credit_friction(
    s: Record, p: Record, model: Record, axis: int, dx: float, elapsed: int, velocity: float
) -> None:
    """Advance the bristles by the last period's motion; write `friction_credit_j`.

    Parameters
    ----------
    dx : float
        Motion since the last tick, rad; 0 on a missed sample, whose motion the next one carries.
    elapsed : int
        Grid ticks it took.
    velocity : float
        Velocity estimate, rad/s: only chooses the place on the friction curve."""
    s.friction_credit_j[axis] = 0.0
    if dx == 0.0:
        return
    before, length = s.bristle_share[axis], p.presliding_rad[axis]
    end = 1.0 if dx > 0.0 else -1.0
    # no length: rigid, it slides at once
    now = min(max(before + dx / length, -1.0), 1.0) if length > 0.0 else end
    s.bristle_share[axis] = now
    # the mean of the bristles' force over the way, in shares of F
    work = 0.5 * (before + now) * dx
    if work <= 0.0:  # given back
        s.friction_credit_j[axis] = _finite(guaranteed_friction(p, model, axis, 0.0) * work)
        return
    # an estimate lags: in a turn it has the wrong branch
    v = velocity if velocity * dx > 0.0 else dx / (p.period_s * max(elapsed, 1))
    friction = guaranteed_friction(p, model, axis, v)
    if now == end:
        friction = max(friction, seen_friction(s, p, axis, dx > 0.0))  # of bent bristles it is given back
    s.friction_credit_j[axis] = _finite(friction * work)
