"""Time for the loop: an absolute grid on CLOCK_MONOTONIC, or a virtual one that runs as fast as it can."""

from __future__ import annotations

import errno
import os
import time
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numba import types

from hw.jit import JIT_DISABLED, compiled
from rtctl.rt import early as looking

# by number: the C library's macros (time.h) are not in a compiled symbol
_CLOCK_MONOTONIC = np.int32(1)
_TIMER_ABSTIME = np.int32(1)

_MARGIN, _MOST, _STEP, _FOLLOWED = looking.MARGIN, looking.MOST, looking.STEP, looking.FOLLOWED
_INCOME, _SAVED, _MOST_SAVED, _LOOKED = looking.INCOME, looking.SAVED, looking.MOST_SAVED, looking.LOOKED
_ONE_LATE_OF = round(1 / looking.LATE_SHARE)

# Resolved by name in the C library: the wake-up is then measured where it happens, not after Python has
# come back from a foreign call (which costs several us at p99).
_nanosleep: Any = types.ExternalFunction(
    "clock_nanosleep", types.int32(types.int32, types.int32, types.voidptr, types.voidptr)
)
_gettime: Any = types.ExternalFunction("clock_gettime", types.int32(types.int32, types.voidptr))


@compiled
def now_ns(timespec: np.ndarray) -> int:
    """CLOCK_MONOTONIC, ns; `timespec`, shape (2,), int64, is scratch."""
    _gettime(_CLOCK_MONOTONIC, timespec.ctypes)
    return int(timespec[0] * 1_000_000_000 + timespec[1])


@compiled
def _sleep(timespec: np.ndarray, until_ns: int) -> int:
    """Sleep; returns the time of waking up, ns, or minus the C error number."""
    # absolute: a relative sleep would begin late by what this process was held up before it
    timespec[0], timespec[1] = until_ns // 1_000_000_000, until_ns % 1_000_000_000
    result = 4
    while result == 4:  # EINTR: a signal came in between; its handler runs when we return
        result = _nanosleep(_CLOCK_MONOTONIC, _TIMER_ABSTIME, timespec.ctypes, 0)
    return now_ns(timespec) if result == 0 else -result


@compiled
def _follow(early: np.ndarray, late_ns: int) -> None:
    """Count the look that follows, and move the margin of `auto` to where all but one of two hundred wake-ups
    are in time, as far as what is saved goes (`rtctl.rt.early`)."""
    # at most the margin, should a clock ever wake it early
    looks = min(max(early[_MARGIN] - late_ns, 0), early[_MARGIN])
    early[_LOOKED] += looks
    if early[_MOST] > 0:
        step, followed = early[_STEP], early[_FOLLOWED]
        # 1 ns at least: of a small step a two-hundredth is 0 in whole ns, and the margin would only grow
        change = step - step // _ONE_LATE_OF if late_ns > followed else -max(step // _ONE_LATE_OF, 1)
        early[_FOLLOWED] = min(max(followed + change, 0), early[_MOST])
        early[_SAVED] = min(early[_SAVED] + early[_INCOME] - looks, early[_MOST_SAVED])
        early[_MARGIN] = min(early[_FOLLOWED], early[_SAVED])


@compiled
def doze(timespec: np.ndarray, deadline_ns: int, early: np.ndarray) -> int:
    """Sleep until shortly before the deadline; the time then, ns, or minus the C error number."""
    until = deadline_ns - early[_MARGIN]
    now = now_ns(timespec)
    # before the clock began: the kernel refuses it
    if until < 0 or now < until:  # a grid that is behind has no time to sleep
        now = _sleep(timespec, until)
        if now >= 0:
            _follow(early, now - until)
    return now


@compiled
def look(timespec: np.ndarray, deadline_ns: int) -> int:
    """Look at the clock until the deadline comes; the time then, ns."""
    now = now_ns(timespec)
    while now < deadline_ns:
        now = now_ns(timespec)
    return now


@compiled
def wait(timespec: np.ndarray, deadline_ns: int, early: np.ndarray) -> int:
    """Sleep until shortly before the deadline, then look until it comes; the time then, ns, or minus the C
    error number."""
    woke = doze(timespec, deadline_ns, early)
    return look(timespec, deadline_ns) if woke >= 0 else woke


class Clock(Protocol):
    """What the loop needs of time. All times are ns."""

    def now(self) -> int:
        """Time now."""

    def sleep_until(self, deadline_ns: int) -> int:
        """Wait for the deadline; returns the time of waking up (at once when it has passed)."""


class WallClock:
    """`clock_nanosleep` on CLOCK_MONOTONIC with absolute deadlines: no drift, no effect of wall-clock steps.

    Attributes
    ----------
    timespec : array, shape (2,), int64
        Scratch of the compiled functions.
    early : array, shape (PLACES,), int64
        How long before each deadline it is awake (`rtctl.rt.early.choose`), ns; it moves where it follows the
        wake-ups."""

    def __init__(self, early: np.ndarray | None = None) -> None:
        self.timespec = np.zeros(2, np.int64)
        self.early = np.zeros(looking.PLACES, np.int64)
        self.now = time.monotonic_ns
        # before `early` is the shared array: what compiling takes is no wake-up to follow
        self.sleep_until(0)  # compile now
        self.early = self.early if early is None else early

    def sleep_until(self, deadline_ns: int) -> int:
        """Wait for `deadline_ns`. A signal that comes in between does not end the wait early."""
        if JIT_DISABLED:
            # plain Python, for tests of the law: punctual to what Python gives
            time.sleep(max(0, deadline_ns - time.monotonic_ns()) / 1e9)
            return time.monotonic_ns()
        woke = int(wait(self.timespec, deadline_ns, self.early))
        if woke < 0:
            raise OSError(-woke, f"clock_nanosleep: {os.strerror(-woke)} ({errno.errorcode[-woke]})")
        return woke


class VirtualClock:
    """Time that jumps to each deadline. Waits only for the reader of the ring, so that no tick is lost.

    `header` is the shared header: the loop pauses while the host is more than its `ahead_rows` behind, unless
    `ending` says that this process has been told to end: a host that has died reads no more."""

    AHEAD = 256
    """Ticks made at once where nobody reads."""

    def __init__(self, header: np.ndarray | None = None, ending: Callable[[], bool] = lambda: False) -> None:
        self._now = 0
        self._ending = ending
        self._header = header

    def now(self) -> int:
        """The virtual time."""
        return self._now

    def room(self) -> int:
        """Ticks that may be made before the reader has to be waited for."""
        if self._header is None or not self._header[0]["ahead_rows"]:
            return self.AHEAD
        # one at least where the reader is just so far behind: the loop stands only beyond that
        header = self._header[0]
        return int(header["ahead_rows"] + 1 - (header["head"] - header["read_head"]))

    def jump(self, now_ns: int) -> None:
        """Go on from this time: cycles went by without this clock being asked."""
        self._now = now_ns

    def sleep_until(self, deadline_ns: int) -> int:
        """Jump to the deadline."""
        while self.room() <= 0 and not self._ending():
            # asking without a pause would take the core that the reader needs
            time.sleep(0.0005)
        # never back: the first deadline may lie before what `jump` has set
        self._now = max(self._now, deadline_ns)
        return self._now
