"""From telemetry to browsers: one reader per topic, any number of followers that each miss nothing they asked
for.

A follower takes what has come since it last asked, thinned to what a screen can show; one that does not ask
holds nobody up, and keeps at most a few seconds."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rtctl.client import RigClient
from rtctl.client.streams import Stream
from rtctl.errors import ClientError
from rtctl.tick import FIELD, joined
from rtctl.wire.fault_names import FaultPlaces

KEPT_BATCHES = 600
"""Unread batches a follower may leave behind: five seconds of a rig of 1 kHz."""

KEPT_BYTES = 16 << 20
"""And no more than so much of them, of a rig of many axes or long batches."""

POINTS = 12
"""Rows of one message to a browser, at most."""


EDGES_US = np.geomspace(1.0, 10_000.0, 25)
"""Edges of the histogram's bins; the outer ones take what lies beyond."""

HISTOGRAM_S = 10.0


class Histogram:
    """How long something took, over the last `HISTOGRAM_S` of ticks."""

    def __init__(self) -> None:
        self._counts: deque[tuple[int, np.ndarray]] = deque()
        self.total = np.zeros(len(EDGES_US) - 1, np.int64)

    def add(self, time_ns: int, durations_ns: np.ndarray) -> None:
        """Count a batch that ended at `time_ns`."""
        # without the outer edges: the outer bins take what lies beyond
        bins = np.searchsorted(EDGES_US[1:-1] * 1e3, durations_ns)
        counts = np.bincount(bins, minlength=len(self.total))
        # kept beside the batches: adding them all up for each picture would cost more
        self.total += counts
        self._counts.append((time_ns, counts))
        # 0 <=: the clock of a daemon that was started anew may be behind
        while not 0 <= time_ns - self._counts[0][0] <= HISTOGRAM_S * 1e9:
            self.total -= self._counts.popleft()[1]


@dataclass(frozen=True)
class Signal:
    """One curve: a field of the tick, and which of its values."""

    field: str
    index: int

    @classmethod
    def parse(cls, text: str) -> Signal:
        """From `position_rad` or `position_rad.1`. Raises ValueError for what no tick has."""
        name, _, index = text.partition(".")
        if name not in FIELD or (index and not index.isdecimal()) or len(index) > 2:
            raise ValueError(f"{text!r} is no signal: a field of the tick, with .0, .1, ... for an axis")
        return cls(name, int(index or 0))

    def of(self, rows: np.ndarray) -> list[float | None]:
        """The signal's values in these ticks; None for one that is not finite, and where the rig has no such
        axis."""
        column = rows[self.field].reshape(len(rows), -1)
        # a page that was opened for another rig, or a daemon that came back with fewer axes
        if self.index >= column.shape[1]:
            return [None] * len(rows)
        return [value if math.isfinite(value) else None for value in column[:, self.index].tolist()]


