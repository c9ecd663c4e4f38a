"""The newest command, as the host edits it for clients: what counts, for which epoch, and what a stop voids.

The loop takes the newest command only. What must not outlive a stop (a request to arm, a target) carries the
epoch its client saw, and a stop empties both, so that nothing from before it can move the rig after it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.rt.shared_memory import CommandWriter

_VOID = -1


class CommandSlot:
    """The host's end of the command mailbox, with a name for each kind of change.

    Attributes
    ----------
    command : structured scalar
        The command as it is; edit it, then `send`.
    stop_seq : int
        Sequence number of the last stop: until a tick carries it, the loop has not seen the stop."""

    def __init__(self, writer: CommandWriter) -> None:
        self._writer = writer
        # a view: an edit is in the mailbox with the next `send`
        self.command: np.void = writer.command[0]
        self.stop_seq = 0

    def send(self) -> int:
        """Publish the command. Returns its sequence number."""
        return self._writer.send()

    def edge(self, counter: str) -> int:
        """Ask for something once: `counter` rises."""
        self.command[counter] += 1
        return self.send()

    def arm(self, epoch: int) -> int:
        """Ask to arm in `epoch`; a stop before the loop sees it voids it."""
        self.command["epoch"] = epoch
        return self.edge("arm_count")

    def stop(self) -> int:
        """Ask to stop, and empty the slot."""
        command = self.command
        # no loop has this epoch: what waits in the slot is void
        command["epoch"] = command["target_epoch"] = _VOID
        command["target_lease"] = 0
        # of several the newest: a tick that has seen it has seen those before
        self.stop_seq = self.edge("stop_count")
        return self.stop_seq

    def target(
        self, epoch: int, lease: int, position_rad: Sequence[float], velocity_rad_s: Sequence[float] | float
    ) -> int:
        """Send a fresh target of the holder of `lease`, for `epoch`."""
        command = self.command
        command["target_epoch"], command["target_lease"] = epoch, lease
        command["target_position_rad"] = position_rad
        command["target_velocity_rad_s"] = velocity_rad_s
        return self.edge("target_count")

    def release(self) -> int:
        """Void the lease in the slot; the loop lets go of its holder when no target comes."""
        self.command["target_lease"] = 0
        return self.send()

    def stop_pending(self, row: np.void) -> bool:
        """Whether a stop has not reached the loop by the tick `row`."""
        return int(row["command_seq"]) < self.stop_seq
