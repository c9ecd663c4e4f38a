"""Worker processes that end with the process that began them, however that one ends."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from typing import TypeVar

from rtctl.rt.birth import die_with

R = TypeVar("R")


def results(work: Callable[..., R], *arguments: Iterable[object], jobs: int = 0) -> Iterator[R]:
    """What `work` returns for each of these arguments, in their order, from `jobs` processes (0: one per
    core).

    The kernel ends the workers when their parent dies: those of an executor otherwise wait for its next word
    for ever."""
    # the cores that this process may use: a container or `taskset` may leave it two of sixty-four
    n, parent = jobs or len(os.sched_getaffinity(0)), os.getpid()
    # its number goes along: a worker that is born as an orphan has another parent by then
    with ProcessPoolExecutor(n, initializer=die_with, initargs=(parent,)) as pool:
        yield from pool.map(work, *arguments)
