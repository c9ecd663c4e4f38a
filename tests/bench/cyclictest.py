"""cyclictest (Debian rt-tests): the reference of what this machine's kernel can do, run beside ours."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import dataclass

import numpy as np

from rtctl.errors import RtctlError

_HISTOGRAM_US = 200_000
"""Longer than any standstill seen on a shared machine: what is later counts as this."""


_FINE_US, _FINE_CELL_NS = 20, 10
"""Up to here our own latencies are kept in finer cells: cyclictest's of 1 us would make every start earlier
than that half a microsecond late."""


def _percentile(counts: np.ndarray, wanted: float) -> float:
    """Cell, with the part of it, below which `wanted` of these lie."""
    cumulative = np.cumsum(counts)
    cell = int(np.searchsorted(cumulative, wanted))
    below = cumulative[cell - 1] if cell else 0
    return float(cell + (wanted - below) / max(1, counts[cell]))


@dataclass(frozen=True)
class Latencies:
    """Wake-up latencies of one run as a histogram: `counts[i]` wake-ups were `i` us late (floored)."""

    counts: np.ndarray
    overflow: int
    fine: np.ndarray
    """Those of less than `_FINE_US`, in cells of `_FINE_CELL_NS`; none where only whole microseconds are
    known."""

    @classmethod
    def of(cls, late_ns: np.ndarray) -> Latencies:
        """Histogram of our own latencies, in the same cells as cyclictest's, and in finer ones."""
        late_ns = np.maximum(late_ns, 0)
        late_us = late_ns // 1000
        inside = late_us[late_us < _HISTOGRAM_US].astype(np.int64)
        counts = np.bincount(inside, minlength=_HISTOGRAM_US)
        cells = (late_ns[late_us < _FINE_US] // _FINE_CELL_NS).astype(np.int64)
        fine = np.bincount(cells, minlength=1000 * _FINE_US // _FINE_CELL_NS)
        return cls(counts, int((late_us >= _HISTOGRAM_US).sum()), fine)

    def __add__(self, other: Latencies) -> Latencies:
        return Latencies(self.counts + other.counts, self.overflow + other.overflow, self.fine + other.fine)

    def percentile_us(self, percent: float) -> float:
        """Percentile, us, interpolated inside its cell: of 1 us, cyclictest's own resolution, or of 10 ns
        where the latencies are known so well.
        """
        wanted = percent / 100 * (int(self.counts.sum()) + self.overflow)
        if wanted <= self.fine.sum():
            return _percentile(self.fine, wanted) * _FINE_CELL_NS / 1000
        if wanted > self.counts.sum():
            return float(_HISTOGRAM_US)
        return _percentile(self.counts, wanted)

    def largest_us(self) -> int:
        """The latest wake-up, us, floored; 0 of none."""
        if self.overflow:
            return _HISTOGRAM_US
        cells = np.flatnonzero(self.counts)
        return int(cells[-1]) if len(cells) else 0

    def missed(self, interval_us: float) -> int:
        """Slots of the grid that were passed over while these wake-ups were late."""
        cells = np.arange(len(self.counts))
        whole = (self.counts * (cells // interval_us)).sum()
        return int(whole + self.overflow * (_HISTOGRAM_US // interval_us))


def available() -> bool:
    """Whether cyclictest is installed."""
    return shutil.which("cyclictest") is not None


def run(seconds: float, interval_us: int, priority: int, cpu: int) -> Latencies:
    """Run cyclictest: one thread, memory locked, absolute `clock_nanosleep`, on one core.

    Raises
    ------
    RtctlError
        When it is missing or refused, with the remedy.
    """
    if not available():
        raise RtctlError("cyclictest is missing: apt-get install rt-tests")
    command = (
        f"cyclictest -m -q -t1 -a{cpu} -p{priority} -i{interval_us} -h{_HISTOGRAM_US} "
        f"-D{max(1, round(seconds))}"
    )
    done = subprocess.run(command.split(), capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RtctlError(f"cyclictest failed: {done.stderr.strip() or done.stdout.strip()}")
    counts, overflow = np.zeros(_HISTOGRAM_US, np.int64), 0
    for line in done.stdout.splitlines():
        if line[:1].isdigit():
            cell, count = line.split()[:2]
            counts[int(cell)] = int(count)
        elif line.startswith("# Histogram Overflows"):
            overflow = int(line.split(":")[1])
    return Latencies(counts, overflow, np.zeros(1000 * _FINE_US // _FINE_CELL_NS, np.int64))
