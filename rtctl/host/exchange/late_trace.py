"""When the loop was woken, ran, and waited, as the kernel's scheduler tells it: tracepoints, read through
perf_event_open(2) by a root service where tracefs is mounted.

The kernel writes into a ring of its own that keeps the newest; the host looks only when a tick was late, and
the descriptors end with it, whatever becomes of it. Written are the loop's wake-ups, and the switches and
softirqs of its core. Source: include/uapi/linux/perf_event.h, include/trace/events/sched.h."""

from __future__ import annotations

import fcntl
import mmap
import os
import struct
from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from rtctl.host.exchange.late_core import perf_event

EVENTS = Path("sys/kernel/tracing/events")
"""Where the kernel has its tracepoints, under the root; empty unless tracefs is mounted."""

_TRACEPOINT, _TIME_RAW, _SAMPLE = 2, 0x4 | 0x400, 9
"""PERF_TYPE_TRACEPOINT; PERF_SAMPLE_TIME | PERF_SAMPLE_RAW; PERF_RECORD_SAMPLE."""

_OWN_CLOCK, _BACKWARD = 1 << 25, 1 << 27
"""Flags `use_clockid` and `write_backward` (newest first, and old ones are overwritten)."""

_ATTRIBUTES = struct.Struct("<IIQQQ8xQ44xi32x")  # 128 bytes, PERF_ATTR_SIZE_VER7
"""struct perf_event_attr: type, size, event, period, what a sample holds, flags, clock."""

_MONOTONIC = 1  # CLOCK_MONOTONIC, the loop's own clock

_OUTPUT, _FILTER = 0x2405, 0x40082406  # PERF_EVENT_IOC_SET_OUTPUT and _SET_FILTER
"""Requests of ioctl(2) on such a descriptor."""

_PAGES = 1024
"""Pages of the ring, 4 MB: some 12 s of a loop of 1 kHz, a second of one of 10 kHz. A host that is kept
waiting for longer has the counters alone."""

_HEAD, _POSITION = 1024, struct.Struct("@Q")
"""Place of the newest record's position in the page before the ring (`data_head`). In the machine's own order
it is read at once; otherwise byte by byte, while the kernel goes on."""

_RECORD, _COMMON = struct.Struct("<IHHQI"), struct.Struct("<H6x")
"""Kind, -, size, time, size of what follows; of that, the tracepoint's number."""

_FOLLOWED = (
    ("sched/sched_switch", ""), ("sched/sched_waking", "pid"), ("irq/softirq_entry", ""),
    ("irq/softirq_exit", ""), ("timer/hrtimer_start", "common_pid"),
)  # fmt: skip
"""Tracepoints, each with the field that must be the loop's number."""

_TIMER = struct.Struct("<24xqq")
"""When a timer comes at the latest, and at the earliest."""

_SWITCH, _SOFTIRQ = struct.Struct("<8x16siiq16sii"), struct.Struct("<8xI")
"""Name, number, priority and state of the task before; name, number and priority of the task after."""

_NOT_READY = 0xFF
"""Bits of the state of a task that waits for something: none of these is set in one that would run on."""

SOFTIRQS = ["HI", "TIMER", "NET_TX", "NET_RX", "BLOCK", "IRQ_POLL", "TASKLET", "SCHED", "HRTIMER", "RCU"]

WOKEN, IN, OUT, OTHER = "woken", "in", "out", "other"
SOFTIRQ, DONE, SLACK, GAP = "softirq", "done", "slack", "gap"


class Mark(NamedTuple):
    """One thing that the kernel told.

    Attributes
    ----------
    at_ns
        CLOCK_MONOTONIC.
    what
        WOKEN (the loop's timer came), IN (the loop has the core), OUT (`name` has it from the loop), OTHER
        (`name` has it from another task), SOFTIRQ and DONE (of that `name`), SLACK (the loop sets a timer
        that may be late), GAP (some were left out before this). An idle core has no name.
    priority
        Of whom has the core now, as the kernel counts: less runs first, from 100 on ordinary.
    left
        Likewise of whom had it before, who may have changed it meanwhile.
    leaver
        Who had it before; none an idle core.
    ready
        OUT of a loop that would have run on.
    slack_ns
        SLACK: by how much."""

    at_ns: int
    what: str
    name: str = ""
    priority: int = 0
    left: int = 0
    leaver: str = ""
    ready: bool = False
    slack_ns: int = 0


