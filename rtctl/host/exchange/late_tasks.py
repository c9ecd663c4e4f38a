"""Which tasks ran on a core in a stretch of time: run times of tasks, each with the time that it was read
at."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from rtctl.host.exchange.late_exits import Exits

_CORE, _PRIORITY, _POLICY = 36, 37, 38
"""Places in /proc/PID/stat behind the name of a task: core where it last ran, real-time priority, policy
(proc(5): 39 to 41)."""

_DEADLINE = 6
"""Policy SCHED_DEADLINE, which runs before every priority and has none."""

HIGHEST = 100

ACTIVE_NS = 3_000_000_000
"""A task that ran on an ordinary loop's core is looked at, at each look, for so long."""

KEPT_NS = 1_000_000_000
"""What is known of a task that has ended is kept for so long."""

SAMPLES = 8
"""Newest readings of a task that are kept."""

MOST = 8
"""Tasks that are told."""


class Ran(NamedTuple):
    """A task that ran on the core asked for, in the time asked for.

    `ran_ns` is for how long at most: NaN for one that has ended meanwhile, which was seen before and nobody
    tells of. `likely_ns` is that if it ran evenly from one reading to the next. `may_preempt`: its priority
    keeps a task of the priority asked for waiting."""

    name: str
    ran_ns: float
    may_preempt: bool
    likely_ns: float = 0.0


class _Sample(NamedTuple):
    at_ns: int
    ran_ns: int
    core: int


@dataclass
class _Task:
    name: str
    folder: str
    priority: int
    samples: list[_Sample]
    active_ns: int
    """When the task was last seen to have run."""
    gone_ns: int = 0
    """When the task was known to have ended; 0: it lives. /proc may show it until its parent has heard."""
    told: bool = False
    """The task's end was told, with its run time."""

    def add(self, sample: _Sample) -> None:
        """Keep a reading. Of several in which it had not run, the first and the last say all."""
        if len(self.samples) > 1 and self.samples[-2].ran_ns == self.samples[-1].ran_ns == sample.ran_ns:
            self.samples.pop()
        elif self.samples[-1].ran_ns != sample.ran_ns:
            self.active_ns = sample.at_ns
        self.samples = [*self.samples[1 - SAMPLES :], sample]

    def within(self, core: int, since_ns: int, until_ns: int) -> tuple[float, float]:
        """How long it ran on `core` between two times, at most and if it ran evenly, ns; on the core at one
        end of a step at least."""
        most = likely = 0.0
        for a, b in zip(self.samples, self.samples[1:], strict=False):
            shared = min(b.at_ns, until_ns) - max(a.at_ns, since_ns)
            if shared > 0 and core in (a.core, b.core):
                # what it ran in the step, all of it within the time asked for: the most that it can have been
                most += min(b.ran_ns - a.ran_ns, shared)
                likely += (b.ran_ns - a.ran_ns) * shared / (b.at_ns - a.at_ns)
        return most, likely


