"""Named loads of a machine, each a few processes that end by themselves:
`python -m tests.bench.loads KIND SECONDS`.

They run at ordinary priority on every core that is allowed, the loop's included unless they are told to keep
off it, talk to loopback only, and write to a temporary folder of their own.
"""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator

import numpy as np

from rtctl.errors import RtctlError

MOST_S = 3600.0
"""A load that nobody ends, ends itself."""

BLOCK = 1 << 20


def _until(seconds: float) -> Iterator[None]:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        yield


def _cpu(seconds: float) -> None:
    for _ in _until(seconds):
        sum(i * i for i in range(50_000))


def _disk(seconds: float) -> None:
    with tempfile.TemporaryFile() as file:
        for _ in _until(seconds):
            file.seek(0)
            for _ in range(32):
                file.write(os.urandom(BLOCK))
            os.fsync(file.fileno())


def _network(seconds: float) -> None:
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sink,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as source,
    ):
        sink.bind(("127.0.0.1", 0))
        sink.setblocking(False)
        for _ in _until(seconds):
            for _ in range(100):
                source.sendto(b"x" * 1400, sink.getsockname())
            with contextlib.suppress(BlockingIOError):
                while sink.recv(2048):
                    pass


def _memory(seconds: float) -> None:
    one, other = np.ones(16 * BLOCK), np.empty(16 * BLOCK)  # 128 MB each: more than any cache
    for _ in _until(seconds):
        other[:] = one
        one[:] = other


LOADS: dict[str, Callable[[float], None]] = {
    "cpu": _cpu,
    "disk": _disk,
    "network": _network,
    "memory": _memory,
}


@contextlib.contextmanager
def running(name: str, off: int = -1) -> Iterator[None]:
    """Have the load `name` run meanwhile, one process for each core but core `off`; "idle" is none.

    Raises
    ------
    RtctlError
        There is no other core.
    """
    if name == "idle":
        yield
        return
    cores = os.sched_getaffinity(0) - {off}
    if not cores:
        raise RtctlError(f"no load can keep off core {off}: it is the only one")
    command = [sys.executable, "-m", "tests.bench.loads", name, str(MOST_S)]
    started = [subprocess.Popen(command) for _ in cores]
    try:
        for one in started:
            os.sched_setaffinity(one.pid, cores)
        time.sleep(1.0)  # they import
        yield
    finally:
        for one in started:
            one.kill()
            one.wait()


if __name__ == "__main__":
    LOADS[sys.argv[1]](min(float(sys.argv[2]), MOST_S))
