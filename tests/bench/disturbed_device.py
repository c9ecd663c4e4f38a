"""A simulated rig whose `read` blocks, or works on memory that is not there, whenever it is told to.

The backend `bench-mock` for the loop's process of `tests.bench.blame`: the mock, in Python, with one byte of
a file between bench and loop. `install` writes what a package's installer would, so that the daemon finds it.
"""

from __future__ import annotations

import mmap
import os
import time
from pathlib import Path

import numpy as np

from hw.interface import BackendInfo, Options, Rig
from hw.simulators.mock_backend import MockBackend

KIND = "bench-mock"

ORDER = "RTCTL_BENCH_ORDER"
"""Name of the environment's variable with the file of the order."""

BLOCK, FAULT = 1, 2
"""What may be ordered; 0: nothing."""

BLOCK_S = 0.02

PAGES = 8192
"""Pages that are touched: some ten milliseconds of page faults."""

MADV_DONTNEED_LOCKED = 24
"""Gives memory back that is locked, too (Linux 5.18)."""

INFO = BackendInfo(
    factory="tests.bench.disturbed_device:DisturbedMock",
    options="hw.simulators.mock_options:MockOptions",
    simulated=True,
    timing="hw.simulators.mock_declared:timing",
    joint="hw.simulators.mock_declared:joint",
)


class DisturbedMock:
    """The mock's five methods; `read` looks at the order first."""

    consumes = MockBackend.consumes

    def __init__(self, options: Options, rig: Rig) -> None:
        self._mock = MockBackend(options, rig)
        self.provides = self._mock.provides
        self._order: bytearray | mmap.mmap = bytearray(1)

    def open(self) -> None:
        """Map the file of the order, and memory to fault on, of pages of the usual size."""
        with Path(os.environ[ORDER]).open("r+b") as file:
            self._order = mmap.mmap(file.fileno(), 1)
        self._memory = mmap.mmap(-1, PAGES * mmap.PAGESIZE, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
        self._memory.madvise(mmap.MADV_NOHUGEPAGE)
        self._bytes = np.frombuffer(self._memory, np.uint8)
        self._mock.open()

    def warm_up(self, tick: np.ndarray) -> None:
        """As the mock."""
        self._mock.warm_up(tick)

    def read(self, tick: np.ndarray) -> None:
        """Do what is ordered, once, and read the mock."""
        order, self._order[0] = self._order[0], 0
        if order == BLOCK:
            time.sleep(BLOCK_S)
        elif order == FAULT:
            self._memory.madvise(MADV_DONTNEED_LOCKED)
            self._bytes[:: mmap.PAGESIZE] = 1
        self._mock.read(tick)

    def write(self, tick: np.ndarray) -> None:
        """As the mock."""
        self._mock.write(tick)

    def stop(self) -> None:
        """As the mock."""
        self._mock.stop()

    def close(self) -> None:
        """As the mock."""
        self._mock.close()


def install(folder: Path) -> dict[str, str]:
    """Make the backend known to children that get the environment returned, and write the file of the order:
    `folder/order`.
    """
    made = folder / "rtctl_bench_mock-1.0.dist-info"
    made.mkdir()
    (made / "METADATA").write_text("Metadata-Version: 2.1\nName: rtctl-bench-mock\nVersion: 1.0\n")
    (made / "entry_points.txt").write_text(f"[rtctl.backends]\n{KIND} = {__name__}:INFO\n")
    (folder / "order").write_bytes(b"\0")
    path = [str(Path(__file__).parents[2]), str(folder), os.environ.get("PYTHONPATH", "")]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(path), ORDER: str(folder / "order")}
