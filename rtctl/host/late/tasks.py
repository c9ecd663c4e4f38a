"""Which task ran on a core: run times of all tasks from one scan to the next."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

_CORE = 36
"""Place of the core where a task last ran in /proc/PID/stat, behind its name."""


class Tasks:
    """Remembers how long each task has run. A scan takes some 30 us a task: not more often than every second.

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

    def busiest(self, core: int) -> tuple[str, float]:
        """Name and run time (ns) since the last scan of the task that ran longest and was last seen on `core`.

        A task that is new counts from its begin; at the first scan, and where no other task ran, the name is empty.
        """
        first, seen = not self._ran_ns, {}
        best, longest = "", 0.0
        for task, name, ran_ns, where in self._all():
            seen[task] = ran_ns
            rose = ran_ns - self._ran_ns.get(task, 0)
            if where == core and rose > longest and not first:
                best, longest = f"{name} {task}", float(rose)
        self._ran_ns = seen
        return best, longest

    def _all(self) -> Iterator[tuple[str, str, int, int]]:
        """Number, name, run time and last core of every task; one that ends meanwhile is left out."""
        with suppress(OSError):
            for process in os.listdir(self._proc):
                if not process.isdigit() or process == self._apart:
                    continue
                with suppress(OSError):
                    for task in os.listdir(f"{self._proc}/{process}/task"):
                        with suppress(OSError, ValueError, IndexError):
                            yield task, *_of(f"{self._proc}/{process}/task/{task}")


def _of(folder: str) -> tuple[str, int, int]:
    name, _, rest = _text(f"{folder}/stat").partition("(")[2].rpartition(")")
    return name, int(_text(f"{folder}/schedstat").split()[0]), int(rest.split()[_CORE])


def _text(name: str) -> str:
    # not through `Path`: it keeps the parts of every name it ever saw
    descriptor = os.open(name, os.O_RDONLY | os.O_CLOEXEC)
    try:
        return os.read(descriptor, 4096).decode("utf-8", "replace")
    finally:
        os.close(descriptor)
