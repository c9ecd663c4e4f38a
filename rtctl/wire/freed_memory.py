"""Gives memory back that was needed once.

The C library keeps what is freed in case it is needed again (measured: 0.7 to 0.9 MB in 10 s); a daemon lives
for months."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

TRIM_S = 10.0
"""Time between two trims of the heap. A trim takes 0.2 ms, too long for every turn."""


def _nothing(_pad: int) -> int:
    return 0


class Heap:
    """The memory of this process that the C library manages. Another library than glibc: does nothing."""

    def __init__(self) -> None:
        # musl, for one, has none
        self._trim: Callable[[int], int] = getattr(ctypes.CDLL(None), "malloc_trim", _nothing)
        self._next_s = 0.0

    def look(self, now_s: float) -> None:
        """Give back what is free, now and then; `now_s` on a clock that never goes back, s."""
        if now_s >= self._next_s:
            self._next_s = now_s + TRIM_S
            self.trim()

    def trim(self) -> None:
        """Give back what is free, now."""
        self._trim(0)
