"""Health of the last second: rate, latency percentiles, missed ticks, state."""

from __future__ import annotations

from typing import Any

import numpy as np

from rtctl.control.vocabulary import State
from rtctl.host.exchange.fault_book import FaultBook
from rtctl.tick import copied, joined

PHASES = ("wakeup", "read", "law", "write", "record", "cycle")
"""Durations of a tick whose percentiles are told; tick field `<phase>_ns`."""

_PERCENT = {"p50": 50.0, "p99": 99.0, "p99.9": 99.9, "max": 100.0}
# five seconds of the quickest loop (20 kHz)
_MOST_ROWS = 100_000


class HealthWindow:
    """Collects the ticks of one second. Memory is bounded: of a virtual clock's flood the newest count."""

    def __init__(self) -> None:
        self._batches: list[np.ndarray] = []
        self._rows = 0
        self.ticks = 0
        self._last: np.ndarray | None = None

    def add(self, rows: np.ndarray) -> None:
        """Take a batch of ticks, in order."""
        if len(rows) == 0:
            return
        self._batches.append(rows)
        self._rows += len(rows)
        # the newest batch stays, however long it is
        while len(self._batches) > 1 and self._rows > _MOST_ROWS:
            self._rows -= len(self._batches.pop(0))
        self.ticks += len(rows)
        # a view would keep the whole batch
        self._last = copied(rows[-1:])

    def take(self, book: FaultBook) -> dict[str, Any]:
        """What was seen since the last call, faults with their places of `book`. Percentiles are nil without
        a tick."""
        rows = joined(self._batches) if self._batches else None
        self._batches, self._rows = [], 0
        summary: dict[str, Any] = {"ticks": self.ticks, "measured_rate_hz": _rate_hz(rows)}
        for phase in PHASES:
            summary[f"{phase}_us"] = None if rows is None else percentiles_us(rows[f"{phase}_ns"])
        last = self._last
        if last is None:
            return {
                **summary,
                "missed_ticks": 0,
                "waiver": False,
                "state": State.INIT.name,
                "faults": [],
                "cause": None,
            }
        return {
            **summary,
            "missed_ticks": int(last["missed_ticks"][0]),
            "waiver": bool(last["waiver"][0]),
            "state": State(int(last["state"][0])).name,
            "faults": book.entries(int(last["faults"][0])),
            "cause": book.cause(last[0]),
        }


def _rate_hz(rows: np.ndarray | None) -> float:
    """Ticks per second of the loop's own clock; missed slots lower it."""
    if rows is None or len(rows) < 2:
        return 0.0
    span_ns = int(rows["time_ns"][-1]) - int(rows["time_ns"][0])
    # one tick, or a clock that stands, has no rate
    return (len(rows) - 1) * 1e9 / span_ns if span_ns > 0 else 0.0


def percentiles_us(durations_ns: np.ndarray) -> dict[str, float]:
    """Percentiles of durations in ns, by name, in us."""
    values = np.percentile(durations_ns, list(_PERCENT.values())) * 1e-3
    return dict(zip(_PERCENT, values.tolist(), strict=True))
