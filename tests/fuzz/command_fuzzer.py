"""Fuzzing of everything a client can send: `python tests/fuzz/command_fuzzer.py 10000000 [SEED]`.

Each input is bytes: a valid message of the table of operations, bent in one of several ways, or a map of
known keys with wild values, or noise. It goes the whole way: decoder, roles, lease, handlers, command, reply.
Three things are never allowed: an exception, a refused input that changes the command, an accepted one that
puts a value out of its bounds into it. The seed makes a run repeatable.
"""

from __future__ import annotations

import math
import os
import random
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import msgpack
import numpy as np

from rtctl.control.environments.table import OWN, PARAMETERS
from rtctl.control.vocabulary import Environment, State
from rtctl.host.exchange.messages import Refusal, decode, decode_target
from rtctl.host.exchange.operations import OPERATIONS, allowed
from rtctl.host.exchange.requests import Requests
from rtctl.host.exchange.rig_description import AxisDescription, RigDescription
from rtctl.rt.shared_memory import CommandWriter, Memory
from rtctl.tick import new_ticks
from rtctl.wire.authenticator import Caller
from rtctl.wire.encoding import encode
from rtctl.wire.protocol import ROLES, Endpoints

BOUNDS = {
    **{one.name: (one.low, one.high) for one in OWN if not one.sign},
    "stiffness_nm_rad": (0.0, 100.0),
    "damping_nms_rad": (0.0, 10.0),
    "center_rad": (-10.0, 10.0),
    "pitch_rad": (0.001, 10.0),
    "position_rad": (-3.0, 3.0),
    "velocity_rad_s": (-20.0, 20.0),
    "mass_kgm2": (0.01, 0.05),
    "mass_damping_nms_rad": (0.1, 2.0),
}
RIG = RigDescription(
    "mock",
    (
        AxisDescription("base", BOUNDS, displays=("admittance", "impedance")),
        AxisDescription("tip", BOUNDS),
    ),
    1000.0,
)
FIELDS = {
    **{f"environment_{one.name}": BOUNDS.get(one.name, (one.low, one.high)) for one in PARAMETERS},
    "environment_pitch_rad": (0.0, 10.0),  # 0: as it is before anybody set one
    "environment_kind": (0, len(Environment) - 1),
    "target_position_rad": BOUNDS["position_rad"],
    "target_velocity_rad_s": BOUNDS["velocity_rad_s"],
    "compensation": (0.0, 1.0),
    "display_kind": (0, 1),
    "mass_kgm2": (0.0, 0.05),  # 0: as it is before anybody set one
    "mass_damping_nms_rad": (0.0, 2.0),
}
STATES = [State.IDLE] * 4 + [State.ACTIVE] * 4 + list(State)
WILD = [
    None, True, False, 0, -1, 1, 2**31, 2**53, 2**53 + 1, 2**63, 2**64 - 1, -(2**63), 0.5, -0.0, 1e308,
    5e-324,
    math.nan, math.inf, -math.inf, "", "a", "base", "tip", "remote", "wall", "stop", "0" * 16, "f" * 16,
    "x" * 64, "é",
    b"", b"stop", [], [0.1, 0.2], [math.nan, 0], [1] * 8, [[]], [[0.1], [0.2]], {}, {"a": 1},
    msgpack.Timestamp(1),
    msgpack.ExtType(3, b"x"),
]  # fmt: skip
HEADERS = [bytes([kind]) + (10**8).to_bytes(4, "big") for kind in (0xDB, 0xDD, 0xDF, 0xC6, 0xC9)]


