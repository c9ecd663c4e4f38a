"""What one process alone may drive on a wire that many can open: two that command one drive would take turns
at it.

A claim is the name of an abstract Unix socket: the kernel gives a name to one process at a time, whoever its
user is, and takes it back however that process ends. Such names are those of a network namespace, as CAN
interfaces are."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import socket
import struct
import time
from collections.abc import Iterable, Sequence
from pathlib import Path

from hw.device_holders import command_of
from hw.interface import BackendError

PATIENCE_S = 1.0
"""Longest wait for a claim that another process holds: one that ends gives its claims back some moments after
its lock."""

_BACKLOG = 4096  # nobody accepts: each who asks keeps a place; the kernel's own most (somaxconn) since 5.4
_CREDENTIALS = struct.Struct("3i")  # struct ucred: pid, uid, gid


def claims_on(interface: str, channel: str, identifiers: Iterable[int]) -> tuple[str, ...]:
    """Names of the claims on identifiers of a wire, in order; a device file counts as what its links lead to.

    Those of a `virtual` bus are none: no other process is on it."""
    if interface == "virtual":
        return ()
    # /dev/serial/by-id/X and /dev/ttyACM0 are one wire
    where = os.path.realpath(channel) if channel.startswith("/") else channel
    return tuple(f"{interface} {where} 0x{one & 0x1FFF_FFFF:x}{_kind(one)}" for one in sorted(identifiers))


def _kind(identifier: int) -> str:
    return " extended" if identifier & 0x8000_0000 else ""


class Claims:
    """The claims of this process, until `release` or its end."""

    def __init__(self) -> None:
        self._held: dict[str, socket.socket] = {}

    def take(self, label: str, names: Sequence[str], patience_s: float = PATIENCE_S) -> None:
        """Take all of `names` for the device `label`, or none. What is held already stays.

        Raises
        ------
        BackendError
            Another process has one of them; the text names that process."""
        end = time.monotonic() + patience_s
        while refused := self._try(names):
            # anything else does not pass by waiting
            if refused[1].errno != errno.EADDRINUSE:
                raise BackendError(f"{label}: cannot claim {refused[0]}: {refused[1].strerror}")
            if time.monotonic() > end:
                raise BackendError(
                    f"{label}: {refused[0]} is driven by {_holder(refused[0])} already; end that one first, "
                    "or give this device another channel or node"
                )
            # a process that was killed gives its names back when the kernel has closed its files
            time.sleep(0.02)

    def _try(self, names: Sequence[str]) -> tuple[str, OSError] | None:
        """The name that was refused, and why; None when all are held."""
        made: dict[str, socket.socket] = {}
        for name in names:
            if name in self._held:
                continue
            try:
                made[name] = _listen(name)
            except OSError as error:
                for one in made.values():
                    one.close()
                return name, error
        self._held |= made
        return None

    def release(self) -> None:
        """Give all of them back. Idempotent."""
        for one in self._held.values():
            one.close()
        self._held.clear()


def _address(name: str) -> bytes:
    """A name of any length, as one that fits."""
    # the zero makes it abstract; a name has 107 bytes more at most (unix(7)), hence the digest
    return b"\0rtctl/drives/" + hashlib.sha256(os.fsencode(name)).hexdigest().encode()


def _listen(name: str) -> socket.socket:
    made = socket.socket(socket.AF_UNIX)
    try:
        made.bind(_address(name))
        # bound alone it could not be connected to, and who holds it would stay unknown
        made.listen(_BACKLOG)  # so that whoever connects is told who we are
    except OSError:
        made.close()
        raise
    return made


def _holder(name: str) -> str:
    """Who holds a claim, for a person."""
    # the kernel tells who listens: the holder need not answer, and could not lie
    with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX) as asking:
        asking.setblocking(False)  # where every place is taken it would wait for one
        asking.connect(_address(name))
        said = asking.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
        pid, uid, _ = _CREDENTIALS.unpack(said)
        if pid:
            return f"process {pid} of user {uid} ({command_of(Path('/'), pid)})"
    return "another process"
