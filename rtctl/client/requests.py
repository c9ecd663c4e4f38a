"""Requests and their replies over a DEALER socket: ids matched, late replies never mistaken."""

from __future__ import annotations

import itertools
import time
from typing import Any

import msgpack
import numpy as np
import zmq

from rtctl.client.connection import Connection
from rtctl.errors import ClientError, NoReplyError, RefusedError
from rtctl.wire.protocol import PROTOCOL_VERSION

Reply = dict[str, Any]

NEWER = ("unknown_op", "unknown_key")
"""How a daemon refuses what a client of a later version asks."""


class Requester:
    """Sends one request at a time and waits for its reply. Not thread-safe; its owner locks.

    After a request without a reply the socket is thrown away with whatever waits in it, so a request can
    never reach a daemon that is started later, and its reply never pass for that of another request. Each
    request names the rig that answered the first one: another rig at the same address refuses it."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._endpoint = connection.endpoints.command
        self._socket: zmq.Socket[bytes] | None = None
        self._ids = itertools.count(1)
        self._rig: str | None = None  # stays None where the daemon is of a version that does not say it

    def call(self, op: str, timeout_s: float, **values: object) -> Reply:
        """Ask for `op` and return the whole reply.

        Raises
        ------
        NoReplyError
            No daemon listens, or it did not answer within `timeout_s` (it may or may not have acted), or
            what answers there belongs to somebody else.
        RefusedError
            The daemon refused, with code and reason."""
        identity = next(self._ids)
        meant: dict[str, object] = {} if self._rig is None else {"rig": self._rig}
        # a request without it is of version 1: daemons of then refuse keys that they do not know
        meant |= {"protocol": PROTOCOL_VERSION} if PROTOCOL_VERSION > 1 else {}
        payload: bytes = msgpack.packb({"id": identity, "op": op, **meant, **values}, default=_plain)
        # before the socket is made: connecting counts, too
        deadline = time.monotonic() + timeout_s
        socket = self._connected()
        try:
            reply = self._exchange(socket, payload, identity, deadline)
            self._connection.vouch(self._endpoint)  # also of a folder made since this client connected
        # Ctrl-C as well: a reply that comes after all would wait there for the next request
        except BaseException:
            self.close()
            raise
        if reply is None:
            self.close()
            raise NoReplyError(
                f"no reply to {op!r} from {self._endpoint} within {timeout_s:g} s: no daemon runs this rig, "
                "or it is busy, or it does not know this client's key; start one with: rtctl run CONFIG"
            )
        _require_version(reply, op)
        # only from the first reply on: whoever answers that is the rig that this client means
        if self._rig is None and isinstance(reply.get("rig"), str):
            self._rig = reply["rig"]
        if not reply.get("ok"):
            error = reply.get("error") or {}
            code, text = str(error.get("code", "unknown")), str(error.get("text", "no reason given"))
            if code in NEWER:
                text += (
                    f"; spelled right, {op!r} is asked in the words of a later version than the daemon's: "
                    "start the daemon anew"
                )
            raise RefusedError(code, text)
        return reply

    def close(self) -> None:
        """Drop the socket and what waits in it; the next call makes a new one."""
        if self._socket is not None:
            self._socket.close(linger=0)
            self._socket = None

    def _connected(self) -> zmq.Socket[bytes]:
        if self._socket is None:
            options = {zmq.IMMEDIATE: 1}  # queue nothing for a daemon that is not there
            self._socket = self._connection.socket(zmq.DEALER, self._endpoint, options)
        return self._socket

    @staticmethod
    def _exchange(socket: zmq.Socket[bytes], payload: bytes, identity: int, deadline: float) -> Reply | None:
        if not socket.poll(_left_ms(deadline), zmq.POLLOUT):
            return None
        socket.send(payload, zmq.NOBLOCK)
        while socket.poll(_left_ms(deadline), zmq.POLLIN):
            # the last frame: an empty delimiter may stand before it
            reply = _unpack(socket.recv_multipart()[-1])
            # else it is the answer to a request that was given up
            if reply.get("id") == identity:
                return reply
        return None


def _require_version(reply: Reply, op: str) -> None:
    """Raise RefusedError where a daemon of another protocol answered; whatever it is, it takes a `stop`."""
    spoken = reply.get("protocol", 1)
    if spoken == PROTOCOL_VERSION or (op == "stop" and reply.get("ok")):
        return
    older = "this client" if isinstance(spoken, int) and spoken > PROTOCOL_VERSION else "the daemon"
    done = "it may have done" if reply.get("ok") else "it has not done"
    raise RefusedError(
        "wrong_protocol",
        f"the daemon speaks protocol {spoken!r:.20}, this client {PROTOCOL_VERSION}, and {done} what {op!r} "
        f"asks here: install the newer version of rtctl for {older}, too"
        + (", and start it anew" if older == "the daemon" else ""),
    )


def _plain(value: object) -> object:
    """A number of NumPy as one of Python. Raises TypeError for what no request carries."""
    if isinstance(value, np.generic):
        return value.item()
    msg = f"{value!r:.60} cannot be sent: a request carries numbers and texts, not a {type(value).__name__}"
    raise TypeError(msg)


def _left_ms(deadline: float) -> int:
    # never below 0, which would wait for ever
    return max(0, round((deadline - time.monotonic()) * 1e3))


def _unpack(payload: bytes) -> Reply:
    try:
        reply = msgpack.unpackb(payload)
    except (ValueError, msgpack.UnpackException) as error:
        raise ClientError(
            f"a reply that is not msgpack ({error!r}); is something else listening there?"
        ) from error
    if not isinstance(reply, dict):
        raise ClientError("a reply that is not a map; is something else listening there?")
    return reply
