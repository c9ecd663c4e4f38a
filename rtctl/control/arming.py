"""The test pulse of ARMING: does a small torque show up in the current, and move the joint its own way?

Four parts of `arming_ticks` each (20 ms; 80 ms together): no torque, +tau, -tau, no torque. tau is at most
5 % of the limit, and so small that a joint without any friction moves by less than the bound.

* Current (where it is measured): sum(measured sent) / sum(sent^2) over the pulses must reach
  CURRENT_SHARE; a wrong sign gives a negative one, a dead drive or sensor none.
* Direction: judged only if the joint was at rest before and no hand pulls harder than half of tau. Moving
  the wrong way by more than SIGN_COUNTS during +tau is a fault; not moving is none, since stiction may
  hold the joint against 5 %.
* Bounded motion: the joint must stay within `arming_travel_rad` of where it started.
* How the current answers (gain, offset, delay, lag): `current_answer`, where a current is measured."""

from __future__ import annotations

from rtctl.control import current_answer
from rtctl.control.detectors import held_torque
from rtctl.control.jit import compiled
from rtctl.control.records import Record
from rtctl.control.vocabulary import Fault, State

_ARMING = int(State.ARMING)
_F_WIRING = int(Fault.WIRING)
_F_MOVED = int(Fault.ARMING_MOVED)

MAX_SHARE = 0.05
"""Share of the torque limit the test may use at most (safety contract)."""

CURRENT_SHARE = 0.25
"""Least answer of the current, as a share of what was sent: sign and life alone. How much it may be off is
`current_answer`'s, which measures the gain with an error."""

SIGN_COUNTS = 4
"""Counts that are no motion: more than a reading that flickers goes by (`flicker.WIDE`)."""

HAND_SHARE = 0.5
"""With more of the test torque in a hand the direction says nothing: the hand may have made it."""

PARTS = 4
"""None, +tau, -tau, none: the first shows whether the joint was at rest, -tau stops what +tau has moved, and
in the last comes what is late of the answer."""


@compiled
def pulse_torque(s: Record, p: Record, axis: int) -> float:
    """Torque of the test at `ticks_in_state`, N m."""
    part = s.ticks_in_state // max(p.arming_ticks, 1)
    # the rig file asks, the contract bounds
    torque = min(p.arming_torque_nm[axis], MAX_SHARE * p.torque_limit_nm[axis])
    if part == 1:
        return torque
    return -torque if part == 2 else 0.0


@compiled
def tested(s: Record, p: Record) -> bool:
    """True when the next tick of ARMING is past the last part."""
    # asked before `advance` counts this tick
    return s.state == _ARMING and s.ticks_in_state + 1 >= PARTS * p.arming_ticks


@compiled
def _restart(s: Record, axis: int) -> None:
    s.test_start_rad[axis] = s.position_rad[axis]
    s.test_pulse_rad[axis] = s.position_rad[axis]
    s.test_moved_rad[axis] = 0.0
    s.test_product_nm2[axis] = 0.0
    s.test_square_nm2[axis] = 0.0
    s.test_hand_nm[axis] = 0.0


@compiled
def _answer(t: Record, s: Record, p: Record, axis: int, sent_ticks: int, skipped: int) -> int:
    """Follow the current's answer, and judge it after the last tick."""
    if p.follow_kind[axis] == 0 or not p.arming_torque_nm[axis] > 0.0:  # nothing measured, or nothing sent
        return 0
    if sent_ticks == 1:
        current_answer.forget(s, axis)
    current_answer.keep(s, p, axis, t.motor_torque_nm[axis], sent_ticks, skipped)
    return current_answer.conclude(s, p, axis) if sent_ticks == PARTS * p.arming_ticks else 0


@compiled
def _wrong_way(s: Record, p: Record, axis: int) -> bool:
    """True when the joint, at rest and left alone, went against the positive pulse."""
    counts = SIGN_COUNTS * p.count_rad[axis]
    # the first part, without torque, told that
    at_rest = abs(s.test_pulse_rad[axis] - s.test_start_rad[axis]) <= counts
    alone = s.test_hand_nm[axis] <= HAND_SHARE * p.arming_torque_nm[axis]
    return at_rest and alone and s.test_moved_rad[axis] < -counts


@compiled
def _no_current(s: Record, p: Record, axis: int) -> bool:
    """True when the current is measured and does not answer the pulses."""
    sent = s.test_square_nm2[axis]
    return p.follow_kind[axis] != 0 and sent > 0.0 and not s.test_product_nm2[axis] >= CURRENT_SHARE * sent


@compiled
def _expected(s: Record, p: Record, axis: int) -> float:
    """Torque that the current may show now: the mean of those sent within the declared delay, N m.

    A device may answer sooner than declared; at low rates the pulses are only a few ticks long, and a
    single wrong lag of two ticks would look like no answer at all."""
    total = 0.0
    for ago in range(1, p.follow_delay_ticks[axis] + 2):
        total += held_torque(s, axis, ago)
    return total / (p.follow_delay_ticks[axis] + 1)


@compiled
def arming_faults(t: Record, s: Record, p: Record, axis: int, elapsed: int, skipped: int) -> int:
    """Follow the test by this tick's sample; WIRING, CURRENT, DELAY and ARMING_MOVED as they are found.

    Called before the state machine advances: `ticks_in_state` still counts the ticks that were sent."""
    if s.state != _ARMING:
        _restart(s, axis)
        return 0
    n = p.arming_ticks
    sent_ticks = s.ticks_in_state + 1  # ticks of the test sent before this sample
    if sent_ticks == n:
        s.test_pulse_rad[axis] = s.position_rad[axis]
    if sent_ticks == 2 * n:  # only the push forward is judged: on the way back the joint is in motion
        s.test_moved_rad[axis] = s.position_rad[axis] - s.test_pulse_rad[axis]
    if elapsed > 0:
        expected = _expected(s, p, axis)
        # over +tau and -tau an offset cancels
        s.test_product_nm2[axis] += expected * t.motor_torque_nm[axis]
        s.test_square_nm2[axis] += expected * expected
    s.test_hand_nm[axis] = max(s.test_hand_nm[axis], abs(t.hand_torque_nm[axis]))
    # in every tick: what runs away must not wait for the end
    if not abs(s.position_rad[axis] - s.test_start_rad[axis]) <= p.arming_travel_rad[axis]:
        return _F_MOVED
    faults = _answer(t, s, p, axis, sent_ticks, skipped)
    if sent_ticks >= PARTS * n and (_wrong_way(s, p, axis) or _no_current(s, p, axis)):
        return _F_WIRING
    return faults
