"""Connections that take nothing of what is sent to them, by what the kernel tells of their descriptors.

Notes
-----
What a client leaves unread waits first in the kernel, then in the queue that libzmq has for it. libzmq tells
neither, and over a Unix socket no sign of life is missed: the question for it waits in the same queue."""

from __future__ import annotations

import contextlib
import fcntl
import select
import struct
import termios

from rtctl.wire.traffic import bytes_of

STALLED_S = 10.0
"""A connection that has taken nothing for so long, while there was no room left for more, is cut: twice as
long as messages are kept for it (`streams.QUEUE_S`), so that it has been losing some for as long again."""


class Stalled:
    """Looks after the connections of one door.

    Parameters
    ----------
    by_tcp
        Otherwise by Unix sockets."""

    def __init__(self, *, by_tcp: bool) -> None:
        self._by_tcp = by_tcp
        self._since: dict[
            int, tuple[int, float]
        ] = {}  # descriptor -> what was taken, since when nothing more

    def found(self, descriptors: list[int], now_s: float, patience_s: float = STALLED_S) -> list[int]:
        """Those of these connections that have taken nothing for `patience_s`; to be asked some times in
        it."""
        poll = select.poll()
        for descriptor in descriptors:
            poll.register(descriptor, select.POLLOUT)
        # where there is room nothing waits in libzmq, and who has gone (POLLHUP, POLLNVAL) takes no more
        full = set(descriptors) - {descriptor for descriptor, _ in poll.poll(0)}
        since: dict[int, tuple[int, float]] = {}
        for descriptor in full:
            with contextlib.suppress(OSError):
                taken = self._taken(descriptor)
                before, at_s = self._since.get(descriptor, (None, now_s))
                since[descriptor] = taken, at_s if taken == before else now_s
        self._since = since
        return [descriptor for descriptor, (_, at_s) in since.items() if now_s - at_s >= patience_s]

    def _taken(self, descriptor: int) -> int:
        """A number that changes whenever something is taken. Raises OSError."""
        if self._by_tcp:
            return bytes_of(descriptor)[0]
        # of a Unix socket what waits: libzmq adds nothing before three quarters of it are taken (EPOLLOUT)
        (waiting,) = struct.unpack("=i", fcntl.ioctl(descriptor, termios.TIOCOUTQ, bytes(4)))
        return int(waiting)
