"""A measuring process: `python -m tests.bench.looking RATE_HZ PRIORITY CPU`.

Wakes up on a grid with the loop's rights and its clock and does nothing in between: once looking at the clock as
`loop.early_us = "auto"` does, once sleeping only. Prints one JSON line: what more of its core the first takes (`share`), and how
long before a deadline it was awake at the end (`early_us`).
"""

from __future__ import annotations

import json
import os
import resource
import sys

import numpy as np

from rtctl.rt import early, realtime
from rtctl.rt.clock import WallClock

SECONDS = 2.0
"""Length of either measurement."""


def used_share(clock: WallClock, slots: int, period_ns: int) -> float:
    """Share of a core that waiting for so many slots takes."""
    first = clock.now() + 10 * period_ns
    clock.sleep_until(first)
    used_s, began_ns = _used_s(), clock.now()
    for slot in range(1, slots + 1):
        clock.sleep_until(first + slot * period_ns)
    return (_used_s() - used_s) / (1e-9 * (clock.now() - began_ns))


def _used_s() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def main(arguments: list[str]) -> None:
    """Measure and print."""
    rate_hz, priority, cpu = float(arguments[0]), int(arguments[1]), int(arguments[2])
    slots, period_ns = round(SECONDS * rate_hz), round(1e9 / rate_hz)
    early_ns = np.zeros(3, np.int64)
    cores = len(os.sched_getaffinity(0))
    asleep, looking = WallClock(), WallClock(early_ns)
    grants, _held = realtime.acquire(priority, cpu)
    early.choose(early_ns, "auto", 1 / rate_hz, cores, granted=realtime.complete(grants))
    without = used_share(asleep, slots, period_ns)
    share = max(used_share(looking, slots, period_ns) - without, 0.0)
    body = {"share": share, "early_us": int(early_ns[early.MARGIN]) / 1e3}
    sys.stdout.write(json.dumps(body) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
