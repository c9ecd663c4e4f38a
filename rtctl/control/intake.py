"""Command intake: which requests rose, which target is fresh, how old the last one is.

The command is one snapshot that the host overwrites; counters in it make edges that survive being read
late or twice. A request is used up in the tick that sees it, granted or not."""

from __future__ import annotations

import math

from rtctl.control import states
from rtctl.control.force import restart_tare
from rtctl.control.friction_factor import follow_factor
from rtctl.control.jit import compiled, inlined
from rtctl.control.records import Record
from rtctl.control.vocabulary import Environment, Fault, State

_REMOTE = int(Environment.REMOTE)
_ACTIVE = int(State.ACTIVE)
_HOLD = int(State.HOLD)
_F_TARGET = int(Fault.TARGET_LOST)
_F_HOST = int(Fault.HOST_SILENT)


@compiled
def _rising_requests(s: Record, c: Record) -> int:
    """Request bits of the counters that rose since the last tick; marks them as seen."""
    requests = 0
    if c.arm_count > s.arm_seen:
        requests |= states.ARM
    if c.stop_count > s.stop_seen:
        requests |= states.STOP
    if c.reset_count > s.reset_seen:
        requests |= states.RESET
    if c.shutdown_count > 0:  # a level, not an edge: the end of the process is never forgotten
        requests |= states.TERMINATE
    s.arm_seen = c.arm_count
    s.stop_seen = c.stop_count
    s.reset_seen = c.reset_count
    return requests


@compiled
def _holds_lease(s: Record, c: Record) -> bool:
    """True when the newest target may count: of this epoch, finite, from whoever holds the lease or takes a
    free one."""
    if c.target_epoch != s.epoch or c.target_lease == 0:  # what was queued before a stop is void
        return False
    if s.lease != 0 and s.lease != c.target_lease:
        return False
    for axis in range(len(c.target_position_rad)):
        if not (math.isfinite(c.target_position_rad[axis]) and math.isfinite(c.target_velocity_rad_s[axis])):
            return False
    return True


@compiled
def _take_target(s: Record, p: Record, c: Record) -> None:
    """Take over a fresh target of the lease holder, or let the last one age until the lease ends.

    A target stays in the command's slot; only the rise of `target_count` makes it fresh, once. What a
    refused one says never reaches the law."""
    risen = c.target_count > s.target_seen
    # refused ones, too: a later lease or epoch must not make an old target fresh
    s.target_seen = c.target_count
    if risen and _holds_lease(s, c):
        s.lease = c.target_lease  # a free lease is taken by the first target, not by a request
        s.target_age_ticks = 0
        for axis in range(len(c.target_position_rad)):
            s.target_position_rad[axis] = c.target_position_rad[axis]
            s.target_velocity_rad_s[axis] = c.target_velocity_rad_s[axis]
        return
    s.targets_refused += int(risen)
    s.target_age_ticks += 1
    if s.lease == 0:  # nobody: as silent as can be
        s.target_age_ticks = max(s.target_age_ticks, p.target_stop_ticks + 1)
    # as late as TARGET_LOST: only then may somebody else take it
    elif s.target_age_ticks > p.target_stop_ticks:
        s.lease = 0


@compiled
def _hear_host(s: Record, c: Record) -> None:
    """Let the host's last sign of life age. It counts ticks that ran: what kept the loop too is no
    silence."""
    s.beat_age_ticks = 0 if c.beat_count > s.beat_seen else s.beat_age_ticks + 1
    s.beat_seen = c.beat_count


@compiled
def _share(x: float) -> float:
    """Limit to 0..1; NaN is 0."""
    if x > 1.0:
        return 1.0
    return x if x > 0.0 else 0.0


@compiled
def _is_remote(c: Record) -> bool:
    """True when a renderer moves the proxy of any axis."""
    for axis in range(len(c.environment_kind)):
        if c.environment_kind[axis] == _REMOTE:
            return True
    return False


@inlined
def take_command(t: Record, s: Record, p: Record, c: Record) -> tuple[int, bool]:
    """Read the newest command into tick and state.

    Returns
    -------
    requests : int
        ARM, STOP, RESET, TERMINATE bits (`states`).
    arm_allowed : bool
        The command belongs to the present epoch: an arm request queued before a stop is void."""
    if s.ticks == 0:
        s.fault_first = -1  # the zeroed state would name the fault of bit 0
        s.epoch = max(c.epoch, 0)  # where this daemon begins: no client of an earlier one knows it
    requests = _rising_requests(s, c)
    _take_target(s, p, c)
    _hear_host(s, c)
    s.remote_ticks = s.remote_ticks + 1 if _is_remote(c) else 0  # for how long a target could have come
    # in power a hand's pull would become the zero
    retare = c.tare_count > s.tare_seen and not states.is_powered(s.state)
    s.tare_seen = c.tare_count  # a tare asked for in power is dropped, not done at the next rest
    t.command_seq = c.seq
    for axis in range(len(t.position_rad)):
        t.compensation[axis] = _share(c.compensation[axis])
        follow_factor(t, s, p, c, axis)
        if retare:
            restart_tare(s, axis)
    return requests, c.epoch == s.epoch


@compiled
def _silence(s: Record) -> int:
    """Ticks of silence of the renderer: nobody can have been silent since before there was anything to
    move."""
    # a rig that becomes remote while armed gives the renderer its time
    return int(min(s.target_age_ticks, s.remote_ticks))


@compiled
def holding(s: Record, p: Record, c: Record) -> bool:
    """True when a remote environment's target is too old to follow."""
    return _is_remote(c) and _silence(s) > p.target_hold_ticks


@compiled
def target_fault(s: Record, p: Record, c: Record) -> int:
    """TARGET_LOST while torque depends on a renderer that has been silent for `target_stop_ticks`."""
    lost = _silence(s) > p.target_stop_ticks and _is_remote(c)
    return _F_TARGET if lost and s.state in (_ACTIVE, _HOLD) else 0


@compiled
def host_fault(s: Record, c: Record) -> int:
    """HOST_SILENT while powered and the host has broken the promise in its last command: no STOP would come
    either."""
    # 0 promises nothing: a virtual clock
    silent = c.beat_ticks > 0 and s.beat_age_ticks > c.beat_ticks
    return _F_HOST if silent and states.is_powered(s.state) else 0
