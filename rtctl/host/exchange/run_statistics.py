"""Running statistics of a run in constant memory: latency histograms, counts, energies, faults."""

from __future__ import annotations

from typing import Any

import numpy as np

from rtctl.control.vocabulary import Fault, State
from rtctl.tick import copied
from rtctl.wire.fault_names import cause_bit

_PER_OCTAVE = 64  # about 1 % resolution
_OCTAVES = 40  # up to 2^40 ns, 18 minutes


class Histogram:
    """Counts of non-negative durations (ns) in logarithmic cells of about 1 %.

    Attributes
    ----------
    max_ns : int
        The exact largest value."""

    def __init__(self) -> None:
        # one cell more: durations beyond the last octave
        self._counts = np.zeros(_PER_OCTAVE * _OCTAVES + 1, np.int64)
        self.max_ns = 0

    def add(self, values_ns: np.ndarray) -> None:
        """Count values; negative ones count as 0."""
        if len(values_ns) == 0:
            return
        values = np.maximum(values_ns, 0)
        # + 1: a duration of 0 has no logarithm
        cells = np.minimum((np.log2(values + 1.0) * _PER_OCTAVE).astype(np.int64), len(self._counts) - 1)
        self._counts += np.bincount(cells, minlength=len(self._counts))
        self.max_ns = max(self.max_ns, int(values.max()))

    def percentile_us(self, percent: float) -> float:
        """Value below which `percent` of the counts lie, us; upper edge of its cell, 0 without counts."""
        total = int(self._counts.sum())
        if total == 0:
            return 0.0
        # max: of few counts a small percentile is the first of them
        cell = int(np.searchsorted(np.cumsum(self._counts), max(1.0, percent / 100 * total)))
        return float(min(2.0 ** ((cell + 1) / _PER_OCTAVE) - 1, self.max_ns) / 1e3)

    def summary_us(self) -> dict[str, float]:
        """p50, p99, p99.9 and max, us, rounded to 10 ns."""
        out = {
            name: round(self.percentile_us(p), 2) for name, p in (("p50", 50), ("p99", 99), ("p99.9", 99.9))
        }
        return {**out, "max": round(self.max_ns / 1e3, 2)}


class RunStatistics:
    """What the closing summary of a run needs, updated with every batch of ticks."""

    def __init__(self) -> None:
        self.wakeup = Histogram()
        self.cycle = Histogram()
        self.ticks = 0
        self.faults = 0
        self.waiver = False
        self.last: np.ndarray | None = None
        self._first_ns = self._cause = 0

    def update(self, rows: np.ndarray) -> None:
        """Take a batch of complete ticks, in order."""
        if len(rows) == 0:
            return
        if self.last is None:
            self._first_ns = int(rows["time_ns"][0])
        self.wakeup.add(rows["wakeup_ns"])
        self.cycle.add(rows["cycle_ns"])
        self.ticks += len(rows)
        self.faults |= int(np.bitwise_or.reduce(rows["faults"]))
        # of the newest tick: rights are had for the whole run or not at all
        self.waiver = bool(rows["waiver"][-1])
        # a copy: a view would keep the whole batch
        self.last = copied(rows[-1:])
        # SHUTDOWN ends every run, and is the cause of none
        before_the_end = np.flatnonzero(rows["state"] != State.SHUTDOWN)
        if len(before_the_end):
            row = rows[before_the_end[-1]]
            self._cause = cause_bit(int(row["state"]), int(row["fault_first"]))

    def summary(self) -> dict[str, Any]:
        """The summary `rtctl run --json` ends with (without telemetry counts)."""
        if self.last is None:
            return {
                "state": State.INIT.name,
                "ticks": 0,
                "missed_ticks": 0,
                "rate_hz": 0.0,
                "faults": [],
                "fault_first": None,
            }
        last = self.last[0]
        span_s = (int(last["time_ns"]) - self._first_ns) / 1e9
        return {
            "state": State(int(last["state"])).name,
            "ticks": self.ticks,
            "missed_ticks": int(last["missed_ticks"]),
            "first_tick_ns": self._first_ns,
            "rate_hz": round((self.ticks - 1) / span_s, 3) if span_s > 0 else 0.0,
            "wakeup_us": self.wakeup.summary_us(),
            "cycle_us": self.cycle.summary_us(),
            "energy_j": {
                "port": [float(x) for x in last["energy_port_j"]],
                "hand": [float(x) for x in last["energy_hand_j"]],
                "feedforward": [float(x) for x in last["energy_feedforward_j"]],
            },
            "faults": [fault.name for fault in Fault if self.faults & fault],
            "fault_first": Fault(self._cause).name if self._cause else None,
            "waiver": self.waiver,
        }
