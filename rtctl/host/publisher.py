"""Sends telemetry over one PUB socket. Never waits for a subscriber.

Notes
-----
A ZeroMQ PUB socket drops silently. With ZMQ_XPUB_NODROP a send that would drop fails instead, but for all
subscribers at once. So each message is first offered that way; when it is refused because *some* queue is
full, it is counted in `dropped` and sent again the lossy way, which serves everybody else. libzmq then
leaves the full queue alone until it is half empty, without telling: `dropped` therefore counts the
occasions on which a subscriber fell behind (0 means that nobody lost anything here), and each
subscriber counts its own losses by the running numbers that messages carry.
"""

from __future__ import annotations

from typing import Protocol

import zmq


def options(queue_messages: int) -> dict[int, int]:
    """Options of the socket, for subscribers' queues of this length."""
    return {zmq.SNDHWM: queue_messages, zmq.XPUB_NODROP: 1}


class HasSocket(Protocol):
    """A door, which opens a new socket when keys are revoked, or whatever else holds one."""

    @property
    def socket(self) -> zmq.Socket[bytes]:
        """The socket as it is now."""


class Publisher:
    """One PUB socket.

    Parameters
    ----------
    holder
        Holds the socket.
    topics
        The topics it carries; None: all.
    """

    def __init__(self, holder: HasSocket, topics: frozenset[bytes] | None = None) -> None:
        self._holder = holder
        self._topics = topics

    def send(self, topic: bytes, payload: bytes) -> bool:
        """Send to every subscriber whose queue has room. False when some queue was full."""
        if self._topics is not None and topic not in self._topics:
            return True
        socket = self._holder.socket
        try:
            socket.send(topic, zmq.SNDMORE | zmq.NOBLOCK)
        except zmq.Again:
            socket.setsockopt(zmq.XPUB_NODROP, 0)
            socket.send_multipart((topic, payload), zmq.NOBLOCK)
            socket.setsockopt(zmq.XPUB_NODROP, 1)
            return False
        socket.send(payload, zmq.NOBLOCK)
        return True
