"""Reads messages of which libzmq bounds each frame, but not their number: long ones are read away, some
frames a turn.

Whoever sends one is expelled. What of it waits still has to be read before the message of another client, or
thrown away with all connections of the door: the latter when it would take too long."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import zmq

from rtctl.wire.sockets import Door

MOST_FRAMES = 4
"""Most frames of a message, identity not counted; a request has at most two."""

FRAMES_PER_TURN = 2048
"""So many frames of a message that is too long are read and dropped in one turn: about 2 ms."""

MOST_READ_AWAY = 32 * FRAMES_PER_TURN
"""Then the door is cut."""

Expel = Callable[[Door, zmq.Frame], None]
"""Throws out of a door whoever sent this frame."""


@dataclass(frozen=True)
class Message:
    """Whom it is from, as the client calls itself, and its frames; none where there were too many."""

    identity: bytes
    frames: list[zmq.Frame]


class Frames:
    """The messages of one ROUTER door."""

    def __init__(self, door: Door, expel: Expel) -> None:
        self.door = door
        self._expel = expel
        self._read_away = 0  # frames of the message that is being read away; 0: none is
        self._openings = door.openings  # of the socket that it came by

    def read(self) -> Message:
        """The next message. Raises zmq.Again when there is none, or none in this turn."""
        socket = self.door.socket
        if socket.closed:
            raise zmq.Again
        # somebody else has cut the door: the rest went with its socket, and what comes now is of others
        if self._openings != self.door.openings:
            self._openings, self._read_away = self.door.openings, 0
        if self._read_away:
            self._read_on(socket)
        # ROUTER puts it in front; the frames behind it are there as well, as libzmq gives whole messages
        identity = socket.recv(zmq.NOBLOCK)
        frames: list[zmq.Frame] = []
        more = True
        while more:
            frame = socket.recv(zmq.NOBLOCK, copy=False)
            more = frame.more
            frames.append(frame)
            if len(frames) > MOST_FRAMES:
                # its rest would be taken for the messages of others
                self._read_away = 1 if more else 0
                self._expel(self.door, frame)
                return Message(identity, [])
        # whole messages only: what is unfinished stays on its sender's account
        self.door.traffic.heard(frame)
        return Message(identity, frames)

    def _read_on(self, socket: zmq.Socket[bytes]) -> None:
        """Read on in a message that is too long. Raises zmq.Again while it has no end."""
        for _ in range(FRAMES_PER_TURN):
            if not socket.recv(zmq.NOBLOCK, copy=False).more:
                self._read_away = 0
                return
        self._read_away += FRAMES_PER_TURN
        if self._read_away > MOST_READ_AWAY:
            self._read_away = 0
            self.door.cut()
        raise zmq.Again
