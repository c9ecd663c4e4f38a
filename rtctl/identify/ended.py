"""What ended a motion, or the arming, that an identification asked for: cause and remedy, for a person."""

from __future__ import annotations

import numpy as np

from rtctl.control.faults import ROW
from rtctl.control.vocabulary import Fault, State
from rtctl.identify.settings import Rig

STOPPED = "somebody asked for it, or the host stood still for over a second: see `rtctl events`"
PAST_TRAVEL = (
    "the joint went past position_min_rad or position_max_rad: with the motor off it slid or crept on "
    "(cogging, gravity) while the host was late by seconds: leave the host time, or keep more of the travel "
    "free in a new data set (--margin)"
)
AGAIN = "Remove the cause and start again (what was measured is kept: --resume)"


def what_ended(rows: np.ndarray, rig: Rig) -> str:
    """What ended that which still went on as these ticks began, with the remedy."""
    # the first: what follows a fault is often its consequence; a rig back in IDLE has forgotten it
    latched = rows["fault_first"][rows["fault_first"] >= 0]
    name, text = first_fault(int(latched[0])) if len(latched) else ("a stop", STOPPED)
    place = rows["position_rad"][:, rig.axis]
    if name == "BAD_SAMPLE" and np.any((place < rig.position_min_rad) | (place > rig.position_max_rad)):
        text = PAST_TRAVEL
    return f"{name}: the rig went to {State(int(rows['state'][-1])).name}; {text}. {AGAIN}"


def first_fault(number: int) -> tuple[str, str]:
    """Name and text of the fault whose bit is `number`, a tick's `fault_first`; empty where there is none."""
    if number < 0:
        return "", ""
    fault = Fault(1 << number)
    return fault.name or "", ROW[fault].text
