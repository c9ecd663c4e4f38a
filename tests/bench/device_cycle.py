"""One cycle of a device as the loop makes it: compiled where the device has that, and Python's halves for
what is left.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from hw.entry_points import call_for_int, entry_point
from hw.interface import CompiledCycleBackend
from hw.jit import JIT_DISABLED, bound, compiled

READ, WRITE = 1, 2
"""What was left to Python: the whole cycle, or its writing."""


@compiled
def _whole(
    at: np.ndarray, read_arguments: tuple[np.ndarray, ...], write_arguments: tuple[np.ndarray, ...]
) -> int:
    """What a whole compiled cycle does with the device (`rtctl.rt.whole_cycle`); 0 when Python was not
    needed.
    """
    if call_for_int(at[0], read_arguments) != 0:
        return READ
    return WRITE if call_for_int(at[1], write_arguments) != 0 else 0


@compiled
def _read(at: np.ndarray, read_arguments: tuple[np.ndarray, ...]) -> int:
    return int(call_for_int(at[0], read_arguments))


class DeviceCycle:
    """The cycle of one open device on one tick.

    Attributes
    ----------
    is_compiled : bool
        Whether Python is left out of ordinary cycles.
    left : int
        Cycles in which Python was needed.
    """

    def __init__(self, backend: Any, tick: np.ndarray) -> None:
        self._backend, self._tick, self.left = backend, tick, 0
        parts = None
        if isinstance(backend, CompiledCycleBackend) and not JIT_DISABLED:
            parts = backend.compiled_cycle(tick)
        self.is_compiled = parts is not None
        self._run: Callable[[], int] = lambda: READ
        self._drain: Callable[[], int] = lambda: READ
        if parts is not None:
            arguments = parts.read_arguments, parts.write_arguments
            at = np.array([entry_point(parts.read, *arguments[0]), entry_point(parts.write, *arguments[1])])
            self._run, self._drain = bound(_whole, at, *arguments), bound(_read, at, arguments[0])

    def run(self) -> None:
        """Read and write."""
        left = self._run()
        if left:
            self.left += 1
            if left == READ:
                self._backend.read(self._tick)
            self._backend.write(self._tick)

    def drain(self) -> None:
        """Take in what waits."""
        if self._drain():
            self._backend.read(self._tick)
