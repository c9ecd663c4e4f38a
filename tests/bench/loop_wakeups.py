"""A measuring process: `python -m tests.bench.loop_wakeups KIND CONFIG SECONDS [RATE_HZ [CPU]]` runs one loop
under real-time rights.

KIND `loop` is the real loop on the rig of CONFIG (mock); KIND `six` the same law with six axes like the first
of CONFIG, each with its friction model, on a device that costs next to nothing; KIND `empty` has the shape of
the loop in Python (wait, three readings of the clock, the same stores) and does nothing in between. Prints
one JSON line with the raw latencies, ns.
"""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import time
from typing import Any

import numpy as np

from hw.interface import Backend, CompiledCycle
from hw.jit import compiled, records
from hw.rig import compose
from rtctl.check import law_plan as planning
from rtctl.control.vocabulary import State
from rtctl.rig_file.config import Config, LoadedConfig, load
from rtctl.rt import early, realtime
from rtctl.rt.clock import WallClock
from rtctl.rt.loop import Stop, run_loop, warm_up
from rtctl.rt.replug import Replug
from rtctl.rt.shared_memory import CommandWriter, Memory

ASK_EVERY_S = 0.25
_SPENT_TICKS = 5
"""That a signal may delay, the newest recorded and those that follow it."""


class _Operator:
    """Arms the rig as soon as it may be, and ends the loop: a timer's signal, as the loop sees those of a
    person.

    A signal costs the tick it comes in: of four a second nothing but themselves would be seen at p99.9 of
    1 kHz, and a host that arms sends none. So none comes between `armed_at` and `ended_at`, in ticks.
    """

    armed_at = ended_at = 0

    def __init__(self, memory: Memory, writer: CommandWriter, stop: Stop, seconds: float) -> None:
        self._memory, self._writer, self._stop = memory, writer, stop
        self._end = time.monotonic() + seconds
        signal.signal(signal.SIGALRM, self._ask)
        signal.setitimer(signal.ITIMER_REAL, ASK_EVERY_S)

    def _ask(self, _signal: int, _frame: object) -> None:
        left, head = self._end - time.monotonic(), int(self._memory.header[0]["head"])
        if left <= 0:
            self._stop.requests, self.ended_at = 1, head
            return
        idle = not head or self._memory.ring[head - 1]["state"] == State.IDLE
        if head and idle:
            self._writer.command["arm_count"] += 1
            self._writer.send()
        self.armed_at = head + _SPENT_TICKS
        signal.setitimer(signal.ITIMER_REAL, max(min(left, ASK_EVERY_S) if idle else left, 1e-3))


def _acquire(loaded: LoadedConfig, early_ns: np.ndarray) -> None:
    """The loop's rights, and how long it looks at the clock."""
    loop, cores = loaded.config.loop, len(os.sched_getaffinity(0))
    grants, _held = realtime.acquire(loop.priority, loop.cpu)
    early.choose(early_ns, loop.early_us, loaded.config.period_s, cores, granted=realtime.complete(grants))


AXES = 6


def _repeated(of_one: np.ndarray, of_many: np.ndarray) -> None:
    """Fill the records of a rig of many axes with those of a rig of one: every axis like that."""
    for name in of_many.dtype.names or ():
        value = of_one[name][0]
        for axis, (one, many) in enumerate(zip(np.shape(value), of_many[name].shape[1:], strict=True)):
            value = value if one == many else np.repeat(value, many, axis)
        of_many[name][0] = value


@compiled
def _show(tick: np.ndarray) -> int:
    """A device's share of a tick: a fresh sample in which every joint turns a little."""
    t = tick[0]
    t.sample_count += 1
    for axis in range(len(t.position_rad)):
        t.position_rad[axis] = 0.3 * math.sin(1e-3 * t.sample_count)
        t.current_a[axis] = t.current_command_a[axis]
    t.force_n[0] = 0.5 * math.cos(1e-3 * t.sample_count)
    return 0


@compiled
def _take(tick: np.ndarray) -> int:
    """Nothing to send."""
    return 0