class Trace:
    """Follows the loop on one core. Raises OSError where that is not granted, or tracefs is not mounted."""

    def __init__(
        self, pid: int, root: Path = Path("/"), opened: Callable[[bytes, int], int] = perf_event
    ) -> None:
        self._pid, self._opened, self._as = pid, opened, (-1, False)
        self._files: list[int] = []
        self._ring: mmap.mmap | None = None
        self._head, self._known = 0, list[Mark]()
        self._numbers = [int((root / EVENTS / name / "id").read_text()) for name, _ in _FOLLOWED]

    def follow(self, core: int, *, ordinary: bool) -> None:
        """Follow it on this core from now on; only the timers of an `ordinary` loop may be late. Raises
        OSError where that is refused."""
        if (core, ordinary) == self._as:
            return
        self.close()
        self._as = core, ordinary
        numbers = self._numbers if ordinary else self._numbers[:-1]
        try:
            for number, (_, field) in zip(numbers, _FOLLOWED, strict=False):
                self._files.append(self._opened(_attributes(number), core))
                if field:
                    fcntl.ioctl(self._files[-1], _FILTER, f"{field}=={self._pid}".encode() + b"\0")
                if len(self._files) > 1:
                    # into the ring of the first: one order of all events
                    fcntl.ioctl(self._files[-1], _OUTPUT, self._files[0])
                else:
                    # the first page is the kernel's own (perf_event_mmap_page)
                    size = (1 + _PAGES) * mmap.PAGESIZE
                    self._ring = mmap.mmap(self._files[0], size, mmap.MAP_SHARED, mmap.PROT_READ)
        except (OSError, ValueError):
            self.close()
            raise

    def read(self, since_ns: int) -> list[Mark]:
        """What was told since then, in order, from when the loop last had the core before; `since_ns` never
        falls."""
        if self._ring is None:
            return []
        # the position counts down and wraps at 2^64
        size, before = len(self._ring) - mmap.PAGESIZE, self._head
        self._head = head = self._newest()
        begin, written = mmap.PAGESIZE + head % size, (before - head) % (1 << 64)
        new = self._ring[begin : begin + written]
        # the ring goes on at its beginning
        new += self._ring[mmap.PAGESIZE : mmap.PAGESIZE + min(written, size) - len(new)]
        left = size - (head - self._newest()) % (1 << 64)  # the kernel goes on, over what is oldest
        # read first, asked afterwards: what was overwritten meanwhile is at the end of what was read
        if written > left:
            self._known, new = [], new[: max(left, 0)]
        told = []
        for mark in marks(new, self._pid, self._numbers):
            told.append(mark)
            if mark.what == IN and mark.at_ns < since_ns:  # nobody asks for what was before
                self._known = []
                break
        self._known += told[::-1]
        self._known = self._known[last_in(self._known, since_ns) :]
        return self._known

    def _newest(self) -> int:
        """Where the newest record begins; falls by what is written."""
        assert self._ring is not None
        return int(_POSITION.unpack_from(self._ring, _HEAD)[0])

    def close(self) -> None:
        """Follow no more."""
        if self._ring is not None:
            self._ring.close()
        for file in self._files:
            os.close(file)
        self._ring, self._files, self._as = None, [], (-1, False)
        self._head, self._known = 0, []


def trace(pid: int) -> Trace | None:
    """What follows the loop; None where this service cannot."""
    with suppress(OSError, ValueError):
        return Trace(pid)
    return None


def last_in(known: Sequence[Mark], at_ns: int) -> int:
    """Place of the mark at which the loop last had got the core before a time; 0 where there is none."""
    place = bisect_left(known, at_ns, key=lambda mark: mark.at_ns)
    return next((k for k in range(place - 1, -1, -1) if known[k].what == IN), 0)


def marks(told: bytes, pid: int, numbers: list[int]) -> Iterator[Mark]:
    """What records say, one after the other: the newest first, as the kernel writes from the ring's end to
    its begin."""
    (switch, waking, entry, leave, start), at, newer_ns = numbers, 0, 0
    while at + _RECORD.size <= len(told):
        kind, _, size, at_ns, _ = _RECORD.unpack_from(told, at)
        if size < _RECORD.size or at + size > len(told):
            return
        body, at = at + _RECORD.size, at + size
        if kind != _SAMPLE:  # it has lost some, or holds itself back
            yield Mark(newer_ns, GAP)
            continue
        newer_ns = at_ns
        (number,) = _COMMON.unpack_from(told, body)
        if number == switch:
            leaver, before, left, state, name, after, priority = _SWITCH.unpack_from(told, body)
            what = IN if after == pid else OUT if before == pid else OTHER
            ready = what == OUT and not state & _NOT_READY
            yield Mark(at_ns, what, _task(name, after), priority, left, _task(leaver, before), ready)
        elif number == waking:
            yield Mark(at_ns, WOKEN)
        elif number == start:
            at_most, at_least = _TIMER.unpack_from(told, body)
            yield Mark(at_ns, SLACK, slack_ns=at_most - at_least)
        elif number in {entry, leave}:
            (vector,) = _SOFTIRQ.unpack_from(told, body)
            name = SOFTIRQS[vector] if vector < len(SOFTIRQS) else str(vector)
            yield Mark(at_ns, SOFTIRQ if number == entry else DONE, name)


def _attributes(number: int) -> bytes:
    return _ATTRIBUTES.pack(
        _TRACEPOINT, _ATTRIBUTES.size, number, 1, _TIME_RAW, _OWN_CLOCK | _BACKWARD, _MONOTONIC
    )


def _task(name: bytes, number: int) -> str:
    text = name.partition(b"\0")[0].decode("utf-8", "replace")
    return f"{text} {number}" if number else ""
