"""What the host and the loop process share: one anonymous memory file, no name, nothing left after a crash.

Layout (each part 64-byte aligned): header, parameters, friction model, command mailbox, tick ring. The
host creates it, fills parameters and model, and hands the file descriptor to the loop process it starts.
Nobody else can attach, and the kernel frees it with the last of the two processes.

Both directions have a single writer and need no lock:

- The ring: the loop copies a sealed tick into the next row, then raises `head`. A reader takes rows below
  `head`, looks at `head` again, drops what may have been overwritten meanwhile, and checks each row's
  seal, so that neither a torn row nor one whose stores became visible out of order is ever returned.
- The mailbox: the host writes the next of `MAILBOX_SLOTS` slots, then the slot's sequence number. The
  loop takes a slot only when its checksum fits, else it keeps the command it has.

The checksum covers every word with its position, so it also stands on weakly ordered processors."""

from __future__ import annotations

import fcntl
import mmap
import os
import time
from collections import deque
from typing import Any

import numpy as np

from rtctl.control import mailbox
from rtctl.control.jit import records
from rtctl.control.records import MODEL, command_dtype, params_dtype
from rtctl.rt.early import PLACES
from rtctl.standard_streams import above_standard_streams
from rtctl.tick import tick_dtype

# three commands may come while one is read: a host that sends more often has the loop try again
MAILBOX_SLOTS = 4
# bytes of a line of the cache: no two parts share one
_ALIGN = 64

HEADER = np.dtype(
    [
        ("magic", "<u8"),
        ("n_axes", "<i8"),
        ("ring_rows", "<i8"),
        ("period_ns", "<i8"),
        ("head", "<i8"),  # ticks recorded so far; row i lives at i % ring_rows
        ("read_head", "<i8"),  # ticks the host has read; a virtual clock waits for it
        ("ahead_rows", "<i8"),  # ticks by which a virtual clock may be ahead of it
        ("start_ns", "<i8"),  # CLOCK_MONOTONIC of tick 0
        ("mailbox_seq", "<i8"),  # newest command's sequence number
        ("commands_refused", "<i8"),  # mailbox slots whose checksum did not fit
        (
            "early_ns",
            "<i8",
            (PLACES,),
        ),  # how long before a deadline the loop is awake, and what moves that (`rtctl.rt.early`)
    ]
)
_MAGIC = 0x7274_6374_6C31  # "rtctl1"
_HEAD, _READ_HEAD, _MAILBOX_SEQ = (
    (HEADER.names or ()).index(name) for name in ("head", "read_head", "mailbox_seq")
)


class Memory:
    """The shared memory of one rig, mapped in this process.

    Attributes
    ----------
    header, params, command, model : structured arrays of one row (model: one row per axis)
        `command` is the staging copy of this process, not shared.
    slots, ring : structured arrays
        Mailbox slots and tick ring, shared.
    slot_words, ring_words : arrays of uint64
        The same memory as words, one row per slot or tick."""

    def __init__(self, fd: int, n_axes: int, ring_rows: int) -> None:
        self.fd = fd
        self.n_axes = n_axes
        self.ring_rows = ring_rows
        parts = _layout(n_axes, ring_rows)
        self._map = mmap.mmap(fd, parts["end"][0])
        self.header = self._part(parts, "header", HEADER)
        self.params = self._part(parts, "params", params_dtype(n_axes))
        self.model = self._part(parts, "model", MODEL)
        self.slots = self._part(parts, "slots", mailbox.slot_dtype(n_axes))
        self.ring = self._part(parts, "ring", tick_dtype(n_axes))
        self.slot_words = words(self.slots)
        self.ring_words = words(self.ring)
        self.command = np.zeros(1, command_dtype(n_axes))

    def _part(self, parts: dict[str, tuple[int, int]], name: str, dtype: np.dtype[np.void]) -> np.ndarray:
        offset, count = parts[name]
        array: np.ndarray = np.frombuffer(self._map, dtype, count, offset)
        return records(array)

    @property
    def early_ns(self) -> np.ndarray:
        """The header's field of this name, shape (PLACES,)."""
        early: np.ndarray = self.header.view(np.ndarray)["early_ns"][0]
        return early

    @classmethod
    def create(cls, n_axes: int, ring_rows: int, period_ns: int) -> Memory:
        """Make the memory; rows are zero. The descriptor is inheritable only through `pass_fds`."""
        fd = above_standard_streams(os.memfd_create("rtctl", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING))
        os.ftruncate(fd, _layout(n_axes, ring_rows)["end"][0])
        # of this size for good: cut through /proc/PID/fd, it would end host and loop at their next look
        fcntl.fcntl(fd, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_SEAL)
        memory = cls(fd, n_axes, ring_rows)
        header = memory.header[0]
        header["n_axes"], header["ring_rows"], header["period_ns"] = n_axes, ring_rows, period_ns
        header["ahead_rows"] = ring_rows // 2  # the reader copies the other half meanwhile
        # last: a process that sees it finds the sizes before it
        header["magic"] = _MAGIC
        return memory

    @classmethod
    def attach(cls, fd: int) -> Memory:
        """Map memory made by `create` in another process. Raises ValueError when it is not that."""
        head = np.frombuffer(os.pread(fd, HEADER.itemsize, 0), HEADER)
        if head.size != 1 or head[0]["magic"] != _MAGIC:
            raise ValueError(f"file descriptor {fd} is not rtctl's shared memory")
        return cls(fd, int(head[0]["n_axes"]), int(head[0]["ring_rows"]))

    def close(self) -> None:
        """Release the descriptor; the mapping goes with the last array that uses it."""
        if self.fd >= 0:
            os.close(self.fd)
            self.fd = -1


