"""The host's watch over late ticks: looks at the kernel's counters beside the ticks, and keeps account of the
causes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from rtctl.host.exchange.late_counters import Counters, Reading, rates, rise
from rtctl.host.exchange.late_seen import Seen, seen
from rtctl.host.exchange.late_tasks import Ran, Tasks
from rtctl.host.exchange.late_ticks import LateTick, bound_ns, late_ticks
from rtctl.host.exchange.late_trace import Mark, Trace
from rtctl.host.exchange.late_verdict import CAUSES, Verdict, is_own, judge
from rtctl.tick import copied, joined

EVENT = "late"

LOOK_NS, LOOK_ORDINARY_NS = 100_000_000, 50_000_000
"""From one look at the counters to the next while no tick is late; the second beside a loop without real-time
rights: any task may keep that waiting, and what they ran for while it did not wait says nothing."""

SCAN_NS, SCAN_LATE_NS = 2_000_000_000, 50_000_000
"""From one look at all tasks to the next, and while ticks are late; at those that matter it looks as often as
at the counters."""

STANDS_NS = 5_000_000
"""A loop that has made no tick for so long stands: whoever has its core is there to be seen now."""

LOOK_TAKES_NS = 1_000_000
"""A look is over so long after it began, on a host that was held up in the middle of it too."""

TELL_NS = 250_000_000
"""From one event to the next: all late ticks since are in it. The event log keeps a burst, then one every 5
s."""

MEMORY = 0.1
"""Weight of the newest look in what is usual: what was is forgotten within seconds."""


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
    trace
        Where the scheduler tells what the loop did; None: nowhere, and the counters say what they can."""

    def __init__(
        self,
        counters: Counters | None,
        tasks: Tasks | None,
        period_ns: int,
        early_ns: Callable[[], int],
        trace: Trace | None = None,
    ) -> None:
        self._counters, self._tasks, self._trace = counters, tasks, trace
        self._period_ns, self._early_ns = period_ns, early_ns
        self._looks: list[tuple[Reading, float]] = []
        """The two newest looks, each with the lateness that was judged at it, ns."""
        self._usual: dict[str, float] = {}
        self._scanned_ns = self._told_ns = 0
        self._row: np.ndarray | None = None
        self._waiting: list[LateTick] = []
        self._untold: Counter[str] = Counter()
        self._worst: tuple[LateTick, Verdict] | None = None
        self._stopped = False
        self.causes: Counter[str] = Counter()
        self.count = 0
        self.newest: tuple[int, dict[str, Any]] = 0, {}
        """Number and content of the newest event."""

    def follow(self, rows: np.ndarray, now_ns: int) -> None:
        """Take a batch of ticks, which may be empty, and look at the counters where it is time."""
        if len(rows):
            known = rows if self._row is None else joined([self._row, rows])
            # by the bound of now: how early the loop wakes follows what wake-ups take
            self._waiting += late_ticks(known, bound_ns(self._period_ns, self._early_ns()))
            # the step from it to the next batch may be the late one
            self._row = copied(rows[-1:])
        self._look(now_ns, idle=not len(rows))
        self._tell(now_ns)

    def _look(self, now_ns: int, *, idle: bool) -> None:
        """Look at the counters, where it is time, and judge the ticks that wait for it."""
        if self._counters is None:
            self._judge(None)
            return
        if idle and self._looks:  # the loop stands: afterwards nothing says that it was stopped
            self._stopped |= self._counters.stopped()
            if self._row is not None and now_ns - int(self._row["time_ns"][0]) > self._period_ns + STANDS_NS:
                self._look_at_tasks(now_ns, self._looks[-1][0].priority, late=True)
            return
        late = bool(self._waiting)
        if self._looks and not late and now_ns - self._looks[-1][0].at_ns < self._pause_ns():
            return
        reading = self._counters.look(now_ns, late=late)
        self._look_at_tasks(now_ns, reading.priority, late=late)
        self._follow(ordinary=reading.priority == 0)
        judged_ns = 0.0
        if self._looks:
            self._stopped |= late and self._counters.stopped()
            if late:
                judged_ns = self._judge(reading)
            else:
                self._learn(self._looks[-1][0], reading)
            self._stopped = False
        self._looks = [*self._looks[-1:], (reading, judged_ns)]

    def _pause_ns(self) -> int:
        return LOOK_NS if self._looks[-1][0].priority > 0 else LOOK_ORDINARY_NS

    def _look_at_tasks(self, now_ns: int, priority: int, *, late: bool) -> None:
        if self._tasks is None or self._counters is None:
            return
        everywhere = now_ns - self._scanned_ns >= (SCAN_LATE_NS if late else SCAN_NS)
        if everywhere:
            self._scanned_ns = now_ns
        self._tasks.look(self._counters.core, priority, everywhere=everywhere)

    def _follow(self, *, ordinary: bool) -> None:
        if self._trace is None or self._counters is None:
            return
        try:
            self._trace.follow(self._counters.core, ordinary=ordinary)
        except OSError:  # not granted: the counters are all
            self._trace = None

    def _marks(self, late: list[LateTick]) -> list[Mark]:
        """What the scheduler told of these ticks and the cycles before them."""
        if self._trace is None:
            return []
        return self._trace.read(min(one.woke_ns - one.late_ns for one in late) - self._period_ns)

    def _seen(self, late: LateTick, marks: list[Mark]) -> Seen | None:
        since_ns = late.woke_ns - late.late_ns - (self._period_ns if is_own(late) else 0)
        return seen(marks, since_ns, late.woke_ns) if marks else None

    def _ran(self, late: LateTick, priority: int) -> tuple[Ran, ...]:
        """Tasks on the loop's core while this tick was waited for, and in the period before."""
        if self._tasks is None or self._counters is None:
            return ()
        since_ns = late.woke_ns - late.late_ns - self._period_ns
        return self._tasks.ran(self._counters.core, priority, since_ns, late.woke_ns)

    def _learn(self, before: Reading, reading: Reading) -> None:
        for name, rate in rates(before, reading).items():
            # from looks without a late tick alone: what makes ticks late must not become usual
            self._usual[name] = (1 - MEMORY) * self._usual.get(name, rate) + MEMORY * rate

    def _since(self, late: list[LateTick]) -> tuple[Reading, float]:
        """What was read before the first of these ticks was held up, and the lateness judged since then, ns.

        That may be the look before the newest: a batch of ticks that comes while the loop is being held up
        has the counters looked at in the middle, and what held it up before that is in neither rise."""
        (reading, judged_ns), began_ns = self._looks[-1], min(one.woke_ns - one.late_ns for one in late)
        if reading.at_ns + LOOK_TAKES_NS <= began_ns - self._period_ns or len(self._looks) < 2:
            return reading, 0.0
        self._stopped |= reading.stopped
        return self._looks[0][0], judged_ns

    def _judge(self, reading: Reading | None) -> float:
        """Give the waiting ticks their causes; returns their lateness, ns."""
        late, self._waiting = self._waiting, []
        total = float(sum(one.late_ns for one in late))
        verdicts = [Verdict("unknown", "", 0.0)] * len(late)
        if reading is not None and late:
            before, judged_ns = self._since(late)
            risen = rise(before, reading, self._usual)
            risen = replace(risen, stopped=risen.stopped or self._stopped)
            if not self._usual:  # nothing is known to be more than usual
                risen = replace(risen, softirqs=None, interrupts=None)
            marks = self._marks(late)
            each = [
                replace(risen, tasks=self._ran(one, reading.priority), seen=self._seen(one, marks))
                for one in late
            ]
            verdicts = [judge(one, its, total + judged_ns) for one, its in zip(late, each, strict=True)]
        for one, verdict in zip(late, verdicts, strict=True):
            self.count += 1
            self.causes[verdict.cause] += 1
            self._untold[verdict.cause] += 1
            if self._worst is None or one.late_ns > self._worst[0].late_ns:
                self._worst = one, verdict
        return total

    def _tell(self, now_ns: int) -> None:
        """Make an event of the late ticks since the last one, unless that was just now."""
        if self._worst is None or now_ns - self._told_ns < TELL_NS:
            return
        worst, verdict = self._worst
        told = {
            "ticks": sum(self._untold.values()),
            "causes": dict(self._untold),
            "worst_us": round(worst.late_ns / 1e3, 1),
            "worst_tick": worst.tick,
            "cause": verdict.cause,
            "name": verdict.name,
            "share": round(verdict.share, 3),
            "text": CAUSES[verdict.cause],
        }
        # numbered: two listeners hear of it, each at its own time (`LateNews`)
        self.newest = self.newest[0] + 1, told
        # the next worst is that of the next event
        self._told_ns, self._worst = now_ns, None
        self._untold.clear()

    def health(self) -> dict[str, Any]:
        """For telemetry: late ticks since the start, by cause, and above which lateness a tick counts."""
        return {
            "ticks": self.count,
            "above_us": bound_ns(self._period_ns, self._early_ns()) / 1e3,
            "causes": dict(self.causes),
            "newest": self.newest[1] or None,
        }

    def close(self) -> None:
        """Close the files."""
        if self._counters is not None:
            self._counters.close()
        if self._tasks is not None:
            self._tasks.close()
        if self._trace is not None:
            self._trace.close()


class LateNews:
    """What one listener has not heard of the watch yet."""

    def __init__(self, watch: LateWatch | None = None) -> None:
        self.watch, self._heard = watch, 0

    def changes(self) -> list[tuple[str, dict[str, Any]]]:
        """Kind and content of a new event; empty without one."""
        if self.watch is None or self.watch.newest[0] == self._heard:
            return []
        self._heard, told = self.watch.newest
        return [(EVENT, told)]
