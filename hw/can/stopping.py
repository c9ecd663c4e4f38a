"""What stops the devices of a bus, also one that nobody here has open.

A socket of SocketCAN is opened within a moment, beside those of others: a host whose loop has died, or
stands still, sends the same frames as that loop would. An adapter behind a serial line has one holder."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from typing import Any

from hw.can.bus import Bus
from hw.can.raw import RawBus, RawFrame
from hw.interface import BackendError, LinkLost, Options

# ten frames, the usual queue of an interface, are gone after 1.4 ms at 1 Mbit/s and 14 ms at 100 kbit/s
STOP_S = 0.02
"""How long a stop keeps trying when the queue of the interface is full."""


def tell(bus: Bus, send: Callable[[], object]) -> None:
    """Have `send` put the frames of a stop on this bus until all are the interface's. Never raises."""
    deadline = time.monotonic() + STOP_S
    while True:
        refused = bus.health.counts["tx_refused"]
        try:
            send()
        except LinkLost:
            return
        # nothing more was refused: every stop frame is the interface's
        if bus.health.counts["tx_refused"] == refused or time.monotonic() > deadline:
            return
        bus.discard()
        time.sleep(5e-4)


class NotedBus:
    """Takes frames as a bus of SocketCAN does, and keeps them."""

    def __init__(self, *, fd: bool) -> None:
        self._fd = fd
        self.frames: list[RawFrame] = []

    def outgoing(self, can_id: int, length: int) -> RawFrame:
        """See Bus."""
        return RawFrame(can_id, length, fd=self._fd)

    def send(self, frame: RawFrame) -> bool:
        """Keep the frame as it is now: the next one may be made in its place."""
        noted = self.outgoing(0, frame.length)
        noted.buffer[:] = frame.buffer
        self.frames.append(noted)
        return True


def is_quick(bus: Options) -> bool:
    """Whether such a bus (a dumped `BusOptions`) can be opened within a moment, whoever has it open."""
    return bool(bus["interface"] == "socketcan" and bus["raw"])


def noted(bus: Options, make: Callable[[Any], None], stop: Callable[[Any], None]) -> list[RawFrame]:
    """The frames that `make` makes and `stop` puts on a bus, for `tell_afresh`; none where that cannot be
    quick."""
    kept = NotedBus(fd=bus["fd"])
    if is_quick(bus):
        make(kept)
        stop(kept)
    return kept.frames


def tell_afresh(bus: Options, frames: list[RawFrame]) -> None:
    """As `tell`, on a bus of its own. Never raises."""
    if frames:
        # no such interface any more: nothing goes to its drives, either
        with contextlib.suppress(BackendError):
            opened = RawBus(bus["channel"], fd=bus["fd"])
            tell(opened, lambda: [opened.send(frame) for frame in frames])
            opened.close()
