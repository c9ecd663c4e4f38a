"""What the daemon does for each operation: reads the newest tick, edits the newest command, or refuses.

A request is accepted *for the loop*: the reply's `command_seq` is in force once a tick carries it. Nothing
here waits, and nothing but an accepted request changes the command."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np

from rtctl import tick
from rtctl.control.vocabulary import State
from rtctl.host.exchange.fault_book import FaultBook
from rtctl.host.exchange.force_zero import ForceZero
from rtctl.host.exchange.friction_watch import CANNOT_FOLLOW, FrictionWatch
from rtctl.host.exchange.lease import LeaseDesk
from rtctl.host.exchange.messages import Refusal, Request
from rtctl.host.exchange.motion_requests import Steering
from rtctl.host.exchange.motor_temperature import TemperatureWatch
from rtctl.host.exchange.newest_command import CommandSlot
from rtctl.host.exchange.operations import OPERATIONS, allowed
from rtctl.host.exchange.rig_description import RigDescription
from rtctl.host.exchange.timing_watch import measured_in
from rtctl.rt.shared_memory import CommandWriter
from rtctl.wire.authenticator import Caller
from rtctl.wire.fault_words import sentence
from rtctl.wire.protocol import PROTOCOL_VERSION, Endpoints, schema_sha256

Result = dict[str, Any]
Handler = Callable[[Request, np.void, Caller], Result | Refusal]
LatestRow = Callable[[], np.ndarray | None]

CLOSED = (State.LOCKOUT, State.SHUTDOWN)

STALLED_S = 1.0
"""A newest tick older than this means that the loop does not run."""

DECIDED_S = 2.0
"""For so long a client waits for a reply. An arm request that comes later (the daemon stood still, a network
held it back) was given up by whoever sent it, who may have a hand in the rig by now."""


class Requests:
    """Carries out checked requests on the newest command.

    Parameters
    ----------
    writer
        The host's end of the command mailbox.
    rig
        Names, axes and bounds.
    endpoints
        Told in `hello` to clients of this machine.
    latest
        Returns the newest tick as an array of one row, or None before the first.
    remote
        Told in `hello` to clients with a key.
    book
        Where faults come from.
    friction
        The watch over the friction; None: there is none.
    zero
        The zero of the force sensor; None: the law's is not known, and accepted.
    motors
        Which motors' temperatures are warned of, as telemetry has it; None: none so far."""

    def __init__(
        self,
        writer: CommandWriter,
        rig: RigDescription,
        endpoints: Endpoints,
        latest: LatestRow,
        remote: Endpoints | None = None,
        book: FaultBook | None = None,
        friction: FrictionWatch | None = None,
        zero: ForceZero | None = None,
        motors: TemperatureWatch | None = None,
    ) -> None:
        self._book, self._motors = book or FaultBook(rig), motors or TemperatureWatch(rig)
        self._friction = friction
        self._zero = zero or ForceZero(rig)
        if zero is None:
            self._zero.follow(None)
        self._slot = CommandSlot(writer)
        self._rig = rig
        self._endpoints = endpoints
        self._remote = remote or endpoints
        self._latest = latest
        self._desk = LeaseDesk(rig.rate_hz)
        self._steering = Steering(self._slot, rig, self._desk)
        self._handlers: dict[str, Handler] = {
            "hello": self._hello,
            "status": self._status,
            "schema": self._schema,
            "arm": self._arm,
            "stop": self._stop,
            "reset": self._reset,
            "tare": self._tare,
            "lease": self._steering.lease,
            "release": self._steering.release,
            "environment": self._steering.environment,
            "display": self._steering.display,
            "target": self._steering.target,
            "compensation": self._steering.compensation,
            "adapt": self._adapt,
        }

    def newest(self) -> np.void:
        """The newest tick, or one of zeros (state INIT) before the first."""
        row = self._latest()
        record: np.void = (tick.new_ticks(1, self._rig.n_axes) if row is None else row)[0]
        self._book.glance(record)
        return record

    def perform(self, request: Request, row: np.void, caller: Caller) -> Result | Refusal:
        """Do what `request` of `caller` asks, judged by the tick `row`; the result, or why it is refused."""
        if not allowed(request.op, caller.role):
            return Refusal(
                "forbidden",
                f"{request.op} is for the role {OPERATIONS[request.op].role}; {caller.name} is {caller.role}",
            )
        # a stop counts in every epoch
        if request.epoch is not None and request.op != "stop" and request.epoch != row["epoch"]:
            void = f"epoch {request.epoch} is void, {row['epoch']} is in force: a stop came between"
            return Refusal("wrong_epoch", f"{void}, or a restart; ask for the status, decide anew")
        # `arm` says more of it
        if request.epoch is not None and request.op not in ("stop", "arm") and self._slot.stop_pending(row):
            return Refusal("wrong_epoch", "a stop is on its way to the loop")
        state = State(int(row["state"]))
        # to ask, and to stop, is for everybody in every state
        if state in CLOSED and OPERATIONS[request.op].role != "observer":
            return Refusal("not_ready", f"state {state.name}: it ends when a person restarts the daemon")
        return self._handlers[request.op](request, row, caller)

    # -- asking

    def _hello(self, _request: Request, _row: np.void, caller: Caller) -> Result:
        rig = self._rig
        return {
            "protocol": PROTOCOL_VERSION,
            "version": rig.version,
            "rig": rig.name,
            "session": rig.session,
            "role": caller.role,
            "rate_hz": rig.rate_hz,
            "state_hz": rig.state_hz,
            "virtual_clock": rig.virtual,
            "axes": [axis.told() for axis in rig.axes],
            "not_proved": list(rig.not_proved),
            "endpoints": asdict(self._remote if caller.user_id.startswith("key:") else self._endpoints),
            "config_sha256": rig.config_sha256,
            "schema_sha256": schema_sha256(rig.n_axes, rig.motions),
        }

    def _schema(self, _request: Request, _row: np.void, _caller: Caller) -> Result:
        return {
            "schema": tick.json_schema(self._rig.n_axes, self._rig.motions),
            "schema_sha256": schema_sha256(self._rig.n_axes, self._rig.motions),
        }

    def _status(self, _request: Request, row: np.void, _caller: Caller) -> Result:
        lease = self._desk.present(int(row["epoch"]))
        first, rig = int(row["fault_first"]), self._rig
        return {
            "tick": int(row["tick"]),
            "monotonic_s": int(row["time_ns"]) * 1e-9,
            "authority": float(row["authority"]),
            "enabled": bool(row["enabled"]),
            "estop": bool(row["estop"]),
            "waiver": bool(row["waiver"]),
            "missed_ticks": int(row["missed_ticks"]),
            "faults": self._book.entries(int(row["faults"])),
            "fault_first": self._book.entries(1 << first)[0] if first >= 0 else None,
            "cause": self._book.cause(row),
            "devices": [voice.as_dict() for voice in self._book.words.voices()],
            "warnings": [
                *self._motors.now(row),
                *([] if self._friction is None else self._friction.warnings()),
            ],
            "command_seq_in_force": int(row["command_seq"]),
            "target_age_ticks": int(row["target_age_ticks"]),
            "position_rad": row["position_rad"].tolist(),
            "velocity_rad_s": row["velocity_rad_s"].tolist(),
            "lease_holder": None if lease is None else lease.holder,
            "lease_in_force": bool(row["lease_held"]),
            "axes": [
                {
                    **self._steering.axis_in_force(a),
                    "motion": rig.axes[a].motion,
                    "measured": one,
                    "adapting": None if self._friction is None else self._friction.adapting(a),
                }
                for a, one in enumerate(measured_in(row, 1.0 / self._rig.rate_hz))
            ],
        }

    # -- moving the state machine

    def _arm(self, request: Request, row: np.void, _caller: Caller) -> Result | Refusal:
        why = self._decided_elsewhen(request, row) or self._not_ready_to_arm(row)
        if why:
            return Refusal("not_ready", why)
        if self._zero.taring(int(self._slot.command["tare_count"])):
            return {"command_seq": self._slot.send()}  # the law would not arm yet either
        return {"command_seq": self._slot.arm(int(row["epoch"]))}

    def _decided_elsewhen(self, request: Request, row: np.void) -> str:
        """Why this request is not what somebody wants now; empty where it is, or does not tell its tick."""
        tick_now = int(row["tick"])
        decided = request.values.get("tick", tick_now)
        if decided > tick_now:
            return "the daemon was started anew since this was decided; decide anew"
        late_s = (tick_now - decided) / self._rig.rate_hz
        if not self._rig.virtual and late_s > DECIDED_S:
            return f"this was decided {late_s:.1f} s ago and came too late; decide anew"
        return ""

    def _not_ready_to_arm(self, row: np.void) -> str:
        state = State(int(row["state"]))
        present = self._book.entries(int(row["faults"]))
        faults = "; ".join(sentence(entry) for entry in present)
        age_s = (time.monotonic_ns() - int(row["time_ns"])) * 1e-9
        if row["time_ns"] == 0 or (not self._rig.virtual and age_s > STALLED_S):
            return "the loop does not run: its newest tick is missing or older than 1 s"
        if self._slot.stop_pending(row):
            return "a stop is on its way to the loop; ask for the status, then arm again"
        if row["estop"]:
            return f"state {state.name}: the emergency stop is pressed; release it"
        if state in (State.FAULT, State.ESTOP):
            return f"state {state.name} (present: {faults or 'none'}): remove the cause, then reset"
        if state != State.IDLE:
            return f"state {state.name}: arming starts from IDLE: stop first"
        if faults:
            return f"state IDLE with faults present: {faults}; arm again when they are gone"
        if not self._zero.taring(int(self._slot.command["tare_count"])) and (moved := self._zero.refusal()):
            return moved
        return "" if self._friction is None else self._friction.hindrance(self._slot.command["compensation"])

    def _stop(self, _request: Request, _row: np.void, _caller: Caller) -> Result:
        return {"command_seq": self.stop()}

    def stop(self) -> int:
        """Ramp the torque to zero, whoever holds a lease; number of the command."""
        self._desk.end("a stop ended it")
        return self._slot.stop()

    def _reset(self, _request: Request, row: np.void, _caller: Caller) -> Result | Refusal:
        state = State(int(row["state"]))
        if state not in (State.FAULT, State.ESTOP):
            if state == State.IDLE and self._friction is not None and self._friction.dismiss():
                return {"command_seq": self._slot.send()}
            return Refusal("not_ready", f"state {state.name}: there is no latched fault to reset")
        if row["estop"]:
            return Refusal(
                "not_ready", f"state {state.name}: the emergency stop is pressed; release it, then reset"
            )
        present = self._book.entries(int(row["faults"]))
        if present:
            causes = "; ".join(sentence(entry) for entry in present)
            return Refusal(
                "not_ready", f"state {state.name}, still present: {causes}; remove the cause, then reset"
            )
        return {"command_seq": self._slot.edge("reset_count")}

    def _adapt(self, request: Request, _row: np.void, _caller: Caller) -> Result | Refusal:
        """Have the feed-forward follow the friction that is seen, or hold it where it is."""
        names = [axis.name for axis in self._rig.axes]
        axis, on = request.values.get("axis"), request.values["follow"] == "on"
        why = CANNOT_FOLLOW if self._friction is None else self._friction.adapt(axis, on=on)
        if why and on:
            which = "no axis may" if axis is None else f"axis {names[axis]}"
            return Refusal("out_of_bounds", f"follow: {which}: it {why}")
        now = [None if self._friction is None else self._friction.adapting(a) for a in range(len(names))]
        return {"adapting": dict(zip(names, now, strict=True))}

    def _tare(self, request: Request, row: np.void, _caller: Caller) -> Result | Refusal:
        state = State(int(row["state"]))
        if state not in (State.INIT, State.IDLE, State.FAULT, State.ESTOP):
            why = "the force is tared at rest: stop first, hands off, then tare"
            return Refusal("not_ready", f"state {state.name}: {why}")
        if "hands" in request.values and request.epoch is None:
            return Refusal("missing_key", "epoch: who says that nobody touches the device says it of now")
        if "hands" not in request.values:
            if pull := self._zero.pull(row):
                return Refusal("not_ready", pull)
        else:
            self._zero.accept_next(int(self._slot.command["tare_count"]) + 1)
        return {"command_seq": self._slot.edge("tare_count")}
