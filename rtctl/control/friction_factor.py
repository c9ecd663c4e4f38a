"""The feed-forward follows a friction that has changed: the host asks for a factor, the law bounds and slows
it (docs/theory.md 5.10).

Gain and caps among the parameters are those of the largest factor, 1 + `friction_raise`: what the certificate
judged. A factor is a share of that, so no command can pass what was judged, and more than one step a tick
does not come about."""

from __future__ import annotations

from rtctl.control.compensation_limit import FACTOR_LEAST
from rtctl.control.jit import compiled
from rtctl.control.records import Record
from rtctl.control.states import is_powered

_LEAST = FACTOR_LEAST - 1.0


@compiled
def follow_factor(t: Record, s: Record, p: Record, c: Record, axis: int) -> None:
    """Bring the factor one step nearer to the one asked for, at once while the motor is off; into the tick,
    too.

    Notes
    -----
    A command of NaN asks for nothing. A step of 0 never takes one."""
    step, asked = p.friction_change_step[axis], c.friction_change[axis]
    if step > 0.0 and asked == asked:  # NaN alone differs from itself
        asked = max(min(asked, p.friction_raise[axis]), _LEAST)
        # with the motor off no step is felt
        if is_powered(s.state):
            asked = max(min(asked, s.friction_change[axis] + step), s.friction_change[axis] - step)
        s.friction_change[axis] = asked
    t.friction_factor[axis] = 1.0 + s.friction_change[axis]


@compiled
def followed_share(s: Record, p: Record, axis: int) -> float:
    """The factor over the largest, .63 to 1: share of the certified feed-forward. 1 on an axis that follows
    nothing."""
    return float((1.0 + s.friction_change[axis]) / (1.0 + p.friction_raise[axis]))
