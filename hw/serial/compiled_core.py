"""Reading and writing of a serial board as compiled halves of a cycle: what `SerialCore.read` and `write` do
in ordinary cycles.

What is rare is left to them: a line that is hung up, a board that has started over, a line that is full."""

from __future__ import annotations

import numpy as np

from hw.entry_points import call_for_int
from hw.jit import compiled
from hw.serial.link import BACKLOGGED, DRAINED, MORE
from hw.serial_port import CHUNK
from hw.system_calls import FAILED, read_some, write_all

# 32 KB: bounded work, whatever floods the port
CHUNKS_PER_READ = 8
"""Most reads of one cycle. A loop that stood still for a second at 1 kHz is up to date after three cycles."""

BACKLOG = CHUNK // 2
"""From this many bytes on the loop has stood still, or the board floods it. The kernel keeps the oldest
4095 bytes and drops the newest, so the last packet of a backlog may be of any age."""

# 16 ms at 1 kHz: the law has cut for a stale sample after 3, so nothing is lost by being sure
RESTART_PACKETS = 16
"""So many samples in a row from before the last one: the board has started over, its position is void."""

PORT = np.dtype(
    [(name, "<i8") for name in ("fd", "receive_at", "send_at", "unsent_in_row", "full", "behind")]
)
"""Descriptor, -1 while closed; addresses of the board's `receive` and `send`; commands in a row that found no
room; whether the last one did and is not told yet; whether there was a backlog in the last cycle: the
kernel may have had more of it, which it hands on when there is room."""


@compiled
def read_cycle(
    port: np.ndarray, chunk: np.ndarray, meta: np.ndarray, receive_arguments: tuple[np.ndarray, ...]
) -> int:
    """Newest sample into the tick; 0, or 1 to leave it to `SerialCore.read`."""
    p = port[0]
    n = read_some(p.fd, chunk)
    # nothing was taken: Python reads again, gets the same error, and has words for it
    if n == FAILED:
        return 1
    meta[0], meta[1] = n, BACKLOGGED if p.behind else DRAINED
    p.behind = 0
    if n >= BACKLOG:
        # taken in and not shown: counters and order go on, no old sample is fresh
        meta[1] = MORE
        for _ in range(CHUNKS_PER_READ - 1):
            call_for_int(p.receive_at, receive_arguments)
            n = max(read_some(p.fd, chunk), 0)  # what is broken is broken in the next cycle too
            meta[0] = n
            if n < BACKLOG:
                break
        meta[1] = BACKLOGGED
        p.behind = 1
    return 1 if call_for_int(p.receive_at, receive_arguments) >= RESTART_PACKETS else 0


@compiled
def write_cycle(port: np.ndarray, packet: np.ndarray, send_arguments: tuple[np.ndarray, ...]) -> int:
    """Command out; 0, or 1 to leave the rest to `SerialCore.write`: with `full` set only what follows from
    that."""
    p = port[0]
    sent = write_all(p.fd, packet, call_for_int(p.send_at, send_arguments))
    if sent == 1:
        # in a row only: one full line in a while is a hiccup of USB
        p.unsent_in_row = 0
        return 0
    # -1 is no full line: Python writes again and has the words for it
    p.full = 1 if sent == 0 else 0
    return 1