class Tasks:
    """Remembers how long each task has run. A look at all takes some 30 us a task, at those that matter as
    much for each of these.

    Parameters
    ----------
    apart_from
        Process whose tasks do not count: the loop.
    root
        Where /proc is, for tests.
    exits
        Tells of tasks that have ended; None: what /proc showed of them last is all.
    clock
        CLOCK_MONOTONIC, ns: each reading bears its own time, as a look may be interrupted for long."""

    def __init__(
        self,
        apart_from: int,
        root: Path = Path("/"),
        exits: Exits | None = None,
        clock: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._proc, self._apart, self._exits, self._clock = root / "proc", str(apart_from), exits, clock
        self._tasks: dict[str, _Task] = {}
        self._scans_ns: list[int] = []
        """When the two newest looks at all tasks began."""

    def look(self, core: int, priority: int, *, everywhere: bool) -> None:
        """Look at all tasks, or at those that matter: that may preempt one of real-time `priority`, or, where
        that is 0, ran lately on `core`.

        Who has ended on `core` is heard as well."""
        self._hear(core)
        if everywhere:
            self._scan()
            return
        now_ns = self._clock()
        for task, one in list(self._tasks.items()):
            lately = now_ns - one.active_ns < ACTIVE_NS and one.samples[-1].core == core
            if not one.gone_ns and (one.priority >= priority if priority else lately):
                try:
                    self._see(task, one.folder)
                except (OSError, ValueError, IndexError):
                    self._forget(task)

    def ran(self, core: int, priority: int, since_ns: int, until_ns: int) -> tuple[Ran, ...]:
        """Who ran on `core` between two times, the likeliest first; who has ended without telling how long,
        last."""
        known, unknown = [], []
        for task, one in self._tasks.items():
            name, may = f"{one.name} {task}", one.priority >= priority
            most, likely = one.within(core, since_ns, until_ns)
            if most > 0:
                known.append(Ran(name, most, may, likely))
            newest = one.samples[-1]
            if one.gone_ns > since_ns and newest.at_ns < until_ns and newest.core == core and not one.told:
                unknown.append(Ran(name, float("nan"), may))
        known.sort(
            key=lambda one: -(one.ran_ns + one.likely_ns)
        )  # one that was seen once only has the first alone
        return (*known[:MOST], *unknown[:MOST])

    def close(self) -> None:
        """Close what tells of tasks that have ended."""
        if self._exits is not None:
            self._exits.close()

    def _hear(self, core: int) -> None:
        """Take what was told of tasks that have ended on the core."""
        if self._exits is None:
            return
        try:
            self._exits.follow(core)
        except OSError:  # not granted: what /proc shows is all
            self._exits.close()
            self._exits = None
            return
        for one in self._exits.read():
            now_ns = self._clock()
            sample = _Sample(now_ns, one.ran_ns, core)
            known = self._tasks.get(one.task)
            if known is None:
                priority = HIGHEST if one.realtime else 0
                known = self._begun(one.task, one.name, "", priority, sample, self._scans_ns[:1])
            elif not known.gone_ns:
                # max: two counters of the kernel meet here, and run times only rise
                known.add(sample._replace(ran_ns=max(one.ran_ns, known.samples[-1].ran_ns)))
            known.name, known.gone_ns, known.told = one.name, now_ns, True

    def _scan(self) -> None:
        began_ns, seen = self._clock(), set()
        for task, folder in self._all():
            with suppress(OSError, ValueError, IndexError):
                self._see(task, folder)
                seen.add(task)
        # a list: `_forget` takes from the dict
        for task in [task for task in self._tasks if task not in seen]:
            self._forget(task)
        self._scans_ns = [*self._scans_ns[-1:], began_ns]

    def _see(self, task: str, folder: str) -> None:
        known, at_ns = self._tasks.get(task), self._clock()
        ran_ns = int(_text(f"{folder}/schedstat").split()[0])
        if known is not None and ran_ns >= known.samples[-1].ran_ns:
            if known.gone_ns:
                return
            if ran_ns == known.samples[-1].ran_ns:
                # it did not run: the same reading, later; stat is not asked again
                known.add(known.samples[-1]._replace(at_ns=at_ns))
                return
        # the last bracket: a task may be called `)`, and stat does not say so (proc(5))
        name, _, rest = _text(f"{folder}/stat").partition("(")[2].rpartition(")")
        words = rest.split()
        priority = HIGHEST if int(words[_POLICY]) == _DEADLINE else int(words[_PRIORITY])
        sample = _Sample(at_ns, ran_ns, int(words[_CORE]))
        if known is None or ran_ns < known.samples[-1].ran_ns:  # or another task of the same number
            self._begun(task, name, folder, priority, sample, self._scans_ns[-1:])
            return
        known.name, known.priority = name, priority
        known.add(sample)

    def _begun(
        self, task: str, name: str, folder: str, priority: int, sample: _Sample, after: list[int]
    ) -> _Task:
        """A task seen for the first time: begun `after` all were looked at, unless they never were.

        One that has ended may have done so before the newest look came to it: that it had not begun, only the
        look before can say."""
        first = [_Sample(at_ns, 0, sample.core) for at_ns in after]
        self._tasks[task] = _Task(name, folder, priority, [*first, sample], sample.at_ns)
        return self._tasks[task]

    def _forget(self, task: str) -> None:
        """A task has ended. Where that is not told with its run time, remember for a while that there was
        one."""
        one, now_ns = self._tasks[task], self._clock()
        if not one.gone_ns and self._exits is None:
            one.gone_ns = now_ns
        if not one.gone_ns or now_ns - one.gone_ns > KEPT_NS:
            del self._tasks[task]

    def _all(self) -> Iterator[tuple[str, str]]:
        """Number and folder of every task."""
        with suppress(OSError):
            for process in _names(str(self._proc)):
                if not process.isdigit() or process == self._apart:
                    continue
                with suppress(OSError):
                    for task in _names(f"{self._proc}/{process}/task"):
                        yield task, f"{self._proc}/{process}/task/{task}"


def _text(name: str) -> str:
    # not through `Path`: it keeps the parts of every name it ever saw
    descriptor = os.open(name, os.O_RDONLY | os.O_CLOEXEC)
    try:
        return os.read(descriptor, 4096).decode("utf-8", "replace")
    finally:
        os.close(descriptor)


def _names(folder: str) -> list[str]:
    with os.scandir(folder) as entries:
        return [entry.name for entry in entries]
