"""The endpoints clients talk to: framing, bounded work, counters. What a request means is in `requests`."""

from __future__ import annotations

import errno
import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import zmq

from rtctl.control.vocabulary import State
from rtctl.host.exchange.fault_book import FaultBook
from rtctl.host.exchange.force_zero import ForceZero
from rtctl.host.exchange.friction_watch import FrictionWatch
from rtctl.host.exchange.messages import Refusal, Request, decode, decode_target
from rtctl.host.exchange.motor_temperature import TemperatureWatch
from rtctl.host.exchange.request_rates import RateLimit
from rtctl.host.exchange.requests import LatestRow, Requests
from rtctl.host.exchange.rig_description import RigDescription, describe
from rtctl.host.exchange.target_latency import TargetLatency
from rtctl.host.exchange.targets import OPTIONS as TARGET_OPTIONS
from rtctl.host.exchange.targets import TargetInbox
from rtctl.rt.shared_memory import CommandWriter
from rtctl.wire.authenticator import Caller
from rtctl.wire.encoding import encode
from rtctl.wire.entrances import Access
from rtctl.wire.long_messages import Frames, Message
from rtctl.wire.protocol import CONNECTIONS, MAX_OUTSTANDING_REQUESTS, PROTOCOL_VERSION, Endpoints
from rtctl.wire.sockets import user_id

if TYPE_CHECKING:
    from rtctl.rig_file.config import LoadedConfig

REQUESTS_PER_CALL = 32
"""Most requests handled in one turn of the host, before it looks after the ticks again."""

PAUSE_S = 0.001
"""Pause after a turn that left messages unread: it bounds the share of a core that a flood of messages can
take."""

GIVEN_UP_S = 1.0
"""Half of what clients wait for a reply. What was asked of a host that stood still for longer has waited for
nobody knows how long: whoever asked has been told that nobody answers, and may have a hand on the rig by
then."""

# one user's connections may send at once all that they may have outstanding
BURST = MAX_OUTSTANDING_REQUESTS * CONNECTIONS

OPTIONS = {
    zmq.RCVHWM: MAX_OUTSTANDING_REQUESTS,
    zmq.SNDHWM: REQUESTS_PER_CALL,
    zmq.ROUTER_HANDOVER: 0,  # nobody takes over another client's identity
    zmq.ROUTER_MANDATORY: 1,  # an undeliverable reply is an error, so it is counted
}


@dataclass
class Counters:
    """What came in: messages received, requests carried out or refused (`limited` of these for asking too
    often, `forbidden` for their role), messages that were no request, replies that could not be delivered."""

    received: int = 0
    accepted: int = 0
    refused: int = 0
    limited: int = 0
    forbidden: int = 0
    malformed: int = 0
    replies_lost: int = 0


