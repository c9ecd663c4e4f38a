"""Telling systemd how the daemon is: ready, status, alive, reloading, stopping (sd_notify(3)).

Without `NOTIFY_SOCKET` every call does nothing, so the daemon runs the same in a shell. The datagrams are
sent without waiting: a manager that does not read must not hold up the host."""

from __future__ import annotations

import contextlib
import os
import socket
import time

from rtctl.control.vocabulary import State
from rtctl.wire.fault_names import cause_bit, fault_entries

ENDING_US = 30_000_000  # above TimeoutStopSec= of the unit, which is to be the bound
"""Watchdog time while the rig is brought to rest, us."""


class Notifier:
    """The daemon's line to the service manager.

    Attributes
    ----------
    dropped
        Messages that could not be sent."""

    def __init__(self, address: str | None = None) -> None:
        """`address` is NOTIFY_SOCKET's value; None takes it from the environment."""
        self.dropped = 0
        self._status = ""
        self._head = -1
        self._socket: socket.socket | None = None
        given = os.environ.get("NOTIFY_SOCKET", "") if address is None else address
        # systemd writes @ for the zero byte that begins an abstract name (sd_notify(3))
        if given[:1] in ("/", "@"):
            self._address = "\0" + given[1:] if given[0] == "@" else given
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
            self._socket.setblocking(False)

    def ready(self) -> None:
        """The rig is up: clients are answered."""
        self._send("READY=1")

    def reloading(self) -> None:
        """The rig file is being read again; `ready` follows."""
        # without its time the manager takes a READY=1 of before for the end of this reload (sd_notify(3))
        self._send(f"RELOADING=1\nMONOTONIC_USEC={time.monotonic_ns() // 1000}")

    def stopping(self) -> None:
        """The end has begun: no ticks will feed the watchdog any more, TimeoutStopSec= bounds it from
        here."""
        # else WatchdogSec= (500 ms) would kill a host whose loop has ended
        self._send(f"STOPPING=1\nWATCHDOG_USEC={ENDING_US}")

    def ended(self, error: Exception) -> None:
        """What ended the daemon, as its last status: once systemd has given up starting it, the lines of the
        journal that `systemctl status` shows are all its own."""
        self._send(f"STATUS={' '.join((str(error), *getattr(error, 'faults', ())[:1]))}")

    def status(self, state: int, faults: int, fault_first: int) -> None:
        """One line for `systemctl status`, sent when it changes."""
        names = [entry["name"] for entry in fault_entries(faults)]
        text = State(state).name
        if cause := cause_bit(state, fault_first):
            text += f", first cause {fault_entries(cause)[0]['name']}"
        if names:
            text += f", present: {', '.join(names)}"
        # systemd keeps the last one: to send it with every batch would be 125 datagrams a second at 1 kHz
        if text != self._status:
            self._status = text
            self._send(f"STATUS={text}")

    def alive(self, head: int, *, excused: bool = False) -> None:
        """Feed the watchdog, if the loop has run ticks since the last call (`head` counts them) or is
        `excused` from it."""
        # the host alone being alive is not enough: a loop that stands must let the watchdog end both
        if head != self._head or excused:
            self._head = head
            self._send("WATCHDOG=1")

    def close(self) -> None:
        """Release the socket. Idempotent."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _send(self, text: str) -> None:
        if self._socket is None:
            return
        sent = False
        with contextlib.suppress(OSError):
            self._socket.sendto(text.encode(errors="backslashreplace"), self._address)
            sent = True
        self.dropped += not sent
