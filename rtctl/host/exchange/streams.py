"""Publishes what the loop recorded: state, full-rate ticks, events, health. Never waits for a subscriber.

Each subscriber has its own queue of `QUEUE_S` seconds. One that falls further behind loses messages; the
others lose nothing."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import zmq

from rtctl.host.exchange import publisher
from rtctl.host.exchange.device_words import DeviceWords
from rtctl.host.exchange.events import EventDetector
from rtctl.host.exchange.fault_book import FaultBook
from rtctl.host.exchange.friction_watch import FrictionWatch
from rtctl.host.exchange.health import HealthWindow
from rtctl.host.exchange.late_watch import LateWatch
from rtctl.host.exchange.motor_temperature import TemperatureWatch
from rtctl.host.exchange.publisher import HasSocket, Publisher
from rtctl.host.exchange.rig_description import RigDescription, describe
from rtctl.host.exchange.samples import Decimator, state_samples, tick_columns
from rtctl.host.exchange.veiled_leases import veil_leases
from rtctl.rig_file.config import LoadedConfig
from rtctl.tick import tick_dtype
from rtctl.wire.encoding import encode
from rtctl.wire.endpoints import private_umask
from rtctl.wire.entrances import LINGER_MS, Access
from rtctl.wire.protocol import (
    PROTOCOL_VERSION,
    TOPIC_COMMAND,
    TOPIC_EVENT,
    TOPIC_HEALTH,
    TOPIC_SETUP,
    TOPIC_STATE,
    TOPIC_TICKS,
    TOPICS,
    Endpoints,
    schema_sha256,
)

QUEUE_S = 5.0
"""How far a subscriber may fall behind before it loses messages."""

QUEUE_BYTES = 16 << 20
"""And with how much: a rig of many axes or a quick loop makes so much in less. A third of what the memory of
a host may grow by before somebody is suspected (`rtctl.wire.intruders`)."""

BESIDES_BYTES = 6000
"""What a batch has besides its ticks: the names of their columns, and a state."""

MOST_ROWS = 2000
"""Ticks per message at most, so that one message stays below about 1 MB per axis."""

HEALTH_PERIOD_NS = 1_000_000_000

Counts = Callable[[], Mapping[str, Any]]


class _Unguarded:
    """A socket that asks nobody who may come in."""

    def __init__(
        self, context: zmq.Context[zmq.Socket[bytes]], address: str, options: Mapping[int, int]
    ) -> None:
        self.socket = context.socket(zmq.PUB)
        for option, value in options.items():
            self.socket.setsockopt(option, value)
        with private_umask():  # ipc: bind makes the socket's file
            self.socket.bind(address)


class Telemetry:
    """The publishers of one rig.

    Parameters
    ----------
    context
        ZeroMQ context of the host.
    endpoints
        Where to listen.
    rig
        The rig file, or the description made from it.
    access
        Who may listen; None: whoever may enter the folder, by ipc.
    commands
        Returns the gateway's counters for `health`.
    clock_ns
        CLOCK_MONOTONIC, ns.
    words
        What the devices say.
    friction
        The watch over the friction; None: there is none.

    Attributes
    ----------
    published, dropped : int
        Messages published, and those that found a subscriber's queue full (see
        `rtctl.host.exchange.publisher`)."""

    def __init__(
        self,
        context: zmq.Context[zmq.Socket[bytes]],
        endpoints: Endpoints,
        rig: LoadedConfig | RigDescription,
        *,
        access: Access | None = None,
        commands: Counts = dict,
        clock_ns: Callable[[], int] = time.monotonic_ns,
        words: DeviceWords | None = None,
        friction: FrictionWatch | None = None,
    ) -> None:
        self._rig = describe(rig)
        self._friction = friction
        self.commands = commands
        """The gateway's counters, for `health`."""
        self._clock_ns = clock_ns
        self._realtime: list[dict[str, Any]] = []
        self.early: Callable[[int], Mapping[str, float]] = lambda _now_ns: {}
        """How the loop looks at the clock (`rtctl.rt.early.Look`), for `health`."""
        self.log: Callable[[], Mapping[str, Any]] = dict
        """How the event log is doing (`FlightRecorder.status`), for `health`."""
        self.recording: Callable[[], Mapping[str, Any] | None] = lambda: None
        """How the recording is doing (`Recorder.status`), for `health`."""
        self.setup: Callable[[], Mapping[str, Any]] | None = None
        """What is published on `rtctl/setup` with every health, for clients that record."""
        self._schema_sha256 = schema_sha256(self._rig.n_axes, self._rig.motions)
        self._decimator = Decimator(self._rig.rate_hz, self._rig.state_hz)
        self._events = EventDetector(self._rig, words, friction)
        self._health = HealthWindow()
        # a second from now: a health at once would tell percentiles of a few ticks
        self._next_health_ns = clock_ns() + HEALTH_PERIOD_NS
        self._states = self._batches = self._healths = self._rows = self._overwritten = 0
        self.published = self.dropped = 0
        options = publisher.options(queue_messages(self._rig))
        self._unguarded: _Unguarded | None = None
        self._local: HasSocket
        if access is None:
            self._local = self._unguarded = _Unguarded(context, endpoints.telemetry, options)
            self._publishers = [Publisher(self._local, TOPICS)]
        else:
            doors = access.publishers(options)
            self._local = doors[0]
            self._publishers = [
                *(Publisher(door, TOPICS, access.expeller(door)) for door in doors),
                *(Publisher(door, [TOPIC_STATE], access.expeller(door)) for door in access.viewers(options)),
            ]

    @property
    def book(self) -> FaultBook:
        """Where each fault came from."""
        return self._events.book

    @property
    def motors(self) -> TemperatureWatch:
        """Which motors' temperatures are warned of."""
        return self._events.temperature

    @property
    def socket(self) -> zmq.Socket[bytes]:
        """The one by ipc."""
        return self._local.socket

    def set_realtime(self, grants: Sequence[Mapping[str, Any]]) -> None:
        """Tell in `health` which real-time rights were granted and which refused, and why."""
        self._realtime = [dict(grant) for grant in grants]

    def set_late(self, watch: LateWatch) -> None:
        """Tell in `health` and events which ticks came late, and why."""
        self._events.late.watch = watch

    def publish_commands(self, commands: np.ndarray) -> None:
        """Publish commands that came into force in the ticks published next."""
        if len(commands):
            columns = tick_columns(veil_leases(commands, "target_lease"))
            self._send(TOPIC_COMMAND, {"session": self._rig.session, "columns": columns})

    def publish(self, rows: np.ndarray, overwritten: int) -> None:
        """Publish new ticks, and health when a second has passed.

        Parameters
        ----------
        rows
            Complete ticks since the last call, oldest first; may be empty.
        overwritten
            Ticks lost so far between the loop and the host, all of them before the last of `rows`."""
        # before the ticks: the first message after a loss says so
        self._overwritten = overwritten
        for first in range(0, len(rows), MOST_ROWS):
            self._publish_ticks(rows[first : first + MOST_ROWS])
        now_ns = self._clock_ns()
        if now_ns >= self._next_health_ns:
            due_ns = self._next_health_ns + HEALTH_PERIOD_NS
            # after a standstill anew: percentiles and rate are of a second, not of the next batch alone
            self._next_health_ns = due_ns if due_ns > now_ns else now_ns + HEALTH_PERIOD_NS
            self._publish_health(now_ns)

    def counts(self) -> dict[str, int]:
        """Messages published, and occasions on which a subscriber's queue was full."""
        return {"published": self.published, "dropped": self.dropped}

    def close(self) -> None:
        """Close the socket, where it is no door (those close with `access`)."""
        if self._unguarded is not None:
            self._unguarded.socket.close(linger=LINGER_MS)

    def _publish_ticks(self, rows: np.ndarray) -> None:
        self._health.add(rows)
        events = self._events.detect(rows)
        if events:
            # before the state: who hears both has the cause by then
            self._send(TOPIC_EVENT, events)
        chosen = rows[self._decimator.pick(rows["tick"])]
        if len(chosen):
            self._send(TOPIC_STATE, state_samples(chosen, self._rig, self._states, self._clock_ns()))
            self._states += len(chosen)
        self._send(TOPIC_TICKS, self._tick_batch(rows))
        self._batches += 1
        self._rows += len(rows)

    def _tick_batch(self, rows: np.ndarray) -> dict[str, Any]:
        return {
            "session": self._rig.session,
            "sequence": self._batches,
            "schema_sha256": self._schema_sha256,
            "start_wall_ns": self._rig.start_wall_ns,
            "first_tick": int(rows["tick"][0]),
            "row": self._rows + self._overwritten,  # counts the run's ticks, those that the host lost too
            "rows": len(rows),
            "lost": self._overwritten,
            "columns": tick_columns(rows),
        }

    def _publish_health(self, now_ns: int) -> None:
        rig = self._rig
        wall_ns = time.time_ns() if rig.virtual else now_ns + rig.start_wall_ns
        health = {
            "timestamp": wall_ns * 1e-9,
            "monotonic_s": now_ns * 1e-9,
            "session": rig.session,
            "sequence": self._healths,
            "protocol": PROTOCOL_VERSION,
            "version": rig.version,
            "rig": rig.name,
            "config_sha256": rig.config_sha256,
            "schema_sha256": self._schema_sha256,
            "rate_hz": rig.rate_hz,
            **self._health.take(self.book),
            "devices": [voice.as_dict() for voice in self.book.words.voices()],
            "warnings": self._warnings(),
            "friction": [] if self._friction is None else self._friction.status(),
            "overwritten": self._overwritten,
            "telemetry": self.counts(),
            "commands": dict(self.commands()),
            "realtime": self._realtime,
            **self.early(now_ns),
            "late": None if self._events.late.watch is None else self._events.late.watch.health(),
            "log": dict(self.log()),
            "recording": self.recording(),
        }
        self._healths += 1
        self._send(TOPIC_HEALTH, health)
        if self.setup is not None:
            # every second: a recording may begin at any time, and PUB repeats nothing to who comes later
            self._send(TOPIC_SETUP, {"session": rig.session, **self.setup()})

    def _warnings(self) -> list[dict[str, str]]:
        # as the events have them: judged anew, a motor at the bound would flicker here
        return self.motors.present + ([] if self._friction is None else self._friction.warnings())

    def _send(self, topic: bytes, message: object) -> None:
        """Send one message to every subscriber whose queue has room."""
        payload = encode(message)
        # counted once, however many doors it goes out by
        self.published += 1
        for sender in self._publishers:
            self.dropped += not sender.send(topic, payload)


def queue_messages(rig: RigDescription) -> int:
    """Length of a subscriber's queue in messages: `QUEUE_S` of them, as far as that is `QUEUE_BYTES`."""
    # state, ticks and events of each batch; health and setup each second
    per_second = 3 / rig.batch_s + 2
    # 100: a batch of a second would leave a queue of few messages, and a burst of events fills that
    wanted = max(100, math.ceil(QUEUE_S * per_second))
    # without events every other message is ticks, and between them is the state
    ticks = min(MOST_ROWS, rig.rate_hz * rig.batch_s) * tick_dtype(rig.n_axes).itemsize
    # 16: what the longest batch of the quickest loop is cut into comes all at once, twice
    return min(wanted, max(16, int(2 * QUEUE_BYTES / (ticks + BESIDES_BYTES))))
