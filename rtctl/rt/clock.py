"""Time for the loop: an absolute grid on CLOCK_MONOTONIC, or a virtual one that runs as fast as it can."""

from __future__ import annotations

import ctypes
import errno
import os
import time
from typing import Protocol

import numpy as np

_CLOCK_MONOTONIC = 1
_TIMER_ABSTIME = 1


class _Timespec(ctypes.Structure):
    _fields_ = (("tv_sec", ctypes.c_int64), ("tv_nsec", ctypes.c_int64))


class Clock(Protocol):
    """What the loop needs of time. All times are ns."""

    def now(self) -> int:
        """Time now."""

    def sleep_until(self, deadline_ns: int) -> int:
        """Wait for the deadline; returns the time of waking up (at once when it has passed)."""


class WallClock:
    """`clock_nanosleep` on CLOCK_MONOTONIC with absolute deadlines: no drift, no effect of wall-clock steps."""

    def __init__(self) -> None:
        libc = ctypes.CDLL(None, use_errno=False)
        self._sleep = libc.clock_nanosleep
        self._sleep.argtypes = (ctypes.c_int, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)
        self._sleep.restype = ctypes.c_int
        self._until = _Timespec()
        self._until_pointer = ctypes.addressof(self._until)
        self.now = time.monotonic_ns

    def sleep_until(self, deadline_ns: int) -> int:
        """Sleep until `deadline_ns`. A signal handler that ran in between does not end the sleep early."""
        until = self._until
        until.tv_sec, until.tv_nsec = divmod(deadline_ns, 1_000_000_000)
        while True:
            result = self._sleep(_CLOCK_MONOTONIC, _TIMER_ABSTIME, self._until_pointer, None)
            if result == 0:
                return time.monotonic_ns()
            if result != errno.EINTR:
                raise OSError(result, os.strerror(result))


class VirtualClock:
    """Time that jumps to each deadline. Waits only for the reader of the ring, so that no tick is lost.

    `header` is the shared header: the loop pauses while the host is more than half a ring behind.
    """

    def __init__(self, header: np.ndarray | None = None) -> None:
        self._now = 0
        self._header = header
        self._most_unread = 0 if header is None else int(header[0]["ring_rows"]) // 2

    def now(self) -> int:
        """The virtual time."""
        return self._now

    def sleep_until(self, deadline_ns: int) -> int:
        """Jump to the deadline."""
        if self._header is not None and self._most_unread:
            header = self._header
            while header[0]["head"] - header[0]["read_head"] > self._most_unread:
                time.sleep(0.0005)
        self._now = max(self._now, deadline_ns)
        return self._now
