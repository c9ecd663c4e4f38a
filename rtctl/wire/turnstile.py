"""Lets connections into a listening socket of libzmq a few at a time, where this process may open few files.

Notes
-----
libzmq 4.3.5 takes every connection that waits, as fast as it can, and ends the process when a Unix socket
finds no descriptor left (`ipc_listener.cpp`, assertion on EMFILE; its TCP sockets bear it). It has no limit
of connections, and whoever looks after them in Python comes too late: four processes open two thousand within
a second. So the kernel stops it: in the epoll set of libzmq's I/O thread the listening socket gets
EPOLLONESHOT, with which one connection is taken and the next one waits until it is armed again. What libzmq
has put there with it (a pointer) the kernel tells in /proc/self/fdinfo, and it is put back as it was."""

from __future__ import annotations

import contextlib
import ctypes
import os
import re
import socket
from pathlib import Path

_EPOLLIN, _EPOLLONESHOT, _MOD = 0x001, 1 << 30, 3
_SELF = Path("/proc/self")
_ENTRY = re.compile(r"tfd:\s*(\d+) events:\s*([0-9a-f]+) data:\s*([0-9a-f]+)")


class _Event(ctypes.Structure):
    """The kernel's struct epoll_event, which is packed on x86-64 only."""

    _pack_ = 1 if os.uname().machine == "x86_64" else 8
    _fields_ = (("events", ctypes.c_uint32), ("data", ctypes.c_uint64))


TRIES = 400
"""Looks until libzmq must have put a socket into its set. After that it has none that the kernel tells of:
all come in."""

_libc = ctypes.CDLL(None, use_errno=True)
_libc.epoll_ctl.argtypes = (ctypes.c_int, ctypes.c_int, ctypes.c_int, ctypes.POINTER(_Event))


class Turnstile:
    """One listening socket of this process.

    Parameters
    ----------
    address
        Where it listens, as libzmq has it: `ipc://PATH` or `tcp://HOST:PORT`."""

    def __init__(self, address: str) -> None:
        self._address = address
        self._places: list[tuple[int, int, _Event]] = []
        self._tries = TRIES

    @property
    def is_set(self) -> bool:
        """Whether it is in place: libzmq puts a new socket into its set a little after it was bound."""
        return bool(self._places)

    def let_in(self, count: int) -> None:
        """Let at most `count` more connections in, 1 or more; they have to be waiting now. Before it is in
        place, all are."""
        # looked for again until it is found: a socket that was just bound is not in the set yet
        if not self._places and self._tries:
            self._tries -= 1
            with contextlib.suppress(OSError):
                self._places = [place for fd in _listening(self._address) for place in _watching(fd)]
        for _ in range(count):
            # armed anew: with EPOLLONESHOT the kernel tells of one connection, then of none
            for epoll, fd, event in self._places:
                # an error is none of ours: the socket was closed meanwhile, and nobody waits there
                _libc.epoll_ctl(epoll, _MOD, fd, ctypes.byref(event))


def _listening(address: str) -> list[int]:
    """Descriptors of this process that listen at an address."""
    scheme, _, where = address.partition("://")
    host, _, port = where.rpartition(":")
    wanted: object = where if scheme == "ipc" else (host, int(port))
    found = []
    # by its address, among all sockets of this process
    for fd in _descriptors("socket:"):
        # of a copy: the object closes what it is given
        with contextlib.suppress(OSError), socket.socket(fileno=os.dup(fd)) as one:
            if one.getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN) and one.getsockname() == wanted:
                found.append(fd)
    return found


def _watching(fd: int) -> list[tuple[int, int, _Event]]:
    """Epoll sets in which connections to a descriptor are waited for, with what stands there."""
    found = []
    for epoll in _descriptors("anon_inode:[eventpoll]"):
        for number, events, data in _ENTRY.findall((_SELF / "fdinfo" / str(epoll)).read_text()):
            # only where connections are waited for: libzmq has other sets with other numbers
            if int(number) == fd and int(events, 16) & _EPOLLIN:
                found.append((epoll, fd, _Event(_EPOLLIN | _EPOLLONESHOT, int(data, 16))))
    return found


def _descriptors(kind: str) -> list[int]:
    """Descriptors of this process of one kind, as the kernel names it."""
    found = []
    for entry in (_SELF / "fd").iterdir():
        with contextlib.suppress(OSError):  # the one that this list is read with has gone by now
            if entry.readlink().name.startswith(kind):
                found.append(int(entry.name))
    return found
