"""The law's state as the host can know it: the same compiled law over the same ticks, a batch behind the
loop.

The state lives in the loop process and never leaves it. But the law is a pure function, so whoever has seen
every tick and command from the first one on has the state too. With it a recording can be replayed bit for
bit that begins in the middle of a run, and so can each part of one that goes on for days."""

from __future__ import annotations

import numpy as np

from rtctl.recording.law_arrays import LawArrays
from rtctl.recording.law_runner import CommandBook, LawRunner
from rtctl.tick import copied


class ShadowLaw:
    """Follows one run from its first tick.

    It compares what it gets with what the loop sent. Once they differ, or a tick or command is missing, the
    state is unknown for the rest of the run (`why` says so): a wrong state is worse than none.

    Attributes
    ----------
    next_row : int
        Number of the row the present state belongs before.
    why : str
        Why the state is unknown; empty while it is known."""

    def __init__(self, arrays: LawArrays, n_axes: int) -> None:
        self._law = LawRunner(arrays, n_axes)
        self._book = CommandBook(n_axes)
        self.next_row = 0
        self.why = ""

    def follow(self, first_row: int, rows: np.ndarray, commands: np.ndarray) -> None:
        """Take the next ticks, and the commands that came into force in them."""
        if self.why or len(rows) == 0:  # once lost, it stays lost
            return
        # a gap, or a batch twice: either way the law here has seen another run
        if first_row != self.next_row:
            self.why = f"ticks were lost before row {first_row}"
            return
        self._book.learn(commands)
        which, known = self._book.find(rows["command_seq"])
        if known < len(rows):
            self.why = f"a command in force at tick {rows['tick'][known]} is not known"
            return
        # by its outputs: the state itself is nowhere to be compared with
        _, differs = self._law.run(rows, self._book.commands, which)
        # before the number is raised: who asks for the state meets `why` first
        if differs.any():
            self.why = (
                f"the law gave something else than the loop at tick {rows['tick'][int(np.argmax(differs))]}"
            )
        self.next_row = first_row + len(rows)

    @property
    def known(self) -> np.void | None:
        """The law's state before row `next_row`, as it is until the next ticks come; None when it is
        unknown."""
        return None if self.why else self._law.state[0]

    def state(self) -> np.ndarray | None:
        """The law's state before row `next_row`, shape (1,), copied; None when it is unknown."""
        # a copy: the law goes on in the same memory
        return None if self.why else copied(self._law.state)
