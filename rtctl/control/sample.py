"""Decide whether this tick's sample may be used, and what it means when it may not.

A sample is missed when the link reports damage, its counter does not advance, a value is not finite or
out of range, or the position jumps further than the axis can travel. A missed sample never reaches the
law: the last valid one is held (`state.position_rad`, `current_a`, `wrench`) and its age grows."""

from __future__ import annotations

import numpy as np

from hw.interface import LinkFault
from rtctl.control import window
from rtctl.control.flicker import steady_reading
from rtctl.control.jit import compiled, inlined
from rtctl.control.records import Record
from rtctl.control.vocabulary import Fault
from rtctl.control.wrench import take_wrench

_CHECKSUM = int(LinkFault.CHECKSUM)
_LOSS = int(LinkFault.SEQUENCE | LinkFault.LOST)
_LOST = int(LinkFault.LOST)
_END = int(LinkFault.END_OF_LOG)

_F_STALE = int(Fault.STALE)
_F_BAD = int(Fault.BAD_SAMPLE)
_F_JUMP = int(Fault.JUMP)
_F_LOST = int(Fault.LINK_LOST)
_F_END = int(Fault.END_OF_LOG)
_F_CHECKSUM = int(Fault.CHECKSUM)
_F_ESTOP = int(Fault.ESTOP)
_F_DEVICE = int(Fault.DEVICE)
_DEVICE = int(LinkFault.DEVICE)

CHECKSUM_OF_1000 = 50
"""More damaged frames than this among 1000 ticks are a fault (safety contract: 5 %)."""

JUMP_FACTOR = 1.5
"""A position further away than this many times v_max allows is a jump (safety contract)."""


@compiled
def _in_range(t: Record, p: Record) -> bool:
    """True when every measured value is finite and within the ranges; comparisons are false for NaN."""
    for axis in range(len(t.position_rad)):
        if not p.position_min_rad[axis] <= t.position_rad[axis] <= p.position_max_rad[axis]:  # NaN: False
            return False
        if not abs(t.current_a[axis]) <= p.current_limit_a[axis]:
            return False
        # one sensor for all axes: the least of their limits counts
        for i in range(3):
            if not abs(t.force_n[i]) <= p.force_limit_n[axis]:
                return False
    for i in range(3):
        if p.moment_used != 0 and not abs(t.moment_nm[i]) <= p.moment_limit_nm:
            return False
    return True


@compiled
def _damage(t: Record, s: Record, p: Record) -> int:
    """Fault that this sample would become if it went on; 0 for a good and fresh one."""
    link = np.int64(t.link_faults)
    if link & _CHECKSUM:
        return _F_CHECKSUM
    if link & _LOSS or t.sample_count <= s.sample_count:  # <=: an older frame that comes late is none
        return _F_STALE
    s.sample_count = t.sample_count  # before its range is asked: a bad sample is not fresh a tick later
    return 0 if _in_range(t, p) else _F_BAD


@compiled
def _jumped(t: Record, s: Record, p: Record, elapsed: int) -> bool:
    """True when an axis moved further than JUMP_FACTOR v_max since the last valid sample."""
    for axis in range(len(t.position_rad)):
        # grows with what was missed
        reach = JUMP_FACTOR * p.velocity_limit_rad_s[axis] * p.period_s * elapsed
        if abs(t.position_rad[axis] - s.position_rad[axis]) > reach:
            return True
    return False


@compiled
def _take(t: Record, s: Record, p: Record, restart: bool) -> None:
    """Make this sample the current one; `restart` also forgets where the axis was before."""
    for axis in range(len(t.position_rad)):
        s.position_rad[axis] = steady_reading(s, p, axis, t.position_rad[axis], restart)
        s.current_a[axis] = t.current_a[axis]
        s.jump_count[axis] = 0
        if restart:
            s.position_before_rad[axis] = s.position_rad[axis]
            s.history_count[axis] = 0
            s.proxy_set_count[axis] = 0  # nor may a proxy pull from where the joint was
    take_wrench(t, s, p)  # after the positions: levers turn with the pose
    s.sample_age_ticks = 0


@compiled
def _link_state(t: Record, s: Record) -> int:
    """Faults that hold whatever the sample is worth."""
    link = np.int64(t.link_faults)
    faults = 0
    s.checksum_count += window.push(s.checksum_marks, s.ticks, link & _CHECKSUM != 0)
    if s.checksum_count > CHECKSUM_OF_1000:
        faults |= _F_CHECKSUM
    if link & _DEVICE:
        faults |= _F_DEVICE
    if link & _LOST:
        faults |= _F_LOST
    if link & _END:
        faults |= _F_END
    if t.estop != 0:
        faults |= _F_ESTOP
    return faults


@compiled
def _forget(s: Record) -> None:
    """A lost device is cut and latched; whatever it counts and shows when it is back is a new beginning."""
    # a device that was powered anew counts from 0
    s.sample_count = -1
    # the next sample then begins the velocity anew: its way from the last one before the loss is no motion
    for axis in range(len(s.history_count)):
        s.history_count[axis] = 0


@inlined
def accept_sample(t: Record, s: Record, p: Record, skipped: int) -> tuple[int, int]:
    """Validate the measured fields of tick `t` and take them over, or hold the last valid ones.

    Parameters
    ----------
    skipped : int
        Grid slots that passed without a tick just before this one.

    Returns
    -------
    faults : int
        `Fault` bits present now. A missed sample becomes a fault at `stale_limit_ticks`: STALE,
        BAD_SAMPLE or CHECKSUM after what was wrong with the latest one; the second jump in a row is
        JUMP at once, and restarts the estimators at the new position (the joint is cut by then).
    elapsed : int
        Grid ticks between the last valid sample and this one; 0 when this one was missed.

    Notes
    -----
    A sample at the end of a recorded log does not age into STALE: the log's end is not a failure.
    Before the first valid sample, after a loss too, there is nothing to hold: a start may take as long as
    readiness does (`ready_ticks`). What is wrong with a sensor that shows nothing usable by then is named
    like any other."""
    # the axes begin together: one stands for all
    started = s.history_count[0] > 0
    # in grid slots, not in ticks that ran: the joint moved through those that were missed, too
    elapsed = s.sample_age_ticks + 1 + skipped
    for axis in range(len(t.position_rad)):
        s.position_before_rad[axis] = s.position_rad[axis]
    faults = _link_state(t, s)
    if faults & _F_LOST:
        started = False
        _forget(s)
    cause = _damage(t, s, p)
    if cause == 0 and not started:  # nothing is known to have jumped from
        _take(t, s, p, True)
        return faults, 1
    if cause == 0 and not _jumped(t, s, p, elapsed):
        _take(t, s, p, False)
        return faults, elapsed
    if cause == 0:
        s.jump_count[0] += 1
        if s.jump_count[0] >= 2:  # twice at the new place: the encoder is there, not the glitch
            _take(t, s, p, True)
            return faults | _F_JUMP, 1
        cause = _F_STALE  # a single jump is a missed sample
    s.sample_age_ticks = elapsed
    patience = p.stale_limit_ticks if started else max(p.stale_limit_ticks, p.ready_ticks)
    if elapsed >= patience and not faults & _F_END and (started or not faults & _F_LOST):
        faults |= cause
    return faults, 0
