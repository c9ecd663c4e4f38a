"""The state machine of the safety contract: what the present state, faults and requests lead to.

`next_state` is a function of numbers to a number; `enter` does what changing state means for the
counters. Priority: ESTOP > CUT > RAMP > HOLD > requests. No fault clears itself into motion.
"""

from __future__ import annotations

from rtctl.control.jit import compiled
from rtctl.control.records import Record
from rtctl.control.vocabulary import Fault, State

_INIT = int(State.INIT)
_IDLE = int(State.IDLE)
_ARMING = int(State.ARMING)
_ACTIVE = int(State.ACTIVE)
_HOLD = int(State.HOLD)
_STOPPING = int(State.STOPPING)
_FAULT = int(State.FAULT)
_ESTOP = int(State.ESTOP)
_LOCKOUT = int(State.LOCKOUT)
_SHUTDOWN = int(State.SHUTDOWN)

CUT = int(
    Fault.STALE
    | Fault.BAD_SAMPLE
    | Fault.CHECKSUM
    | Fault.JUMP
    | Fault.LINK_LOST
    | Fault.LAW_NOT_FINITE
    | Fault.OVERSPEED
)
"""Faults that take the torque away in the tick they are seen."""

RAMP = int(Fault.OVERRUN | Fault.PASSIVITY | Fault.TARGET_LOST)
"""Faults that ramp the torque down before disabling."""

LATCHING_AT_REST = int(Fault.LINK_LOST | Fault.LAW_NOT_FINITE)
"""Faults that are latched even while no torque can leave; the others just make the rig not ready."""

_END_OF_LOG = int(Fault.END_OF_LOG)
_ESTOP_PRESSED = int(Fault.ESTOP)

ARM = 1
STOP = 2
RESET = 4
TERMINATE = 8
"""Request bits."""

ARMING_TICKS = 10
"""Ticks enabled at zero torque before ACTIVE; the micro-test will take their place."""

CLEAR_TICKS = 1000
"""The cause of a fault must have been absent this long before a reset is accepted."""


@compiled
def is_powered(state: int) -> bool:
    """True in the states where the actuator is enabled."""
    return state in (_ARMING, _ACTIVE, _HOLD, _STOPPING)


@compiled
def _from_rest(state: int, faults: int, requests: int, may_arm: bool, may_reset: bool) -> int:
    """INIT, IDLE, FAULT, ESTOP: nothing is enabled."""
    if requests & TERMINATE or faults & _END_OF_LOG:  # also from FAULT: nothing more will come
        return _SHUTDOWN
    if faults & LATCHING_AT_REST and state != _ESTOP:
        return _FAULT
    if state == _INIT:
        return _IDLE
    if state == _IDLE:
        return _ARMING if requests & ARM and may_arm else _IDLE
    if state == _FAULT:
        return _IDLE if requests & RESET and may_reset else _FAULT
    return _IDLE if requests & RESET else _ESTOP


@compiled
def _from_power(state: int, faults: int, requests: int, ticks: int, hold: bool) -> int:
    """ARMING, ACTIVE, HOLD: a torque may be leaving."""
    if faults & (RAMP | _END_OF_LOG) or requests & (STOP | TERMINATE):
        return _STOPPING
    if state == _ARMING:
        return _ACTIVE if ticks >= ARMING_TICKS else _ARMING
    return _HOLD if hold else _ACTIVE


