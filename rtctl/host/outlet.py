"""What a daemon says, to a reader that may have stopped reading: written at once or not at all.

A pipe that nobody reads fills up, and Ctrl-S stops a terminal: whoever writes then waits, and a host that
waits answers no STOP. Asking first whether there is room is not enough (a terminal with room for one byte
says yes), so the descriptor's file is opened once more, without waiting; making the descriptor itself so
would do it to the shell as well."""

from __future__ import annotations

import contextlib
import io
import os
import select
import socket
import stat
import sys
import threading
import time
from collections.abc import Iterator

from rtctl.terminal import Harmless, obeyed_by_none

LOOK_S = 0.01
"""Between two attempts of somebody patient."""

LAST_WORDS_S = 2.0
"""Patience with the reader of what is said after the end, when nothing waits for this process any more."""


class Outlet:
    """Writes to a descriptor that stays the caller's, without ever waiting.

    Attributes
    ----------
    lost : int
        Texts that found no room, and were left out."""

    def __init__(self, fd: int) -> None:
        self.fd, self.lost = fd, 0
        self._rest = b""
        self._own = -1
        self._lock = threading.Lock()
        self._socket: socket.socket | None = None
        with contextlib.suppress(OSError):
            self._open(os.fstat(fd).st_mode)

    def write(self, data: bytes, patience_s: float = 0.0) -> bool:
        """Write `data` as far as there is room; what is begun is ended before anything else. False: left out.

        With some patience it waits that long for room, and then leaves out the rest of it too."""
        with self._lock:
            if self._flush(patience_s):
                # kept, not cut off: half a line would run into the next one
                self._rest = data
                self._flush(patience_s)
                # still the same object: not a byte went out, and all of it can be left out; else the rest
                # follows first
                if self._rest is not data:
                    return True
                self._rest = b""
            self.lost += 1
            return False

    def close(self) -> None:
        """Release what was opened here. Idempotent."""
        if self._socket is not None:
            self._socket.close()
        if self._own >= 0:
            os.close(self._own)
        self._socket, self._own = None, -1

    def _open(self, mode: int) -> None:
        if stat.S_ISSOCK(mode):
            # a socket cannot be opened by /proc (ENXIO), and has MSG_DONTWAIT in place of it
            self._socket = socket.socket(fileno=os.dup(self.fd))
        elif stat.S_ISFIFO(mode) or os.isatty(self.fd):
            # O_NOCTTY: a daemon without a terminal must not get this one
            # by /proc, since O_NONBLOCK belongs to the open file, which the shell shares by the descriptor
            # (open(2))
            flags = os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC
            self._own = os.open(f"/proc/self/fd/{self.fd}", flags)

    def _flush(self, patience_s: float) -> bool:
        """Write what is left of the last text. True when nothing is."""
        end = time.monotonic() + patience_s
        while self._rest:
            written = 0
            with contextlib.suppress(OSError):  # no room, closed, or the reader has gone
                written = self._put(self._rest)
            if written == 0:
                if time.monotonic() >= end:
                    return False
                time.sleep(LOOK_S)
            self._rest = self._rest[written:] if written else self._rest
        return True

    def _put(self, data: bytes) -> int:
        if self._socket is not None:
            return self._socket.send(data, socket.MSG_DONTWAIT)
        if self._own >= 0:
            return os.write(self._own, data)
        poll = select.poll()  # a file, or a terminal that somebody else owns
        poll.register(self.fd, select.POLLOUT)
        ready = poll.poll(0)
        return os.write(self.fd, data) if ready and ready[0][1] & select.POLLOUT else 0


class _Stream(io.TextIOBase):
    """A text stream into an outlet, in the place of `sys.stdout` or `sys.stderr`."""

    encoding, errors = "utf-8", "backslashreplace"

    def __init__(self, outlet: Outlet, patience_s: float) -> None:
        self._outlet, self._patience_s = outlet, patience_s

    def write(self, text: str) -> int:
        if not isinstance(text, str):
            raise TypeError("text is written here, not bytes")
        if text:
            self._outlet.write(obeyed_by_none(text).encode(self.encoding, self.errors), self._patience_s)
        return len(text)

    def writable(self) -> bool:
        return True

    def fileno(self) -> int:
        return self._outlet.fd

    def isatty(self) -> bool:
        return os.isatty(self._outlet.fd)


@contextlib.contextmanager
def streams_that_never_wait(patience_s: float = 0.0) -> Iterator[None]:
    """While this lasts nothing that this process prints makes it wait; what finds no room (in `patience_s`)
    is left out.

    No terminal obeys it either (`rtctl.terminal`). Streams that somebody else has replaced already stay as
    they are."""
    with contextlib.ExitStack() as stack:
        for name in ("stdout", "stderr"):
            before = getattr(sys, name)
            own = isinstance(before, Harmless) or before is getattr(sys, f"__{name}__")
            if before is None or not own:
                continue
            with contextlib.suppress(OSError, ValueError):
                # else what Python has kept would come after what is written past it
                before.flush()
                outlet = Outlet(before.fileno())
                stack.callback(outlet.close)
                stack.callback(setattr, sys, name, before)
                setattr(sys, name, _Stream(outlet, patience_s))
        yield
