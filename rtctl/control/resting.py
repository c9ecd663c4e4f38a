"""Is the joint at rest, as far as its encoder can tell? Then what the force sensor says is taken in slowly.

A joint that rests in a hand may vibrate within one count of its encoder, at some milliradians a second, driven by help that
follows the hand's torque: nothing of it is seen in the position, so neither the coupling nor an account of energy can end it.
It is an oscillation of tens of hertz, while a hand that wants a resting joint to move bends it by several counts within
some hundredths of a second. So a joint that stayed within `REST_COUNTS` of one place for `REST_S` follows
the hand's torque with a low-pass of `REST_HZ` only, until the next count.
"""

from __future__ import annotations

from rtctl.control.jit import compiled
from rtctl.control.records import Record

REST_COUNTS = 1.5
"""A joint within so many encoder counts of one place may rest: one that flickers between two counts does."""

REST_S = 0.02
"""A joint counts as resting when it has stayed within that for so long."""

REST_HZ = 5.0
"""Low-pass of the hand's torque for the help with friction while the joint rests."""


@compiled
def advance_rest(s: Record, p: Record, axis: int) -> None:
    """Count the ticks since the joint last moved."""
    moved = s.position_rad[axis] - s.rest_position_rad[axis]
    if abs(moved) <= REST_COUNTS * p.count_rad[axis]:
        s.rest_ticks[axis] += 1
        return
    s.rest_position_rad[axis] = s.position_rad[axis]
    s.rest_ticks[axis] = 0


@compiled
def calmed(s: Record, p: Record, axis: int, alpha: float) -> float:
    """Low-pass coefficient per tick of what follows the hand's torque: `alpha` of a joint that moves."""
    return min(alpha, p.rest_alpha[axis]) if s.rest_ticks[axis] * p.period_s > REST_S else alpha
