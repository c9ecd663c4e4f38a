"""A measuring process: `python -m tests.bench.looking RATE_HZ PRIORITY CPU`.

Wakes up on a grid with the loop's rights and its clock and does nothing in between: once looking at the clock
as `loop.early_us = "auto"` does, once sleeping only. Then it never sleeps in between: what is late then no
program could have begun earlier, since the core itself was taken away (an interrupt, the host of a virtual
machine). Prints one JSON line: what more of its core the first takes (`share`), how long before a deadline it
was awake at the end (`early_us`), and how late each deadline was seen by who never slept (`awake_ns`).
"""

from __future__ import annotations

import json
import os
import resource
import sys

import numpy as np

from rtctl.rt import early, realtime
from rtctl.rt.clock import WallClock, look

SECONDS = 2.0
"""Length of each measurement."""

BURST_S = 0.25
"""So long it is awake without a pause; then it sleeps as long, or the kernel would take the core from it
(`sched_rt_runtime_us`)."""


def used_share(clock: WallClock, slots: int, period_ns: int) -> float:
    """Share of a core that waiting for so many slots takes."""
    first = clock.now() + 10 * period_ns
    clock.sleep_until(first)
    used_s, began_ns = _used_s(), clock.now()
    for slot in range(1, slots + 1):
        clock.sleep_until(first + slot * period_ns)
    return (_used_s() - used_s) / (1e-9 * (clock.now() - began_ns))


def late_awake(clock: WallClock, slots: int, period_ns: int) -> list[int]:
    """How late each of so many deadlines is seen by who has looked at the clock ever since the one before,
    ns.
    """
    late: list[int] = []
    while len(late) < slots:
        clock.sleep_until(clock.now() + round(BURST_S * 1e9))
        first = clock.now() + period_ns
        looking = range(first, first + round(BURST_S * 1e9), period_ns)
        late += [look(clock.timespec, deadline) - deadline for deadline in looking]
    return late


def _used_s() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def main(arguments: list[str]) -> None:
    """Measure and print."""
    rate_hz, priority, cpu = float(arguments[0]), int(arguments[1]), int(arguments[2])
    slots, period_ns = round(SECONDS * rate_hz), round(1e9 / rate_hz)
    early_ns = np.zeros(early.PLACES, np.int64)
    cores = len(os.sched_getaffinity(0))
    asleep, looking = WallClock(), WallClock(early_ns)
    grants, _held = realtime.acquire(priority, cpu)
    early.choose(early_ns, "auto", 1 / rate_hz, cores, granted=realtime.complete(grants))
    without = used_share(asleep, slots, period_ns)
    share = max(used_share(looking, slots, period_ns) - without, 0.0)
    early_us = int(early_ns[early.MARGIN]) / 1e3
    late_awake(asleep, 1, period_ns)  # compiled now
    body = {"share": share, "early_us": early_us, "awake_ns": late_awake(asleep, slots, period_ns)}
    sys.stdout.write(json.dumps(body) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
