"""Arms a simulated rig by itself (`rtctl run --arm`, the demonstration)."""

from __future__ import annotations

import time

import numpy as np

from rtctl.control.vocabulary import State
from rtctl.host.supervisor import Host


class AutoArm:
    """Observer that arms a simulated rig as soon as it is ready (`rtctl run --arm`)."""

    def __init__(self) -> None:
        self._asked, self._epoch = 0.0, -1

    def __call__(self, host: Host, rows: np.ndarray) -> None:
        """Ask again every 0.2 s until the rig leaves IDLE; never after a fault or a stop."""
        if len(rows) == 0 or self._asked < 0:
            return
        state, epoch = State(int(rows["state"][-1])), int(rows["epoch"][-1])
        self._epoch = epoch if self._epoch < 0 else self._epoch
        # a stop or a fault has raised the epoch: to arm again would undo it
        if state not in (State.INIT, State.IDLE) or epoch != self._epoch:
            # never again: a clock that never goes back is not below 0
            self._asked = -1.0
        # used up in the tick that sees it: one that came too early is lost (docs/protocol.md)
        elif state == State.IDLE and time.monotonic() - self._asked > 0.2:
            self._asked = time.monotonic()
            host.arm(epoch)
