"""One serial cycle (newest state packet in, a command out) by our backend, by a plain pyserial loop, and by
one read and one write that look at nothing, on three ptys.

All get the same `rtctl-frame` packets (docs/serial-protocol.md) in turn.
"""

from __future__ import annotations

import os
import pty
import select
import struct
import threading
import time
import tty
import zlib
from typing import Any

import numpy as np

from hw.interface import Rig
from hw.jit import bound, compiled
from hw.serial.frame_backend import SerialBackend
from hw.serial.link import DRAINED
from hw.serial.options import SerialOptions
from hw.serial_port import CHUNK, Port
from hw.simulators.serial_firmware import Board
from hw.system_calls import read_some, write_all
from rtctl.errors import RtctlError
from rtctl.tick import new_ticks
from tests.bench.device_cycle import DeviceCycle
from tests.bench.io_slcan import DELIVERY_S, waiting
from tests.bench.row import Row

BAUD = 921_600

STATE, COMMAND = struct.Struct("<BBHIHHBBH3iiih"), struct.Struct("<BBHBBBBi")
SUM = struct.Struct("<I")


def stuffed(body: bytes) -> bytes:
    """COBS: no zero byte is left."""
    return b"".join(bytes([len(run) + 1]) + run for run in body.split(b"\0"))


def unstuffed(packet: bytes) -> bytes:
    """Back from COBS, for packets shorter than 255 bytes."""
    out, at = [], 0
    while at < len(packet):
        out.append(packet[at + 1 : at + packet[at]])
        at += packet[at]
    return b"\0".join(out)


class PyserialLoop:
    """What a careful user writes with pyserial: read all that waits, decode the newest packet, send a
    command.
    """

    def __init__(self, path: str) -> None:
        import serial

        self.port: Any = serial.Serial(path, BAUD, timeout=0)
        self.state: tuple[Any, ...] = ()
        self.samples = self._sequence = 0
        self._left = b""

    def cycle(self) -> None:
        """One cycle."""
        port = self.port
        *packets, self._left = (self._left + port.read(port.in_waiting)).split(b"\0")
        for packet in reversed(packets):
            body = unstuffed(packet)
            if len(body) == STATE.size + 4 and zlib.crc32(body[:-4]) == SUM.unpack(body[-4:])[0]:
                self.state = STATE.unpack(body[:-4])
                self.samples += 1
                break
        self._sequence = self._sequence + 1 & 0xFFFF
        body = COMMAND.pack(1, 0x81, self._sequence, 0, 20, 1, 0, 0)
        port.write(b"\0" + stuffed(body + SUM.pack(zlib.crc32(body))) + b"\0")


@compiled
def _exchange(fd: np.ndarray, chunk: np.ndarray, packet: np.ndarray) -> int:
    """What every cycle asks of the kernel, and nothing else."""
    read_some(fd[0], chunk)
    return write_all(fd[0], packet, len(packet))


class _Far:
    """The board's end of a pty; answers identify packets while `serving`."""

    def __init__(self, board: Board) -> None:
        self.fd, far = pty.openpty()
        self._far = far
        for fd in (self.fd, far):
            tty.setraw(fd)
        self.port, self._board = os.ttyname(far), board
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def __enter__(self) -> _Far:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        self.forget()

    def _serve(self) -> None:
        tick, counts, sent = new_ticks(1, 1), np.zeros(1, np.int64), 0
        while not self._stop.wait(1e-3):
            sent += 1
            self.forget()
            os.write(self.fd, self._board.identity_packet())
            os.write(self.fd, self._board.state_packet(tick, counts, 1000 * sent))

    def feed(self, packet: bytes, fd: int) -> None:
        """Put a packet on the port and wait until it has arrived at its reader, `fd`."""
        before = waiting(fd)
        os.write(self.fd, packet)
        deadline = time.monotonic() + DELIVERY_S
        while waiting(fd) < before + len(packet):
            if time.monotonic() > deadline:
                raise RtctlError(f"serial: a pty did not deliver within {DELIVERY_S:g} s")

    def forget(self) -> None:
        """Throw away what was sent to the board."""
        while select.select([self.fd], [], [], 0)[0]:
            os.read(self.fd, 4096)

    def close(self) -> None:
        """Both ends."""
        os.close(self.fd)
        os.close(self._far)


