"""Tasks that end on a core, with name and run time: taskstats of the kernel, for a service that may
(CAP_NET_ADMIN).

The kernel says it once, when the task ends; /proc shows nothing of it any more. Source:
Documentation/accounting/taskstats.rst and linux/taskstats.h, linux/genetlink.h."""

from __future__ import annotations

import os
import select
import socket
import struct
from collections.abc import Iterator
from contextlib import suppress
from typing import NamedTuple

_GENERIC, _CONTROLLER, _REQUEST_ACK, _ERROR = 16, 16, 0x5, 2
"""Netlink protocol, the family that knows the others, flags NLM_F_REQUEST | NLM_F_ACK, and message
NLMSG_ERROR."""

_GET_FAMILY, _FAMILY_ID, _FAMILY_NAME = 3, 1, 2
_GET, _REGISTER, _DEREGISTER = 1, 3, 4
"""Command of taskstats, and its attributes with a list of cores."""

_OF_TASK, _STATS = 4, 3
"""Attributes of an answer: TASKSTATS_TYPE_AGGR_PID, and TASKSTATS_TYPE_STATS in it."""

_RUN = struct.Struct("<64xQQ32sB15xI")
"""What is read of struct taskstats: run time without stolen time, run time as the scheduler counts it (ns),
name, policy, number."""

_REAL_TIME = (os.SCHED_FIFO, os.SCHED_RR, 6)
"""Policies that run before ordinary tasks; 6: SCHED_DEADLINE."""

_PATIENCE_S = 1.0
"""The kernel answers within microseconds."""

MOST = 1000
"""Messages that are read at once."""


class Ended(NamedTuple):
    """A task that has ended: number, name, run time of its whole life in ns, and whether its policy was a
    real-time one."""

    task: str
    name: str
    ran_ns: int
    realtime: bool


class Exits:
    """Hears of every task that ends on one core. Raises OSError where that is not granted, or not in this
    kernel."""

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_NETLINK, socket.SOCK_RAW | socket.SOCK_CLOEXEC, _GENERIC)
        self._core: int | None = None
        try:
            # 0: the kernel gives a number of its own, so that two hosts of one machine do not collide
            self._socket.bind((0, 0))
            self._socket.setblocking(False)
            self._family = self._ask_family()
        except OSError:
            self._socket.close()
            raise

    def follow(self, core: int) -> None:
        """Hear of this core from now on. Raises OSError where that is refused."""
        if core == self._core:
            return
        if self._core is not None:
            # one core at a time: else ends on the core of before would go on coming
            self._send(self._family, _GET, _attribute(_DEREGISTER, f"{self._core}\0".encode()))
        self._core = None
        self._send(self._family, _GET, _attribute(_REGISTER, f"{core}\0".encode()))
        self._core = core

    def read(self) -> list[Ended]:
        """Tasks that have ended since this was last asked, `MOST` at once. Some are lost where more ended
        than the kernel keeps."""
        found: list[Ended] = []
        for _ in range(MOST):
            try:
                found += ended(self._socket.recv(65536))
            except BlockingIOError:
                break
            except OSError:  # the kernel says that it has lost some
                continue  # ENOBUFS: on with the rest, and the loop is bounded by MOST
        return found

    def close(self) -> None:
        """Hear no more."""
        self._socket.close()

    def _ask_family(self) -> int:
        # NUL-terminated, as the kernel compares it
        answer = self._send(_CONTROLLER, _GET_FAMILY, _attribute(_FAMILY_NAME, b"TASKSTATS\0"))
        # 20: nlmsghdr (16 bytes) and genlmsghdr (4)
        numbers = [body for kind, body in _attributes(answer[20:]) if kind == _FAMILY_ID]
        if not numbers:
            raise OSError("this kernel has no taskstats")
        return int(struct.unpack_from("<H", numbers[0])[0])

    def _send(self, family: int, command: int, attributes: bytes) -> bytes:
        """Ask, and return the answer that came before the kernel's word that all is well."""
        # version 1 of the interface, two reserved bytes
        body = struct.pack("<BBH", command, 1, 0) + attributes
        self._socket.send(struct.pack("<IHHII", 16 + len(body), family, _REQUEST_ACK, 0, 0) + body)
        answer = b""
        while True:
            if not select.select([self._socket], [], [], _PATIENCE_S)[0]:
                raise TimeoutError
            message = self._socket.recv(65536)
            (kind,) = struct.unpack_from("<H", message, 4)
            # the answer comes before the acknowledgement, and an acknowledgement is an error of number 0
            if kind != _ERROR:
                answer = message
                continue
            (number,) = struct.unpack_from("<i", message, 16)
            if number:
                raise OSError(-number, os.strerror(-number))
            return answer


def exits() -> Exits | None:
    """Someone who hears of them; None where that is not granted."""
    try:
        return Exits()
    except OSError:
        return None


def ended(message: bytes) -> Iterator[Ended]:
    """What a message of taskstats says of tasks that have ended; of anything else, nothing."""
    # a kernel that tells less than is looked for has a shorter message
    with suppress(struct.error):
        for kind, body in _attributes(message[20:]):
            for inner, stats in _attributes(body) if kind == _OF_TASK else ():
                if inner == _STATS:
                    real, virtual, name, policy, number = _RUN.unpack_from(stats)
                    text = name.partition(b"\0")[0].decode("utf-8", "replace")
                    yield Ended(str(number), text, virtual or real, policy in _REAL_TIME)


def _attribute(kind: int, body: bytes) -> bytes:
    # attributes are padded to 4 bytes, and their length does not count it (netlink(7))
    return struct.pack("<HH", 4 + len(body), kind) + body + b"\0" * (-len(body) % 4)


def _attributes(body: bytes) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at + 4 <= len(body):
        length, kind = struct.unpack_from("<HH", body, at)
        if length < 4:  # less would not go on, and this would never end
            return
        yield kind & 0x3FFF, body[at + 4 : at + length]  # NLA_TYPE_MASK: the two highest bits are flags
        at += (length + 3) & ~3
