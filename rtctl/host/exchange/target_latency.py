"""How long targets take from the host's socket into the law, for `health`."""

from __future__ import annotations

from collections import deque

import numpy as np

from rtctl.host.exchange.health import percentiles_us

# a loop that stands takes none: the oldest are forgotten
_MOST_WAITING = 4096


class TargetLatency:
    """Matches targets handed to the loop with the ticks that took them.

    Parameters
    ----------
    virtual
        The loop runs on a virtual clock: its times are no times of this machine, and nothing is measured."""

    def __init__(self, *, virtual: bool) -> None:
        self._virtual = virtual
        self._waiting: deque[tuple[int, int]] = deque(maxlen=_MOST_WAITING)
        self._taken_ns: deque[int] = deque(maxlen=_MOST_WAITING)

    def handed(self, seq: int, read_ns: int) -> None:
        """The target of command `seq` was read from the socket at `read_ns`."""
        if not self._virtual:
            self._waiting.append((seq, read_ns))

    def observe(self, rows: np.ndarray) -> None:
        """Look for the ticks that took targets, in new ticks in order."""
        if len(rows) == 0:
            return
        newest = int(rows["command_seq"][-1])
        while self._waiting and self._waiting[0][0] <= newest:
            seq, read_ns = self._waiting.popleft()
            row = rows[np.searchsorted(rows["command_seq"], seq)]
            # 0: a target that was read within the cycle that took it
            self._taken_ns.append(max(0, int(row["time_ns"]) + int(row["wakeup_ns"]) - read_ns))

    def take(self) -> dict[str, float] | None:
        """Percentiles since the last call, us; None without a target."""
        if not self._taken_ns:
            return None
        percentiles = percentiles_us(np.array(self._taken_ns))
        self._taken_ns.clear()
        return percentiles
