"""Connections of the page's server: no more than there is room for, and always room for one that comes to
press STOP."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TypeAlias

Request: TypeAlias = socket.socket | tuple[bytes, socket.socket]
"""A connection as socketserver passes it on; a datagram comes with its bytes, and none comes here."""

MOST_GUESTS = 64
"""Connections that wait for something to be asked; each has a thread. A browser keeps six."""


class Guests:
    """Whoever has said nothing whole for longest makes room for who comes. For several threads.

    Parameters
    ----------
    most
        Connections that may wait; those that are being served are not counted."""

    def __init__(self, most: int = MOST_GUESTS) -> None:
        self._most = most
        self._lock = threading.Lock()
        self._waiting: dict[socket.socket, None] = {}

    def come(self, guest: Request) -> None:
        """A connection waits from now on; the one that has waited for longest may be cut off for it."""
        if isinstance(guest, tuple):
            return
        with self._lock:
            self._waiting[guest] = None
            # a dict keeps the order in which they came: the first has waited for longest
            while len(self._waiting) > self._most:
                oldest = next(iter(self._waiting))
                del self._waiting[oldest]
                with suppress(OSError):  # it has gone by itself
                    oldest.shutdown(socket.SHUT_RDWR)

    def go(self, guest: Request) -> None:
        """A connection is about to be closed. Idempotent."""
        if isinstance(guest, tuple):
            return
        with self._lock:
            # without a default it would raise for one that was cut off already
            self._waiting.pop(guest, None)

    @contextmanager
    def served(self, guest: socket.socket) -> Iterator[None]:
        """A connection has asked for something, and is not cut off while that is given."""
        self.go(guest)
        try:
            yield
        finally:
            self.come(guest)  # it may ask for more
