"""Which tasks ran on a core: their run times from one mark to the next."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from rtctl.host.telemetry.late_exits import Exits

_CORE, _PRIORITY, _POLICY = 36, 37, 38
"""Places in /proc/PID/stat behind the name of a task: core where it last ran, real-time priority, policy (proc(5): 39 to 41)."""

_DEADLINE = 6
"""Policy SCHED_DEADLINE, which runs before every priority and has none."""

HIGHEST = 100

ACTIVE_NS = 10_000_000_000
"""A task that ran is looked at, at each look, for so long."""

MOST = 8
"""Tasks that are told, those that ran longest."""


class Ran(NamedTuple):
    """A task that ran on the core asked for.

    `ran_ns` is NaN for one that has ended and was seen before: how long it ran at its end is not known. `may_preempt` is whether its
    priority keeps a task of the priority asked for waiting.
    """

    name: str
    ran_ns: float
    may_preempt: bool


@dataclass
class _Task:
    name: str
    folder: str
    core: int
    priority: int
    ran_ns: int
    marked_ns: int = 0
    """Run time at the last mark; 0 for one that was begun since: it counts from its begin."""
    marked_core: int = -1
    active_ns: int = 0
    """When it was last seen to have run, CLOCK_MONOTONIC."""
    ended: bool = False
    """It was told to have ended; /proc may show it until its parent has heard."""


class _Gone(NamedTuple):
    name: str
    ran_ns: float
    priority: int


class Tasks:
    """Remembers how long each task has run. A look at all takes some 30 us a task, at those that matter as much for each of these.

    Parameters
    ----------
    apart_from
        Process whose tasks do not count: the loop.
    root
        Where /proc is, for tests.
    exits
        Tells of tasks that have ended; None: what /proc showed of them last is all.
    """

    def __init__(self, apart_from: int, root: Path = Path("/"), exits: Exits | None = None) -> None:
        self._proc, self._apart, self._exits = root / "proc", str(apart_from), exits
        self._tasks: dict[str, _Task] = {}
        self._gone: dict[int, list[_Gone]] = {}
        self._scanned = False

    def look(self, now_ns: int, core: int, priority: int, *, everywhere: bool) -> None:
        """Look at all tasks, or only at those that ran lately or may preempt one of real-time `priority`.

        A task that has ended is remembered, until the next mark, as one of the core it was on.
        """
        self._hear(core)
        if everywhere:
            self._scan(now_ns)
            return
        for task, one in list(self._tasks.items()):
            if now_ns - one.active_ns < ACTIVE_NS or 0 < priority <= one.priority:
                try:
                    self._see(task, one.folder, now_ns)
                except (OSError, ValueError, IndexError):
                    self._forget(task)

    def mark(self, core: int, priority: int) -> tuple[Ran, ...]:
        """Who ran on `core` since the last mark, the longest first; who has ended without telling how long, last.

        A task counts that was on the core at one end of this time at least: what it did in between elsewhere is not known.
        """
        ran = [
            Ran(f"{one.name} {task}", float(one.ran_ns - one.marked_ns), one.priority >= priority)
            for task, one in self._tasks.items()
            if one.ran_ns > one.marked_ns and not one.ended and core in (one.core, one.marked_core)
        ]
        ran += [Ran(one.name, one.ran_ns, one.priority >= priority) for one in self._gone.get(core, ())]
        self._gone.clear()
        for one in self._tasks.values():
            one.marked_ns, one.marked_core = one.ran_ns, one.core
        known = sorted((one for one in ran if one.ran_ns > 0), key=lambda one: -one.ran_ns)
        return (*known[:MOST], *[one for one in ran if not one.ran_ns >= 0][:MOST])

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
            priority = HIGHEST if one.realtime else 0
            known = self._tasks.setdefault(one.task, _Task(one.name, "", core, priority, one.ran_ns))
            ran_ns = max(one.ran_ns - known.marked_ns, 0)
            known.ended = True
            self._gone.setdefault(core, []).append(
                _Gone(f"{one.name} {one.task}", float(ran_ns), known.priority)
            )

    def _scan(self, now_ns: int) -> None:
        seen = set()
        for task, folder in self._all():
            with suppress(OSError, ValueError, IndexError):
                self._see(task, folder, now_ns)
                seen.add(task)
        for task in [task for task in self._tasks if task not in seen]:
            self._forget(task)
        if not self._scanned:  # nobody was begun since the last mark: there was none
            self._scanned = True
            for one in self._tasks.values():
                one.marked_ns, one.marked_core = one.ran_ns, one.core

    def _see(self, task: str, folder: str, now_ns: int) -> None:
        ran_ns = int(_text(f"{folder}/schedstat").split()[0])
        known = self._tasks.get(task)
        if known is not None and (ran_ns == known.ran_ns or (known.ended and ran_ns > known.ran_ns)):
            return
        name, _, rest = _text(f"{folder}/stat").partition("(")[2].rpartition(")")
        words = rest.split()
        priority = HIGHEST if int(words[_POLICY]) == _DEADLINE else int(words[_PRIORITY])
        if known is None or ran_ns < known.ran_ns:  # or another task of the same number
            known = self._tasks[task] = _Task(name, folder, int(words[_CORE]), priority, ran_ns)
        known.name, known.core, known.priority, known.ran_ns = name, int(words[_CORE]), priority, ran_ns
        known.active_ns = now_ns

    def _forget(self, task: str) -> None:
        """It has ended. Where that is not told with its run time, remember that there was one."""
        one = self._tasks.pop(task, None)
        if one is not None and self._exits is None:
            gone = _Gone(f"{one.name} {task}", float("nan"), one.priority)
            self._gone.setdefault(one.core, []).append(gone)

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
