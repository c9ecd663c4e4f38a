"""What a board on a serial port is sent besides its commands: start, poll, and what switches a drive on and
off."""

from __future__ import annotations

import select
import time
from collections.abc import Callable, Sequence

import numpy as np

from hw.interface import Options
from hw.serial_port import Port

ASK_AGAIN_S = 0.1
"""How often a board that is not heard yet is started and asked while it is opened."""


def await_first(
    port: Port,
    chunk: np.ndarray,
    seconds: float,
    questions: Sequence[bytes],
    take_in: Callable[[int], None],
    heard: Callable[[], bool],
) -> int | None:
    """Send `questions` every `ASK_AGAIN_S` and take in what comes, until a sample is `heard` (None) or
    `seconds` are over.

    Returns
    -------
    int or None
        Bytes that came, when none of them made a sample. Raises LinkLost."""
    # -1: the first question goes out at once, whatever the clock shows
    end, asked, seen = time.monotonic() + seconds, -1.0, 0
    views = [chunk.data]
    while not heard():
        now = time.monotonic()
        # looked at before a question is sent: none goes out that nobody waits for
        if now >= end:
            return seen
        # again and again: a board that boots does not hear the first ones
        if now - asked > ASK_AGAIN_S:
            asked = now
            for packet in questions:
                port.write(packet)
        # no longer than to the next question
        select.select([port.fd], [], [], min(end - now, ASK_AGAIN_S))
        n = port.read_into(views)
        seen += n
        take_in(n)
    return None


def switched(
    tick: np.ndarray,
    packet: np.ndarray,
    send: Callable[[], int],
    command: Options,
    poll: bytes,
    unsent: np.ndarray,
    end: bytes = b"",
) -> Callable[[], int]:
    """`send() -> bytes in packet` with `enter` and `idle` of the command in its place where due, and a poll
    behind it.

    Parameters
    ----------
    tick
        One-row tick array; `enabled` tells whether the rig is armed.
    packet
        uint8, room for a command and a poll.
    send
        Writes a command to the beginning of `packet`; returns its length.
    command
        Has `enter` and `idle`, possibly empty.
    poll
        Bytes that ask for the next sample, possibly none.
    unsent
        Shape (1,): packets in a row that the line had no room for, up to the one before.
    end
        Ends what a line without room took in part; put before `enter` and `idle` then."""
    enter, idle, entered, entering = bytes(command["enter"]), bytes(command["idle"]), False, False
    buffer, enabled = packet.data, tick["enabled"].data

    def _put(data: bytes, at: int = 0) -> int:
        buffer[at : at + len(data)] = data
        return at + len(data)

    def _send() -> int:
        nonlocal entered, entering
        before, entered, refused = entered, bool(enabled[0]), bool(unsent[0])
        # again where the line had no room: a drive that was never switched on would ignore every command
        entering = bool(enter) and entered and (not before or (entering and refused))
        cut = end if refused else b""
        # a command of zeros would do, but a drive that is switched by bytes may need to be told off by bytes
        if idle and not entered:
            if before:
                send()  # not sent: what it keeps of the board is to know that the host has disabled it
            return _put(poll, _put(cut + idle))
        if entering:
            # in place of the first command, which a drive that is not on yet would drop
            return _put(poll, _put(cut + enter))
        # one write for both: the board hears its question right behind the command that it answers
        return _put(poll, send())

    return _send
