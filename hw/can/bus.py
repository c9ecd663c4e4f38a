"""A bus as the loop uses it: never blocking, newest frames first served, errors as health.

Three of them: `hw.can.raw` for SocketCAN, `hw.can.slcan` for serial adapters, `hw.can.adapter` for whatever
else python-can drives. Identifiers
carry SocketCAN's flags in their upper bits, so that one integer tells standard 0x10 from extended 0x10."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from hw.can.fields import Buffer
from hw.can.health import BusHealth
from hw.interface import BackendError

if TYPE_CHECKING:
    from can import BusABC

    from hw.can.batch import Batch

# linux/can.h: CAN_EFF_FLAG, CAN_RTR_FLAG, CAN_ERR_FLAG
EXTENDED = 0x8000_0000
REMOTE = 0x4000_0000
ERROR = 0x2000_0000

Handler = Callable[[Buffer, int, int], None]
"""`handler(buffer, offset, length)`: data of one frame; must not keep the buffer."""

# some 30 ms of a bus of 1 Mbit/s that is full of frames of 8 bytes: more than a cycle finds on time
DRAIN_LIMIT = 256
"""Most frames taken from the queue in one cycle. More waiting means a backlog: what was taken is old."""


# the law stops by itself for a stale sample; this only names the reason, which one lost frame is not
SILENT_TICKS = 10
"""Cycles without a complete sample after which the link counts as lost, besides each sample going stale."""

# the newest of each kind is taken from the queue; how long it lay there, no frame says
UNKNOWN_AGE_TICKS = 2
"""After more missed slots than this what waits in the queue may be old: it is dropped, not shown as fresh."""

LINE_READS, LINE_MAX, LINE_FULL = 16, 64, 4095
"""Most reads of one cycle from an adapter that writes lines; most bytes of a line; what the kernel's line
discipline holds: after a read of so many newer lines wait, or have been dropped."""


class Outgoing(Protocol):
    """A frame to be sent again and again: its data is `buffer[offset:offset + length]`, changed in place."""

    buffer: bytearray
    offset: int
    length: int


class Bus(Protocol):
    """An open bus."""

    health: BusHealth

    def subscribe(self, handlers: Mapping[int, Handler]) -> None:
        """Have `receive` call these, by identifier; all other frames are dropped."""

    def receive(self) -> bool:
        """Hand every waiting frame to its handler. False if some may be left. Raises LinkLost."""

    def outgoing(self, can_id: int, length: int) -> Any:  # noqa: ANN401 - each bus has its own Outgoing
        """Make a frame that can be sent; its data is all zero."""

    def send(self, frame: Any) -> bool:  # noqa: ANN401
        """Queue a frame; False (and counted) when the queue is full. Never blocks. Raises LinkLost."""

    def discard(self) -> None:
        """Throw away what has not left yet, where the interface can do so. Never raises."""

    def fresh_python_can(self) -> BusABC:
        """A python-can bus on the same wire, for set-up before the loop; `release` it afterwards."""

    def release(self, bus: BusABC) -> None:
        """Give back what `fresh_python_can` gave."""

    def close(self) -> None:
        """Release the interface. Idempotent, never raises."""


@runtime_checkable
class SteadyBus(Protocol):
    """A bus that is a descriptor: compiled code can read and write it (`hw.can.steady`)."""

    health: BusHealth
    lines: bool
    """Whether frames are lines of slcan, or what the kernel's CAN gives."""

    def fileno(self) -> int:
        """Descriptor."""

    def use(self, batch: Batch) -> None:
        """Take frames into this from now on."""

    def packed(self, frame: Any) -> bytes:  # noqa: ANN401
        """A frame as the kernel's CAN takes it."""

    def rest(self) -> bytes:
        """Bytes that were read and are no whole frame yet: compiled code's from now on."""

    def keep(self, begin: int, end: int, rest: bytes, error: int) -> None:
        """Compiled code gives back: frames `begin` to `end` of the batch, bytes behind them, an error; all
        still to be looked at."""


def wait_for(bus: Bus, done: Callable[[], bool], seconds: float) -> bool:
    """Serve the bus until `done()`, at most `seconds`. For set-up only: it sleeps."""
    # never the wall clock: a clock that is set while a drive is opened would make it wait for hours
    deadline = time.monotonic() + seconds
    while not done():
        bus.receive()
        if time.monotonic() > deadline:
            # looked at once more: what came in the last `receive` counts
            return done()
        # set-up only: a cycle has no sleep but the loop's own
        time.sleep(2e-4)
    return True


def twice_within(count: Callable[[], int], seconds: float) -> Callable[[], bool]:
    """What tells, asked again and again from a count of 0 on, whether two have come no more than `seconds`
    apart."""
    seen, at = 0, -math.inf

    def _close() -> bool:
        nonlocal seen, at
        new, seen, now = count() - seen, count(), time.monotonic()
        # two in one look came within its time; two looks far apart are two beats far apart
        close = new > 1 or (new == 1 and now - at <= seconds)
        at = now if new else at
        return close

    return _close


def require(condition: bool, text: str) -> None:
    """Raise BackendError with `text` unless `condition`."""
    if not condition:
        raise BackendError(text)