def awake_s() -> float:
    """Time that never goes back, and that goes on while the machine sleeps, s."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


class Gateway:
    """Answers requests and takes targets. Never blocks, never raises for what a client sends.

    Parameters
    ----------
    context
        ZeroMQ context of the host.
    endpoints
        Where to listen by ipc.
    writer
        The host's end of the command mailbox.
    rig
        The rig file, or the description made from it.
    latest
        Returns the newest tick as an array of one row, or None before the first.
    access
        Who may come in; default: this machine, by ipc.
    book
        Where faults come from.
    friction
        The watch over the friction; None: there is none.
    zero
        The zero of the force sensor; None: the law's is not known, and accepted.
    motors
        Which motors' temperatures are warned of; None: none so far.
    announce
        Is told what a person at the terminal should know.
    refused
        Is told each `arm` that was refused: to whom, and why.
    clock_s
        Time that goes on whatever happens to this process, s.

    Attributes
    ----------
    counters : Counters
        Told in `health`.
    latency : TargetLatency
        Give it the new ticks."""

    def __init__(
        self,
        context: zmq.Context[zmq.Socket[bytes]],
        endpoints: Endpoints,
        writer: CommandWriter,
        rig: LoadedConfig | RigDescription,
        latest: LatestRow,
        *,
        access: Access | None = None,
        book: FaultBook | None = None,
        friction: FrictionWatch | None = None,
        zero: ForceZero | None = None,
        motors: TemperatureWatch | None = None,
        announce: Callable[[str], None] = lambda _text: None,
        refused: Callable[[str, str], None] = lambda _what, _why: None,
        clock_s: Callable[[], float] = awake_s,
    ) -> None:
        self._rig = describe(rig)
        # inf: before the first turn nothing has stood still
        self._announce, self._refused, self._clock_s, self._here_s = announce, refused, clock_s, math.inf
        self.access = access or Access(context, endpoints)
        remote = self.access.remote
        self._requests = Requests(writer, self._rig, endpoints, latest, remote, book, friction, zero, motors)
        self.counters = Counters()
        rate_hz = 2.0 * self._rig.rate_hz
        self._request_rate = RateLimit(rate_hz, BURST, clock_s)
        self._target_rate = RateLimit(rate_hz, BURST, clock_s)
        expel = self.access.intruders.expel
        self.doors = [Frames(door, expel) for door in self.access.routers("command", 0, OPTIONS)]
        targets = [Frames(door, expel) for door in self.access.routers("targets", 1, TARGET_OPTIONS)]
        self.inbox = TargetInbox(targets, self.access.caller, self._carry_out_target)
        self.latency = TargetLatency(virtual=self._rig.virtual)
        self._polled: list[zmq.Socket[bytes]] = []
        self._poller: zmq.Poller | None = None

    @property
    def socket(self) -> zmq.Socket[bytes]:
        """The socket of requests by ipc."""
        return self.doors[0].door.socket

    def stop(self) -> None:
        """Stop the rig as a client would: for what the host itself sees."""
        self._requests.stop()

    def register(self, poller: zmq.Poller) -> None:
        """Have `poller` wake up for everything `serve` handles, also when sockets are replaced later."""
        self._poller = poller
        for socket in self._polled:
            poller.unregister(socket)
        doors = [frames.door for frames in (*self.doors, *self.inbox.doors)]
        self._polled = [self.access.authenticator.socket, *(door.socket for door in doors if door.is_open)]
        for socket in self._polled:
            poller.register(socket, zmq.POLLIN)

    def serve(self, limit: int = REQUESTS_PER_CALL) -> bool:
        """Let clients in and handle what waits, at most `limit` requests.

        Returns True when more waits: the caller then rests for `PAUSE_S` before the next turn."""
        self._void_after_standstill()
        flooded = self.inbox.serve()  # first: a hand waits for the renderer
        self.access.authenticator.serve()
        self.access.look()
        share = max(1, limit // len(self.doors))  # one door cannot use up another's turn
        for frames in self.doors:
            # as many as it may: more may wait
            flooded |= self._serve_door(frames, share) == share
        if self.access.renewed() and self._poller is not None:
            self.register(self._poller)
        return flooded

    def _void_after_standstill(self) -> None:
        """Where this process stood still, or the machine slept, stop the rig before anything more is carried
        out, as the loop stops one that is powered (HOST_SILENT): the new epoch voids each `arm` that
        waited."""
        now_s = self._clock_s()
        stood_s, self._here_s = now_s - self._here_s, now_s
        if stood_s > GIVEN_UP_S and not self._rig.virtual:
            self.stop()
            self._announce(f"stood still for {stood_s:.1f} s: an arm that was asked for meanwhile is void")

    def counts(self) -> dict[str, Any]:
        """The counters by name, and percentiles of targets' latency since the last call."""
        return {
            **asdict(self.counters),
            "targets": {**self.inbox.counts(), "latency_us": self.latency.take()},
            "connections": self.access.counts(),
        }

    def close(self) -> None:
        """Close the sockets; unsent replies are dropped."""
        self.access.close()

    def _serve_door(self, frames: Frames, limit: int) -> int:
        """Handle at most `limit` requests of one door; returns how many there were."""
        for handled in range(limit):
            try:
                message = frames.read()
            except zmq.Again:
                return handled
            # between two requests too: a host may be stopped in the middle of a turn
            self._void_after_standstill()
            self.counters.received += 1
            envelope, frame = self._opened(message)
            reply = None if frame is None else self._answer(frame.bytes, self.access.caller(user_id(frame)))
            if reply is None:
                self.counters.malformed += 1
            else:
                self._send(frames.door.socket, [message.identity, *envelope, encode(reply)])
        return limit

    @staticmethod
    def _opened(message: Message) -> tuple[list[bytes], zmq.Frame | None]:
        """The empty delimiter if the client sent one, and the payload: None when there is not exactly one."""
        frames = message.frames
        # REQ sends an empty delimiter (RFC 28), DEALER need not
        envelope = [b""] if frames and len(frames[0]) == 0 else []
        payload = frames[len(envelope) :]
        return envelope, payload[0] if len(payload) == 1 else None

    def _answer(self, payload: bytes, caller: Caller | None) -> dict[str, Any] | None:
        """The reply to a payload, or None where nobody can be answered."""
        request = decode(payload, self._rig)
        if isinstance(request, Refusal) and request.id is None:
            return None
        row = self._requests.newest()
        outcome = self._outcome(request, row, caller)
        if request.id is None:
            return None
        reply = {
            "id": request.id,
            "op": request.op,
            "ok": not isinstance(outcome, Refusal),
            "state": State(int(row["state"])).name,
            "epoch": int(row["epoch"]),
            "rig": self._rig.name,
            "protocol": PROTOCOL_VERSION,
        }
        if isinstance(outcome, Refusal):
            self.counters.refused += 1
            self.counters.forbidden += outcome.code == "forbidden"
            if request.op == "arm":
                self._refused("arm" if caller is None else f"arm of {caller.name}", outcome.text)
            return {**reply, "error": {"code": outcome.code, "text": outcome.text}}
        self.counters.accepted += 1
        return {**reply, "result": outcome}

    def _outcome(
        self, request: Request | Refusal, row: np.void, caller: Caller | None
    ) -> dict[str, Any] | Refusal:
        """Carry out a request, unless its sender is nobody any more or asks too often. Stops always count."""
        if caller is None:
            return Refusal("forbidden", "this key has been revoked")
        if not self._request_rate.allows(caller.user_id) and request.op != "stop":
            self.counters.limited += 1
            return Refusal("too_fast", "more than twice the loop's rate; send targets to their own endpoint")
        return self._requests.perform(request, row, caller) if isinstance(request, Request) else request

    def _carry_out_target(self, payload: bytes, caller: Caller) -> bool:
        """Hand the target of one frame to the loop, if it may count."""
        if not self._target_rate.allows(caller.user_id):
            return False
        request = decode_target(payload, self._rig)
        if isinstance(request, Refusal):
            return False
        outcome = self._requests.perform(request, self._requests.newest(), caller)
        if isinstance(outcome, Refusal):
            return False
        self.latency.handed(outcome["command_seq"], self.inbox.read_ns)
        return True

    def _send(self, socket: zmq.Socket[bytes], frames: list[bytes]) -> None:
        try:
            socket.send_multipart(frames, zmq.NOBLOCK)
        except zmq.Again:
            self.counters.replies_lost += 1
        except zmq.ZMQError as error:
            if error.errno != errno.EHOSTUNREACH:  # the client has gone
                raise
            self.counters.replies_lost += 1
