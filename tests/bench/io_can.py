"""One CAN cycle (two frames in, one out) by our backend and by a plain python-can loop, in turn on the same
bus.
"""

from __future__ import annotations

import struct
import time
from pathlib import Path
from typing import Any

import numpy as np

from hw.can.drive_backend import OdriveBackend
from hw.can.options import OdriveOptions
from hw.interface import BackendError, Rig
from hw.simulators.can_device import DriveSim, make_drives
from hw.simulators.can_plant import Inertia
from rtctl.errors import RtctlError
from rtctl.tick import new_ticks
from tests.bench.device_cycle import DeviceCycle
from tests.bench.row import Row

ENCODER, IQ, TORQUE = 1 << 5 | 0x09, 1 << 5 | 0x14, 1 << 5 | 0x0E
VCAN = "vcan0"
FILTERS = [{"can_id": one, "can_mask": 0x7FF, "extended": False} for one in (ENCODER, IQ)]
ROUNDS = 3
PAIR, _ONE = struct.Struct("<ff"), struct.Struct("<f")


def _rig() -> Rig:
    one = np.ones(1)
    return Rig(1, 1e-3, one, one, 0.05 * one, 4096 * one, np.eye(3)[:1])


class _NullBus:
    """Takes frames and gives none: what is left is our own decoding and encoding."""

    def __init__(self, outgoing: Any) -> None:
        self.outgoing = outgoing

    def send(self, _frame: object) -> bool:
        return True


class PythonCanLoop:
    """What a careful user writes with python-can: drain, decode, encode, send."""

    def __init__(self, can: Any, bus: Any) -> None:
        self._bus, self._message = bus, can.Message
        self.position = self.current = 0.0

    def cycle(self) -> None:
        """One cycle."""
        bus = self._bus
        while (message := bus.recv(0)) is not None:
            if message.arbitration_id == ENCODER:
                self.position, _ = PAIR.unpack(message.data)
            elif message.arbitration_id == IQ:
                _, self.current = PAIR.unpack(message.data)
        bus.send(self._message(arbitration_id=TORQUE, data=_ONE.pack(0.01), is_extended_id=False))


def rows(cycles: int) -> list[Row]:
    """Ratio and times on vcan0 where the kernel has it, else on python-can's in-process bus."""
    try:
        import can
    except ModuleNotFoundError as error:
        raise RtctlError("CAN is not measured: pip install 'rtctl[can]'") from error
    on_vcan = Path(f"/sys/class/net/{VCAN}").exists()
    interface, channel = ("socketcan", VCAN) if on_vcan else ("virtual", "rtctl-bench")
    with can.Bus(interface=interface, channel=channel, ignore_config=True) as device:
        options = OdriveOptions.model_validate(
            {"bus": {"interface": interface, "channel": channel}, "axis": [{"node": 1}]}
        )
        backend = OdriveBackend(options.model_dump(), _rig())
        sim = DriveSim(device, make_drives("odrive", [1]), Inertia(1, 0.05))
        sim.start()
        try:
            backend.open()
        except BackendError as error:
            raise RtctlError(str(error)) from error
        finally:
            sim.stop()
        # in software they are a trap for `recv(0)`
        more: dict[str, Any] = {"can_filters": FILTERS} if on_vcan else {}
        with can.Bus(interface=interface, channel=channel, ignore_config=True, **more) as plain:
            rounds = [
                _interleaved(can, device, backend, plain, max(cycles // ROUNDS, 100)) for _ in range(ROUNDS)
            ]
        codec_us = _codec_us(backend, cycles)
        backend.close()
    where = f"{channel} ({'raw socket' if on_vcan else 'no CAN in this kernel: both through python-can'})"
    ours, theirs = sorted(rounds, key=lambda pair: pair[0] / pair[1])[ROUNDS // 2]
    every = ", ".join(f"{a / b:.3f}" for a, b in rounds)
    told = f"{theirs:.1f} us; {ROUNDS} x {max(cycles // ROUNDS, 100)} cycles in turn on {where}: {every}"
    target = 0.4 if on_vcan else 0.6  # python-can's in-process bus does most of the work for both
    return [
        Row("CAN cycle against plain python-can", ours / theirs, "x", told, target),
        Row("CAN cycle: read 2 frames, write 1", ours, "us", f"p50, tick filled and faults judged; {where}"),
        Row("CAN decode and encode, per frame", codec_us, "us",
            "ODrive: 2 decoded, 1 encoded, tick filled; no I/O", 2.0),
    ]  # fmt: skip


def _interleaved(
    can: Any,
    device: Any,
    backend: OdriveBackend,
    plain: Any,
    cycles: int,
) -> tuple[float, float]:
    """Median microseconds of our cycle and of theirs; each drains before the other is timed."""
    tick = new_ticks(1, 1)
    backend.warm_up(tick)
    cycle = DeviceCycle(backend, tick)
    before = backend.counts()["samples"]
    reference = PythonCanLoop(can, plain)
    frames = [
        can.Message(arbitration_id=i, data=PAIR.pack(0.5, 0.25), is_extended_id=False) for i in (ENCODER, IQ)
    ]
    ours, theirs = np.empty(cycles), np.empty(cycles)
    for k in range(cycles):
        for which in (0, 1) if k % 2 else (1, 0):
            while device.recv(0) is not None:
                pass
            while plain.recv(0) is not None:
                pass
            cycle.drain()
            for frame in frames:
                device.send(frame)
            tick["tick"] += which
            began = time.perf_counter_ns()
            if which:
                cycle.run()
                ours[k] = time.perf_counter_ns() - began
            else:
                reference.cycle()
                theirs[k] = time.perf_counter_ns() - began
    if cycle.is_compiled and cycle.left > cycles // 4:
        raise RtctlError(f"CAN: {cycle.left} of {cycles} cycles were left to Python")
    if backend.counts()["samples"] - before < cycles:
        raise RtctlError(f"CAN: only {backend.counts()['samples'] - before} samples in {cycles} cycles")
    return float(np.median(ours)) / 1e3, float(np.median(theirs)) / 1e3


def _codec_us(backend: OdriveBackend, cycles: int) -> float:
    """Microseconds per frame of a cycle on a bus that costs nothing."""
    bus: Any = backend.bus
    handlers = backend.drives[0].handlers()
    encoder, iq, data = handlers[ENCODER], handlers[IQ], PAIR.pack(0.5, 0.25)
    null: Any = _NullBus(bus.outgoing)
    tick = new_ticks(1, 1)
    backend.warm_up(tick)
    times = np.empty(cycles)
    for k in range(cycles):
        began = time.perf_counter_ns()
        encoder(data, 0, 8)
        iq(data, 0, 8)
        backend.show()
        backend.send(null, enabled=False)
        times[k] = time.perf_counter_ns() - began
    return float(np.median(times)) / 3e3
