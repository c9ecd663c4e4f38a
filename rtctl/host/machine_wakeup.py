"""How late the loop's core wakes up: `python -m rtctl.host.machine_wakeup SECONDS PERIOD_NS PRIORITY CPU`.

A process of its own, because it asks for the loop's rights: SCHED_FIFO, locked memory, its core. It sleeps on
the loop's own absolute grid with the loop's own clock and does nothing in between. Prints one JSON line."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import dataclass
from typing import Any

import numpy as np

from rtctl.host.machine_line import Line

EDGES_US = (5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)
"""Upper edges of the histogram's cells; a last one takes the rest."""

MISSED_MOST = 0.01
"""Share of missed slots at which the loop itself would stop a real rig (safety contract)."""

_START_S = 60.0  # importing, and compiling the clock the first time


@dataclass(frozen=True)
class Wakeups:
    """Wake-ups of one measurement, us; `refused` holds what right was refused and the remedy."""

    seconds: float
    period_us: float
    wakeups: int
    missed: int
    p50_us: float
    p99_us: float
    p999_us: float
    max_us: float
    counts: tuple[int, ...]
    refused: tuple[str, ...]

    @classmethod
    def of(cls, late_ns: np.ndarray, missed: int, period_ns: int, refused: tuple[str, ...] = ()) -> Wakeups:
        """Summarise latencies, ns."""
        late_us = np.asarray(late_ns, dtype=float) / 1000
        p50, p99, p999 = np.percentile(late_us, [50, 99, 99.9])
        cells = np.searchsorted(EDGES_US, late_us, side="right")
        return cls(
            seconds=round((len(late_us) + missed) * period_ns * 1e-9, 3),
            period_us=period_ns / 1000,
            wakeups=len(late_us),
            missed=missed,
            p50_us=round(float(p50), 1),
            p99_us=round(float(p99), 1),
            p999_us=round(float(p999), 1),
            max_us=round(float(late_us.max()), 1),
            counts=tuple(np.bincount(cells, minlength=len(EDGES_US) + 1).tolist()),
            refused=refused,
        )


def histogram(found: Wakeups) -> list[str]:
    """Lines that show the histogram to a person."""
    labels = [f"< {edge} us" for edge in EDGES_US] + [f">= {EDGES_US[-1]} us"]
    most = max(found.counts)
    return [
        f"{label:>10} {count:>8} {'#' * round(40 * count / most)}"
        for label, count in zip(labels, found.counts, strict=True)
        if count
    ]


def judge(found: Wakeups, core: int, *, real: bool, required: bool) -> list[Line]:
    """Lines of the report: the rights the process got, and how late it woke up.

    `real`: a person's hand may be on the rig. `required`: the rig file refuses to start without the rights.
    """
    out = []
    if found.refused:
        serious = real or required
        out.append(
            Line("loop rights", "fail" if serious else "warn", found.refused[0], "; ".join(found.refused[1:]))
        )
    share = found.missed / max(found.wakeups + found.missed, 1)
    text = (
        f"core {core}, {found.seconds:g} s: p50 {found.p50_us:g}, p99 {found.p99_us:g}, "
        f"p99.9 {found.p999_us:g}, max {found.max_us:g} us of {found.period_us:g}; {found.missed} slots "
        "missed"
    )
    fix = (
        "isolate the core, set its governor to performance, use PREEMPT_RT (lines above), or lower "
        "loop.rate_hz"
    )
    if found.missed == 0 and found.max_us < found.period_us / 2:
        out.append(Line("wake-up", "ok", text))
    else:
        out.append(Line("wake-up", "fail" if real and share > MISSED_MOST else "warn", text, fix))
    return out


def measure(seconds: float, period_ns: int, priority: int, cpu: int) -> Wakeups | None:
    """Measure in a process of its own; None when that failed. Takes `seconds` and a few more."""
    command = [
        sys.executable,
        "-m",
        "rtctl.host.machine_wakeup",
        str(seconds),
        str(period_ns),
        str(priority),
        str(cpu),
    ]
    try:
        done = subprocess.run(
            # not checked: whatever it ends with, a line that cannot be read is the answer
            command,
            capture_output=True,
            text=True,
            check=False,
            timeout=seconds + _START_S,
        )
        return of_json(json.loads(done.stdout))
    except (subprocess.TimeoutExpired, ValueError):
        return None


def of_json(data: dict[str, Any]) -> Wakeups:
    """Back from the process's line."""
    return Wakeups.of(np.array(data["late_ns"]), data["missed"], data["period_ns"], tuple(data["refused"]))


def main(arguments: list[str]) -> None:
    """Measure in this process and print."""
    from rtctl.rt import realtime
    from rtctl.rt.clock import WallClock

    seconds, period_ns, priority, cpu = float(arguments[0]), *map(int, arguments[1:4])
    clock = WallClock()
    # percentiles of fewer say nothing
    wanted = max(10, round(seconds * 1e9 / period_ns))
    late_ns = np.zeros(wanted, np.int64)
    # after the array: to lock memory brings its pages in, which `zeros` has not touched
    grants, _held = realtime.acquire(priority, cpu)
    refused = [
        f"{grant.right} refused: {grant.detail}" for grant in grants if grant.required and not grant.granted
    ]
    # the first slot lies behind what the start itself takes
    deadline = clock.now() + 10 * period_ns
    slot = missed = n = 0
    while slot < wanted:
        late = clock.sleep_until(deadline + slot * period_ns) - (deadline + slot * period_ns)
        late_ns[n], n = late, n + 1
        skipped = late // period_ns
        # as in the loop: slots that have passed are skipped and counted, not caught up
        missed, slot = missed + skipped, slot + skipped + 1
    body = {"late_ns": late_ns[:n].tolist(), "missed": missed, "period_ns": period_ns, "refused": refused}
    sys.stdout.write(json.dumps(body) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
