"""Cut a byte stream into packets: bytes up to a zero, at most one packet long. Used by both ends."""

from __future__ import annotations

from functools import cache

import numpy as np

from hw.jit import compiled
from hw.serial.framing import BODY_MAX

_ROOM = BODY_MAX + 2  # one byte more than a packet may have: by it one that is too long is told


@cache
def deframer_dtype() -> np.dtype[np.void]:
    """State between chunks. Fresh ones are zeros: what comes before the first delimiter is ignored."""
    return np.dtype(
        [
            ("synced", "<i8"),  # a delimiter has been seen
            ("n", "<i8"),  # bytes pending; more than BODY_MAX + 1: too long to be a packet
            ("pending", "u1", (_ROOM,)),
        ]
    )


@compiled
def next_packet(deframer: np.ndarray, chunk: np.ndarray, at: int, stop: int) -> tuple[int, int]:
    """Take bytes `chunk[at:stop]` up to the end of the next packet.

    Returns
    -------
    at : int
        Where to go on.
    n : int
        Length of the packet in `deframer[0].pending`, 0 when the chunk ended before one did. A length over
        `BODY_MAX + 1` says that the bytes were too many for a packet (`framing.unseal` refuses it)."""
    d = deframer[0]
    while at < stop:
        byte = chunk[at]
        at += 1
        # zero stands nowhere but between packets: that is what COBS is for
        if byte != 0:
            # what is too long is not kept, and not forgotten either: its end must be told as damage
            if d.n < _ROOM:
                d.pending[d.n] = byte
                d.n += 1
        # the rest of a packet that began before the port was opened: no damage
        elif d.synced == 0:
            d.synced = 1
            d.n = 0
        # two zeros in a row are the end of one packet and the begin of the next
        elif d.n > 0:
            n = d.n
            d.n = 0
            return at, n
    return at, 0
