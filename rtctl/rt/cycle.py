"""The arrays that one running loop works on, and the steps of a cycle that need no device."""

from __future__ import annotations

from typing import Any

import numpy as np

from rtctl.control import law, mailbox
from rtctl.control.jit import bound, records
from rtctl.control.records import command_dtype, state_dtype
from rtctl.rt.shared_memory import HEADER, Memory, words
from rtctl.tick import new_ticks

_MAILBOX_SEQ = (HEADER.names or ()).index("mailbox_seq")

SLOT, DEADLINE, PERIOD, MISSED, WOKE, RECORD_NS = range(6)
GRID = np.dtype(
    [(name, "<i8") for name in ("slot", "deadline_ns", "period_ns", "missed", "woke_ns", "record_ns")]
)
"""Where the loop is on its grid: slot and deadline to wait for, slots missed, when it woke up last, what
recording took last."""


class Cycle:
    """The arrays of one running loop, private to this process but for the ring and the mailbox."""

    def __init__(self, memory: Memory) -> None:
        n = memory.n_axes
        self.memory = memory
        self.grid = records(np.zeros(1, GRID))
        self.tick = records(new_ticks(1, n))
        self.state = records(np.zeros(1, state_dtype(n)))
        # copies: nothing the host does can change what the loop goes by
        self.params = records(memory.params.copy())
        self.model = records(memory.model.copy())
        self.command = records(np.zeros(2, command_dtype(n)))  # row 1 is scratch of the intake
        self.command_words = words(self.command)
        self.tick_words = words(self.tick)
        # through a plain view: NumPy's record would make an object for each look
        header: Any = memory.header.view(np.int64)
        self._newest_seq: Any = memoryview(header)  # looked at every cycle: cheaper than a call
        self._seq: Any = memoryview(self.command_words.view(np.int64)[0])
        self._take = bound(mailbox.take, memory.header, memory.slot_words, self.command_words)
        self._step = bound(law.step, self.tick, self.state, self.params, self.command, self.model)
        self.record = bound(mailbox.publish, memory.header, memory.ring_words, self.tick_words)
        """Seal the tick and put it into the ring."""

    def decide(self) -> None:
        """Take the newest command if there is a new one; then the law."""
        if self._newest_seq[_MAILBOX_SEQ] != self._seq[0]:
            self._take()
        self._step()
