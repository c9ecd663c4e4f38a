"""A daemon without a controller, for tests of the wire alone.

A loop thread obeys commands through shared memory; a host thread runs the real telemetry and gateway.
"""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import zmq
from axis_bounds import BOUNDS as AXIS
from axis_bounds import DISPLAY
from patience import PATIENCE_S

from rtctl.control import mailbox
from rtctl.control.jit import records
from rtctl.control.records import command_dtype
from rtctl.control.vocabulary import Environment, Fault, State
from rtctl.host.exchange import gateway, requests
from rtctl.host.exchange.gateway import PAUSE_S, Gateway
from rtctl.host.exchange.rig_description import AxisDescription, RigDescription
from rtctl.host.exchange.streams import Telemetry
from rtctl.rt.shared_memory import CommandWriter, Memory, RingReader, words
from rtctl.tick import new_ticks
from rtctl.wire.endpoints import RuntimeDirectory
from rtctl.wire.entrances import Access
from rtctl.wire.openings import Openings

IPC_ONLY = Openings()
BOUNDS = {**AXIS, **DISPLAY}

FAULT_NS = 200_000_000
"""So long the cause of a fault is there."""

LATE_NS = 100_000_000

STANDSTILLS = ((gateway, "GIVEN_UP_S"), (requests, "STALLED_S"), (requests, "DECIDED_S"))
"""Times after which a host distrusts itself, its loop, or a request: here all of them stand still with the
machine, and nobody is to be distrusted for that."""


def description(names=("joint",), displays=("impedance",), **more) -> RigDescription:
    axes = tuple(AxisDescription(name, BOUNDS, displays=displays) for name in names)
    return RigDescription(**{"name": "mock", "axes": axes, "rate_hz": 1000.0, **more})


@cache
def warm_up(n_axes: int) -> None:
    """Compile what the loop calls, on scratch memory."""
    memory = Memory.create(n_axes, 8, 1)
    loop = FakeLoop(memory, 1e9)
    loop._cycle(1)
    memory.close()


class FakeLoop:
    """Advances ticks on CLOCK_MONOTONIC and follows arm, stop, reset and target edges."""

    def __init__(self, memory: Memory, rate_hz: float) -> None:
        n = memory.n_axes
        self.memory, self.period_ns = memory, round(1e9 / rate_hz)
        self.tick = records(new_ticks(1, n))
        self.command = records(np.zeros(2, command_dtype(n)))
        self.seen = {"arm_count": 0, "stop_count": 0, "reset_count": 0}
        self.state, self.epoch, self.faults, self.first, self.slot = State.IDLE, 1, Fault(0), Fault(0), 0
        self.gone_slot = 0
        self.start_ns = time.monotonic_ns()
        self.trip = threading.Event()

    def advance(self) -> None:
        """Record every tick that is due; a machine that stood still for longer than `LATE_NS` has stopped the
        rig's time, too.
        """
        now_ns = time.monotonic_ns()
        self.start_ns = max(self.start_ns, now_ns - LATE_NS - self.slot * self.period_ns)
        while self.start_ns + self.slot * self.period_ns <= now_ns:
            self._cycle(self.start_ns + self.slot * self.period_ns)
            self.slot += 1

    def _cycle(self, time_ns: int) -> None:
        mailbox.take(self.memory.header, self.memory.slot_words, words(self.command))
        command, row = self.command[0], self.tick[0]
        self._decide(command)
        row["tick"], row["time_ns"], row["wakeup_ns"], row["cycle_ns"] = self.slot, time_ns, 3000, 5000
        row["position_rad"] = 0.5 * math.sin(self.slot * 1e-3)
        row["temperature_c"] = math.nan
        row["enabled"] = self.state in (State.ARMING, State.ACTIVE)
        row["command_seq"], row["environment_kind"] = command["seq"], command["environment_kind"]
        for name in ("display_kind", "mass_kgm2", "mass_damping_nms_rad"):
            row[name] = command[name]
        row["compensation"], row["proxy_position_rad"] = (
            command["compensation"],
            command["target_position_rad"],
        )
        row["state"], row["epoch"], row["faults"] = int(self.state), self.epoch, int(self.faults)
        row["fault_first"] = int(self.first).bit_length() - 1
        mailbox.publish(self.memory.header, self.memory.ring_words, words(self.tick))

    def _decide(self, command: np.void) -> None:
        edges = {name: command[name] > count for name, count in self.seen.items()}
        self.seen = {name: int(command[name]) for name in self.seen}
        if self.trip.is_set():
            self.trip.clear()
            self.state, self.epoch = State.FAULT, self.epoch + 1
            self.faults = self.first = Fault.OVERSPEED
            self.gone_slot = self.slot + FAULT_NS // self.period_ns
        elif self.faults and self.slot >= self.gone_slot:
            self.faults = Fault(0)
        elif edges["stop_count"]:
            self.state, self.epoch = State.IDLE, self.epoch + 1
        elif edges["reset_count"] and self.state == State.FAULT and not self.faults:
            self.state, self.first = State.IDLE, Fault(0)
        elif edges["arm_count"] and self.state == State.IDLE and command["epoch"] == self.epoch:
            self.state = State.ARMING
        elif self.state == State.ARMING:
            self.state = State.ACTIVE


