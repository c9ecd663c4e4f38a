"""Sockets of the host: bound by ipc or TCP, bounded in every respect, entered by leave of the authenticator.

Notes
-----
A TCP address is held by a listening socket of our own, of which libzmq gets a copy. So all connections of a
door can be cut by opening it anew, without losing the address for a moment: libzmq knows no other way to
close a connection that is up.

ZMQ_CONFLATE is used on no socket here: a client that sends one frame of a message of two and waits makes
libzmq 4.3.5 abort the process (assertion in fq.cpp)."""

from __future__ import annotations

import os
import resource
import socket as network
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass

import zmq

from rtctl.errors import BusyError, ConfigError
from rtctl.wire.authenticator import Authenticator, Entry
from rtctl.wire.connections import Connections
from rtctl.wire.endpoints import private_umask
from rtctl.wire.private_folder import REMEDY
from rtctl.wire.protocol import CONNECTIONS, HANDSHAKE_MS, HEARTBEAT_MS, MAX_REQUEST_BYTES
from rtctl.wire.spare_descriptors import Reserve
from rtctl.wire.stalled import Stalled
from rtctl.wire.traffic import Traffic
from rtctl.wire.turnstile import Turnstile
from rtctl.wire.unix_group import give

Options = Mapping[int, int] | Mapping[zmq.SocketOption, int]
"""Integer options of a socket."""

BACKLOG = 128
"""Connections the kernel keeps while the host is busy."""


@dataclass(frozen=True)
class Binding:
    """Where a door is. `listener` holds the address of TCP; `server_secret` is the daemon's CURVE key;
    `group` may enter by ipc."""

    address: str
    entry: Entry
    listener: network.socket | None = None
    server_secret: bytes = b""
    group: int | None = None


def tcp_binding(host: str, port: int, entry: Entry, server_secret: bytes = b"") -> Binding:
    """Take a TCP address of this machine.

    Raises
    ------
    BusyError
        It is in use, or is none of this machine."""
    listener = network.socket(network.AF_INET, network.SOCK_STREAM)
    try:
        # else the last connections of a daemon that ended hold the address for a minute (TIME_WAIT)
        listener.setsockopt(network.SOL_SOCKET, network.SO_REUSEADDR, 1)
        listener.bind((host, port))
        listener.listen(BACKLOG)
    except OSError as error:
        listener.close()
        key = "[telemetry] plotjuggler_port" if entry == "viewer" else "[gateway] bind or port"
        raise BusyError(f"cannot listen on {host}:{port}: {error.strerror}; choose another {key}") from error
    # libzmq polls it: a connection that is gone before it is taken would hold up its I/O thread
    listener.setblocking(False)
    return Binding(f"tcp://{host}:{listener.getsockname()[1]}", entry, listener, server_secret)


