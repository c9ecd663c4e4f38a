"""Arms a simulated rig by itself (`rtctl run --arm`, the demonstration)."""

from __future__ import annotations

import time

import numpy as np

from rtctl.control.vocabulary import State
from rtctl.host.supervisor import Host


class AutoArm:
    """Observer that arms a simulated rig as soon as it is ready (`rtctl run --arm`)."""

    def __init__(self) -> None:
        self._asked = 0.0

    def __call__(self, host: Host, rows: np.ndarray) -> None:
        """Ask again every 0.2 s until the rig leaves IDLE; never after a fault or a stop."""
        if len(rows) == 0 or self._asked < 0:
            return
        state = State(int(rows["state"][-1]))
        if state not in (State.INIT, State.IDLE):
            self._asked = -1.0
        elif state == State.IDLE and time.monotonic() - self._asked > 0.2:
            self._asked = time.monotonic()
            host.arm()
