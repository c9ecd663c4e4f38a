"""Sends telemetry over one socket. Never waits for a subscriber, and throws out one that would fill the
memory.

Notes
-----
A ZeroMQ PUB socket drops silently. With ZMQ_XPUB_NODROP a send that would drop fails instead, but for all
subscribers at once. So each message is first offered that way; when it is refused because *some* queue is
full, it is counted in `dropped` and sent again the lossy way, which serves everybody else. libzmq then
leaves the full queue alone until it is half empty, without telling: `dropped` therefore counts the
occasions on which a subscriber fell behind (0 means that nobody lost anything here), and each
subscriber counts its own losses by the running numbers that messages carry.

libzmq keeps every topic anybody subscribes to, at some 25 bytes a byte (measured: 20 000 topics of 500 bytes
took 484 MB). There are few topics here; so the socket of a door is an XPUB, which shows subscriptions, and
whoever asks for others again and again is expelled, which frees what they took. It also hands out whatever
else subscribers send, and keeps what nobody reads, without a bound: whoever does that is expelled at once."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import Protocol

import zmq

from rtctl.wire.authenticator import VIEWER
from rtctl.wire.sockets import descriptor_of, user_id

WRONG_TOPICS = 8
"""So many subscriptions of one connection to topics that do not exist are forgiven as mistakes of its
program."""

DEAF_S = 1.0
"""For so long nothing is made of what comes from somebody who was expelled: it was sent before, and is on its
way."""

# a send must not wait for a crowd: what is left is looked at with the next one
_LOOKS_PER_SEND = 64


def options(queue_messages: int) -> dict[int, int]:
    """Options of the socket, for subscribers' queues of this length."""
    return {zmq.SNDHWM: queue_messages, zmq.RCVHWM: _LOOKS_PER_SEND, zmq.XPUB_NODROP: 1}


class HasSocket(Protocol):
    """A door, which opens a new socket when keys are revoked, or whatever else holds one."""

    @property
    def socket(self) -> zmq.Socket[bytes]:
        """The socket as it is now."""


class Publisher:
    """One PUB or XPUB socket.

    Parameters
    ----------
    holder
        Holds the socket.
    topics
        The topics it carries.
    expel
        Throws out the subscriber that sent a frame (XPUB sockets); None: subscribers are trusted."""

    def __init__(
        self, holder: HasSocket, topics: Iterable[bytes], expel: Callable[[zmq.Frame], None] | None = None
    ) -> None:
        self._holder = holder
        self._topics = frozenset(topics)
        # a subscription is a prefix: every beginning of a topic is a right one
        self._beginnings = {topic[:size] for topic in self._topics for size in range(len(topic) + 1)}
        self._expel = expel
        self._wrong: dict[str, int] = {}
        self._deaf_to: dict[str, float] = {}

    def send(self, topic: bytes, payload: bytes) -> bool:
        """Send to every subscriber whose queue has room. False when some queue was full."""
        # of a publication for viewers: they hear the state alone
        if topic not in self._topics:
            return True
        if self._expel is not None and not self._holder.socket.closed:
            offender = self._offender(self._holder.socket)
            if offender is not None:
                self._expel(offender)
        socket = self._holder.socket
        if socket.closed:  # a door that could not be opened again yet
            return True
        try:
            # the first part decides: queues count whole messages, so that the second one fits
            socket.send(topic, zmq.SNDMORE | zmq.NOBLOCK)
        except zmq.Again:
            socket.setsockopt(zmq.XPUB_NODROP, 0)
            socket.send_multipart((topic, payload), zmq.NOBLOCK)
            # back again: the next message is offered to all first
            socket.setsockopt(zmq.XPUB_NODROP, 1)
            return False
        socket.send(payload, zmq.NOBLOCK)
        return True

    def _offender(self, socket: zmq.Socket[bytes]) -> zmq.Frame | None:
        """A frame of somebody who has subscribed to too many topics that do not exist, if there is one."""
        for _ in range(_LOOKS_PER_SEND):
            try:
                frame = socket.recv(zmq.NOBLOCK, copy=False)
            except zmq.Again:
                return None
            sender = _subscriber(frame)
            if self._is_expelled(sender) or not self._offends(frame, sender):
                continue
            # it is gone with its connection, and its count with it: the table cannot grow
            self._wrong.pop(sender, None)
            self._deaf_to[sender] = time.monotonic() + DEAF_S
            return frame
        return None

    def _is_expelled(self, sender: str) -> bool:
        if not self._deaf_to:
            return False
        now = time.monotonic()
        self._deaf_to = {one: until for one, until in self._deaf_to.items() if now < until}
        return sender in self._deaf_to

    def _offends(self, frame: zmq.Frame, sender: str) -> bool:
        data = frame.bytes
        if frame.more or data[:1] not in (
            b"\0",
            b"\1",
        ):  # subscribers have nothing to say: no client does this
            return True
        # libzmq itself ends those of one that has gone
        if data[:1] == b"\1" and data[1:] not in self._beginnings:
            self._wrong[sender] = self._wrong.get(sender, 0) + 1
        return self._wrong.get(sender, 0) > WRONG_TOPICS


def _subscriber(frame: zmq.Frame) -> str:
    """Who sent this frame: the user, and of viewers, who are one user, the connection."""
    user = user_id(frame)
    return f"{user}{descriptor_of(frame)}" if user == VIEWER else user