def allow_descriptors(wanted: int) -> int:
    """Have this process open up to `wanted` files and sockets, as far as it may allow itself. Returns how
    many it may."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    # more than the hard limit would be refused as a whole, and the soft one stay as low as it was
    most = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
    # never lower: who was given more may need it for something else
    if soft != resource.RLIM_INFINITY and soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
        return most
    # the hard limit does not let it be more
    return wanted if soft == resource.RLIM_INFINITY else soft


def user_id(frame: zmq.Frame) -> str:
    """Who sent this frame, as the authenticator named them; empty: nobody it let in."""
    try:
        # of each frame: what the authenticator said when its connection was made
        return str(frame.get("User-Id"))
    except zmq.ZMQError:
        return ""


def descriptor_of(frame: zmq.Frame) -> int | None:
    """The connection over which this frame came; None where libzmq does not tell."""
    try:
        return int(frame.get("__fd"))
    except zmq.ZMQError:
        return None


class Door:
    """One bound socket, and who is connected to it.

    Parameters
    ----------
    context, authenticator
        Of the host.
    name
        Distinguishes the doors of one way of entry.
    binding
        Where it is.
    kind
        Type of the ZeroMQ socket.
    options
        More integer options of the socket.
    reserve
        Given up for a moment when the door is opened anew.
    places
        Clients that may be connected.
    linger_ms
        What is unsent at the end is given this long.
    one_by_one
        Connections are let in a few at every look (`let_in`): this process may open few files.

    Attributes
    ----------
    traffic : Traffic
        What its connections have sent.
    stalled : Stalled
        Which of them take nothing of what is sent to them.
    openings : int
        How often it was opened: its socket is another one each time."""

    def __init__(
        self,
        context: zmq.Context[zmq.Socket[bytes]],
        authenticator: Authenticator,
        name: str,
        binding: Binding,
        kind: int,
        options: Options,
        reserve: Reserve,
        *,
        places: int = CONNECTIONS,
        linger_ms: int = 0,
        one_by_one: bool = False,
    ) -> None:
        self._one_by_one = one_by_one
        self._turnstile: Turnstile | None = None
        self._reserve, self._places, self._linger_ms = reserve, places, linger_ms
        self.openings = 0
        self._context = context
        self._authenticator = authenticator
        self._name = name
        self._binding = binding
        self._kind = kind
        # kept: a door that is opened anew is to be the same one
        self._options = {int(option): value for option, value in options.items()}
        try:
            self._open()
        except zmq.ZMQError as error:  # no room for the file of a Unix socket, no descriptors
            raise ConfigError(f"cannot listen: {error}; {REMEDY}") from error

    @property
    def address(self) -> str:
        """Where it is."""
        return self._binding.address

    @property
    def by_key(self) -> bool:
        """Whether keys decide who comes in."""
        return self._binding.entry == "curve"

    @property
    def by_tcp(self) -> bool:
        """Whether clients come by TCP."""
        return self._binding.listener is not None

    @property
    def for_viewers(self) -> bool:
        """Whether anybody of this machine may listen."""
        return self._binding.entry == "viewer"

    @property
    def is_open(self) -> bool:
        """False after a cut for which there were no descriptors left, until `reopen`."""
        return not self.socket.closed

    def let_in(self, count: int) -> None:
        """Let so many of those in who wait, if it is a door that lets in one by one; else all come in by
        themselves."""
        if self._turnstile is not None and count > 0:
            self._turnstile.let_in(count)

    def cut(self) -> None:
        """Close every connection. Clients that may still come in connect again by themselves."""
        if self.is_open:
            self._shut(0)  # what is unsent goes with its connections
        self.reopen()

    def reopen(self) -> None:
        """Open a door that a cut left shut; it stays so while that cannot be done."""
        # no descriptors, or the last socket still holds the address
        with self._reserve.lent(), suppress(OSError, zmq.ZMQError):
            self._open()

    def close(self) -> None:
        """Close the socket and give the address back. Idempotent."""
        if self.is_open:
            self._shut(self._linger_ms)  # the last words of a daemon may still go out
        if self._binding.listener is not None:
            self._binding.listener.close()

    def _shut(self, linger_ms: int) -> None:
        self._turnstile = None  # what it knows of libzmq's socket is void from now on
        self.connections.close()
        self.socket.close(linger=linger_ms)

    def _open(self) -> None:
        binding = self._binding
        self.openings += 1
        by_tcp, listeners = binding.listener is not None, self._kind in (zmq.PUB, zmq.XPUB)
        self.traffic, self.stalled = Traffic(by_tcp=by_tcp, listeners=listeners), Stalled(by_tcp=by_tcp)
        # of a door that cannot be opened nothing stays: it is tried again and again
        with ExitStack() as undo:
            self.socket = undo.enter_context(self._context.socket(self._kind))
            # what nobody has taken must not hold up the end of a daemon
            self.socket.setsockopt(zmq.LINGER, 0)
            # of each frame; how many a message has, `long_messages` bounds
            self.socket.setsockopt(zmq.MAXMSGSIZE, MAX_REQUEST_BYTES)
            self.socket.setsockopt(zmq.HANDSHAKE_IVL, HANDSHAKE_MS)
            for option, value in self._options.items():
                self.socket.setsockopt(option, value)
            # before `bind`: a connection that is not counted from the first moment never is
            self.connections = Connections(self._context, self.socket, places=self._places)
            undo.callback(self.connections.close)
            self.domain = self._authenticator.guard(self.socket, self._name, binding.entry, self.connections)
            if binding.entry == "curve":  # with an empty secret this fails, as it must
                self.socket.setsockopt(zmq.HEARTBEAT_IVL, HEARTBEAT_MS)
                self.socket.setsockopt(zmq.HEARTBEAT_TIMEOUT, 3 * HEARTBEAT_MS)
                self.socket.setsockopt(zmq.CURVE_SERVER, 1)
                self.socket.setsockopt(zmq.CURVE_SECRETKEY, binding.server_secret)
            self._bind(binding)
            if self._one_by_one:
                self._turnstile = Turnstile(binding.address)
            if binding.group is not None:
                give(binding.address.removeprefix("ipc://"), binding.group, 0o660)
            undo.pop_all()

    def _bind(self, binding: Binding) -> None:
        own = -1 if binding.listener is None else os.dup(binding.listener.fileno())
        try:
            if own >= 0:
                self.socket.setsockopt(zmq.USE_FD, own)
            # the file of a Unix socket is for this user alone, until a group is given it
            with private_umask():
                self.socket.bind(binding.address)
        except zmq.ZMQError:
            if own >= 0:
                os.close(own)  # only that of a socket that is bound is libzmq's
            raise
