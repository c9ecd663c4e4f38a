"""A wall clock of their own for some processes, that a test steps (`stepped_clock.c`)."""

from pathlib import Path

import numpy as np
from c_board import compiled

SOURCE = Path(__file__).with_suffix(".c")
HOUR_NS = 3600 * 10**9


class SteppedClock:
    """The processes that are started with `environment` read a wall clock that is `step` hours off."""

    def __init__(self, folder):
        self.library = compiled(SOURCE, folder / "stepped-clock.so", "-shared", "-fPIC", "-ldl")
        path = folder / "wall-clock"
        path.write_bytes(bytes(24))
        self._numbers = np.memmap(path, np.int64, "r+")
        self.environment = {"LD_PRELOAD": str(self.library), "STEPPED_CLOCK": str(path)}

    def step(self, hours):
        """From now on the wall clock is so many hours ahead of the true one."""
        self._numbers[0] = round(hours * HOUR_NS)

    @property
    def reads(self):
        """How often these processes have read it."""
        return int(self._numbers[1])

    @property
    def waits(self):
        """How often a thread of them began to wait for a moment of it."""
        return int(self._numbers[2])

    def is_in(self, pid):
        """Whether a process has loaded it."""
        return str(self.library) in Path(f"/proc/{pid}/maps").read_text()
