"""Everything a recording needs from a running rig, over one subscription: setup, ticks, events, commands."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import msgpack
import numpy as np
import zmq

from rtctl.client.connection import Connection
from rtctl.client.samples import fill, tick_rows
from rtctl.control.records import command_dtype, state_dtype
from rtctl.errors import ClientError, NoReplyError
from rtctl.wire.protocol import TOPIC_COMMAND, TOPIC_EVENT, TOPIC_HEALTH, TOPIC_SETUP, TOPIC_TICKS, Endpoints

SILENCE_S = 3.0
"""Without a word for so long the daemon has ended (docs/protocol.md)."""

_UNREADABLE = (AttributeError, LookupError, TypeError, ValueError, msgpack.UnpackException)
"""What a message of another shape ends in."""

# as of a stream: more than half a minute of a rig of 1 kHz, while the disk is waited for
QUEUE_MESSAGES = 5000


@dataclass
class Ticks:
    """One batch: ticks, the number of the first among all the loop recorded, and what happened in them.

    `state` is the law's before the first tick, in batches that follow a setup message; else None."""

    first_row: int
    rows: np.ndarray
    events: list[dict[str, Any]]
    commands: np.ndarray
    state: np.ndarray | None = None


@dataclass
class Run:
    """The run that is being captured.

    Attributes
    ----------
    setup
        The daemon's `rtctl/setup` message.
    lost : int
        Ticks that did not arrive here."""

    session: int
    setup: Mapping[str, Any]
    n_axes: int
    lost: int = 0
    expected: int | None = None
    events: list[dict[str, Any]] = field(default_factory=list)
    commands: list[np.ndarray] = field(default_factory=list)
    state: np.ndarray | None = None
    state_row: int = -1


class Capture:
    """Follows the telemetry of one rig. A context manager.

    `receive` gives batches of the present run; a restart of the daemon shows as another `run`."""

    def __init__(self, endpoints: Endpoints) -> None:
        self._endpoint = endpoints.telemetry
        Connection.vouch(self._endpoint)  # before there is a context to be ended
        # a context of its own: its end waits for its own socket alone
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        connection = Connection(self._context, endpoints)
        topics = (TOPIC_SETUP, TOPIC_TICKS, TOPIC_EVENT, TOPIC_COMMAND, TOPIC_HEALTH)
        self._socket = connection.socket(zmq.SUB, self._endpoint, {zmq.RCVHWM: QUEUE_MESSAGES}, topics)
        self._heard = time.monotonic()
        self.run: Run | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self._socket.close(linger=0)
        self._context.term()

    def receive(self, timeout_s: float) -> Ticks | None:
        """The next batch of ticks; None when none came within `timeout_s`, or when another run begins.

        Raises
        ------
        NoReplyError
            The daemon has been silent for `SILENCE_S`.
        ClientError
            A message this version cannot read."""
        # the run of before: another one ends the call, so that nobody takes its ticks for the old one's
        deadline, before = time.monotonic() + timeout_s, self.run
        while (left_s := deadline - time.monotonic()) > 0:
            # 1 ms at least: 0 would ask again and again until the time is over
            if not self._socket.poll(max(1, round(left_s * 1e3))):
                break
            self._heard = time.monotonic()
            topic, payload = self._socket.recv_multipart()
            try:
                message = msgpack.unpackb(payload)
                # events of the ticks that come next: kept until those are given
                if topic == TOPIC_EVENT:
                    self._take_events(message)
                    continue
                found = self._take(topic, message)
            except _UNREADABLE as error:
                raise ClientError(
                    f"telemetry this client cannot read ({error!r}); is the daemon another version?"
                ) from error
            if found is not None or self.run is not before:
                return found
        # asked last: what waited in the socket counts as heard
        if time.monotonic() - self._heard > SILENCE_S:
            raise NoReplyError(
                f"no telemetry from {self._endpoint} for {SILENCE_S:g} s: the daemon has ended"
            )
        return None

    def _take_events(self, events: Sequence[Mapping[str, Any]]) -> None:
        if (run := self.run) is not None:
            run.events += [dict(event) for event in events if event["session"] == run.session]

    def _take(self, topic: bytes, message: Mapping[str, Any]) -> Ticks | None:
        run = self.run
        if topic == TOPIC_SETUP:
            # every second the same setup comes again, for clients that begin later
            if run is None or message["session"] != run.session:
                self.run = run = _begin(message)
            # each time: the state in it belongs before the very next batch
            run.state, run.state_row = _state(message, run.n_axes), int(message.get("state_row", -1))
            return None
        if run is None or message["session"] != run.session:
            return None
        if topic == TOPIC_COMMAND:
            run.commands.append(_commands(message["columns"], run.n_axes))
        elif topic == TOPIC_TICKS:
            return _ticks(run, message)
        return None


def _begin(message: Mapping[str, Any]) -> Run:
    n_axes = int(message["about"]["n_axes"])
    # the command in force: the first ticks bear its number, and no command message comes for it again
    known = [_commands(message["command"], n_axes)] if message["command"] else []
    return Run(message["session"], message, n_axes, commands=known)


def _ticks(run: Run, message: Mapping[str, Any]) -> Ticks:
    rows = tick_rows(message)
    first = int(message["row"])
    # what was before the first batch was not lost on the way
    if run.expected is not None:
        run.lost += max(0, first - run.expected)
    run.expected = first + len(rows)
    none = np.zeros(0, command_dtype(run.n_axes))
    # of a row that did not arrive it would be the state of another moment
    state = run.state if run.state_row == first else None
    batch = Ticks(first, rows, run.events, np.concatenate([none, *run.commands]), state)
    run.events, run.commands = [], []
    return batch


def _state(message: Mapping[str, Any], n_axes: int) -> np.ndarray | None:
    """The law's state, if the daemon knows it and is of this version: one that lacks a field is of no use."""
    columns, dtype = message.get("state") or {}, state_dtype(n_axes)
    return _table(columns, dtype) if columns.keys() == set(dtype.names or ()) else None


def _commands(columns: Mapping[str, Any], n_axes: int) -> np.ndarray:
    return _table(columns, command_dtype(n_axes))


def _table(columns: Mapping[str, Any], dtype: np.dtype[np.void]) -> np.ndarray:
    """Rows of a record from its columns; those that are missing are 0."""
    first, *_ = columns.values()  # of no column at all a ValueError, which is named
    rows = int(first["shape"][0])
    if rows > len(first["data"]):  # before room is made for what did not come
        raise ValueError(f"{rows} rows in {len(first['data'])} bytes")
    table = np.zeros(rows, dtype)
    fill(table, columns)
    return table
