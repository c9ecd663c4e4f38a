"""A drive on slcan and a force sensor on a serial port as one rig, beside a bare reader of the same bytes."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from hw.can import slcan
from hw.can.odrive_codec import GET_ENCODER, PAIR, can_id
from hw.can.options import OdriveOptions
from hw.force import rokubi
from hw.force.frames import Frames
from hw.force.options import RokubiOptions
from hw.interface import Backend, BackendError, CompiledBackend, Rig
from hw.member import Member
from hw.rig import compose
from hw.serial_port import CHUNK, Port
from rtctl.errors import RtctlError
from rtctl.tick import new_ticks
from tests.bench.io_source import NODE
from tests.bench.row import Row

PERIOD_NS = 1_000_000
OLD_S = 2e-3
SENSOR_MAX_AGE_TICKS = 1
"""Sensor and loop run at one rate on two clocks: a cycle without a new force is in order."""


SETTLED = 20
"""Cycles until what queued up before the first one is gone."""


class BareReader:
    """What a careful user writes for these two ports: read all that waits, keep the newest of each."""

    def __init__(self, drive: str, sensor: str) -> None:
        self._ports = Port(drive, 115_200), Port(sensor, rokubi.BAUD)
        self._frames, self._left = Frames(rokubi.HEADER, rokubi.LENGTH, rokubi.intact), b""
        self._wanted = can_id(NODE, GET_ENCODER)
        self.turns = self.force_n = 0.0

    def cycle(self) -> None:
        """Take in what waits."""
        drive, sensor = (self._all(port) for port in self._ports)
        *lines, self._left = (self._left + drive).split(b"\r")
        for one in lines:
            found = slcan.parse(one)
            if found is not None and found[0] == self._wanted:
                self.turns = PAIR.unpack(found[1])[0]
        frame = self._frames.newest(sensor)
        if frame is not None:
            self.force_n = rokubi.decode(frame).force[0]

    @staticmethod
    def _all(port: Port) -> bytes:
        try:
            return os.read(port.fd, CHUNK)
        except BlockingIOError:
            return b""

    def close(self) -> None:
        """Release both ports."""
        for port in self._ports:
            port.close()


@dataclass
class Ages:
    """What was seen. `old_*`: cycles whose older part is older than `OLD_S`."""

    cycles: int = 0
    old: int = 0
    old_bare: int = 0
    stale_as_fresh: int = 0
    fresh: int = 0
    _count: int = -1
    _turns: float = -1.0
    _force: float = -1.0
    _same_force: int = 0

    def judge(self, tick: np.ndarray, began_s: float, bare: BareReader) -> None:
        """One cycle that began at `began_s`, on the clock the devices measure."""
        count = int(tick["sample_count"][0])
        turns, force = float(tick["position_rad"][0, 0]) / math.tau, float(tick["force_n"][0, 0])
        self._same_force = self._same_force + 1 if force == self._force else 0
        self.cycles += 1
        self.old += began_s - min(turns, force) > OLD_S
        self.old_bare += began_s - min(bare.turns, bare.force_n) > OLD_S
        if count != self._count:
            self.fresh += 1
            self.stale_as_fresh += turns == self._turns or self._same_force > SENSOR_MAX_AGE_TICKS
        self._count, self._turns, self._force = count, turns, force


def _rig(drive: str, sensor: str) -> Backend:
    one = np.ones(1)
    bus = {"interface": "slcan", "channel": drive}
    odrive = OdriveOptions.model_validate({"bus": bus, "axis": [{"node": NODE}]}).model_dump(mode="json")
    force = RokubiOptions.model_validate({"port": sensor, "matrix": np.eye(3).tolist()}).model_dump(
        mode="json"
    )
    moving = ("current", "current_command", "position")
    members = [
        Member("odrive", odrive, "device[0] 'drive'", (0,), moving),
        Member("rokubi", force, "device[1] 'sensor'", (0,), ("force",), SENSOR_MAX_AGE_TICKS),
    ]
    return compose(members, Rig(1, 1e-9 * PERIOD_NS, one, one, 0.05 * one, 4096 * one, np.eye(3)[:1]))


@contextmanager
def _source() -> Iterator[tuple[int, list[str]]]:
    command = [sys.executable, "-m", "tests.bench.io_source"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            start, *ports = process.stdout.readline().split()
            yield int(start), ports
        finally:
            process.kill()


def measure(seconds: float) -> Ages:
    """Run both readers in every cycle for some seconds, in turn first. Raises RtctlError."""
    with _source() as (start, ports):
        rig = _rig(*ports[:2])
        try:
            rig.open()
        except BackendError as error:
            raise RtctlError(str(error)) from error
        bare = BareReader(*ports[2:])
        try:
            return _cycles(rig, bare, start, round(seconds * 1e9) // PERIOD_NS)
        finally:
            bare.close()
            rig.close()


def _cycles(rig: Backend, bare: BareReader, start: int, cycles: int) -> Ages:
    tick, ages = new_ticks(1, 1), Ages()
    if isinstance(rig, CompiledBackend):
        rig.warm_up(tick)
    began = time.monotonic_ns()
    slot = 0
    while slot < cycles:
        slot = max(slot + 1, (time.monotonic_ns() - began) // PERIOD_NS)  # slots that have passed are skipped
        time.sleep(max(0, began + slot * PERIOD_NS - time.monotonic_ns()) * 1e-9)
        tick["tick"] = slot
        for ours in (True, False) if slot % 2 else (False, True):
            if ours:
                now = time.monotonic_ns()
                rig.read(tick)
            else:
                bare.cycle()
        if slot > SETTLED:
            ages.judge(tick, 1e-9 * (now - start), bare)
        rig.write(tick)
    return ages


def rows(seconds: float) -> list[Row]:
    """Stale samples shown as fresh, and the share of old samples beyond those of the bare reader."""
    ages = measure(seconds)
    if ages.fresh < ages.cycles // 4:
        raise RtctlError(f"composed rig: only {ages.fresh} samples in {ages.cycles} cycles: machine too busy")
    ours, theirs = 100 * ages.old / ages.cycles, 100 * ages.old_bare / ages.cycles
    told = (
        f"{ages.cycles} cycles at 1 kHz, {ages.fresh} samples; drive on slcan, force sensor on serial, ptys"
    )
    return [
        Row("composed rig: stale shown as fresh", ages.stale_as_fresh, "samples", told, 0),
        Row("composed rig: older than 2 ms, beyond bare", ours - theirs, "%",
            f"bare reader {theirs:.3f} %, ours {ours:.3f} %", 0.1),
    ]  # fmt: skip