class _Nothing:
    """A device that measures something and drives nothing, compiled all through."""

    provides, consumes = frozenset({"position", "current", "force"}), frozenset({"torque"})

    def compiled_cycle(self, tick: np.ndarray) -> CompiledCycle:
        return CompiledCycle(_show, (records(tick),), _take, (records(tick),))

    def open(self) -> None:
        pass

    def read(self, tick: np.ndarray) -> None:
        _show(tick)

    def write(self, tick: np.ndarray) -> None:
        pass

    def stop(self) -> None:
        pass

    def close(self) -> None:
        pass


def _full(loaded: LoadedConfig, seconds: float, device: Backend | None = None) -> np.ndarray:
    plan = planning.build(loaded)
    n = round(seconds / plan.period_s)
    memory = Memory.create(plan.n_axes if device is None else AXES, 2 * n + 1000, plan.period_ns)
    memory.model[:] = plan.model
    _repeated(plan.params, memory.params)
    writer = CommandWriter(memory)
    _repeated(plan.command, writer.command)
    writer.send()
    backend = Replug(device or compose(loaded.members(), loaded.config.hardware()))
    backend.open()
    warm_up(memory, backend)
    stop, clock = Stop(), WallClock(memory.early_ns)
    _acquire(loaded, memory.early_ns)
    operator = _Operator(memory, writer, stop, seconds)
    run_loop(backend, memory, clock, stop)
    backend.close()
    rows = memory.ring.view(np.ndarray)[operator.armed_at : operator.ended_at]
    return np.stack([rows["wakeup_ns"], rows["cycle_ns"], rows["missed_ticks"], rows["state"]])


def _empty(loaded: LoadedConfig, seconds: float) -> np.ndarray:
    period = round(1e9 / loaded.config.loop.rate_hz)
    n = round(seconds * loaded.config.loop.rate_hz)
    early_ns = np.zeros(early.PLACES, np.int64)
    clock = WallClock(early_ns)
    out = np.zeros((4, n), np.int64)
    word: Any = memoryview(np.zeros(16, np.int64))  # type: ignore[arg-type]
    _acquire(loaded, early_ns)
    now, deadline, slot, missed, record_ns = clock.now, clock.now() + period, 0, 0, 0
    for i in range(n):
        woke = clock.sleep_until(deadline)
        late = woke - deadline
        if late >= period:
            skipped = late // period
            missed, slot, deadline = missed + skipped, slot + skipped, deadline + skipped * period
            late -= skipped * period
            word[8] = missed
        word[0], word[1], word[2] = slot, deadline, late
        t_read = now()
        t_law = now()
        t_write = now()
        word[3], word[4], word[5], word[6] = t_read - woke, t_law - t_read, t_write - t_law, record_ns
        word[7] = t_write - woke + record_ns
        out[0, i], out[1, i], out[2, i] = late, word[7], missed
        slot, deadline = slot + 1, deadline + period
        record_ns = now() - t_write
    return out


def at_rate(loaded: LoadedConfig, rate_hz: float, cpu: int = -1) -> LoadedConfig:
    """The rig at another rate of its loop, on another core. Nothing is proved of it: for measuring time
    only.
    """
    table = loaded.config.model_dump(mode="json", by_alias=True)
    table["loop"] |= {
        "rate_hz": rate_hz or table["loop"]["rate_hz"],
        "cpu": cpu if cpu >= 0 else table["loop"]["cpu"],
    }
    return loaded.model_copy(update={"config": Config.model_validate(table)})


def measure(kind: str, config: str, seconds: float, rate_hz: float = 0.0, cpu: float = -1) -> np.ndarray:
    """Rows: wake-up latency, cycle, missed so far, state; one column per tick, of a rig while it is
    armed. `rate_hz` 0, `cpu` -1: the rig file's.
    """
    loaded = load(config)
    loaded = at_rate(loaded, rate_hz, int(cpu)) if rate_hz or cpu >= 0 else loaded
    if kind == "six":
        return _full(loaded, seconds, _Nothing())
    return (_full if kind == "loop" else _empty)(loaded, seconds)


def main(arguments: list[str]) -> None:
    """Measure and print; see the module docstring."""
    kind, config, *numbers = arguments
    sys.stdout.write(json.dumps(measure(kind, config, *map(float, numbers)).tolist()) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