@dataclass
class Follower:
    """What one browser has not seen yet."""

    batches: deque[np.ndarray] = field(default_factory=lambda: deque(maxlen=KEPT_BATCHES))
    events: deque[dict[str, Any]] = field(default_factory=lambda: deque(maxlen=200))
    news: threading.Event = field(default_factory=threading.Event)

    def add(self, rows: np.ndarray) -> None:
        """Keep a batch; the oldest go where it is too much."""
        self.batches.append(rows)
        # one batch is as long as another
        while len(self.batches) > max(1, KEPT_BYTES // rows.nbytes):
            with suppress(IndexError):  # taken meanwhile
                self.batches.popleft()
        self.news.set()

    def take(self) -> tuple[np.ndarray | None, list[dict[str, Any]]]:
        """Ticks and events since the last call."""
        self.news.clear()  # first: what comes while this takes wakes the follower again
        # as many as there are now: what comes meanwhile is for the next call
        batches = [self.batches.popleft() for _ in range(len(self.batches))]
        # a daemon that was started anew may have another number of axes: its ticks are of another size
        batches = [rows for rows in batches if rows.dtype == batches[-1].dtype]
        events = [self.events.popleft() for _ in range(len(self.events))]
        return (joined(batches) if batches else None), events


class Feed:
    """Reads events and health of one rig until it is closed, and its ticks while somebody follows: those are
    most of the work, and nobody sees them otherwise.

    Attributes
    ----------
    health
        The newest health message.
    silent
        Why there is no telemetry; empty while there is.
    places
        Where faults come from.
    unread
        Why the newest events or the newest health could not be read; "" while they can."""

    def __init__(self, client: RigClient) -> None:
        self._client = client
        self._followers: list[Follower] = []
        self._lock = threading.Lock()
        self._closed = threading.Event()
        self._followed = threading.Event()
        self.health: dict[str, Any] = {}
        self.newest: np.ndarray | None = None
        self.places = FaultPlaces()
        self.unread = {"events": "", "health": ""}
        self._histograms: dict[str, Histogram] = {}
        self._begin()
        self._threads = [
            threading.Thread(target=target, name=f"rtctl-view-{name}", daemon=True)
            for name, target in (("ticks", self._ticks), ("events", self._events), ("health", self._health))
        ]
        for thread in self._threads:
            thread.start()

    @property
    def silent_s(self) -> float:
        """Time since the newest tick came."""
        return time.monotonic() - self._heard_s

    def follow(self) -> Follower:
        """Begin to follow."""
        follower = Follower()
        with self._lock:
            self._followers.append(follower)
            self._followed.set()
        return follower

    def leave(self, follower: Follower) -> None:
        """Stop following."""
        with self._lock:
            self._followers.remove(follower)
            if not self._followers:
                self._followed.clear()

    def close(self) -> None:
        """Stop reading."""
        self._closed.set()
        self._followed.set()  # who waits for a follower sees the end
        for thread in self._threads:
            thread.join(2.0)

    def histogram(self) -> dict[str, list[float]]:
        """How often the loop woke up so late and took so long, with the edges of the bins."""
        counts = {name: histogram.total.tolist() for name, histogram in self._histograms.items()}
        return {"edges_us": EDGES_US.tolist(), **counts}

    def _each(self) -> list[Follower]:
        with self._lock:
            # a copy: followers come and go while it is gone through
            return list(self._followers)

    def _begin(self) -> None:
        """Nothing has been seen, as far as who comes next is told."""
        # what was seen before nobody looked is old: a page would show it as now
        self.silent, self._heard_s, self.newest = "connecting", time.monotonic(), None
        self._histograms = {name: Histogram() for name in ("wakeup", "cycle")}

    def _ticks(self) -> None:
        # no stream is open while nobody looks: the daemon packs ticks for subscribers alone
        while self._followed.wait() and not self._closed.is_set():
            self._ticks_while_followed()
            self._begin()

    def _ticks_while_followed(self) -> None:
        with self._client.ticks() as stream:
            while self._followed.is_set() and not self._closed.is_set():
                try:
                    # half a second: it looks now and then whether anybody follows still
                    rows = stream.receive(0.5)
                except ClientError as error:
                    self.silent = str(error)
                    continue
                if rows is None:
                    self.silent = "no telemetry: does the daemon run?"
                    continue
                self.silent, self._heard_s = "", time.monotonic()
                self.newest = rows[-1:]  # a row, and no record: views of its fields stay arrays
                for name, histogram in self._histograms.items():
                    histogram.add(int(rows["time_ns"][-1]), rows[f"{name}_ns"])
                for follower in self._each():
                    follower.add(rows)

    def _events(self) -> None:
        with self._client.events() as stream:
            while not self._closed.is_set():
                event = self._readable(stream, "events")
                # none within the time, or one that cannot be read
                if event is not None:
                    self.places.take_event(event)
                    for follower in self._each():
                        follower.events.append(event)
                        follower.news.set()

    def _health(self) -> None:
        with self._client.health() as stream:
            while not self._closed.is_set():
                self.health = self._readable(stream, "health") or self.health
                self.places.take_health(self.health)

    def _readable(self, stream: Stream[dict[str, Any]], topic: str) -> dict[str, Any] | None:
        """The next message; None for one that cannot be read, as of a daemon of another version, which is
        told: the messages after it count."""
        message, why = None, ""
        try:
            message = stream.receive(0.5)
        except ClientError as error:
            why = str(error)
        if message is not None or why:  # silence does not mend what was said
            self.unread[topic] = why
        return message


def columns(rows: np.ndarray, signals: list[Signal], points: int = POINTS) -> dict[str, list[float | None]]:
    """Thinned columns of these ticks, newest row always among them: `t` in s, and one list per signal.

    A value that is not finite becomes None, as JSON has none."""
    step = max(1, math.ceil(len(rows) / points))  # up: no more points than were asked for
    # counted from the end, so that the newest is always one of them
    chosen = rows[::-1][::step][::-1]
    out: dict[str, list[float | None]] = {"t": (chosen["time_ns"] * 1e-9).tolist()}
    for signal in signals:
        out[f"{signal.field}.{signal.index}"] = signal.of(chosen)
    return out