def words(array: np.ndarray) -> np.ndarray:
    """The rows of a structured array as unsigned 64-bit words: shape (rows, words per row)."""
    plain = array.view(np.ndarray)
    return plain.view(np.uint64).reshape(plain.shape[0], -1)


def _header_words(memory: Memory) -> memoryview:
    """The header as a buffer of integers: read and written one at a time, quicker than fields of an array."""
    return memory.header.view(np.int64).data


def _layout(n_axes: int, ring_rows: int) -> dict[str, tuple[int, int]]:
    """Offset and row count of each part, and the total size under `end`."""
    sizes: tuple[tuple[str, np.dtype[Any], int], ...] = (
        ("header", HEADER, 1),
        ("params", params_dtype(n_axes), 1),
        ("model", MODEL, n_axes),
        ("slots", mailbox.slot_dtype(n_axes), MAILBOX_SLOTS),
        ("ring", tick_dtype(n_axes), ring_rows),
    )
    parts: dict[str, tuple[int, int]] = {}
    offset = 0
    for name, dtype, count in sizes:
        parts[name] = (offset, count)
        offset += -(-dtype.itemsize * count // _ALIGN) * _ALIGN
    parts["end"] = (offset, 0)
    return parts


class RingReader:
    """Reads the ring in order, from the newest row at the time it was made.

    `overwritten` counts the rows lost because this reader was too slow; `torn` those whose seal did not
    fit though they should have been complete. Neither is ever returned."""

    GUARD_ROWS = 2  # rows the writer may be working on: never read

    def __init__(self, memory: Memory, *, from_start: bool = False) -> None:
        self._memory = memory
        self._header = _header_words(memory)
        self._dtype = memory.ring.dtype
        self.next = 0 if from_start else int(memory.header[0]["head"])
        self.overwritten = 0
        self.torn = 0

    @property
    def waiting(self) -> int:
        """Ticks not read yet, those overwritten meanwhile included."""
        return int(self._header[_HEAD]) - self.next

    def read(self, max_rows: int = 1_000_000) -> np.ndarray:
        """Complete ticks since the last call, oldest first; a copy of at most `max_rows` rows."""
        header, rows = self._header, self._memory.ring_rows
        head = header[_HEAD]
        oldest = head - rows + self.GUARD_ROWS
        if self.next < oldest:
            self.overwritten += oldest - self.next
            self.next = oldest
        first, last = self.next, min(head, self.next + max_rows)
        # copied before it is judged: the loop goes on writing meanwhile
        copy = self._memory.ring_words[np.arange(first, last) % rows]
        self.next = last
        safe_from = header[_HEAD] - rows + self.GUARD_ROWS
        if safe_from > first:
            lost = min(safe_from, last) - first
            self.overwritten += lost
            copy = copy[lost:]
        sealed = mailbox.seals_fit(copy)
        if not sealed.all():
            # not one that the loop was writing: those are left out above
            self.torn += int((~sealed).sum())
            copy = copy[sealed]
        header[_READ_HEAD] = self.next
        ticks: np.ndarray = copy.view(self._dtype)[:, 0]
        return ticks

    def latest(self) -> np.ndarray | None:
        """The newest complete tick (one row, copied), or None before the first. Does not move the reader."""
        ring_words = self._memory.ring_words
        # again: on a weakly ordered processor `head` may be seen before the row
        for _ in range(8):
            head = self._header[_HEAD]
            if head == 0:
                return None
            # copied first: the loop may overwrite the row while it is being looked at
            row = ring_words[(head - 1) % len(ring_words)].copy()
            if mailbox.checksum(row[:-1]) == row[-1]:
                newest: np.ndarray = row.view(self._dtype)
                return newest
        return None


SENT_COMMANDS = 20_000
"""Commands remembered until the loop says which ones it took up; more than any client may send in a batch."""


class CommandWriter:
    """The host's end of the mailbox: edit `command`, then `send()`. The newest command wins.

    `sent` holds copies of what was sent, oldest first, for who follows it (`rtctl.host.command_trace`)."""

    def __init__(self, memory: Memory) -> None:
        self.sent: deque[np.ndarray] = deque(maxlen=SENT_COMMANDS)
        self._slots = memory.slot_words
        self._header = _header_words(memory)
        staged = np.zeros(1, mailbox.slot_dtype(memory.n_axes))
        self.command = staged["command"]
        self._staged = words(staged)[0]
        self._body, self._seal = self._staged[:-1], self._staged[-1:]

    def send(self) -> int:
        """Publish the command as edited. Returns its sequence number."""
        seq: int = self._header[_MAILBOX_SEQ] + 1
        self.command["seq"] = seq
        self.command["stamp_ns"] = time.monotonic_ns()
        self._seal[0] = mailbox.checksum(self._body)
        # not the slot of the newest command: the loop may be copying that one
        self._slots[seq % MAILBOX_SLOTS] = self._staged
        self._header[_MAILBOX_SEQ] = seq
        self.sent.append(self._body.copy().view(self.command.dtype))  # words: 100 times quicker than fields
        return seq
