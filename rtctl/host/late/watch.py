"""The host's watch over late ticks: looks at the kernel's counters beside the ticks, and keeps account of the causes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from rtctl.host.late.counters import Counters, Reading, rates, rise
from rtctl.host.late.tasks import Tasks
from rtctl.host.late.ticks import LateTick, bound_ns, late_ticks
from rtctl.host.late.verdict import CAUSES, Verdict, judge

EVENT = "late"

LOOK_NS = 100_000_000
"""From one look at the counters to the next while no tick is late."""

SCAN_NS = 1_000_000_000
"""From one scan of the tasks to the next."""

TELL_NS = 5_000_000_000
"""From one event to the next: all late ticks since are in it."""

MEMORY = 0.1
"""Weight of the newest second in what is usual."""


class LateWatch:
    """One run's watch.

    Parameters
    ----------
    counters, tasks
        Where to look; None: nowhere, every cause is then unknown.
    period_ns
        Of the loop.
    early_ns
        Returns by how much the loop wakes early now, ns; 0: it sleeps until the deadline.
    """

    def __init__(
        self, counters: Counters | None, tasks: Tasks | None, period_ns: int, early_ns: Callable[[], int]
    ) -> None:
        self._counters, self._tasks = counters, tasks
        self._period_ns, self._early_ns = period_ns, early_ns
        self._before: Reading | None = None
        self._usual: dict[str, float] = {}
        self._scanned_ns = self._told_ns = 0
        self._row: np.ndarray | None = None
        self._waiting: list[LateTick] = []
        self._untold: Counter[str] = Counter()
        self._worst: tuple[LateTick, Verdict] | None = None
        self.causes: Counter[str] = Counter()
        self.count = 0

    def follow(self, rows: np.ndarray, now_ns: int) -> None:
        """Take a batch of ticks, which may be empty, and look at the counters where it is time."""
        if len(rows):
            known = rows if self._row is None else np.concatenate((self._row, rows))
            self._waiting += late_ticks(known, bound_ns(self._period_ns, self._early_ns()))
            self._row = rows[-1:].copy()
        if self._counters is None:
            self._judge(None)
            return
        if self._before is not None and not self._waiting and now_ns - self._before.at_ns < LOOK_NS:
            return
        reading = self._counters.look(now_ns)
        before, self._before = self._before, reading
        if before is None:
            return
        if self._waiting:
            self._judge((before, reading))
        else:
            self._learn(before, reading)
        if now_ns - self._scanned_ns >= SCAN_NS and self._tasks is not None:
            self._scanned_ns = now_ns
            self._tasks.busiest(self._counters.core)

    def _learn(self, before: Reading, reading: Reading) -> None:
        for name, rate in rates(before, reading).items():
            self._usual[name] = (1 - MEMORY) * self._usual.get(name, rate) + MEMORY * rate

    def _judge(self, between: tuple[Reading, Reading] | None) -> None:
        """Give the waiting ticks their causes."""
        late, self._waiting = self._waiting, []
        if not late:
            return
        verdicts = [Verdict("unknown", "", 0.0)] * len(late)
        if between is not None and self._counters is not None:
            risen = rise(*between, self._usual)
            if self._tasks is not None:
                name, ran_ns = self._tasks.busiest(self._counters.core)
                self._scanned_ns = between[1].at_ns
                risen = replace(risen, other_task=name, other_task_ns=ran_ns)
            # Of a burst the first tick has the cause; those that follow within its lateness have it too.
            total = float(sum(one.late_ns for one in late))
            verdicts = [judge(one, risen, total) for one in late]
        for one, verdict in zip(late, verdicts, strict=True):
            self.count += 1
            self.causes[verdict.cause] += 1
            self._untold[verdict.cause] += 1
            if self._worst is None or one.late_ns > self._worst[0].late_ns:
                self._worst = one, verdict

    def news(self, now_ns: int) -> dict[str, Any] | None:
        """Content of an event about the late ticks since the last one; None: there are none, or one was told just now."""
        if self._worst is None or now_ns - self._told_ns < TELL_NS:
            return None
        worst, verdict = self._worst
        told = {
            "ticks": sum(self._untold.values()),
            "causes": dict(self._untold),
            "worst_us": round(worst.late_ns / 1e3, 1),
            "worst_tick": worst.tick,
            "worst_cause": verdict.cause,
            "worst_name": verdict.name,
            "worst_share": round(verdict.share, 3),
            "meaning": CAUSES[verdict.cause],
        }
        self._told_ns, self._worst = now_ns, None
        self._untold.clear()
        return told

    def health(self) -> dict[str, Any]:
        """For telemetry: late ticks since the start, by cause, and above which lateness a tick counts."""
        return {
            "ticks": self.count,
            "above_us": bound_ns(self._period_ns, self._early_ns()) / 1e3,
            "causes": dict(self.causes),
        }

    def close(self) -> None:
        """Close the files."""
        if self._counters is not None:
            self._counters.close()
