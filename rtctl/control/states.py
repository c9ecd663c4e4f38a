"""The state machine of the safety contract, as one table.

`TRANSITIONS` is read from the top: the first row whose state and event are present decides, so its order
is the order of priority (LOCKOUT > ESTOP > CUT > RAMP > HOLD > requests). `next_state` is that and nothing
else; `advance` finds out which events are present and keeps the counters. No fault clears itself into
motion: the only row that ends in ARMING needs a fresh request."""
# longer than 300 lines: the table of transitions and the events it is read with are checked against each
# other, line by line

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag

import numpy as np

from rtctl.control import faults as fault_table
from rtctl.control.authority import raise_authority
from rtctl.control.jit import compiled
from rtctl.control.records import LOCKOUT_FAULTS, Record
from rtctl.control.vocabulary import Fault, State

ARM = 1
STOP = 2
RESET = 4
TERMINATE = 8
"""Request bits."""

CLEAR_S = 1.0
"""The cause of a fault must have been absent this long before a reset is accepted: a loose plug is no quicker
on a quick loop."""

LOCKOUT_S = 60.0
"""LOCKOUT_FAULTS faults within this time close the rig."""


class Event(IntFlag):
    """What may move the machine; several can be present in one tick."""

    ALWAYS = 1 << 0
    LOCKOUT = 1 << 1
    ESTOP = 1 << 2
    CUT = 1 << 3
    RAMP = 1 << 4
    STOP = 1 << 5
    END = 1 << 6
    TERMINATE = 1 << 7
    LATCH = 1 << 8
    ARM = 1 << 9
    RESET = 1 << 10
    TESTED = 1 << 11
    SILENT = 1 << 12
    FOLLOWED = 1 << 13
    RAMPED_TO_IDLE = 1 << 14
    RAMPED_TO_FAULT = 1 << 15
    RAMPED_TO_SHUTDOWN = 1 << 16


@dataclass(frozen=True)
class Transition:
    """In any of `states`, `event` leads to `to`; `who` may bring it about."""

    states: tuple[State, ...]
    event: Event
    to: State
    who: str
    meaning: str


_S = State
_CLOSED = (_S.LOCKOUT, _S.SHUTDOWN)
_OPEN = tuple(state for state in State if state not in _CLOSED)  # a state that is added is open
_POWERED = (_S.ARMING, _S.ACTIVE, _S.HOLD, _S.STOPPING)
_MOVING = (_S.ARMING, _S.ACTIVE, _S.HOLD)
_REST = (_S.INIT, _S.IDLE, _S.FAULT, _S.ESTOP)

TRANSITIONS: tuple[Transition, ...] = (
    Transition((_S.LOCKOUT,), Event.TERMINATE, _S.SHUTDOWN, "system", "the process is ended"),
    Transition(_OPEN, Event.LOCKOUT, _S.LOCKOUT, "fault", "a fault of reaction LOCKOUT"),
    Transition(_REST, Event.TERMINATE, _S.SHUTDOWN, "system", "the process is ended"),
    Transition(_OPEN, Event.ESTOP, _S.ESTOP, "fault", "emergency stop pressed"),
    Transition(_POWERED, Event.CUT, _S.FAULT, "fault", "a fault of reaction CUT"),
    Transition(_REST, Event.END, _S.SHUTDOWN, "system", "the recording played back is over"),
    Transition((_S.INIT, _S.IDLE), Event.LATCH, _S.FAULT, "fault", "a fault that is latched at rest too"),
    Transition((_S.INIT,), Event.ALWAYS, _S.IDLE, "system", "the self-tests passed before the first tick"),
    Transition((_S.IDLE,), Event.STOP, _S.IDLE, "anyone", "a stop voids an arm request of the same tick"),
    Transition((_S.IDLE,), Event.ARM, _S.ARMING, "operator", "a fresh request while ready and tared"),
    Transition((_S.FAULT,), Event.RESET, _S.IDLE, "operator", "cause absent for 1 s"),
    Transition((_S.ESTOP,), Event.RESET, _S.IDLE, "operator", "released"),
    Transition(_MOVING, Event.RAMP, _S.STOPPING, "fault", "a fault of reaction RAMP"),
    Transition(_MOVING, Event.END, _S.STOPPING, "system", "the recording played back is over"),
    Transition(_MOVING, Event.STOP, _S.STOPPING, "anyone", "stop asked for, or the renderer lost"),
    Transition(_MOVING, Event.TERMINATE, _S.STOPPING, "system", "the process is ended"),
    Transition((_S.ARMING,), Event.TESTED, _S.ACTIVE, "system", "the test pulse passed"),
    Transition(
        (_S.ACTIVE,), Event.SILENT, _S.HOLD, "lease holder", "no target for 20 ms (20 ticks below 1 kHz)"
    ),
    Transition((_S.HOLD,), Event.FOLLOWED, _S.ACTIVE, "lease holder", "a target of the same epoch and lease"),
    Transition((_S.STOPPING,), Event.RAMPED_TO_SHUTDOWN, _S.SHUTDOWN, "system", "ramp over, process ending"),
    Transition((_S.STOPPING,), Event.RAMPED_TO_FAULT, _S.FAULT, "system", "ramp over, a fault caused it"),
    Transition((_S.STOPPING,), Event.RAMPED_TO_IDLE, _S.IDLE, "system", "ramp over"),
)

