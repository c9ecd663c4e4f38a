"""The endpoint for targets: single frames, no replies, of each client only the newest.

A renderer that is quicker than the loop costs the loop nothing: all that waits is read here, and at most one
target a turn is handed on."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

import zmq

from rtctl.wire.authenticator import Caller
from rtctl.wire.long_messages import Frames
from rtctl.wire.sockets import user_id

FRAMES_PER_CALL = 256
"""Most messages read in one turn from one door."""

# few: only the newest counts, and what waits is old
OPTIONS = {zmq.RCVHWM: 8, zmq.SNDHWM: 1, zmq.ROUTER_HANDOVER: 0}


@dataclass
class TargetCounters:
    """Targets received; superseded by newer ones before they were looked at; handed to the loop; refused."""

    received: int = 0
    superseded: int = 0
    accepted: int = 0
    refused: int = 0


class TargetInbox:
    """Reads what waits and keeps the newest frame of each connection.

    Parameters
    ----------
    doors
        ROUTER sockets, ipc and TCP.
    caller
        Who a user id is; None: nobody.
    carry_out
        Judges one frame and hands it on; True when it was accepted.

    Attributes
    ----------
    read_ns : int
        CLOCK_MONOTONIC at the beginning of the last turn."""

    def __init__(
        self,
        doors: list[Frames],
        caller: Callable[[str], Caller | None],
        carry_out: Callable[[bytes, Caller], bool],
    ) -> None:
        self.doors = doors
        self.counters = TargetCounters()
        self.read_ns = 0
        self._caller = caller
        self._carry_out = carry_out

    def serve(self) -> bool:
        """Hand on the newest targets. True when more messages wait than one turn reads."""
        # by door and identity: two doors may give two clients the same identity
        newest: dict[tuple[int, bytes], tuple[str, bytes]] = {}
        more = False
        # before reading: what waited here counts as latency
        self.read_ns = time.monotonic_ns()
        for number, door in enumerate(self.doors):
            more |= self._read(number, door, newest)
        for sender, payload in newest.values():
            caller = self._caller(sender)
            if caller is not None and self._carry_out(payload, caller):
                self.counters.accepted += 1
            else:
                self.counters.refused += 1
        return more

    def counts(self) -> dict[str, int]:
        """The counters by name."""
        return asdict(self.counters)

    def _read(self, number: int, frames: Frames, newest: dict[tuple[int, bytes], tuple[str, bytes]]) -> bool:
        counters = self.counters
        for _ in range(FRAMES_PER_CALL):
            try:
                message = frames.read()
            except zmq.Again:
                return False
            counters.received += 1
            if len(message.frames) != 1:
                counters.refused += 1
                continue
            (frame,) = message.frames
            sender = number, message.identity
            counters.superseded += sender in newest
            newest[sender] = (user_id(frame), frame.bytes)
        return True
