"""What the daemon does for each operation: reads the newest tick, edits the newest command, or refuses.

A request is accepted *for the loop*: the reply's `command_seq` is in force once a tick carries it. Nothing
here waits, and nothing but an accepted request changes the command.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from rtctl import tick
from rtctl.control.vocabulary import Environment, State
from rtctl.host.description import RigDescription
from rtctl.host.faults import fault_entries
from rtctl.host.messages import Refusal, Request
from rtctl.host.temperature import temperature_warnings
from rtctl.protocol import PROTOCOL_VERSION, Endpoints, schema_sha256
from rtctl.shm import CommandWriter

Result = dict[str, Any]
LatestRow = Callable[[], np.ndarray | None]

ONLY_LEASE = 1
"""Nonce of the one renderer."""

STALLED_S = 1.0
"""A newest tick older than this means that the loop does not run."""

_ENVIRONMENT_KEYS = ("stiffness_nm_rad", "damping_nms_rad", "center_rad", "side", "pitch_rad")
_CLOSED = (State.LOCKOUT, State.SHUTDOWN)


class Requests:
    """Carries out checked requests on the newest command.

    Parameters
    ----------
    writer
        The host's end of the command mailbox.
    rig
        Names, axes and bounds.
    endpoints
        Told in `hello`.
    latest
        Returns the newest tick as an array of one row, or None before the first.
    """

    def __init__(
        self, writer: CommandWriter, rig: RigDescription, endpoints: Endpoints, latest: LatestRow
    ) -> None:
        self._writer = writer
        self._rig = rig
        self._endpoints = endpoints
        self._latest = latest
        self._stop_seq = 0
        self._handlers: dict[str, Callable[[Request, np.void], Result | Refusal]] = {
            "hello": self._hello,
            "status": self._status,
            "schema": self._schema,
            "arm": self._arm,
            "stop": self._stop,
            "reset": self._reset,
            "tare": self._tare,
            "environment": self._environment,
            "target": self._target,
            "compensation": self._compensation,
        }

    def newest(self) -> np.void:
        """The newest tick, or one of zeros (state INIT) before the first."""
        row = self._latest()
        record: np.void = (tick.new_ticks(1, self._rig.n_axes) if row is None else row)[0]
        return record

    def perform(self, request: Request, row: np.void) -> Result | Refusal:
        """Do what `request` asks, judged by the tick `row`; the result, or why it is refused."""
        if request.epoch is not None and request.op != "stop" and request.epoch != row["epoch"]:
            return Refusal(
                "wrong_epoch",
                f"epoch {request.epoch} is void, {row['epoch']} is in force: a stop came between",
            )
        return self._handlers[request.op](request, row)

    # -- asking

    def _hello(self, _request: Request, _row: np.void) -> Result:
        rig = self._rig
        return {
            "protocol": PROTOCOL_VERSION,
            "version": rig.version,
            "rig": rig.name,
            "session": rig.session,
            "rate_hz": rig.rate_hz,
            "state_hz": rig.state_hz,
            "virtual_clock": rig.virtual,
            "axes": [
                {"name": axis.name, "bounds": {k: list(v) for k, v in axis.bounds.items()}}
                for axis in rig.axes
            ],
            "endpoints": {"telemetry": self._endpoints.telemetry, "command": self._endpoints.command},
            "config_sha256": rig.config_sha256,
            "schema_sha256": schema_sha256(rig.n_axes),
        }

    def _schema(self, _request: Request, _row: np.void) -> Result:
        return {
            "schema": tick.json_schema(self._rig.n_axes),
            "schema_sha256": schema_sha256(self._rig.n_axes),
        }

    def _status(self, _request: Request, row: np.void) -> Result:
        command = self._writer.command[0]
        first = int(row["fault_first"])
        return {
            "tick": int(row["tick"]),
            "monotonic_s": int(row["time_ns"]) * 1e-9,
            "authority": float(row["authority"]),
            "enabled": bool(row["enabled"]),
            "estop": bool(row["estop"]),
            "waiver": bool(row["waiver"]),
            "missed_ticks": int(row["missed_ticks"]),
            "faults": fault_entries(int(row["faults"])),
            "fault_first": fault_entries(1 << first)[0] if first >= 0 else None,
            "warnings": temperature_warnings(self._rig, row),
            "command_seq_in_force": int(row["command_seq"]),
            "target_age_ticks": int(row["target_age_ticks"]),
            "position_rad": row["position_rad"].tolist(),
            "velocity_rad_s": row["velocity_rad_s"].tolist(),
            "axes": [self._axis_in_force(a, command) for a in range(self._rig.n_axes)],
        }

    def _axis_in_force(self, a: int, command: np.void) -> Result:
        return {
            "axis": self._rig.axes[a].name,
            "environment": {
                "kind": Environment(int(command["environment_kind"][a])).name.lower(),
                **{key: command[f"environment_{key}"][a].item() for key in _ENVIRONMENT_KEYS},
            },
            "compensation": float(command["compensation"][a]),
            "target_position_rad": float(command["target_position_rad"][a]),
            "target_velocity_rad_s": float(command["target_velocity_rad_s"][a]),
        }

    # -- moving the state machine

    def _arm(self, _request: Request, row: np.void) -> Result | Refusal:
        why = self._not_ready_to_arm(row)
        if why:
            return Refusal("not_ready", why)
        return self._edge("arm_count", row)

    def _not_ready_to_arm(self, row: np.void) -> str:
        state = State(int(row["state"]))
        faults = ", ".join(entry["name"] for entry in fault_entries(int(row["faults"])))
        age_s = (time.monotonic_ns() - int(row["time_ns"])) * 1e-9
        if row["time_ns"] == 0 or (not self._rig.virtual and age_s > STALLED_S):
            return "the loop does not run: its newest tick is missing or older than 1 s"
        if int(row["command_seq"]) < self._stop_seq:
            return "a stop is on its way to the loop; ask for the status, then arm again"
        if row["estop"]:
            return f"state {state.name}: the emergency stop is pressed; release it"
        if state in (State.FAULT, State.ESTOP):
            return f"state {state.name} (present: {faults or 'none'}): remove the cause, then reset"
        if state != State.IDLE:
            return f"state {state.name}: arming starts from IDLE"
        if faults:
            return f"state IDLE with faults present: {faults}"
        return ""

    def _stop(self, _request: Request, row: np.void) -> Result:
        result = self._edge("stop_count", row)
        self._stop_seq = int(result["command_seq"])
        return result

    def _reset(self, _request: Request, row: np.void) -> Result | Refusal:
        state = State(int(row["state"]))
        if state in _CLOSED:
            return Refusal(
                "not_ready", f"state {state.name}: only a person who restarts the daemon leaves it"
            )
        if state not in (State.FAULT, State.ESTOP):
            return Refusal("not_ready", f"state {state.name}: there is no latched fault to reset")
        return self._edge("reset_count", row)

    def _tare(self, _request: Request, row: np.void) -> Result | Refusal:
        state = State(int(row["state"]))
        if state not in (State.INIT, State.IDLE, State.FAULT, State.ESTOP):
            return Refusal(
                "not_ready", f"state {state.name}: the force is tared at rest, with no hand on the device"
            )
        return self._edge("tare_count", row)

    def _edge(self, counter: str, row: np.void) -> Result:
        self._writer.command[counter] += 1
        return self._send(row)

    # -- setting values

    def _environment(self, request: Request, row: np.void) -> Result | Refusal:
        if closed := self._closed(row):
            return closed
        axis, command = request.values["axis"], self._writer.command[0]
        command["environment_kind"][axis] = Environment[request.values["kind"].upper()]
        for key in _ENVIRONMENT_KEYS:
            if key in request.values:
                command[f"environment_{key}"][axis] = request.values[key]
        return {**self._send(row), **self._axis_in_force(axis, command)}

    def _target(self, request: Request, row: np.void) -> Result | Refusal:
        if closed := self._closed(row):
            return closed
        command = self._writer.command[0]
        if int(row["command_seq"]) < self._stop_seq:
            return Refusal("wrong_epoch", "a stop is on its way to the loop")
        if not (command["environment_kind"] == Environment.REMOTE).any():
            return Refusal("not_remote", "no axis has the environment `remote`; set it first")
        command["target_position_rad"] = request.values["position_rad"]
        command["target_velocity_rad_s"] = request.values.get("velocity_rad_s", 0.0)
        command["target_epoch"], command["target_lease"] = row["epoch"], ONLY_LEASE
        return self._edge("target_count", row)

    def _compensation(self, request: Request, row: np.void) -> Result | Refusal:
        if closed := self._closed(row):
            return closed
        axis = request.values.get("axis", slice(None))
        self._writer.command[0]["compensation"][axis] = request.values["share"]
        return self._send(row)

    def _closed(self, row: np.void) -> Refusal | None:
        state = State(int(row["state"]))
        return Refusal("not_ready", f"state {state.name}: the rig is closed") if state in _CLOSED else None

    def _send(self, row: np.void) -> Result:
        """Publish the command in the epoch of the newest tick; a stop meanwhile voids it."""
        self._writer.command["epoch"] = row["epoch"]
        return {"command_seq": self._writer.send()}
