"""Which commands the loop took up, of all that were sent: what telemetry tells and a recording keeps.

A replay needs every command that was in force, exactly. The loop takes only the newest when it looks, and
says in each tick which one that was."""

from __future__ import annotations

import numpy as np

from rtctl.control.records import command_dtype
from rtctl.rt.shared_memory import CommandWriter


class CommandTrace:
    """Follows one writer. Used in the thread that writes.

    Attributes
    ----------
    lost : int
        Commands that were in force and are not known any more."""

    def __init__(self, writer: CommandWriter, n_axes: int) -> None:
        self._sent = writer.sent
        self._none = np.zeros(0, command_dtype(n_axes))
        self._in_force = 0
        self.newest = self._none
        self.lost = 0

    def take(self, rows: np.ndarray) -> np.ndarray:
        """Commands that came into force in these ticks, in order, shape (n,)."""
        if len(rows) == 0:
            return self._none
        fresh = np.unique(rows["command_seq"])
        # the first ticks of a batch still bear the command of the batch before
        fresh = fresh[fresh > self._in_force]
        if len(fresh) == 0:
            return self._none
        found = []
        # commands replaced before the loop looked were never in force: dropped, not counted
        while self._sent and self._sent[0]["seq"][0] <= fresh[-1]:
            command = self._sent.popleft()
            if command["seq"][0] in fresh:
                found.append(command)
        # in force, but gone from the writer's bounded queue: a replay of these ticks would not be exact
        self.lost += len(fresh) - len(found)
        self._in_force = int(fresh[-1])
        if found:
            self.newest = found[-1]
        return np.concatenate([self._none, *found])
