"""What a board on a serial port is sent besides its commands: start, poll, and what switches a drive on and off."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from hw.interface import Options
from hw.serial.port import Port

ASK_AGAIN_S = 0.1
"""How often a board that is not heard yet is started and asked while it is opened."""


def knock(port: Port, options: Options) -> None:
    """Send the start packets, then a poll."""
    for packet in options["start"]:
        port.write(bytes(packet))
    if options["poll"]:
        port.write(bytes(options["poll"]))


def switched(
    tick: np.ndarray, packet: np.ndarray, send: Callable[[], int], command: Options, poll: bytes
) -> Callable[[], int]:
    """`send() -> bytes in packet` with `enter` and `idle` of the command in its place where due, and a poll behind it.

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
    """
    enter, idle, entered = bytes(command["enter"]), bytes(command["idle"]), False
    view: Any = memoryview  # numpy offers the buffer
    buffer, enabled = view(packet), view(tick["enabled"])

    def _put(data: bytes, at: int = 0) -> int:
        buffer[at : at + len(data)] = data
        return at + len(data)

    def _send() -> int:
        nonlocal entered
        first, entered = bool(enabled[0]) and not entered, bool(enabled[0])
        if idle and not entered:
            return _put(poll, _put(idle))
        if enter and first:
            return _put(poll, _put(enter))
        return _put(poll, send())

    return _send