@compiled
def next_state(
    state: int,
    faults: int,
    requests: int,
    ticks: int,
    may_arm: bool,
    may_reset: bool,
    hold: bool,
    ramped: bool,
    stop_target: int,
) -> int:
    """State after this tick's faults and requests.

    Parameters
    ----------
    state : int
        `State` before.
    faults : int
        `Fault` bits present now.
    requests : int
        ARM, STOP, RESET, TERMINATE bits that rose in this tick.
    ticks : int
        Ticks spent in `state`.
    may_arm : bool
        Ready, tared, the request's epoch is the present one, no fault present.
    may_reset : bool
        The latched cause has been absent for CLEAR_TICKS.
    hold : bool
        A remote environment's target is too old.
    ramped : bool
        STOPPING has brought the torque to zero, or used up its time.
    stop_target : int
        Where STOPPING leads.
    """
    if state in (_SHUTDOWN, _LOCKOUT):
        return state
    if faults & _ESTOP_PRESSED:
        return _ESTOP
    if not is_powered(state):
        return _from_rest(state, faults, requests, may_arm, may_reset)
    if faults & CUT:
        return _FAULT
    if state == _STOPPING:
        return stop_target if ramped else _STOPPING
    return _from_power(state, faults, requests, ticks, hold)


@compiled
def stop_target(target: int, faults: int, requests: int) -> int:
    """Where a stop leads after this tick: SHUTDOWN outranks FAULT, FAULT outranks IDLE."""
    if requests & TERMINATE or faults & _END_OF_LOG or target == _SHUTDOWN:
        return _SHUTDOWN
    return _FAULT if faults & RAMP or target == _FAULT else _IDLE


@compiled
def lowest_bit(bits: int) -> int:
    """Number of the lowest set bit; -1 for none."""
    for i in range(63):
        if bits & (1 << i):
            return i
    return -1


@compiled
def _latch(s: Record, faults: int) -> None:
    """Keep the first cause of a stop; later ones do not replace it."""
    if s.fault_first < 0:
        s.fault_first = lowest_bit(faults & (CUT | RAMP | _ESTOP_PRESSED))


@compiled
def _enter(s: Record, state: int, faults: int) -> None:
    """Counters, epoch and latch on a change of state."""
    if state in (_STOPPING, _FAULT, _ESTOP):
        s.epoch += 1
        _latch(s, faults)
    if state == _IDLE and s.state in (_FAULT, _ESTOP):
        s.fault_first = -1
    if state in (_ARMING, _ACTIVE):
        s.authority = 0.0
    s.state = state
    s.ticks_in_state = 0
    s.clear_ticks = 0
    s.good_ticks = 0


@compiled
def _ramped(s: Record, p: Record) -> bool:
    """True when nothing is left to ramp down, or the time for it is over."""
    for axis in range(len(s.torque_applied_nm)):
        if s.torque_applied_nm[axis] != 0.0:
            return s.ticks_in_state >= p.stop_ticks
    return True


@compiled
def advance(s: Record, p: Record, faults: int, requests: int, arm_allowed: bool, hold: bool) -> bool:
    """Run the machine one tick on the state record; True when the state changed.

    Parameters
    ----------
    arm_allowed : bool
        Tare complete and the request's epoch valid; readiness and faults are judged here.
    """
    s.ticks_in_state += 1
    s.clear_ticks = 0 if faults else s.clear_ticks + 1
    ready = s.good_ticks >= p.ready_ticks and not faults
    if s.state == _STOPPING:
        s.stop_target = stop_target(s.stop_target, faults, requests)
        _latch(s, faults)
    state = next_state(
        s.state,
        faults,
        requests,
        s.ticks_in_state,
        arm_allowed and ready,
        s.clear_ticks >= CLEAR_TICKS,
        hold,
        _ramped(s, p),
        s.stop_target,
    )
    if requests & STOP and not is_powered(s.state):
        s.epoch += 1  # a stop also voids whatever was queued while disabled
    if state == s.state:
        _count(s, p, faults)
        return False
    if state == _STOPPING:
        s.stop_target = stop_target(_IDLE, faults, requests)
    _enter(s, state, faults)
    return True


@compiled
def _count(s: Record, p: Record, faults: int) -> None:
    """Readiness and soft start while a state lasts."""
    if s.state == _IDLE:
        if faults:
            s.good_ticks = 0
        elif s.sample_age_ticks == 0:
            s.good_ticks += 1
    elif s.state == _ACTIVE:
        s.authority = min(1.0, s.authority + 1.0 / max(p.soft_start_ticks, 1))
    elif s.state == _HOLD:
        s.authority = 1.0
