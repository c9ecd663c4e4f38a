"""`RigClient`: requests, streams and the newest state of one rig."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self

import numpy as np
import zmq

from rtctl.client.requests import Reply, Requester
from rtctl.client.samples import RigState
from rtctl.client.streams import Stream, event_stream, health_stream, state_stream, tick_stream
from rtctl.control.vocabulary import State
from rtctl.errors import ClientError, NoReplyError, RefusedError
from rtctl.protocol import Endpoints, endpoints_in, rig_directory

Kind = Literal["free", "spring", "wall", "damper", "detents", "remote"]

FRESH_S = 0.25
"""`latest_state` keeps reading until what it has was sent within this time."""

_POLL_S = 0.01
_ASK_AGAIN_S = 0.2
_CLOSED = (State.LOCKOUT, State.SHUTDOWN)


class RigClient:
    """A connection to the daemon of one rig.

    Requests may come from any thread: they take turns. Each stream belongs to one thread at a time, and so
    does `latest_state`. Connecting does not wait: the first request or sample shows whether a daemon runs.

    Parameters
    ----------
    rig
        Name of the rig on this machine.
    endpoints
        ZeroMQ addresses, instead of a name.
    runtime_dir
        Where the daemons of this machine listen; default as for `rtctl run`.
    timeout_s
        Longest wait for a reply or for telemetry.

    Raises
    ------
    ConfigError
        A name that cannot be a rig's, or a path too long for a socket.
    """

    def __init__(
        self,
        rig: str = "mock",
        *,
        endpoints: Endpoints | None = None,
        runtime_dir: str | Path | None = None,
        timeout_s: float = 2.0,
    ) -> None:
        root = None if runtime_dir is None else Path(runtime_dir)
        self.endpoints = endpoints or endpoints_in(rig_directory(rig, root))
        self.timeout_s = timeout_s
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._requester = Requester(self._context, self.endpoints.command)
        self._lock = threading.Lock()
        self._newest: Stream[RigState] | None = None
        self._last: RigState | None = None
        self._streams: list[Stream[Any]] = []
        self._epoch: int | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close every stream and connection. Does not stop the rig. Idempotent."""
        with self._lock:
            self._requester.close()
        for stream in self._streams:
            stream.close()
        self._context.term()

    # -- asking

    def hello(self) -> dict[str, Any]:
        """What runs there: protocol, version, rig, axes with their bounds, rate, endpoints."""
        return self._result("hello")

    def status(self) -> dict[str, Any]:
        """State, epoch, faults with their texts, newest position and velocity, command in force."""
        reply = self._call("status")
        return {"state": reply["state"], "epoch": reply["epoch"], **reply["result"]}

    def schema(self) -> dict[str, Any]:
        """JSON Schema of the tick record."""
        schema: dict[str, Any] = self._result("schema")["schema"]
        return schema

    # -- the state machine

    def arm(self, *, wait: bool = True, timeout_s: float = 10.0) -> None:
        """Enable the actuator. With `wait`, return when the rig is ACTIVE.

        While the rig is still getting ready (IDLE) the request is repeated.

        Raises
        ------
        RefusedError
            `not_ready`, saying what is missing; also when arming ended in a fault, or after `timeout_s`.
        """
        deadline = time.monotonic() + timeout_s
        self._edge("arm")
        asked = time.monotonic()
        while wait:
            status = self.status()
            state = State[status["state"]]
            if state == State.ACTIVE:
                return
            if state in (State.FAULT, State.ESTOP, *_CLOSED):
                first = status["fault_first"] or {"name": "no fault", "text": "none told"}
                raise RefusedError(
                    "not_ready", f"arming ended in {state.name}: {first['name']}: {first['text']}"
                )
            if time.monotonic() > deadline:
                raise RefusedError("not_ready", f"state {state.name} after {timeout_s:g} s; not ACTIVE")
            if state == State.IDLE and time.monotonic() - asked > _ASK_AGAIN_S:
                self._edge("arm")
                asked = time.monotonic()
            time.sleep(_POLL_S)

    def stop(self) -> None:
        """Ramp the torque to zero and disable the actuator. Never refused."""
        self._call("stop")

    def reset(self, *, wait: bool = True, timeout_s: float = 5.0) -> None:
        """Leave FAULT or ESTOP. With `wait`, return when the rig is IDLE, repeating the request until then.

        Raises
        ------
        RefusedError
            There is nothing to reset, or the cause is still there after `timeout_s`.
        """
        deadline = time.monotonic() + timeout_s
        self._call("reset")
        while wait:
            status = self.status()
            state = State[status["state"]]
            if state in _CLOSED:
                raise RefusedError("not_ready", f"the rig is in {state.name}: restart the daemon")
            if state not in (State.FAULT, State.ESTOP):
                return
            if time.monotonic() > deadline:
                present = ", ".join(fault["name"] for fault in status["faults"]) or "none"
                raise RefusedError(
                    "not_ready", f"still {status['state']} after {timeout_s:g} s; present: {present}"
                )
            time.sleep(_ASK_AGAIN_S)
            self._reset_again()

    def _reset_again(self) -> None:
        try:
            self._call("reset")
        except RefusedError as refused:
            if refused.code != "not_ready":
                raise

    def tare(self) -> None:
        """Take the present force reading as zero. In IDLE, with no hand on the device."""
        self._call("tare")

    # -- setting values

    def set_environment(
        self,
        axis: str | int,
        kind: Kind,
        *,
        stiffness_nm_rad: float | None = None,
        damping_nms_rad: float | None = None,
        center_rad: float | None = None,
        side: Literal[-1, 1] | None = None,
        pitch_rad: float | None = None,
    ) -> dict[str, Any]:
        """Set the virtual environment of one axis; values left out stay. Returns what is then in force.

        Raises RefusedError for a value out of bounds (see `hello`).
        """
        given = {
            "stiffness_nm_rad": stiffness_nm_rad,
            "damping_nms_rad": damping_nms_rad,
            "center_rad": center_rad,
            "side": side,
            "pitch_rad": pitch_rad,
        }
        values = {name: value for name, value in given.items() if value is not None}
        return self._result("environment", axis=axis, kind=kind, **values)

    def set_target(
        self, position_rad: Sequence[float], velocity_rad_s: Sequence[float] | None = None
    ) -> None:
        """Send the proxy of the remote environments, one value per axis; at least every 20 ticks.

        Targets are valid in the epoch this client last saw when arming or asking for the status: after a
        stop they are refused with `wrong_epoch` until it asks again.
        """
        values = {"position_rad": [float(x) for x in position_rad]}
        if velocity_rad_s is not None:
            values["velocity_rad_s"] = [float(x) for x in velocity_rad_s]
        if self._epoch is None:
            self.status()
        self._call("target", epoch=self._epoch, **values)

    def set_compensation(self, share: float, axis: str | int | None = None) -> None:
        """Share of the configured friction feed-forward, 0 to 1, on one axis or on all."""
        values: dict[str, Any] = {"share": float(share)}
        if axis is not None:
            values["axis"] = axis
        self._call("compensation", **values)

    # -- telemetry

    def states(self) -> Stream[RigState]:
        """Decimated samples, from now on."""
        return self._opened(state_stream(self._context, self.endpoints.telemetry, self.timeout_s))

    def ticks(self) -> Stream[np.ndarray]:
        """Every tick, as structured arrays of `rtctl.tick.tick_dtype`, from now on."""
        return self._opened(tick_stream(self._context, self.endpoints.telemetry, self.timeout_s))

    def events(self) -> Stream[dict[str, Any]]:
        """Changes of state, and faults with their texts, from now on."""
        return self._opened(event_stream(self._context, self.endpoints.telemetry, self.timeout_s))

    def health(self) -> Stream[dict[str, Any]]:
        """Rate, latency percentiles, missed ticks and counters, once a second from now on."""
        return self._opened(health_stream(self._context, self.endpoints.telemetry, self.timeout_s))

    def latest_state(self) -> RigState:
        """The newest sample. Waits only when there is no fresh one; the sample's `age_s` is as of now.

        Raises
        ------
        NoReplyError
            No fresh sample within the client's `timeout_s`.
        """
        if self._newest is None:
            self._newest = self.states()
        deadline = time.monotonic() + self.timeout_s
        while True:
            while (sample := self._newest.receive(0)) is not None:
                self._last = sample
            now = time.monotonic()
            if self._last is not None and now - self._last.fields["sent_monotonic_s"] < FRESH_S:
                age = self._last.fields["age_s"] + now - self._last.fields["sent_monotonic_s"]
                return replace(self._last, age_s=age)
            if now > deadline:
                raise NoReplyError(
                    f"no fresh state from {self.endpoints.telemetry} within {self.timeout_s:g} s"
                )
            self._last = self._newest.receive(deadline - now) or self._last

    # -- inside

    def _opened(self, stream: Stream[Any]) -> Stream[Any]:
        self._streams.append(stream)
        return stream

    def _edge(self, op: str) -> None:
        """Ask for an edge in the epoch the daemon is in now."""
        self._call(op, epoch=self._call("status")["epoch"])

    def _call(self, op: str, **values: Any) -> Reply:  # noqa: ANN401
        with self._lock:
            if self._context.closed:
                raise ClientError("this client is closed")
            reply = self._requester.call(op, self.timeout_s, **values)
        if op == "status" or self._epoch is None:
            self._epoch = int(reply["epoch"])
        return reply

    def _result(self, op: str, **values: Any) -> dict[str, Any]:  # noqa: ANN401
        result: dict[str, Any] = self._call(op, **values)["result"]
        return result
