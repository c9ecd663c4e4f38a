"""One CAN cycle over a serial (slcan) adapter, by our reader and by a plain python-can loop, in turn on two
ptys.
"""

from __future__ import annotations

import fcntl
import os
import pty
import select
import struct
import termios
import threading
import time
import tty
from typing import Any

import numpy as np

from hw.can import slcan
from hw.can.drive_backend import OdriveBackend
from hw.can.options import OdriveOptions
from hw.interface import Rig
from hw.simulators.can_drives import OdriveSim
from rtctl.errors import RtctlError
from rtctl.tick import new_ticks
from tests.bench.device_cycle import DeviceCycle
from tests.bench.io_can import ENCODER, IQ, PAIR, PythonCanLoop
from tests.bench.row import Row

DELIVERY_S = 30.0
"""How long the kernel of a busy machine may take to bring bytes to the other end of a pty."""


class _Adapter:
    """The adapter's side of a pty, with an ODrive on its bus while `serving`."""

    def __init__(self) -> None:
        self.fd, self._far = pty.openpty()
        for fd in (self.fd, self._far):
            tty.setraw(fd)
        self.port = os.ttyname(self._far)
        self._drive = OdriveSim(1, 0.05, 1e-3, 10.0)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def __enter__(self) -> _Adapter:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _serve(self) -> None:
        left = b""
        while not self._stop.is_set():
            frames = self._drive.pass_time(2e-3, 0.0, 0.0, 0.0)
            if select.select([self.fd], [], [], 2e-3)[0]:
                *lines, left = (left + os.read(self.fd, 4096)).split(b"\r")
                for line in lines:
                    found = slcan.parse(line)
                    frames += self._drive.frame(*found) if found else []
                    if found is None:
                        os.write(self.fd, b"\r")
            for can_id, data in frames:
                os.write(self.fd, b"t%03X%d%s\r" % (can_id, len(data), data.hex().encode()))

    def feed(self, lines: bytes, fd: int) -> None:
        """Put lines on the port and wait until they have arrived at its reader, `fd`."""
        os.write(self.fd, lines)
        deadline = time.monotonic() + DELIVERY_S
        while waiting(fd) < len(lines):
            if time.monotonic() > deadline:
                raise RtctlError(f"slcan: a pty did not deliver within {DELIVERY_S:g} s")

    def drain(self) -> None:
        """Forget what was sent to the adapter."""
        while select.select([self.fd], [], [], 0)[0]:
            os.read(self.fd, 4096)


def waiting(fd: int) -> int:
    """Bytes that wait to be read from a descriptor."""
    count: int = struct.unpack("i", fcntl.ioctl(fd, termios.FIONREAD, b"\0\0\0\0"))[0]
    return count


def rows(cycles: int) -> list[Row]:
    """Ratio and time of a cycle. Raises RtctlError without python-can."""
    try:
        import can
    except ModuleNotFoundError as error:
        raise RtctlError("CAN is not measured: pip install 'rtctl[can]'") from error
    one = np.ones(1)
    near, far = _Adapter(), _Adapter()
    table = {"bus": {"interface": "slcan", "channel": near.port}, "axis": [{"node": 1}]}
    options = OdriveOptions.model_validate(table).model_dump()
    backend = OdriveBackend(options, Rig(1, 1e-3, one, one, 0.05 * one, 4096 * one, np.eye(3)[:1]))
    with near:
        backend.open()
    with far:
        plain = can.Bus(
            interface="slcan",
            channel=far.port,
            bitrate=1_000_000,
            timeout=0.0,
            sleep_after_open=0,
            ignore_config=True,
        )
    try:
        ours, theirs = _interleaved(near, backend, far, plain, PythonCanLoop(can, plain), cycles)
    finally:
        backend.close()
        plain.shutdown()
    return [
        Row("CAN cycle over slcan against python-can", ours / theirs, "x",
            f"{theirs:.1f} us; {cycles} cycles each on ptys", 0.6),
        Row("CAN cycle over slcan: read 2, write 1", ours, "us", "p50, tick filled and faults judged; pty"),
    ]  # fmt: skip


def _interleaved(
    near: _Adapter,
    backend: OdriveBackend,
    far: _Adapter,
    plain: Any,
    reference: PythonCanLoop,
    cycles: int,
) -> tuple[float, float]:
    tick = new_ticks(1, 1)
    backend.warm_up(tick)
    lines = b"".join(b"t%03X8%s\r" % (i, PAIR.pack(0.5, 0.25).hex().encode()) for i in (ENCODER, IQ))
    ours, theirs = np.empty(cycles), np.empty(cycles)
    bus: Any = backend.bus
    cycle = DeviceCycle(backend, tick)
    reference.cycle()
    for k in range(cycles):
        near.feed(lines, bus.fileno())
        tick["tick"] += 1
        began = time.perf_counter_ns()
        cycle.run()
        ours[k] = time.perf_counter_ns() - began
        far.feed(lines, plain.fileno())
        began = time.perf_counter_ns()
        reference.cycle()
        theirs[k] = time.perf_counter_ns() - began
        near.drain()
        far.drain()
    if backend.counts()["samples"] < cycles:
        raise RtctlError(f"slcan: only {backend.counts()['samples']} samples in {cycles} cycles")
    return float(np.median(ours)) / 1e3, float(np.median(theirs)) / 1e3
