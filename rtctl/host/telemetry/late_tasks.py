"""Which task ran on a core: run times of all tasks from one scan to the next."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

_CORE, _PRIORITY = 36, 37
"""Places in /proc/PID/stat behind the name of a task: the core where it last ran, its real-time priority."""


class Tasks:
    """Remembers how long each task has run. A scan takes some 30 us a task.

    Parameters
    ----------
    apart_from
        Process whose tasks do not count: the loop.
    root
        Where /proc is, for tests.
    """

    def __init__(self, apart_from: int, root: Path = Path("/")) -> None:
        self._proc, self._apart = root / "proc", str(apart_from)
        self._ran_ns: dict[str, int] = {}

    def busiest(self, core: int, priority: int = 0) -> tuple[str, float]:
        """Name and run time (ns) since the last scan of the task that ran longest and was last seen on `core`.

        Asked for a task that may keep one of `priority` waiting; where none of these ran, any. A task that is new counts
        from its begin; at the first scan, and where no other task ran, the name is empty.
        """
        first, seen = not self._ran_ns, {}
        best = any_one = ("", 0.0)
        for task, name, ran_ns, where, may in self._all():
            seen[task] = ran_ns
            rose = float(ran_ns - self._ran_ns.get(task, 0))
            if where == core and not first:
                any_one = max(any_one, (f"{name} {task}", rose), key=lambda one: one[1])
                if may >= priority:
                    best = max(best, (f"{name} {task}", rose), key=lambda one: one[1])
        self._ran_ns = seen
        return best if best[0] else any_one

    def _all(self) -> Iterator[tuple[str, str, int, int, int]]:
        """Number, name, run time, last core and priority of every task; one that ends meanwhile is left out."""
        with suppress(OSError):
            for process in _names(str(self._proc)):
                if not process.isdigit() or process == self._apart:
                    continue
                with suppress(OSError):
                    for task in _names(f"{self._proc}/{process}/task"):
                        with suppress(OSError, ValueError, IndexError):
                            yield task, *_of(f"{self._proc}/{process}/task/{task}")


def _of(folder: str) -> tuple[str, int, int, int]:
    name, _, rest = _text(f"{folder}/stat").partition("(")[2].rpartition(")")
    words = rest.split()
    return name, int(_text(f"{folder}/schedstat").split()[0]), int(words[_CORE]), int(words[_PRIORITY])


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
