"""`RigClient`: requests, streams and the newest state of one rig."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Self

import zmq

from rtctl.client.connection import Connection, remote_endpoints
from rtctl.client.lease import Lease
from rtctl.client.listener import Listener
from rtctl.client.requests import Reply, Requester
from rtctl.client.worlds import Worlds
from rtctl.control.vocabulary import State
from rtctl.errors import ClientError, ConfigError, RefusedError
from rtctl.wire.fault_words import sentence
from rtctl.wire.keys import ClientKey
from rtctl.wire.protocol import Endpoints, client_directory, endpoints_in

LEASE_POLL_S = 0.05  # half of what the loop asks for after a release
_POLL_S = 0.005  # a renderer's targets go out so often while it arms: HOLD comes after 20 ms
_ASK_AGAIN_S = 0.2  # an edge that the law did not take (not ready yet) is lost: asked anew
_CLOSED = (State.LOCKOUT, State.SHUTDOWN)


class RigClient(Worlds, Listener):
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
    address, key
        `HOST:PORT` of a rig on another machine, and this client's key file (`rtctl keys new`).

    Raises
    ------
    ConfigError
        A name that cannot be a rig's, a path too long for a socket, a key file that is none, a folder that
        belongs to another user, who could answer in place of the rig."""

    def __init__(
        self,
        rig: str = "mock",
        *,
        endpoints: Endpoints | None = None,
        runtime_dir: str | Path | None = None,
        timeout_s: float = 2.0,
        address: str | None = None,
        key: str | Path | None = None,
    ) -> None:
        if not 0 < timeout_s < math.inf:
            raise ConfigError(f"timeout_s {timeout_s!r}: seconds, more than 0")
        root = None if runtime_dir is None else Path(runtime_dir)
        if (address is None) != (key is None):
            raise ConfigError(
                "address and key belong together: a rig on the network is reached with a key only"
            )
        if address is not None:
            endpoints = remote_endpoints(address)
        client_key = None if key is None else ClientKey.load(key)
        addresses = endpoints or endpoints_in(client_directory(rig, root))  # the first that was given
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        super().__init__(Connection(self._context, addresses, client_key), timeout_s)
        self._requester = Requester(self._connection)
        self._lock = threading.Lock()  # requests of several threads take turns
        self._lease: Lease | None = None
        self._epoch: int | None = None  # none seen yet: asked for when it is needed

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def close(self) -> None:
        """Close every stream and connection. Does not stop the rig. Idempotent."""
        if self._lease is not None:
            self._lease.abandon()
        with self._lock:  # a request of another thread ends first
            self._requester.close()
        self.close_streams()  # before the context: it waits for every socket
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

    def arm(
        self, *, wait: bool = True, timeout_s: float = 10.0, meanwhile: Callable[[], object] = lambda: None
    ) -> None:
        """Enable the actuator. With `wait`, return when the rig is ACTIVE.

        While the rig is still getting ready (IDLE) the request is repeated. `meanwhile` is called every few
        milliseconds: a renderer sends its targets there, without which a remote environment stops at once.

        Raises
        ------
        RefusedError
            `not_ready`, saying what is missing; also when arming ended in a fault, or after `timeout_s`.
            `wrong_epoch`: somebody stopped the rig meanwhile."""
        deadline = time.monotonic() + timeout_s
        status = self.status()  # not remembered: whoever stopped the rig before this is not armed over
        epoch = int(status["epoch"])
        self._call("arm", epoch=epoch, tick=status["tick"])
        asked = time.monotonic()
        while wait:
            status = self.status()
            state = State[status["state"]]
            if state in (State.FAULT, State.ESTOP, *_CLOSED):
                cause = (
                    status.get("cause") or status["fault_first"] or {"name": "no fault", "text": "none told"}
                )
                raise RefusedError("not_ready", f"arming ended in {state.name}: {sentence(cause)}")
            if status["epoch"] != epoch:  # who stopped the rig did not mean until the next request
                raise RefusedError("wrong_epoch", "the rig was stopped while it armed; decide anew")
            if state == State.ACTIVE:  # after the epoch was compared: nobody stopped it meanwhile
                return
            if time.monotonic() > deadline:
                raise RefusedError("not_ready", f"state {state.name} after {timeout_s:g} s; not ACTIVE")
            if state == State.IDLE and time.monotonic() - asked > _ASK_AGAIN_S:
                self._call("arm", epoch=epoch, tick=status["tick"])
                asked = time.monotonic()
            meanwhile()
            time.sleep(_POLL_S)

    def stop(self) -> int:
        """Ramp the torque to zero and disable the actuator. Never refused.

        Returns the number of the stop, before the torque is zero: a status whose `command_seq_in_force` is
        below that number tells of before the stop."""
        # without an epoch: it is meant for whatever runs now
        return int(self._call("stop")["result"].get("command_seq", 0))

    def reset(self, *, wait: bool = True, timeout_s: float = 5.0) -> None:
        """Leave FAULT or ESTOP. With `wait`, return when the rig is IDLE, repeating the request until then.

        Raises
        ------
        RefusedError
            There is nothing to reset, or the cause is still there after `timeout_s`."""
        deadline = time.monotonic() + timeout_s
        try:
            self._call("reset")
        except RefusedError as refused:  # a cause that is still there may go while this waits
            if not wait or refused.code != "not_ready" or not self._is_latched():
                raise
        while wait:
            status = self.status()
            state = State[status["state"]]
            if state in _CLOSED:
                raise RefusedError("not_ready", f"the rig is in {state.name}: restart the daemon")
            if state not in (State.FAULT, State.ESTOP):
                return
            if time.monotonic() > deadline:
                present = "; ".join(sentence(fault) for fault in status["faults"]) or "none"
                raise RefusedError(
                    "not_ready", f"still {status['state']} after {timeout_s:g} s; present: {present}"
                )
            time.sleep(_ASK_AGAIN_S)  # its cause has to be gone for a second
            self._reset_again()

    def _is_latched(self) -> bool:
        return self.status()["state"] in (State.FAULT.name, State.ESTOP.name)

    def _reset_again(self) -> None:
        try:
            self._call("reset")
        except RefusedError as refused:
            if refused.code != "not_ready":
                raise

    def tare(self, *, hands_off: bool = False) -> None:
        """Take the present force reading as zero. In IDLE, with no hand on the device.

        A force that looks like a hand is refused (`not_ready`). With `hands_off` you say that nobody touches
        the device: the sensor itself has moved."""
        values = {"hands": "off", "epoch": self.status()["epoch"]} if hands_off else {}  # as it is now
        self._call("tare", **values)

    # -- setting values

    def lease(self, wait_s: float = 0.5) -> Lease:
        """Be the one who moves the proxy of the remote environments: the way for a renderer.

        The lease belongs to the epoch this client last saw when arming or asking for the status. While
        another client has it, or has only just let go, it is asked for again for up to `wait_s`.

        Raises
        ------
        RefusedError
            `lease_taken` (the text says by whom, and what to do), `wrong_epoch`, `forbidden`."""
        if self._epoch is None:
            self.status()
        assert self._epoch is not None
        if self._lease is not None:
            self._lease.release()
        deadline = time.monotonic() + wait_s
        while True:
            try:
                self._lease = Lease(self._connection, self._epoch, self.timeout_s)
            except RefusedError as refused:
                if refused.code != "lease_taken" or time.monotonic() > deadline:  # others do not pass
                    raise
                time.sleep(LEASE_POLL_S)
            else:
                return self._lease

    def set_target(
        self, position_rad: Sequence[float], velocity_rad_s: Sequence[float] | None = None
    ) -> None:
        """Send the proxy of the remote environments, one value per axis, and wait for the reply.

        Takes the lease when this client has none; `Lease.set_target` is quicker, and does not wait. Targets
        are valid in the epoch this client last saw when arming or asking for the status: after a stop they
        are refused (`wrong_epoch`, `lease_lost`) until it asks again."""
        values: dict[str, Any] = {"position_rad": [float(x) for x in position_rad]}
        if velocity_rad_s is not None:
            values["velocity_rad_s"] = [float(x) for x in velocity_rad_s]
        if self._epoch is None:
            self.status()
        if self._lease is None or self._lease.epoch != self._epoch:
            self.lease()
        assert self._lease is not None
        try:
            self._call("target", epoch=self._epoch, lease=self._lease.text, **values)
        except RefusedError as refused:
            if refused.code == "lease_lost":
                self._lease.abandon()
                self._lease = None
            raise

    def set_compensation(self, share: float, axis: str | int | None = None) -> None:
        """Share of the configured friction feed-forward, 0 to 1, on one axis or on all."""
        values: dict[str, Any] = {"share": float(share)}
        if axis is not None:
            values["axis"] = axis
        self._call("compensation", **values)

    def set_adaptation(self, on: bool, axis: str | int | None = None) -> dict[str, bool | None]:
        """Have the compensation follow the friction that is seen, or hold it where it is, on one axis or on
        all that may.

        Returns
        -------
        dict
            Of each axis, by name, whether it follows; None where it may not.

        Raises
        ------
        RefusedError
            `out_of_bounds`: the rig file has adapt_per_min = 0, or that axis has nothing to follow."""
        values: dict[str, Any] = {"follow": "on" if on else "off"}
        if axis is not None:
            values["axis"] = axis
        adapting: dict[str, bool | None] = self._result("adapt", **values)["adapting"]
        return adapting

    # -- inside

    def _call(self, op: str, **values: object) -> Reply:
        with self._lock:
            if self._context.closed:
                raise ClientError("this client is closed")
            reply = self._requester.call(op, self.timeout_s, **values)
        if op == "status" or self._epoch is None:  # nobody decides by an epoch of another reply
            self._epoch = int(reply["epoch"])
        return reply

    def _result(self, op: str, **values: object) -> dict[str, Any]:
        result: dict[str, Any] = self._call(op, **values)["result"]
        return result