class FakeRig:
    """Both threads. A context manager; `loop.trip.set()` causes a fault."""

    def __init__(
        self,
        root: Path,
        *,
        names=("joint",),
        rate_hz: float = 1000.0,
        ring_rows: int = 8000,
        openings: Openings = IPC_ONLY,
        **more,
    ) -> None:
        self.openings, self.notices = openings, []
        warm_up(len(names))
        self.description = description(names, rate_hz=rate_hz, **more)
        self.runtime = RuntimeDirectory.acquire("mock", root)
        self.memory = Memory.create(len(names), ring_rows, round(1e9 / rate_hz))
        self.reader = RingReader(self.memory, from_start=True)
        self.writer = CommandWriter(self.memory)
        self.writer.command["environment_kind"] = Environment.REMOTE
        self.writer.send()
        self.loop = FakeLoop(self.memory, rate_hz)
        self._end = threading.Event()
        self._orders = deque()
        self._threads = [threading.Thread(target=self._run_loop), threading.Thread(target=self._run_host)]

    def __enter__(self):
        self._patience = pytest.MonkeyPatch()
        for module, name in STANDSTILLS:
            self._patience.setattr(module, name, PATIENCE_S)
        self.context = zmq.Context()
        endpoints = self.runtime.endpoints
        self.access = Access(
            self.context, endpoints, self.openings, lambda *notice: self.notices.append(notice)
        )
        self.telemetry = Telemetry(self.context, endpoints, self.description, access=self.access)
        self.gateway = Gateway(
            self.context, endpoints, self.writer, self.description, self.reader.latest, access=self.access
        )
        self.gateway._requests._desk._clock_s = lambda: 0.0  # a loaded machine is no silent renderer
        self.telemetry.commands = self.gateway.counts
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_):
        self._end.set()
        for thread in self._threads:
            thread.join()
        self.telemetry.close()
        self.gateway.close()
        self.context.term()
        self.memory.close()
        self.runtime.release()
        self._patience.undo()

    def in_host(self, order) -> None:
        """Have the host's thread call `order` between two turns: what it works on is its own."""
        self._orders.append(order)

    def _run_loop(self) -> None:
        while not self._end.is_set():
            self.loop.advance()
            time.sleep(0.002)

    def _run_host(self) -> None:
        due = time.monotonic()
        poller = zmq.Poller()
        self.gateway.register(poller)
        while not self._end.is_set():
            poller.poll(2)
            while self._orders:
                self._orders.popleft()()
            if self.gateway.serve():
                time.sleep(PAUSE_S)
            if time.monotonic() >= due:
                due += self.description.batch_s
                self.telemetry.publish(self.reader.read(), self.reader.overwritten)
