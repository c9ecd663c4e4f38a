"""A drive on CAN (slcan) and a force sensor on a serial port, twice, for `rtctl bench io`:
`python -m tests.bench.io_source`.

Both pairs get the same bytes in the same millisecond. What they measure is the time they were sent at:
seconds since the beginning, as turns of the encoder and as newtons. A process of its own: nothing here holds
up who reads.
"""

from __future__ import annotations

import contextlib
import os
import pty
import sys
import threading
import time
import tty

from hw.can.odrive_codec import GET_ENCODER, GET_IQ, HEARTBEAT, HEARTBEAT_STRUCT, PAIR, can_id
from hw.force import rokubi

NODE = 0
PERIOD_NS = 1_000_000


def line(command: int, data: bytes) -> bytes:
    """A frame of the drive as an adapter shows it."""
    return b"t%03X%d%s\r" % (can_id(NODE, command), len(data), data.hex().encode())


def instant(seconds: float) -> tuple[bytes, bytes]:
    """What drive and sensor send at that time."""
    iq = line(GET_IQ, PAIR.pack(0.0, 0.0))
    return line(GET_ENCODER, PAIR.pack(seconds, 0.0)) + iq, rokubi.encode(
        (seconds, 0.0, 0.0), stamp_us=round(1e6 * seconds)
    )


def _put(fd: int, data: bytes) -> None:
    with contextlib.suppress(BlockingIOError):  # nobody reads there yet
        os.write(fd, data)


def _swallow(fds: list[int]) -> None:
    for fd in fds:
        with contextlib.suppress(BlockingIOError):
            while os.read(fd, 4096):
                pass


def _await_end(over: threading.Event) -> None:
    sys.stdin.read()
    over.set()


def main() -> int:
    """Serve until standard input closes. Prints the start (CLOCK_MONOTONIC, ns) and drive, sensor, drive,
    sensor.
    """
    pairs = [pty.openpty() for _ in range(4)]
    for near, far in pairs:
        tty.setraw(near)
        tty.setraw(far)
        os.set_blocking(near, False)
    fds = [near for near, _ in pairs]
    over = threading.Event()
    threading.Thread(target=_await_end, args=(over,), daemon=True).start()
    start = time.monotonic_ns()
    sys.stdout.write(" ".join([str(start), *(os.ttyname(far) for _, far in pairs)]) + "\n")
    sys.stdout.flush()
    beat, sent, due = line(HEARTBEAT, HEARTBEAT_STRUCT.pack(0, 1, 0, 0) + b"\0"), 0, start
    while not over.is_set():
        drive, force = instant(1e-9 * (time.monotonic_ns() - start))
        for fd, data in zip(fds, (drive, force, drive, force), strict=True):
            _put(fd, data if data is force or sent % 10 else data + beat)
        _swallow(fds)
        sent, due = sent + 1, max(due + PERIOD_NS, time.monotonic_ns() - PERIOD_NS)
        time.sleep(max(0, due - time.monotonic_ns()) * 1e-9)
    return 0


if __name__ == "__main__":
    sys.exit(main())
