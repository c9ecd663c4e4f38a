"""Streams of telemetry: one SUB socket per stream, losses counted by the numbers messages carry."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from typing import Any, Generic, Self, TypeVar

import msgpack
import numpy as np
import zmq

from rtctl.client.connection import Connection
from rtctl.client.samples import RigState, rig_state, tick_rows
from rtctl.errors import ClientError, NoReplyError
from rtctl.wire.event_words import device_line, line_of
from rtctl.wire.fault_names import FaultPlaces
from rtctl.wire.protocol import TOPIC_EVENT, TOPIC_HEALTH, TOPIC_STATE, TOPIC_TICKS

Item = TypeVar("Item")

QUEUE_MESSAGES = 5000
"""Messages a stream may hold unread: at the 125 a second of a rig of 1 kHz, more than half a minute."""

CLOCKS_APART = 2e-4
"""How much faster one machine's clock may run than another's, where nobody sets either: quartz is off by up
to 1e-4."""


class Stream(Generic[Item]):
    """An endless iterator over one topic. Use each stream in one thread at a time.

    It survives a restart of the daemon. When nothing arrives for `timeout_s`, `next()` raises
    NoReplyError; the stream stays usable and may be asked again.

    Attributes
    ----------
    lost : int
        Items published while this stream was open that did not arrive here.
    restarts : int
        Times the daemon was seen to have been restarted.
    outdated : int
        Items left out because they were too old when they were read."""

    def __init__(
        self,
        connection: Connection,
        topic: bytes,
        items: Callable[[Any], list[tuple[int, int, int, Item]]],
        timeout_s: float,
        as_of_now: Callable[[Item], Item | None] = lambda item: item,
    ) -> None:
        self._items = items
        self._as_of_now = as_of_now
        self._endpoint = connection.endpoints.telemetry
        self._timeout_s = timeout_s
        # a message brings several items, which are asked for one by one
        self._waiting: deque[Item] = deque()
        self._session: int | None = None
        self._expected = 0
        self._closed = False
        self.lost = 0
        self.restarts = 0
        self.outdated = 0
        options = {zmq.RCVHWM: QUEUE_MESSAGES}
        self._socket = connection.socket(zmq.SUB, self._endpoint, options, (topic,))

    def __iter__(self) -> Self:
        return self

    def __next__(self) -> Item:
        item = self.receive(self._timeout_s)
        if item is None:
            raise NoReplyError(
                f"no telemetry from {self._endpoint} for {self._timeout_s:g} s; is the daemon running?"
            )
        return item

    def receive(self, timeout_s: float) -> Item | None:
        """The next item, or None when there is none within `timeout_s` (0: what has arrived).

        Raises ClientError once the stream is closed."""
        if self._closed:
            # and not None, for which a caller would ask again and again
            raise ClientError("this stream is closed")
        deadline = time.monotonic() + timeout_s
        while True:
            while not self._waiting:
                # a negative time would wait for ever
                if not self._socket.poll(max(0, round((deadline - time.monotonic()) * 1e3))):
                    return None
                self._take(self._socket.recv_multipart()[-1])  # the topic comes first
            # as of when it is handed out: an item may have waited here for long
            item = self._as_of_now(self._waiting.popleft())
            if item is not None:
                return item
            self.outdated += 1

    @property
    def closed(self) -> bool:
        """Whether it was closed."""
        return self._closed

    def close(self) -> None:
        """Close the stream. Idempotent."""
        # first: another thread that asks meanwhile is told so, and not of a socket that is none
        self._closed = True
        self._socket.close(linger=0)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def _take(self, payload: bytes) -> None:
        try:
            for item in self._items(msgpack.unpackb(payload)):
                self._count(*item)
        except (AttributeError, KeyError, TypeError, ValueError, msgpack.UnpackException) as error:
            raise ClientError(
                f"telemetry this client cannot read ({error!r}); is the daemon another version?"
            ) from error

    def _count(self, session: int, first: int, count: int, item: Item) -> None:
        end = first + count  # before anything is noted: numbers that are none raise
        if session != self._session:
            # the first session that is seen is no restart
            self.restarts += self._session is not None
            self._session = session
        # numbers only rise within a session; of a new one nothing is known to be lost
        elif first > self._expected:
            self.lost += first - self._expected
        self._expected = end
        self._waiting.append(item)


class OtherClock:
    """Puts times of the daemon's CLOCK_MONOTONIC on that of this machine: over TCP the two may be of machines
    that were started days apart.

    The least that lies between sending and taking counts, of the message that was on its way for the shortest
    time: how long that was nobody can tell, and ages leave it out."""

    def __init__(self) -> None:
        self._session: int | None = None
        self._apart_s = self._taken_s = 0.0

    def here(self, session: int, sent_s: float, now_s: float) -> float:
        """When it was here what the daemon's clock shows as `sent_s`, for a message that is taken now, s."""
        apart_s = now_s - sent_s  # clocks and way together
        if session == self._session:
            # a daemon that was started anew may be on a machine that was, too; else the least so far
            apart_s = min(apart_s, self._apart_s + CLOCKS_APART * (now_s - self._taken_s))
        self._session, self._apart_s, self._taken_s = session, apart_s, now_s
        return sent_s + apart_s


