"""How many clients are connected to an endpoint, from libzmq's own events and the permissions given.

Notes
-----
libzmq has no limit of connections and does not tell which connection a permission was for. But it closes
every connection that is not authenticated within `HANDSHAKE_MS`: so an older one is a client for certain, and
of the younger ones no more than permissions were given. The count can be too high for that long after clients
have come and gone in quick succession, never too low.

libzmq's I/O thread waits when the queue of its monitor is full; so the queue is unlimited here and emptied at
every turn of the host."""

from __future__ import annotations

import itertools
import struct
import time
from collections import deque

import zmq

from rtctl.wire.protocol import CONNECTIONS, HANDSHAKE_MS
from rtctl.wire.traffic import local_peer

RESERVED = 4
"""Places of an endpoint that only an operator gets, so that other clients cannot lock an operator out."""

SHARE = 0.5
"""Share of the places of an endpoint that one process of this machine gets: it may lose or leak connections,
and another one must still come in for a STOP."""

# half a second more: libzmq's timer and the host's look both come late
CERTAIN_S = HANDSHAKE_MS / 1e3 + 0.5
"""A connection older than this has been authenticated."""

_EVENT = struct.Struct("=Hi")  # an event of a monitor: its number, and here the descriptor of the connection
_NUMBER = itertools.count()


class Connections:
    """Counts the clients connected to one socket, and says whether one more may come.

    Parameters
    ----------
    context, socket
        The socket, and the context it is of.
    places
        Clients that may be connected."""

    def __init__(
        self, context: zmq.Context[zmq.Socket[bytes]], socket: zmq.Socket[bytes], places: int = CONNECTIONS
    ) -> None:
        self._places = places
        self._watched = socket
        self._opened: dict[int, float] = {}  # descriptor -> when, the oldest first
        self._peers: dict[int, str | None] = {}
        self._permitted: deque[float] = deque()
        address = f"inproc://rtctl-connections-{next(_NUMBER)}"
        # before it is bound: the first connection counts, too
        socket.monitor(address, zmq.EVENT_ACCEPTED | zmq.EVENT_DISCONNECTED)
        self._monitor = context.socket(zmq.PAIR)
        # 0: without a bound, see the notes above
        self._monitor.setsockopt(zmq.RCVHWM, 0)
        self._monitor.setsockopt(zmq.LINGER, 0)
        self._monitor.connect(address)

    @property
    def count(self) -> int:
        """Clients connected, at most (Notes of the module)."""
        self.take()
        old = time.monotonic() - CERTAIN_S
        while self._permitted and self._permitted[0] <= old:
            self._permitted.popleft()
        young = sum(opened > old for opened in self._opened.values())
        return len(self._opened) - young + min(young, len(self._permitted))

    def permit(self, role: str, peer: str | None = None) -> bool:
        """Whether a client of this role may come in; then its place is taken. `peer`: a process, as
        `local_peer` names it."""
        places = self._places if role == "operator" else self._places - RESERVED
        # the asking one is counted: a process has half of the places at most
        if self.count >= places or (peer is not None and self._held_by(peer) > SHARE * self._places):
            return False
        self._permitted.append(time.monotonic())
        return True

    def _held_by(self, peer: str) -> int:
        """Connections of one process, the one that asks included, those that have not said who they are
        too."""
        return sum(one == peer for one in self._peers.values())

    def descriptors(self) -> list[int]:
        """File descriptors of all open connections, strangers included, the oldest first."""
        return list(self._opened)

    def strangers(self) -> list[int]:
        """File descriptors of the connections that may not be authenticated yet, the oldest first."""
        old = time.monotonic() - CERTAIN_S
        return [descriptor for descriptor, opened in self._opened.items() if opened > old]

    def take(self) -> None:
        """Read every event that waits."""
        while True:
            try:
                head, _address = self._monitor.recv_multipart(zmq.NOBLOCK)
            except zmq.Again:
                return
            # by descriptor: the kernel gives a number anew only once its connection is closed
            event, fd = _EVENT.unpack(head)
            if event == zmq.EVENT_ACCEPTED:
                self._opened.pop(fd, None)  # in the order of arrival
                self._opened[fd] = time.monotonic()
                # asked at once: when the other end has gone, the kernel tells no more who it was
                self._peers[fd] = local_peer(fd)
            else:
                self._opened.pop(fd, None)
                self._peers.pop(fd, None)

    def close(self) -> None:
        """Stop counting. Before the socket is closed."""
        self._watched.disable_monitor()
        self._monitor.close(linger=0)
