"""The command socket: framing, bounded work, counters. What a request means is in `requests`."""

from __future__ import annotations

import errno
from dataclasses import asdict, dataclass
from typing import Any

import zmq

from rtctl.config import LoadedConfig
from rtctl.control.vocabulary import State
from rtctl.host.description import RigDescription, describe
from rtctl.host.endpoints import private_umask
from rtctl.host.messages import Refusal, Request, decode, encode
from rtctl.host.requests import LatestRow, Requests
from rtctl.protocol import MAX_OUTSTANDING_REQUESTS, MAX_REQUEST_BYTES, Endpoints
from rtctl.shm import CommandWriter

REQUESTS_PER_CALL = 32
"""Most messages handled before the host looks after the ticks again."""


@dataclass
class Counters:
    """What came in: messages received, requests carried out or refused, messages that were no request,
    replies that could not be delivered.
    """

    received: int = 0
    accepted: int = 0
    refused: int = 0
    malformed: int = 0
    replies_lost: int = 0


class Gateway:
    """Answers requests on a ROUTER socket. Never blocks, never raises for what a client sends.

    Parameters
    ----------
    context
        ZeroMQ context of the host.
    endpoints
        Where to listen.
    writer
        The host's end of the command mailbox.
    rig
        The rig file, or the description made from it.
    latest
        Returns the newest tick as an array of one row, or None before the first.

    Attributes
    ----------
    socket : zmq.Socket
        For the host's poller.
    counters : Counters
        Told in `health`.
    """

    def __init__(
        self,
        context: zmq.Context[zmq.Socket[bytes]],
        endpoints: Endpoints,
        writer: CommandWriter,
        rig: LoadedConfig | RigDescription,
        latest: LatestRow,
    ) -> None:
        self._rig = describe(rig)
        self._requests = Requests(writer, self._rig, endpoints, latest)
        self.counters = Counters()
        self.socket = context.socket(zmq.ROUTER)
        self.socket.setsockopt(zmq.LINGER, 0)
        self.socket.setsockopt(zmq.RCVHWM, MAX_OUTSTANDING_REQUESTS)
        self.socket.setsockopt(zmq.SNDHWM, REQUESTS_PER_CALL)
        self.socket.setsockopt(zmq.MAXMSGSIZE, MAX_REQUEST_BYTES)
        self.socket.setsockopt(zmq.ROUTER_HANDOVER, 0)  # nobody takes over another client's identity
        self.socket.setsockopt(
            zmq.ROUTER_MANDATORY, 1
        )  # an undeliverable reply is an error, so it is counted
        with private_umask():
            self.socket.bind(endpoints.command)

    def serve(self, limit: int = REQUESTS_PER_CALL) -> int:
        """Handle the messages that wait, at most `limit`; returns how many."""
        for handled in range(limit):
            try:
                identity, envelope, payload = self._receive()
            except zmq.Again:
                return handled
            self.counters.received += 1
            reply = self._answer(payload)
            if reply is not None:
                self._send([identity, *envelope, encode(reply)])
        return limit

    def counts(self) -> dict[str, int]:
        """The counters by name."""
        return asdict(self.counters)

    def close(self) -> None:
        """Close the socket; unsent replies are dropped."""
        self.socket.close(linger=0)

    def _receive(self) -> tuple[bytes, list[bytes], bytes | None]:
        """One message: identity, the empty delimiter if the client sent one, and the payload frame.

        The payload is None when there is not exactly one. Surplus frames are read away one by one and
        never kept.
        """
        identity = self.socket.recv(zmq.NOBLOCK)
        envelope: list[bytes] = []
        payload: bytes | None = None
        count = 0
        while self.socket.getsockopt(zmq.RCVMORE):
            frame = self.socket.recv(zmq.NOBLOCK)
            if count == 0 and not frame and not envelope:
                envelope = [b""]
                continue
            count += 1
            payload = frame if count == 1 else None
        return identity, envelope, payload

    def _answer(self, payload: bytes | None) -> dict[str, Any] | None:
        """The reply to a payload, or None where nobody can be answered."""
        request = Refusal("malformed", "frames") if payload is None else decode(payload, self._rig)
        if isinstance(request, Refusal) and request.id is None:
            self.counters.malformed += 1
            return None
        row = self._requests.newest()
        outcome = self._requests.perform(request, row) if isinstance(request, Request) else request
        reply = {
            "id": request.id,
            "op": request.op,
            "ok": not isinstance(outcome, Refusal),
            "state": State(int(row["state"])).name,
            "epoch": int(row["epoch"]),
        }
        if isinstance(outcome, Refusal):
            self.counters.refused += 1
            return {**reply, "error": {"code": outcome.code, "text": outcome.text}}
        self.counters.accepted += 1
        return {**reply, "result": outcome}

    def _send(self, frames: list[bytes]) -> None:
        try:
            self.socket.send_multipart(frames, zmq.NOBLOCK)
        except zmq.Again:
            self.counters.replies_lost += 1
        except zmq.ZMQError as error:
            if error.errno != errno.EHOSTUNREACH:  # the client has gone
                raise
            self.counters.replies_lost += 1