def _packets(board: Board, first: int, cycles: int) -> list[bytes]:
    """State packets of a joint that turns, one per millisecond; `first` is the time of the first."""
    tick, counts = new_ticks(1, 1), np.zeros(1, np.int64)
    out = []
    for k in range(first, first + cycles):
        counts[:], tick["current_a"], tick["force_n"] = 37 * k, 0.25, (1.0, -2.0, 0.5)
        out.append(board.state_packet(tick, counts, 1000 * k))
    return out


def rows(cycles: int) -> list[Row]:
    """Ratio and times of a cycle. Raises RtctlError without pyserial."""
    one = np.ones(1)
    board = Board(1, "BENCH", 1000)
    near, far, third = _Far(board), _Far(board), _Far(board)
    options = SerialOptions.model_validate({"port": near.port, "baud": BAUD}).model_dump(mode="json")
    backend = SerialBackend(options, Rig(1, 1e-3, one, one, 0.05 * one, 160_000 * one, np.eye(3)[:1]))
    try:
        loop = PyserialLoop(far.port)
    except ModuleNotFoundError as error:
        raise RtctlError("serial is not measured: pip install 'rtctl[serial]'") from error
    tick = new_ticks(1, 1)
    backend.warm_up(tick)
    port = Port(third.port, BAUD)
    try:
        with near:
            backend.open()
        packets = _packets(board, 1000, cycles)
        ours, theirs, least = _interleaved((near, far, third), backend, loop, port.fd, packets, tick)
    finally:
        backend.close()
        loop.port.close()
        port.close()
    codec_us = _codec_us(backend, _packets(board, 1000 + cycles, cycles))
    for line in (near, far, third):
        line.close()
    return [
        Row("serial cycle: newest frame in, command out", ours, "us",
            "p50; rtctl-frame on a pty, tick filled and faults judged", 25.0),
        Row("serial cycle against a pyserial loop", ours / theirs, "x",
            f"{theirs:.1f} us; {cycles} cycles each in turn on ptys, same frame", 0.45),
        Row("serial cycle beyond one read and one write", ours - least, "us",
            f"those two system calls alone {least:.2f} us, {least / theirs:.3f}x of the pyserial loop"),
        Row("serial decode and encode, per frame", codec_us, "us",
            "rtctl-frame: 1 decoded, 1 encoded, tick filled; no I/O", 2.0),
    ]  # fmt: skip


def _interleaved(
    lines: tuple[_Far, _Far, _Far],
    backend: SerialBackend,
    loop: PyserialLoop,
    third: int,
    packets: list[bytes],
    tick: np.ndarray,
) -> tuple[float, float, float]:
    """Median microseconds of our cycle, of theirs, and of one read and one write on the descriptor
    `third`.
    """
    cycle = DeviceCycle(backend, tick)
    backend.read(tick)
    before = int(tick["sample_count"][0])
    command = np.frombuffer(COMMAND.pack(1, 0x81, 1, 0, 20, 1, 0, 0) + bytes(7), np.uint8).copy()
    exchange = bound(_exchange, np.array([third]), np.zeros(CHUNK, np.uint8), command)
    exchange()  # compiled now
    runs = cycle.run, loop.cycle, exchange
    fds = backend.fileno(), loop.port.fileno(), third
    took = np.empty((3, len(packets)))
    for k, packet in enumerate(packets):
        tick["tick"] += 1
        for which in (k % 3, (k + 1) % 3, (k + 2) % 3):
            lines[which].feed(packet, fds[which])
            began = time.perf_counter_ns()
            runs[which]()
            took[which, k] = time.perf_counter_ns() - began
        if cycle.left:
            raise RtctlError("serial: a cycle was left to Python")
        for line in lines:
            line.forget()
    seen = int(tick["sample_count"][0]) - before, loop.samples
    if min(seen) < len(packets):
        raise RtctlError(f"serial: only {seen[0]} and {seen[1]} samples in {len(packets)} cycles")
    ours, theirs, least = np.median(took, axis=1) / 1e3
    return float(ours), float(theirs), float(least)


def _codec_us(backend: SerialBackend, packets: list[bytes]) -> float:
    """Microseconds per frame of a cycle without I/O."""
    times = np.empty(len(packets))
    receive, send = backend._receive, backend._send
    assert receive is not None
    assert send is not None
    for k, packet in enumerate(packets):
        backend.chunk[: len(packet)] = np.frombuffer(packet, np.uint8)
        backend.meta[:] = len(packet), DRAINED
        began = time.perf_counter_ns()
        receive()
        send()
        times[k] = time.perf_counter_ns() - began
    return float(np.median(times)) / 2e3
