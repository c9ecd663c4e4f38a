"""What ended a motion, or the arming, that an identification asked for: cause and remedy, for a person."""

from __future__ import annotations

import numpy as np

from rtctl.control.faults import ROW
from rtctl.control.vocabulary import Fault, State

STOPPED = "somebody asked for it, or the host stood still for over a second: see `rtctl events`"
AGAIN = "Remove the cause and start again (what was measured is kept: --resume)"


def what_ended(rows: np.ndarray, last: np.void) -> str:
    """What ended that which still went on as these ticks began, with the remedy; `last` is the newest
    tick."""
    # the first: what follows a fault is often its consequence; a rig back in IDLE has forgotten it
    latched = rows["fault_first"][rows["fault_first"] >= 0]
    fault = Fault(1 << int(latched[0])) if len(latched) else None
    name, text = (fault.name, ROW[fault].text) if fault else ("a stop", STOPPED)
    return f"{name}: the rig went to {State(int(last['state'])).name}; {text}. {AGAIN}"