# the table as numbers: compiled code asks for a bit where it cannot look into a tuple of classes
_FROM = np.array([sum(1 << int(state) for state in row.states) for row in TRANSITIONS])
_EVENT = np.array([int(row.event) for row in TRANSITIONS])
_TO = np.array([int(row.to) for row in TRANSITIONS])
_POWERED_BITS = sum(1 << int(state) for state in _POWERED)

_IDLE, _ARMING, _ACTIVE, _HOLD = int(_S.IDLE), int(_S.ARMING), int(_S.ACTIVE), int(_S.HOLD)
_STOPPING, _FAULT, _ESTOP = int(_S.STOPPING), int(_S.FAULT), int(_S.ESTOP)
_LOCKOUT, _SHUTDOWN = int(_S.LOCKOUT), int(_S.SHUTDOWN)

_E_ALWAYS, _E_LOCKOUT, _E_ESTOP = int(Event.ALWAYS), int(Event.LOCKOUT), int(Event.ESTOP)
_E_CUT, _E_RAMP, _E_STOP, _E_END = int(Event.CUT), int(Event.RAMP), int(Event.STOP), int(Event.END)
_E_TERMINATE, _E_LATCH = int(Event.TERMINATE), int(Event.LATCH)
_E_ARM, _E_RESET, _E_TESTED = int(Event.ARM), int(Event.RESET), int(Event.TESTED)
_E_SILENT, _E_FOLLOWED = int(Event.SILENT), int(Event.FOLLOWED)
_E_TO_IDLE, _E_TO_FAULT = int(Event.RAMPED_TO_IDLE), int(Event.RAMPED_TO_FAULT)
_E_TO_SHUTDOWN = int(Event.RAMPED_TO_SHUTDOWN)

_F_CUT, _F_RAMP, _F_STOP, _F_END = fault_table.CUT, fault_table.RAMP, fault_table.STOP, fault_table.END
_F_ESTOP, _F_LOCKOUT = fault_table.ESTOP, fault_table.LOCKOUT
_F_STALLED = int(Fault.STALLED)
_F_LATCH, _F_LATCHED = fault_table.LATCHING_AT_REST, fault_table.LATCHED


@compiled
def is_powered(state: int) -> bool:
    """True in the states where the actuator is enabled."""
    return (_POWERED_BITS >> state) & 1 != 0


@compiled
def next_state(state: int, events: int) -> int:
    """State that the first fitting row of `TRANSITIONS` leads to; `state` itself when none fits.

    Parameters
    ----------
    state : int
        `State`.
    events : int
        `Event` bits present in this tick."""
    # in the order of the table, which is that of priority: the first that fits decides
    for row in range(len(_TO)):
        if (_FROM[row] >> state) & 1 and events & _EVENT[row]:
            return int(_TO[row])
    return state


@compiled
def fault_events(faults: int) -> int:
    """Events that the `Fault` bits present bring about."""
    events = _E_ALWAYS
    if faults == 0:
        return events
    if faults & _F_LOCKOUT:
        events |= _E_LOCKOUT
    if faults & _F_ESTOP:
        events |= _E_ESTOP
    if faults & _F_CUT:
        events |= _E_CUT
    if faults & _F_RAMP:
        events |= _E_RAMP
    if faults & _F_STOP:
        events |= _E_STOP
    if faults & _F_END:
        events |= _E_END
    if faults & _F_LATCH:
        events |= _E_LATCH
    return events


@compiled
def request_events(requests: int, may_arm: bool, may_reset: bool) -> int:
    """Events that the request bits bring about.

    `may_arm`: ready, tared, of the present epoch. `may_reset`: the cause has been absent long enough."""
    events = 0
    if requests & STOP:
        events |= _E_STOP
    if requests & TERMINATE:
        events |= _E_TERMINATE
    if requests & ARM and may_arm:
        events |= _E_ARM
    if requests & RESET and may_reset:
        events |= _E_RESET
    return events


@compiled
def stop_target(target: int, faults: int, requests: int) -> int:
    """Where a stop leads after this tick: SHUTDOWN outranks FAULT, FAULT outranks IDLE."""
    # a target only rises while the ramp lasts: whoever ended the process is not overruled by a later fault
    if requests & TERMINATE or faults & _F_END or target == _SHUTDOWN:
        return _SHUTDOWN
    return _FAULT if faults & _F_RAMP or target == _FAULT else _IDLE


