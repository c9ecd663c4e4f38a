"""What each connection of a door has sent since its last whole message, as the kernel counts it.

Notes
-----
libzmq's bounds are for whole messages. One that is not finished waits in memory at 64 bytes a frame,
invisible to `recv` and to every high-water mark (measured: 2.5 GB), and a publisher's socket takes in all
that subscribers send. So the bytes are taken from TCP_INFO, less those the kernel still holds. A Unix socket
has no such count: there the memory of the process is looked at (`rtctl.wire.intruders`)."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import socket as network
import struct
import termios
from collections.abc import Iterable

import zmq

UNFINISHED_BYTES = 256 * 1024
"""A well-behaved client has at most 8 requests of 4 KiB in the queue, and what libzmq is decoding."""

LISTENER_BYTES = 64 * 1024
LISTENER_BYTES_S = 16 * 1024
"""What a subscriber may send at once and for ever: subscriptions and signs of life."""

_TCP_INFO = struct.Struct("=120xQQ")  # linux/tcp.h: tcpi_bytes_acked, tcpi_bytes_received


class Traffic:
    """Accounts of the connections of one TCP door, by descriptor.

    Parameters
    ----------
    by_tcp
        Otherwise nothing is counted.
    listeners
        The clients only listen: a publisher's door."""

    def __init__(self, *, by_tcp: bool, listeners: bool) -> None:
        self._by_tcp, self._listeners = by_tcp, listeners
        self._mark: dict[int, float] = {}  # bytes that are accounted for
        self._heard: set[int] = set()
        self._looked_s = 0.0
        self.users: dict[int, str] = {}

    def heard(self, frame: zmq.Frame) -> None:
        """A whole message has come, and this frame is of it."""
        if self._by_tcp:
            with contextlib.suppress(zmq.ZMQError):
                descriptor = int(frame.get("__fd"))
                self._heard.add(descriptor)
                self.users[descriptor] = str(frame.get("User-Id"))

    def excessive(self, descriptors: Iterable[int], now_s: float) -> list[int]:
        """Those of these connections that have sent more than any client needs to."""
        if not self._by_tcp:
            return []
        allowed = LISTENER_BYTES if self._listeners else UNFINISHED_BYTES
        # a listener sends signs of life for ever, and never a whole message that would settle them
        refill = LISTENER_BYTES_S * (now_s - self._looked_s) if self._listeners else 0.0
        # after the refill was reckoned: it is of the time since
        self._looked_s = now_s
        marks: dict[int, float] = {}
        found = []
        for descriptor in descriptors:
            taken = bytes_taken(descriptor)
            # it goes from the accounts, too: its number may be another's next
            if taken is None:
                continue
            # a number that is smaller is another connection's, of the same descriptor
            mark = min(self._mark.get(descriptor, 0.0), taken)
            marks[descriptor] = taken if descriptor in self._heard else min(mark + refill, taken)
            if taken - marks[descriptor] > allowed:
                found.append(descriptor)
        self._mark = marks
        self._heard.clear()
        self.users = {known: user for known, user in self.users.items() if known in marks}
        return found


def bytes_of(descriptor: int) -> tuple[int, int]:
    """Bytes that the other end of a TCP connection has acknowledged, and those that came from it. Raises
    OSError."""
    # an object around libzmq's own descriptor, for one question: `detach` leaves it open
    one = network.socket(network.AF_INET, network.SOCK_STREAM, 0, fileno=descriptor)
    try:
        acknowledged, received = _TCP_INFO.unpack_from(
            one.getsockopt(network.IPPROTO_TCP, network.TCP_INFO, _TCP_INFO.size)
        )
    except struct.error as error:  # a kernel that tells less
        raise OSError(errno.ENOTSUP, str(error)) from error
    finally:
        one.detach()
    return int(acknowledged), int(received)


def bytes_taken(descriptor: int) -> int | None:
    """Bytes that this process has read from a TCP connection; None where it has gone."""
    with contextlib.suppress(OSError):
        # what waits in the kernel takes no memory of this process yet
        return bytes_of(descriptor)[1] - unread(descriptor)
    return None


def unread(descriptor: int) -> int:
    """Bytes of a connection that wait in the kernel. Raises OSError."""
    (waiting,) = struct.unpack("=i", fcntl.ioctl(descriptor, termios.FIONREAD, bytes(4)))
    return int(waiting)


def local_peer(descriptor: int) -> str | None:
    """User id of the process behind a Unix socket, as the authenticator gives it; None where it has gone."""
    try:
        one = network.socket(network.AF_UNIX, network.SOCK_STREAM, 0, fileno=descriptor)
    except OSError:
        return None
    try:
        # struct ucred
        pid, uid, gid = struct.unpack("=iII", one.getsockopt(network.SOL_SOCKET, network.SO_PEERCRED, 12))
    except (OSError, struct.error):
        return None
    finally:
        one.detach()
    return f"ipc:{uid}:{gid}:{pid}"


def hang_up(descriptor: int) -> None:
    """Cut this connection: libzmq sees its end, and frees what it held. Nothing where it has gone."""
    with contextlib.suppress(OSError):
        one = network.socket(network.AF_UNIX, network.SOCK_STREAM, 0, fileno=descriptor)
        try:
            one.shutdown(network.SHUT_RDWR)
        finally:
            one.detach()
