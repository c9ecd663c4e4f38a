"""cyclictest (Debian rt-tests): the reference of what this machine's kernel can do, run beside ours."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import dataclass

import numpy as np

from rtctl.errors import RtctlError

_HISTOGRAM_US = 200_000
"""Longer than any standstill seen on a shared machine: what is later counts as this."""


@dataclass(frozen=True)
class Latencies:
    """Wake-up latencies of one run as a histogram: `counts[i]` wake-ups were `i` us late (floored)."""

    counts: np.ndarray
    overflow: int

    @classmethod
    def of(cls, late_ns: np.ndarray) -> Latencies:
        """Histogram of our own latencies, in the same cells as cyclictest's."""
        late_us = np.maximum(late_ns, 0) // 1000
        inside = late_us[late_us < _HISTOGRAM_US].astype(np.int64)
        return cls(np.bincount(inside, minlength=_HISTOGRAM_US), int((late_us >= _HISTOGRAM_US).sum()))

    def __add__(self, other: Latencies) -> Latencies:
        return Latencies(self.counts + other.counts, self.overflow + other.overflow)

    def percentile_us(self, percent: float) -> float:
        """Percentile, us, interpolated inside the 1 us cell (cyclictest's own resolution)."""
        cumulative = np.cumsum(self.counts)
        wanted = percent / 100 * (cumulative[-1] + self.overflow)
        cell = int(np.searchsorted(cumulative, wanted))
        if cell >= len(self.counts):
            return float(_HISTOGRAM_US)
        below = cumulative[cell - 1] if cell else 0
        return float(cell + (wanted - below) / max(1, self.counts[cell]))

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
    command = f"cyclictest -m -q -t1 -a{cpu} -p{priority} -i{interval_us} -h{_HISTOGRAM_US} -D{max(1, round(seconds))}"
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
    return Latencies(counts, overflow)
