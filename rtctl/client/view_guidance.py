"""What a person at the page can do next: one sentence per state, and why a button would be refused.

The daemon decides all the same; this keeps the page from offering what it would refuse."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rtctl.control.vocabulary import Fault, State

_NEXT = {
    State.INIT: "Self-tests before the first tick.",
    State.IDLE: "No torque. Arm to begin, hands off while the motor is tested.",
    State.ARMING: "The motor is being tested: hands off.",
    State.ACTIVE: "Torque is on.",
    State.HOLD: "The renderer is silent: the joint is held with damping only.",
    State.STOPPING: "The torque goes down to zero.",
    State.FAULT: "No torque. The cause is gone: Reset, then Arm.",
    State.ESTOP: "No torque. The emergency stop is released: Reset, then Arm.",
    State.LOCKOUT: "No torque. Only a restart of the daemon leads on.",
    State.SHUTDOWN: "The daemon ends.",
}

_TARED_IN = (State.INIT, State.IDLE, State.FAULT, State.ESTOP)


def next_step(state: State, faults: int) -> str:
    """What the state means and what leads on, as one or two short sentences; `faults` are the bits present
    now."""
    # before the states: a pressed stop is what has to go first, whatever else is latched
    if faults & Fault.ESTOP:
        return "No torque. Release the emergency stop, then Reset."
    if faults and state in (State.FAULT, State.ESTOP):
        return "No torque. Remove the cause; Reset once it has been gone for a second."
    if faults and state == State.IDLE:
        return "No torque. Not ready to arm: remove the cause below."
    # of every state: one that is added and has no sentence raises here
    return _NEXT[state]


STOPPED = "OVERCOMPENSATION"
"""The warning that a rig was stopped for: in IDLE a reset dismisses it."""


def hindrances(state: State, faults: int, warnings: Sequence[Mapping[str, Any]] = ()) -> dict[str, str]:
    """Why each button would be refused now; empty where it would not."""
    # what only a reset leads out of
    latched = state in (State.FAULT, State.ESTOP)
    stopped = state == State.IDLE and any(one.get("name") == STOPPED for one in warnings)
    # in any other state the state itself is why, whatever is present
    if state == State.IDLE:
        arm = "a fault is present: its remedy comes first" if faults else ""
    else:
        arm = f"the rig is in {state.name}" + (": Reset first" if latched else "")
    return {
        "arm": arm,
        "reset": "" if latched or stopped else f"there is nothing to reset in {state.name}",
        "tare": "" if state in _TARED_IN else f"the force is tared at rest, not in {state.name}",
    }


_REMEDIES = {
    Fault.OVERSPEED: "let the joint come to rest, and move it more slowly",
    Fault.ESTOP: "release the emergency stop",
    Fault.END_OF_LOG: "none: the daemon ends",
}
"""What to do about the faults whose text names no remedy."""


def taken_apart(name: str, text: str) -> tuple[str, str]:
    """A fault's text as what is wrong, and what to do."""
    # at the first colon: texts of the table of faults are "what is wrong: what to do"
    wrong, _, remedy = text.partition(": ")
    return wrong, remedy or next((said for fault, said in _REMEDIES.items() if fault.name == name), "")