def state_stream(connection: Connection, timeout_s: float, max_age_s: float = math.inf) -> Stream[RigState]:
    """Decimated samples, those older than `max_age_s` when they are read left out.

    A message carries several: their age is that of the moment when each is handed out."""
    clock = OtherClock() if connection.endpoints.telemetry.startswith("tcp:") else None

    def items(message: list[dict[str, Any]]) -> list[tuple[int, int, int, RigState]]:
        if clock is not None:
            now_s = time.monotonic()
            # before anything is made of them: ages go by the time on this machine
            for one in message:
                sent_s = clock.here(one["session"], one["sent_monotonic_s"], now_s)
                one["sent_monotonic_s"] = sent_s
        # made at once: a message that cannot be read is told when it comes
        samples = [rig_state(sample) for sample in message]
        return [(sample.session, sample.sequence, 1, sample) for sample in samples]

    def as_of_now(sample: RigState) -> RigState | None:
        aged = sample.as_of(time.monotonic())
        return None if aged.age_s > max_age_s else aged

    return Stream(connection, TOPIC_STATE, items, timeout_s, as_of_now)


def tick_stream(connection: Connection, timeout_s: float) -> Stream[np.ndarray]:
    """Every tick, as structured arrays; `lost` counts ticks."""

    def items(message: dict[str, Any]) -> list[tuple[int, int, int, np.ndarray]]:
        rows = tick_rows(message)
        # by rows, not by messages: each tick counts; and who takes a batch looks at its last tick
        return [(message["session"], message["row"], len(rows), rows)] if len(rows) else []

    return Stream(connection, TOPIC_TICKS, items, timeout_s)


def event_stream(connection: Connection, timeout_s: float) -> Stream[dict[str, Any]]:
    """Events, as the maps of the protocol."""

    def items(message: list[dict[str, Any]]) -> list[tuple[int, int, int, dict[str, Any]]]:
        # what is shown of an event, and where faults come from: raises for what neither can be read of
        for event in message:
            line_of(event)
            FaultPlaces().take_event(event)
        return [(event["session"], event["sequence"], 1, event) for event in message]

    return Stream(connection, TOPIC_EVENT, items, timeout_s)


def health_stream(connection: Connection, timeout_s: float) -> Stream[dict[str, Any]]:
    """Health, as the map of the protocol."""

    def items(message: dict[str, Any]) -> list[tuple[int, int, int, dict[str, Any]]]:
        # likewise
        FaultPlaces().take_health(message)
        for voice in message.get("devices", []):
            device_line(voice)
        for warning in message.get("warnings", []):
            warning["name"]
        return [(message["session"], message["sequence"], 1, message)]

    return Stream(connection, TOPIC_HEALTH, items, timeout_s)