class Bench:
    """A daemon's command path without its sockets, and what must hold of it."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.memory = Memory.create(2, 8, 1_000_000)
        self.writer = CommandWriter(self.memory)
        self.row = new_ticks(1, 2)
        self.row["fault_first"] = -1
        self.requests = Requests(
            self.writer, RIG, Endpoints("ipc://a", "ipc://b", "ipc://c"), lambda: self.row
        )
        self.callers = [Caller(f"key:{role}", role, role) for role in ROLES]
        self.lease = "0" * 16
        self.inputs = self.accepted = 0

    def run(self, count: int) -> None:
        """Feed `count` inputs; raises AssertionError, with the input, at the first that breaks a promise."""
        for _ in range(count):
            if self.inputs % 64 == 0:
                self._move_on()
            payload = self._input()
            try:
                self._feed(payload)
            except Exception as error:
                raise AssertionError(f"input {payload.hex()} -> {error!r}") from error
            self.inputs += 1

    def _move_on(self) -> None:
        """Another state, another epoch, a tick that has taken every command."""
        self.row["state"] = self.random.choice(STATES)
        self.row["epoch"] += self.random.random() < 0.1
        self.row["time_ns"] = time.monotonic_ns() + 10**12  # new, however long this machine stands still
        self.row["command_seq"] = self.memory.header[0]["mailbox_seq"]

    def _feed(self, payload: bytes) -> None:
        before, seq = self.writer.command.tobytes(), int(self.memory.header[0]["mailbox_seq"])
        caller = self.random.choice(self.callers)
        request = (decode_target if self.random.random() < 0.3 else decode)(payload, RIG)
        outcome = request
        if not isinstance(request, Refusal):
            outcome = self.requests.perform(request, self.requests.newest(), caller)
        if isinstance(outcome, Refusal):
            assert self.writer.command.tobytes() == before, "a refused input changed the command"
            assert self.memory.header[0]["mailbox_seq"] == seq, "a refused input was sent to the loop"
            assert len(encode({"error": outcome.text})) < 1000
            return
        self.accepted += 1
        assert allowed(request.op, caller.role)
        assert len(encode(outcome)) < 20_000
        if "lease" in outcome:
            self.lease = outcome["lease"]
        command = self.writer.command[0]
        for name, (low, high) in FIELDS.items():
            values = command[name]
            assert np.all((values >= low) & (values <= high)), f"{name} = {values}"

    # -- inputs

    def _input(self) -> bytes:
        draw = self.random.random()
        if draw < 0.15:
            return self.random.randbytes(self.random.choice((0, 1, 2, 7, 43, 300)))
        if draw < 0.45:
            return self._wild_map()
        payload = self._valid()
        return payload if draw < 0.6 else self._bent(bytearray(payload))

    def _valid(self) -> bytes:
        return msgpack.packb(self._message())

    def _message(self) -> dict:
        pick = self.random
        op = pick.choice(list(OPERATIONS))
        message = {"id": pick.randrange(1000), "op": op}
        if OPERATIONS[op].needs_epoch or pick.random() < 0.2:
            message["epoch"] = int(self.row["epoch"][0])
        for key in OPERATIONS[op].keys:
            if key.required or pick.random() < 0.5:
                message[key.name] = self._value(key)
        return message

    def _value(self, key):
        pick = self.random
        if key.kind == "choice":
            return pick.choice(key.choices)
        if key.kind == "axis":
            return pick.choice((0, 1, "base", "tip"))
        if key.kind == "lease":
            return self.lease
        low, high = BOUNDS.get(key.name, (0.0, 1.0))
        return [pick.uniform(low, high), low] if key.kind == "numbers" else pick.uniform(low, high)

    def _wild_map(self) -> bytes:
        message = self._message()
        for _ in range(self.random.choice((1, 1, 2, 5))):
            message[self.random.choice((*message, "x", "axis", "lease"))] = self.random.choice(WILD)
        return msgpack.packb(message)

    def _bent(self, payload: bytearray) -> bytes:
        pick, where = self.random, self.random.randrange(len(payload))
        how = pick.randrange(6)
        if how == 0:
            payload[where] ^= 1 << pick.randrange(8)
        elif how == 1:
            payload[where] = pick.randrange(256)
        elif how == 2:
            del payload[where:]
        elif how == 3:
            payload[where:where] = pick.randbytes(pick.randrange(1, 5))
        elif how == 4:
            payload[where : where + 1] = pick.choice(HEADERS)
        else:
            payload[where:] = self._valid()[where:]
        return bytes(payload)


def run(seed: int, count: int) -> tuple[int, int]:
    """Inputs fed and accepted."""
    bench = Bench(seed)
    try:
        bench.run(count)
    finally:
        bench.memory.close()
    return bench.inputs, bench.accepted


def main() -> None:
    total = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000_000
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    workers, part = os.cpu_count() or 1, 100_000
    parts = [min(part, total - first) for first in range(0, total, part)]
    fed = accepted = 0
    began = time.monotonic()
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        for inputs, taken in pool.map(run, range(seed, seed + len(parts)), parts):
            fed, accepted = fed + inputs, accepted + taken
            sys.stderr.write(f"\r{fed} inputs, {accepted} accepted, {time.monotonic() - began:.0f} s")
    sys.stderr.write("\n")
    sys.stdout.write(
        f"{fed} inputs from seed {seed}: {accepted} accepted, none crashed, none got past its bounds\n"
    )


if __name__ == "__main__":
    main()
