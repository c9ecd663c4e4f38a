"""Lets clients in: the ZAP handler of the host, asked by libzmq for every connection (ZeroMQ RFC 27).

Every endpoint enforces its ZAP domain: a connection is refused unless this handler, served by the host's own
poller, says otherwise. Over TCP a client shows a CURVE key; its user id is that key. Over ipc the folder's
permissions have decided already, and the user id names the process as the kernel knows it."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import zmq
from zmq.utils import z85

from rtctl.errors import BusyError
from rtctl.wire.connections import Connections
from rtctl.wire.keys import Key

ZAP_ADDRESS = "inproc://zeromq.zap.01"
# a crowd must not hold up the turn in which a STOP is read
ANSWERS_PER_CALL = 64

BAN_S = 60.0
"""How long somebody who was expelled stays out."""

VIEWER = "viewer:"
"""User id of every viewer: nothing tells one from another before it is connected."""

PAUSE_S = 1.0
"""How long no viewer comes in after one was expelled. Those that are connected stay, the others try again by
themselves."""

KNOWN_S = 5.0
"""How long somebody who was let in is told from strangers, until the age of the connection tells."""

Entry = Literal["ipc", "curve", "viewer"]
"""Who may come in: processes of this machine by ipc; clients with a key; viewers of this machine by TCP."""

Notice = Callable[[str, str], None]
"""Takes the kind of a notice and its text."""


@dataclass(frozen=True)
class Caller:
    """Who sent a message: user id as authenticated, name for people, and role."""

    user_id: str
    name: str
    role: str


@dataclass
class _Domain:
    entry: Entry
    connections: Connections


class Authenticator:
    """Decides who comes in and what they are.

    Parameters
    ----------
    context
        The host's ZeroMQ context. It can have one authenticator only.
    notice
        Told of connections that were refused.

    Attributes
    ----------
    socket
        For the host's poller; call `serve` when it can be read.
    keys
        Clients with keys, by public key. Replace it when keys change: it decides for every message.
    refresh : callable
        Called for a key that is not known: it may have been made just now.
    admitted, refused : int
        Connections let in and turned away."""

    def __init__(
        self,
        context: zmq.Context[zmq.Socket[bytes]],
        notice: Notice = lambda _kind, _text: None,
        clock_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._clock_s = clock_s
        # by domain and user: who was expelled from one door may still stop the rig at another
        self._banned: dict[tuple[bytes, str], float] = {}
        self._let_in: dict[tuple[bytes, str], float] = {}
        self.keys: Mapping[str, Key] = {}
        self.refresh: Callable[[], None] = lambda: None
        self.admitted = self.refused = 0
        self._notice = notice
        # by name, not by socket: a door that is opened anew has another socket, and keeps who was expelled
        self._domains: dict[bytes, _Domain] = {}
        self.socket = context.socket(zmq.REP)
        self.socket.setsockopt(zmq.LINGER, 0)
        try:
            # before any door: a connection that finds nobody here is refused (ZAP_ENFORCE_DOMAIN)
            self.socket.bind(ZAP_ADDRESS)
        except zmq.ZMQError as error:
            self.socket.close()
            raise BusyError("this ZeroMQ context has an authenticator already") from error

    def guard(self, socket: zmq.Socket[bytes], name: str, entry: Entry, connections: Connections) -> bytes:
        """Have every connection to `socket` decided here. Before it is bound. Returns its ZAP domain."""
        domain = f"rtctl.{entry}.{name}".encode()
        socket.setsockopt(zmq.ZAP_DOMAIN, domain)
        socket.setsockopt(zmq.ZAP_ENFORCE_DOMAIN, 1)
        self._domains[domain] = _Domain(entry, connections)
        return domain

    def serve(self) -> None:
        """Answer the connections that wait, a bounded number of them."""
        for _ in range(ANSWERS_PER_CALL):
            try:
                frames = self.socket.recv_multipart(zmq.NOBLOCK)
            except zmq.Again:
                return
            # libzmq finds the connection by it, also of a request that cannot be read
            number = frames[1] if len(frames) > 1 else b""
            user_id, why = self._decide(frames)
            self.admitted += user_id is not None
            self.refused += user_id is None
            status = (why[:3].encode(), why[4:].encode()) if user_id is None else (b"200", b"OK")
            # version, number, status, text, user id, metadata (ZeroMQ RFC 27)
            self.socket.send_multipart([b"1.0", number, *status, (user_id or "").encode(), b""])

    def caller(self, user_id: str) -> Caller | None:
        """Who a message of this user id is from, by the keys of this moment; None: nobody any more."""
        if user_id.startswith("ipc:"):
            return Caller(user_id, user_id, "operator")
        # asked for each message: a key that was revoked counts no more, whoever is still connected
        key = self.keys.get(user_id.removeprefix("key:"))
        return None if key is None else Caller(user_id, key.name, key.role)

    def knows(self, domain: bytes, user_id: str) -> bool:
        """Whether this user was let in by the door of `domain` in the last `KNOWN_S`."""
        return self._clock_s() < self._let_in.get((domain, user_id), -math.inf) + KNOWN_S

    def ban(self, domain: bytes, user_id: str) -> None:
        """Let this user in at the door of `domain` no more for `BAN_S`; the others stay open to it, for a
        stop.

        As viewers are all one user, they wait for `PAUSE_S` only: one that was expelled must not keep out the
        others."""
        now = self._clock_s()
        self._banned = {which: until for which, until in self._banned.items() if until > now}
        self._banned[domain, user_id] = now + (PAUSE_S if user_id == VIEWER else BAN_S)

    def close(self) -> None:
        """Let nobody in any more."""
        self.socket.close(linger=0)

    def _decide(self, frames: list[bytes]) -> tuple[str | None, str]:
        """User id of a connection, or None, and then the status of ZAP and why it is turned away."""
        if len(frames) < 6 or frames[0] != b"1.0":  # six frames, then those of the mechanism
            return None, "400 not a ZAP 1.0 request"
        _version, _number, domain, address, _identity, mechanism, *credentials = frames
        door = self._domains.get(domain)
        # nothing of ours: a socket of this context that was never guarded
        if door is None:
            return None, "400 unknown domain"
        peer = address.decode("ascii", "replace")
        user_id, role, why = self._identify(door.entry, peer, mechanism, credentials)
        # before its place is asked for: who is expelled takes none
        if user_id is not None and self._clock_s() < self._banned.get((domain, user_id), -math.inf):
            user_id, why = None, "300 expelled for a while"
        process = user_id if door.entry == "ipc" else None
        if user_id is not None and not door.connections.permit(role, process):
            user_id, why = None, "300 all places, or those of one process, are taken"  # 300: it may try again
        if user_id is not None:
            now = self._clock_s()
            self._let_in = {which: at for which, at in self._let_in.items() if now < at + KNOWN_S}
            self._let_in[domain, user_id] = now
        if user_id is None:
            self._notice("refused", f"connection from {peer} to {domain.decode()} refused: {why[4:]}")
        return user_id, why

    def _identify(
        self, entry: Entry, peer: str, mechanism: bytes, credentials: list[bytes]
    ) -> tuple[str | None, str, str]:
        """User id and role; without one, the status of ZAP and why."""
        if entry == "curve":
            if mechanism != b"CURVE" or len(credentials) != 1 or len(credentials[0]) != 32:
                return None, "", "400 no CURVE key"
            # as it stands in the files: the wire has 32 bytes
            public = z85.encode(credentials[0]).decode()
            if public not in self.keys:
                self.refresh()
            key = self.keys.get(public)
            return (None, "", "400 unknown key") if key is None else (f"key:{public}", key.role, "")
        if mechanism != b"NULL":
            return None, "", "400 this endpoint takes no keys"
        if entry == "viewer":
            local = peer == "127.0.0.1"
            return (VIEWER, "observer", "") if local else (None, "", "400 not from this machine")
        # libzmq names the peer of a Unix socket ...:uid:gid:pid
        uid = peer.partition(":")[2].partition(":")[0]
        own = uid in {"0", str(os.geteuid())}  # the last places are not for those of the group
        return f"ipc:{peer.partition(':')[2]}", "operator" if own else "renderer", ""
