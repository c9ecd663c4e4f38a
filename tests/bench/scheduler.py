"""SCHED_DEADLINE beside SCHED_FIFO on the same grid, sleeping only and looking at the clock, in turns.

`python -m tests.bench.scheduler POLICY LOOK_US RATE_HZ SECONDS PRIORITY` is the measuring process; it prints
how late it woke up, ns.
"""

from __future__ import annotations

import ctypes
import json
import os
import struct
import subprocess
import sys
from collections.abc import Iterator

import numpy as np

from rtctl.errors import RtctlError
from rtctl.rt import early, realtime
from rtctl.rt.clock import WallClock
from tests.bench.row import Row, in_turns

BUDGET = 0.3
"""Share of each period that SCHED_DEADLINE is asked for."""

_SCHED_SETATTR = {"x86_64": 314, "aarch64": 274, "riscv64": 274}
_SCHED_DEADLINE = 6
_ATTRIBUTES = struct.Struct("=IIQiIQQQ")  # size, policy, flags, nice, priority, runtime, deadline, period


def ask_for_deadline(runtime_ns: int, period_ns: int) -> None:
    """Have this thread run `runtime_ns` of each period. Raises OSError."""
    number = _SCHED_SETATTR.get(os.uname().machine)
    if number is None:
        raise OSError(f"the number of sched_setattr is not known for {os.uname().machine}")
    packed = _ATTRIBUTES.pack(_ATTRIBUTES.size, _SCHED_DEADLINE, 0, 0, 0, runtime_ns, period_ns, period_ns)
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.syscall(number, 0, packed, 0) != 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


def wake(policy: str, look_us: float, rate_hz: float, seconds: float, priority: int) -> list[int]:
    """How late each wake-up was, ns, under "deadline" or "fifo"."""
    period_ns = round(1e9 / rate_hz)
    early_ns = np.zeros(early.PLACES, np.int64)
    clock = WallClock(early_ns)
    early_ns[early.MARGIN] = round(1e3 * look_us)
    if policy == "deadline":
        ask_for_deadline(round(BUDGET * period_ns), period_ns)
    else:
        realtime.acquire(priority, -1)
    late, deadline = [], clock.now() + 10 * period_ns
    for _ in range(round(seconds * rate_hz)):
        woke = clock.sleep_until(deadline)
        late.append(woke - deadline)
        deadline += period_ns * (1 + max(woke - deadline, 0) // period_ns)
    return late


def rows(rate_hz: float, seconds: float, priority: int, rounds: int) -> Iterator[Row]:
    """Percentiles of each, the rounds in turn. Raises RtctlError where SCHED_DEADLINE is refused."""
    look_us = min(early.INCOME_US, early.MOST_SHARE * 1e6 / rate_hz)
    found: dict[tuple[str, float], list[int]] = {}

    def turns() -> Iterator[None]:
        for _ in range(rounds):
            for policy in ("deadline", "fifo"):
                for look in (0.0, look_us):
                    late = _measure(policy, look, rate_hz, seconds, priority)
                    found.setdefault((policy, look), []).extend(late)
                    yield

    def percentiles() -> Iterator[Row]:
        for (policy, look), late in found.items():
            p50, p99, latest = (float(np.percentile(late, q)) / 1e3 for q in (50, 99, 100))
            how = f"looking {look:g} us" if look else "sleeping"
            text = f"p99 {p99:.1f} us, latest {latest:.0f} us; {len(late)} wake-ups"
            yield Row(f"SCHED_{policy.upper()}, {how}, {rate_hz / 1e3:g} kHz, p50", p50, "us", text)

    return in_turns(turns(), percentiles)


def _measure(policy: str, look_us: float, rate_hz: float, seconds: float, priority: int) -> list[int]:
    command = [
        sys.executable,
        "-m",
        "tests.bench.scheduler",
        policy,
        *map(str, (look_us, rate_hz, seconds, priority)),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RtctlError(f"SCHED_{policy.upper()} is not measured: {done.stderr.strip().splitlines()[-1]}")
    late: list[int] = json.loads(done.stdout)
    return late


if __name__ == "__main__":
    kind, *numbers = sys.argv[1:]
    look, rate, length = map(float, numbers[:3])
    sys.stdout.write(json.dumps(wake(kind, look, rate, length, int(numbers[3]))) + "\n")
