"""What a client hears of a rig: streams, and the newest state."""

from __future__ import annotations

import math
import threading
import time
from typing import Any

import numpy as np

from rtctl.client.connection import Connection
from rtctl.client.samples import RigState
from rtctl.client.streams import Stream, event_stream, health_stream, state_stream, tick_stream
from rtctl.errors import NoReplyError

FRESH_S = 0.25
"""`latest_state` keeps reading until what it has was sent within this time."""


class Listener:
    """Opens streams of telemetry. Each belongs to one thread at a time, and so does `latest_state`.

    Parameters
    ----------
    connection
        Where the rig is.
    timeout_s
        Longest wait for telemetry."""

    def __init__(self, connection: Connection, timeout_s: float) -> None:
        self._connection = connection
        self.endpoints = connection.endpoints
        self.timeout_s = timeout_s
        self._newest: Stream[RigState] | None = None
        # kept from call to call: the newest sample may have come long before it is asked for
        self._last: RigState | None = None
        self._streams: list[Stream[Any]] = []
        self._opening = threading.Lock()

    def close_streams(self) -> None:
        """Close every stream. Idempotent."""
        # each closes a socket: the context waits for all of them
        for stream in self._streams:
            stream.close()

    def states(self, max_age_s: float = math.inf) -> Stream[RigState]:
        """Decimated samples, from now on; those older than `max_age_s` when they are read are left out."""
        return self._opened(state_stream(self._connection, self.timeout_s, max_age_s))

    def ticks(self) -> Stream[np.ndarray]:
        """Every tick, as structured arrays of `rtctl.tick.tick_dtype`, from now on."""
        return self._opened(tick_stream(self._connection, self.timeout_s))

    def events(self) -> Stream[dict[str, Any]]:
        """Changes of state, and faults with their texts, from now on."""
        return self._opened(event_stream(self._connection, self.timeout_s))

    def health(self) -> Stream[dict[str, Any]]:
        """Rate, latency percentiles, missed ticks and counters, once a second from now on."""
        return self._opened(health_stream(self._connection, self.timeout_s))

    def latest_state(self) -> RigState:
        """The newest sample. Waits only when there is no fresh one; the sample's `age_s` is as of now.

        Raises
        ------
        NoReplyError
            No fresh sample within the client's `timeout_s`."""
        # opened on demand: a client that only asks has no subscription that fills
        if self._newest is None:
            self._newest = self.states()
        deadline = time.monotonic() + self.timeout_s
        while True:
            # the queue holds the oldest first
            while (sample := self._newest.receive(0)) is not None:
                self._last = sample
            now = time.monotonic()
            if self._last is not None and now - self._last.fields["sent_monotonic_s"] < FRESH_S:
                return self._last.as_of(now)
            if now > deadline:
                raise NoReplyError(
                    f"no fresh state from {self.endpoints.telemetry} within {self.timeout_s:g} s"
                )
            # an old one is kept: it may be all there is when the time is over
            self._last = self._newest.receive(deadline - now) or self._last

    def _opened(self, stream: Stream[Any]) -> Stream[Any]:
        with self._opening:
            # without the closed ones: a page opens one for each visit, for months
            self._streams = [*(one for one in self._streams if not one.closed), stream]
        return stream