@compiled
def _ramp_events(s: Record, p: Record) -> int:
    """The end of the ramp: nothing is left of the torque, or the time for it is over."""
    if s.ticks_in_state < p.stop_ticks:  # a torque that does not reach 0 ends anyway
        for axis in range(len(s.torque_applied_nm)):
            # exactly 0, which the gate gives: a tiny rest is torque in a hand
            if s.torque_applied_nm[axis] != 0.0:
                return 0
    if s.stop_target == _SHUTDOWN:
        return _E_TO_SHUTDOWN
    return _E_TO_FAULT if s.stop_target == _FAULT else _E_TO_IDLE


@compiled
def lowest_bit(bits: int) -> int:
    """Number of the lowest set bit; -1 for none."""
    # 63: the sign bit of an int64 is no fault
    for i in range(63):
        if bits & (1 << i):
            return i
    return -1


@compiled
def _latch(s: Record, faults: int) -> None:
    """Keep the first cause of a stop; later ones do not replace it.

    What a loop finds after a standstill (a device that let go, say) comes of the standstill."""
    if s.fault_first < 0:
        s.fault_first = lowest_bit(faults & _F_STALLED if faults & _F_STALLED else faults & _F_LATCHED)


@compiled
def _locks_out(s: Record, p: Record, tick: int) -> bool:
    """Note one more fault at grid slot `tick`; True when it is the last one of too many in LOCKOUT_S."""
    for i in range(LOCKOUT_FAULTS - 1):
        s.fault_tick[i] = s.fault_tick[i + 1]
    s.fault_tick[LOCKOUT_FAULTS - 1] = tick
    s.fault_total += 1
    # by the total, too: unused places of a zeroed state are no faults at slot 0
    return s.fault_total >= LOCKOUT_FAULTS and (tick - s.fault_tick[0]) * p.period_s <= LOCKOUT_S


@compiled
def _enter(s: Record, state: int, faults: int) -> None:
    """Counters, epoch and latch on a change of state."""
    if state in (_STOPPING, _FAULT, _ESTOP, _LOCKOUT):
        s.epoch += 1
        s.lease = 0
        _latch(s, faults)
    if state == _IDLE:
        # after a reset, or where nothing was wrong: what comes next is a first cause again
        s.fault_first = -1
    if state in (_ARMING, _ACTIVE):  # back from HOLD, too: what was wound up meanwhile is paid (3.4)
        s.authority = 0.0
    s.state = state
    s.ticks_in_state = 0
    s.clear_ticks = 0
    s.good_ticks = 0


@compiled
def advance(
    s: Record, p: Record, tick: int, faults: int, requests: int, arm_allowed: bool, tested: bool, silent: bool
) -> bool:
    """Run the machine one tick on the state record; True when the state changed.

    Parameters
    ----------
    tick : int
        Grid slot, the machine's clock.
    faults, requests : int
        `Fault` bits present now; ARM, STOP, RESET, TERMINATE bits that rose in this tick.
    arm_allowed : bool
        Tare complete and the request's epoch valid; readiness and faults are judged here.
    tested : bool
        The test pulse of ARMING is over and found nothing.
    silent : bool
        A remote environment's target is too old to follow."""
    # first: a state has lasted for a tick when it is asked for its end
    s.ticks_in_state += 1
    s.clear_ticks = 0 if faults else s.clear_ticks + 1  # any fault, not the one that stopped the rig
    # `good_ticks` is of the ticks before: a fault of this very one counts, too
    ready = s.good_ticks >= p.ready_ticks and not faults
    events = fault_events(faults)
    if requests:
        if requests & STOP and not is_powered(s.state):
            s.epoch += 1  # a stop also voids whatever was queued while disabled
            s.lease = 0
        # an emergency stop shows its own release
        may_reset = (s.clear_ticks + 0.5) * p.period_s >= CLEAR_S or s.state == _ESTOP
        events |= request_events(requests, arm_allowed and ready, may_reset)
    if tested:
        events |= _E_TESTED
    # one of both is always there; only ACTIVE and HOLD have rows for them
    events |= _E_SILENT if silent else _E_FOLLOWED
    if s.state == _STOPPING:
        s.stop_target = stop_target(s.stop_target, faults, requests)  # a ramp may yet become that of a fault
        _latch(s, faults)
        events |= _ramp_events(s, p)
    state = next_state(s.state, events)
    # only a state that stays is counted: one that was just entered has been good for no tick
    if state == s.state:
        _count(s, p, faults)
        return False
    if state == _FAULT and _locks_out(s, p, tick):  # after the table: how often is no event
        state = _LOCKOUT
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
        elif s.sample_age_ticks == 0:  # a tick without a sample neither counts nor spoils
            s.good_ticks += 1
    elif s.state == _ACTIVE:
        raise_authority(s, p)
    elif s.state == _HOLD:
        # its damping only takes, and no authority scales it (`law`): all of it, however far a soft start was
        s.authority = 1.0
