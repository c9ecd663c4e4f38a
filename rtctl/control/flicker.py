"""An encoder that flickers among a few counts is no motion: what stays among them, to and fro, is taken for
its mean.

    lowest, highest     of the readings, at most `WIDE` counts apart; else both begin anew with the newest
    turns               of the reading among them
    position = mean of the readings since the first turn
                        from the `HELD_AFTER`th on and `HELD_S` later, for as long as they stay there
             = reading + gap
                        else; gap is what was left when they went, and goes with `EASE_S`

Why. A joint that friction holds is a spring within its presliding, often over several counts. The coupling
answers a step of one count a sample or more late, and a square wave that comes late feeds that spring: the
joint hums at 10 to 60 Hz, a count wide or less, as long as the coupling is there, with and without help with
friction (docs/theory.md 2.10). A torque that stands still feeds nothing.

Why the mean, and not the middle: the torque stays what it was on the average, so that the joint comes to rest
where it hummed. Why the gap goes slowly: a torque that jumps by some counts at once kicks the joint into the
next hum. The servo of an admittance, which answers a count of velocity by K_v Delta/T, is not told of either
as of a motion (`reading_slip_rad`): it kicked the joint out of the flicker it had just been held in.

What swings wider is answered as it is read, and so is a hand that turns back a few times. The position is
wrong by less than `WIDE` counts, and only where friction surely holds the joint against as much
(`friction.guarantee.holds_flicker`): one that glides would go from edge to edge."""

from __future__ import annotations

import math

from rtctl.control.jit import inlined
from rtctl.control.program import in_program
from rtctl.control.records import Record
from rtctl.control.vocabulary import State

_ACTIVE = int(State.ACTIVE)

HELD_AFTER = 5.0
"""Turns that are a flicker: two whole swings after the first."""

HELD_S = 0.5
"""And so much time: an encoder that is noisy turns all the time, and a joint that moves on is not to go by
steps of `WIDE` counts. A hand that turns back rests for some tenths of a second: taken for a flicker, it was
answered otherwise at each turn, and some elastic joints rang louder after it."""

WIDE = 3.0
"""Counts between the outermost readings: a swing of up to a count and a half to either side reads no
further."""

SAME = 0.25
"""Readings nearer than this share of a count are one."""

EASE_S = 0.03
"""Time constant with which the gap goes."""


@inlined
def _begin(s: Record, axis: int, reading: float) -> None:
    s.reading_rad[axis] = s.reading_from_rad[axis] = reading
    s.reading_lowest_rad[axis] = s.reading_highest_rad[axis] = reading
    s.reading_turns[axis] = s.reading_sum_rad[axis] = s.reading_ticks[axis] = 0.0


@inlined
def _turn(s: Record, p: Record, axis: int) -> None:
    """Count a turn; the last one that is needed holds the mean of what the coupling was given."""
    if s.reading_turns[axis] < HELD_AFTER - 1.0:
        s.reading_turns[axis] += 1.0
    elif s.reading_turns[axis] < HELD_AFTER and s.reading_ticks[axis] * p.period_s >= HELD_S:
        s.reading_turns[axis] = HELD_AFTER
        # sums of the difference to the first reading: large angles lose no digits
        mean = s.reading_from_rad[axis] + s.reading_sum_rad[axis] / s.reading_ticks[axis]
        # of what the coupling was given: reading and gap
        s.reading_held_rad[axis] = mean + s.reading_gap_rad[axis]


BLIND_HZ = 1.0
"""Low-pass of the hand's torque on a virtual mass while the joint is not seen: an answer to it would feed
what nothing damps."""


def blind_hz(force_lowpass_hz: float) -> float:
    """That low-pass, Hz: the rig file's (0: none) where it is slower."""
    return min(force_lowpass_hz or math.inf, BLIND_HZ)


def blind_damping_nms_rad(rest_nms_rad: float, velocity_gain_nms_rad: float) -> float:
    """Damping of the mass meanwhile, N m s/rad: that of a joint that sticks, and at least what the servo
    gives one that is seen."""
    return max(rest_nms_rad, velocity_gain_nms_rad)


@inlined
def is_blind(s: Record, p: Record, axis: int) -> bool:
    """True while the reading is held, or has not changed for as long: the law does not see what the joint
    does."""
    still_s = s.reading_still_ticks[axis] * p.period_s
    return s.reading_turns[axis] >= HELD_AFTER or still_s >= HELD_S


@inlined
def steady_reading(s: Record, p: Record, axis: int, reading: float, restart: bool) -> float:
    """Position of a fresh sample, rad: the finite `reading`, or the mean of those among which it flickers."""
    count, before = p.count_rad[axis], s.position_rad[axis]
    s.reading_slip_rad[axis] = 0.0
    if restart or p.flicker_held[axis] == 0.0 or s.state != _ACTIVE or in_program(s, axis):
        _begin(s, axis, reading)
        s.reading_way[axis] = s.reading_gap_rad[axis] = s.reading_still_ticks[axis] = 0.0
        return reading
    moved = reading - s.reading_rad[axis]
    s.reading_still_ticks[axis] = s.reading_still_ticks[axis] + 1.0 if abs(moved) <= SAME * count else 0.0
    s.reading_lowest_rad[axis] = min(s.reading_lowest_rad[axis], reading)
    s.reading_highest_rad[axis] = max(s.reading_highest_rad[axis], reading)
    if s.reading_highest_rad[axis] - s.reading_lowest_rad[axis] > (WIDE + SAME) * count:
        if s.reading_turns[axis] >= HELD_AFTER:
            # what was held goes on from where it was: no jump
            s.reading_gap_rad[axis] = s.reading_held_rad[axis] - s.reading_rad[axis]
        _begin(s, axis, reading)
        s.reading_way[axis] = 1.0 if moved > 0.0 else -1.0
    elif abs(moved) > SAME * count:
        way = 1.0 if moved > 0.0 else -1.0
        if way * s.reading_way[axis] < 0.0:
            _turn(s, p, axis)
            if s.reading_turns[axis] >= HELD_AFTER:
                # the servo is not to take the step to the mean for motion
                s.reading_slip_rad[axis] = s.reading_held_rad[axis] - before
        s.reading_way[axis], s.reading_rad[axis] = way, reading
    if s.reading_turns[axis] >= HELD_AFTER:
        return s.reading_held_rad[axis]
    if s.reading_turns[axis] > 0.0:
        s.reading_sum_rad[axis] += reading - s.reading_from_rad[axis]
        s.reading_ticks[axis] += 1.0
    s.reading_slip_rad[axis] = -min(p.period_s / EASE_S, 1.0) * s.reading_gap_rad[axis]
    s.reading_gap_rad[axis] += s.reading_slip_rad[axis]
    return reading + s.reading_gap_rad[axis]
