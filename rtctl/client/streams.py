"""Streams of telemetry: one SUB socket per stream, losses counted by the numbers messages carry."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from types import TracebackType
from typing import Any, Generic, Self, TypeVar

import msgpack
import numpy as np
import zmq

from rtctl.client.samples import RigState, rig_state, tick_rows
from rtctl.errors import ClientError, NoReplyError
from rtctl.protocol import TOPIC_EVENT, TOPIC_HEALTH, TOPIC_STATE, TOPIC_TICKS

Item = TypeVar("Item")

QUEUE_MESSAGES = 5000
"""Messages a stream may hold unread: at 50 batches a second, more than a minute."""


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
    """

    def __init__(
        self,
        context: zmq.Context[zmq.Socket[bytes]],
        endpoint: str,
        topic: bytes,
        items: Callable[[Any], list[tuple[int, int, int, Item]]],
        timeout_s: float,
    ) -> None:
        self._items = items
        self._endpoint = endpoint
        self._timeout_s = timeout_s
        self._waiting: deque[Item] = deque()
        self._session: int | None = None
        self._expected = 0
        self.lost = 0
        self.restarts = 0
        self._socket = context.socket(zmq.SUB)
        self._socket.setsockopt(zmq.LINGER, 0)
        self._socket.setsockopt(zmq.RCVHWM, QUEUE_MESSAGES)
        self._socket.setsockopt(zmq.RECONNECT_IVL, 20)
        self._socket.setsockopt(zmq.RECONNECT_IVL_MAX, 500)
        self._socket.setsockopt(zmq.SUBSCRIBE, topic)
        self._socket.connect(endpoint)

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
        """The next item, or None when there is none within `timeout_s` (0: what has arrived)."""
        deadline = time.monotonic() + timeout_s
        while not self._waiting:
            if not self._socket.poll(max(0, round((deadline - time.monotonic()) * 1e3))):
                return None
            self._take(self._socket.recv_multipart()[-1])
        return self._waiting.popleft()

    def close(self) -> None:
        """Close the stream. Idempotent."""
        self._socket.close(linger=0)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _take(self, payload: bytes) -> None:
        try:
            items = self._items(msgpack.unpackb(payload))
        except (KeyError, TypeError, ValueError, msgpack.UnpackException) as error:
            raise ClientError(
                f"telemetry this client cannot read ({error!r}); is the daemon another version?"
            ) from error
        for session, first, count, item in items:
            if session != self._session:
                self.restarts += self._session is not None
                self._session = session
            elif first > self._expected:
                self.lost += first - self._expected
            self._expected = first + count
            self._waiting.append(item)


def state_stream(
    context: zmq.Context[zmq.Socket[bytes]], endpoint: str, timeout_s: float
) -> Stream[RigState]:
    """Decimated samples."""

    def items(message: Any) -> list[tuple[int, int, int, RigState]]:  # noqa: ANN401
        samples = [rig_state(sample) for sample in message]
        return [(sample.session, sample.sequence, 1, sample) for sample in samples]

    return Stream(context, endpoint, TOPIC_STATE, items, timeout_s)


def tick_stream(
    context: zmq.Context[zmq.Socket[bytes]], endpoint: str, timeout_s: float
) -> Stream[np.ndarray]:
    """Every tick, as structured arrays; `lost` counts ticks."""

    def items(message: Any) -> list[tuple[int, int, int, np.ndarray]]:  # noqa: ANN401
        rows = tick_rows(message)
        return [(message["session"], message["row"], len(rows), rows)]

    return Stream(context, endpoint, TOPIC_TICKS, items, timeout_s)


def event_stream(
    context: zmq.Context[zmq.Socket[bytes]], endpoint: str, timeout_s: float
) -> Stream[dict[str, Any]]:
    """Events, as the maps of the protocol."""

    def items(message: Any) -> list[tuple[int, int, int, dict[str, Any]]]:  # noqa: ANN401
        return [(event["session"], event["sequence"], 1, event) for event in message]

    return Stream(context, endpoint, TOPIC_EVENT, items, timeout_s)


def health_stream(
    context: zmq.Context[zmq.Socket[bytes]], endpoint: str, timeout_s: float
) -> Stream[dict[str, Any]]:
    """Health, as the map of the protocol."""

    def items(message: Any) -> list[tuple[int, int, int, dict[str, Any]]]:  # noqa: ANN401
        return [(message["session"], message["sequence"], 1, message)]

    return Stream(context, endpoint, TOPIC_HEALTH, items, timeout_s)
