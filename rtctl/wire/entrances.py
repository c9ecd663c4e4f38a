"""Every way into the host: ipc in the runtime folder, TCP with keys, viewers of this machine.

By ipc the permissions of the folder decide; over TCP nobody comes in without a CURVE key; the telemetry for
viewers is off unless asked for, on 127.0.0.1 only, and takes no requests."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import zmq

from rtctl.errors import RtctlError
from rtctl.wire.authenticator import Authenticator, Caller, Notice
from rtctl.wire.intruders import SPARED, Intruders
from rtctl.wire.keys import KeyStore
from rtctl.wire.openings import NOTHING_OPENED, Openings
from rtctl.wire.protocol import Endpoints, tcp_endpoints
from rtctl.wire.sockets import Binding, Door, Options, allow_descriptors, tcp_binding, user_id
from rtctl.wire.spare_descriptors import Reserve

LOOK_S = 0.5
"""How often the folder of keys is looked at."""

MOST_DESCRIPTORS = 65536
"""Files and sockets the host would like to be allowed: strangers hold a connection for as long as a handshake
may take."""

DESCRIPTORS = 8192
"""With fewer a crowd could take them all between two looks: clients are then let in one by one."""

LET_IN = 64
"""Most of those who wait at a door that lets in one by one, at every look."""

LEAST_DESCRIPTORS = 512
"""Fewer are too few for clients that mean well."""

REFRESH_S = 0.05
"""Strangers make the host look there at most this often."""

VIEWER_ADDRESS = "127.0.0.1"

LOCAL_LISTENERS = 64
"""Subscribers by ipc."""

LINGER_MS = 50
"""What subscribers by ipc have not taken at the end is given this long."""


class Access:
    """Opens the doors of one rig and keeps to its keys.

    Parameters
    ----------
    context
        The host's ZeroMQ context.
    endpoints
        The ipc addresses.
    openings
        What is opened besides; nothing by default.
    notice
        Told, in a line each, of what concerns the keeper of the rig.
    resident
        Resident memory of this process alone, bytes, by which floods are known that nothing else shows; None:
        not looked at.

    Attributes
    ----------
    authenticator : Authenticator
        Decides about connections and messages.
    remote : Endpoints or None
        The TCP addresses.

    Raises
    ------
    ConfigError
        Keys that are missing, or that others could read or change.
    BusyError
        A TCP address in use.
    RtctlError
        Too few descriptors for its clients."""

    def __init__(
        self,
        context: zmq.Context[zmq.Socket[bytes]],
        endpoints: Endpoints,
        openings: Openings = NOTHING_OPENED,
        notice: Notice = lambda _kind, _text: None,
        clock_s: Callable[[], float] = time.monotonic,
        resident: Callable[[], int] | None = None,
    ) -> None:
        self._notice = notice
        # first of all: every socket below takes some
        descriptors = self._descriptors = self._allow_descriptors()
        self._context = context
        self._endpoints = endpoints
        self._openings = openings
        self._clock_s = clock_s
        self._doors: list[Door] = []
        self._signature: tuple[tuple[str, int, int], ...] = ()
        self._gone: list[str] = []  # names of keys that hold no more; cut by `look`
        self._next_look_s = self._next_refresh_s = -math.inf
        self.remote: Endpoints | None = None
        self._store = None if openings.keys is None else KeyStore(openings.keys)
        self._server_secret = b"" if self._store is None else self._store.server().secret_key.encode()
        self.authenticator = Authenticator(context, notice, clock_s)
        # before any door: what is lent must have been taken while there was some
        self._reserve = Reserve()
        self._opened: list[int] = []
        self.intruders = Intruders(self._doors, self.authenticator, notice, descriptors, resident)
        if self._store is not None:
            self.remote = tcp_endpoints(openings.bind, openings.port)
        self.authenticator.refresh = self._refresh
        self._read_keys()

    def _allow_descriptors(self) -> int:
        """How many this process may open. Without any left, libzmq ends it at the next connection to a Unix
        socket."""
        found = allow_descriptors(MOST_DESCRIPTORS)
        remedy = f"raise the hard limit to {DESCRIPTORS} (ulimit -Hn; in a unit: LimitNOFILE=)"
        if found < LEAST_DESCRIPTORS:
            raise RtctlError(f"this process may open only {found} files and sockets: {remedy}")
        if found < DESCRIPTORS:
            self._notice(
                "descriptors",
                f"this process may open only {found} files and sockets; lest a crowd takes them all, "
                f"clients are let in one by one: {remedy}",
            )
        return found

    def routers(self, name: str, port_offset: int, options: Options) -> list[Door]:
        """ROUTER sockets for the endpoint `name` (`command` or `targets`): by ipc and, if asked for, TCP."""
        # in any case: whoever runs the rig stops it from this machine, whatever is asked of the network
        local = Binding(getattr(self._endpoints, name), "ipc", group=self._openings.group)
        doors = [self._door(name, local, zmq.ROUTER, options)]
        if self.remote is not None:
            doors.append(self._door(name, self._by_key(port_offset), zmq.ROUTER, options))
        return doors

    def publishers(self, options: Options) -> list[Door]:
        """XPUB sockets for all telemetry: by ipc and, if asked for, over TCP for clients with a key."""
        local = Binding(self._endpoints.telemetry, "ipc", group=self._openings.group)
        more = {"places": LOCAL_LISTENERS, "linger_ms": LINGER_MS}
        doors = [self._door("telemetry", local, zmq.XPUB, options, **more)]
        if self.remote is not None:
            doors.append(self._door("telemetry", self._by_key(2), zmq.XPUB, options))
        return doors

    def viewers(self, options: Options) -> list[Door]:
        """XPUB sockets for the state samples that viewers without keys may see."""
        port = self._openings.viewer_port
        if port is None:  # off unless the rig file asks for it
            return []
        return [self._door("viewer", tcp_binding(VIEWER_ADDRESS, port, "viewer"), zmq.XPUB, options)]

    def expeller(self, door: Door) -> Callable[[zmq.Frame], None]:
        """What throws whoever sent a frame out of `door`, and keeps them out for a while. The others connect
        again.

        Viewers are one user to the authenticator, and told apart by their connections: of them only that one
        is cut."""
        why = "what it sent is no subscription, or again and again one to topics that do not exist"

        def expel(frame: zmq.Frame) -> None:
            if door.for_viewers:
                self.intruders.expel(door, frame, why)
                return
            sender = user_id(frame)
            who = self.caller(sender)
            # before the cut: whoever is cut connects again by itself, within milliseconds
            self.authenticator.ban(door.domain, sender)
            door.cut()
            self._notice(
                "expelled", f"{sender if who is None else who.name} was expelled from {door.address}: {why}"
            )

        return expel

    def look(self) -> None:
        """Look after every door: who is connected, who takes too much, which keys hold no more."""
        for door in self._doors:
            if door.is_open:
                door.connections.take()
        now = self._clock_s()
        self.intruders.look(now)  # at every turn: a flood fills memory within milliseconds
        self._let_in()
        if now < self._next_look_s:
            return
        self._next_look_s = now + LOOK_S  # from now: what was late is not made up for
        for door in self._doors:
            if not door.is_open:
                door.reopen()
        self._read_keys()
        if not self._gone:  # nobody has to be cut
            return
        for door in self._doors:
            # the whole door: who has said nothing since is not told apart (`Traffic.users`)
            if door.by_key:
                door.cut()
        names = ", ".join(self._gone)
        self._notice("revoked", f"keys revoked or changed: {names}; connections with keys were cut")
        self._gone = []

    def _let_in(self) -> None:
        """Where few descriptors are allowed: some more of those who wait, while enough are left for
        everything else."""
        if self._descriptors >= DESCRIPTORS:  # all come in by themselves
            return
        doors = [door for door in self._doors if door.is_open]
        # what strangers of all doors may take together: one door must not use up what another needs
        left = self._descriptors - SPARED - sum(len(door.connections.descriptors()) for door in doors)
        for door in doors:
            door.let_in(min(LET_IN, left // len(doors)))

    def renewed(self) -> bool:
        """Whether any door has another socket than when this was asked last."""
        # 0 for a door that is shut: that is another socket, too
        before, self._opened = self._opened, [door.openings * door.is_open for door in self._doors]
        return before != self._opened

    def caller(self, user_id: str) -> Caller | None:
        """Who a message is from, by the keys of this moment."""
        return self.authenticator.caller(user_id)

    def counts(self) -> dict[str, int]:
        """Clients connected now, connections let in and turned away so far."""
        return {
            "connected": sum(door.connections.count for door in self._doors if door.is_open),
            "admitted": self.authenticator.admitted,
            "turned_away": self.authenticator.refused,
        }

    def describe(self) -> list[str]:
        """Lines that tell a person who can get in, and how."""
        # without ipc://
        lines = [f"by ipc, without keys: whoever may enter {self._endpoints.command[6:].rpartition('/')[0]}"]
        if self.remote is not None:
            lines.append(f"by TCP, with keys:    {self.remote.command} (targets +1, telemetry +2)")
        lines += [
            f"for viewers, without keys, read only: {door.address}"
            for door in self._doors
            if door.address.startswith(f"tcp://{VIEWER_ADDRESS}") and not door.by_key
        ]
        return lines

    def close(self) -> None:
        """Close every door, and let nobody in any more. Idempotent."""
        for door in self._doors:
            door.close()  # first the doors: who comes now finds none
        self.authenticator.close()
        self._reserve.close()

    def _by_key(self, port_offset: int) -> Binding:
        address, port = self._openings.bind, self._openings.port + port_offset
        return tcp_binding(address, port, "curve", self._server_secret)

    def _door(self, name: str, binding: Binding, kind: int, options: Options, **more: int) -> Door:
        few, reserve = self._descriptors < DESCRIPTORS, self._reserve
        door = Door(
            self._context, self.authenticator, name, binding, kind, options, reserve, one_by_one=few, **more
        )
        self._doors.append(door)  # the list that the intruders look at, too
        return door

    def _refresh(self) -> None:
        """Look for a key that was made just now, but not as often as strangers try theirs."""
        now = self._clock_s()
        # by a clock of its own: `look` comes too late for a client that has just got its key
        if now >= self._next_refresh_s:
            self._next_refresh_s = now + REFRESH_S
            self._read_keys()

    def _read_keys(self) -> None:
        """Take over the keys if they changed, and note those that hold no more. What cannot be read has not
        changed."""
        if self._store is None:  # nobody comes in by a key
            return
        try:
            # by names and times: the files themselves are read only when one of them has changed
            if (signature := self._store.signature()) == self._signature:
                return
            found, faults = self._store.clients()
        except OSError as error:
            self._notice(
                "keys",
                f"{self._store.folder}: cannot be read now ({error.strerror}): the keys stay as they are",
            )
            return
        # not before they were read: a folder that fails once would else never be read again
        self._signature = signature
        before, self.authenticator.keys = self.authenticator.keys, found
        self._gone += [
            key.name for public, key in before.items() if self.authenticator.keys.get(public) != key
        ]
        for fault in faults:  # each time that the folder changes: a person is at it
            self._notice("keys", f"{fault}; nobody is let in by it")
