"""The control loop: one cycle on one screen.

wait -> read -> decide (newest command, law, gate) -> write -> record, on an absolute grid. Slots that
have passed are skipped and counted, never caught up. Every way out ends in `backend.stop()`.

A device that has compiled parts runs whole cycles in compiled code (`rtctl.rt.whole_cycle`), and comes back
here in the middle of one where a step needs Python: the cycle is then gone on with from that step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hw.interface import OPTIONAL_FIELDS, Backend, CompiledBackend
from hw.record_fields import placed
from rtctl.control.vocabulary import State
from rtctl.rt.clock import Clock, VirtualClock, WallClock
from rtctl.rt.cycle import DEADLINE, MISSED, PERIOD, RECORD_NS, SLOT, WOKE, Cycle
from rtctl.rt.shared_memory import CommandWriter, Memory
from rtctl.rt.whole_cycle import ENDED, NEXT, READ, WAIT, WRITE, WholeCycles
from rtctl.tick import FIELDS, new_ticks, tick_dtype

_SHUTDOWN = int(State.SHUTDOWN)
_NOW = 1 << 62  # a shutdown count no host reaches: always a rise
_LEADING = [field.name for field in FIELDS].index("sample_count")
"""Words before `sample_count` are the loop's own scalars, one word each, in the order of `FIELDS`."""


@dataclass
class Stop:
    """How often the process was asked to end: once ramps the torque down, twice cuts it."""

    requests: int = 0


def prepare(n_axes: int) -> None:
    """Compile (or load) what every rig of so many axes needs. No device is looked at."""
    # 8 rows: compiled code goes by the type of the ring, not by its length
    scratch = Memory.create(n_axes, 8, 1_000_000)
    Cycle(scratch)
    WallClock()
    scratch.close()


def warm_up(memory: Memory, backend: Backend) -> None:
    """Compile (or load) everything the loop calls, on copies: nothing shared is touched, nothing moves."""
    if isinstance(backend, CompiledBackend):
        backend.warm_up(new_ticks(1, memory.n_axes))
    scratch = Memory.create(memory.n_axes, 8, int(memory.header[0]["period_ns"]))
    cycle = Cycle(scratch)
    # the rig's own: with zeros the law would take other ways, and load other pages
    cycle.params[:] = memory.params
    CommandWriter(scratch).send()
    cycle.decide()
    cycle.record()
    WholeCycles.of(backend, cycle, VirtualClock())
    scratch.close()


def run_loop(backend: Backend, memory: Memory, clock: Clock, stop: Stop, *, waiver: bool = False) -> None:
    """Run cycles until the law reaches SHUTDOWN or a second stop request cuts it short.

    Parameters
    ----------
    backend
        An open backend.
    memory
        Shared memory with parameters and model filled in.
    clock
        Wall or virtual.
    stop
        Watched every cycle, or after `PYTHON_EVERY_S` of compiled ones; signal handlers raise
        `stop.requests`.
    waiver
        Stamped into every tick: the rig runs without granted real-time rights.

    Raises
    ------
    Exception
        Whatever a backend raised (LinkLost among others), after the actuator was stopped."""
    cycle = Cycle(memory)
    tick = cycle.tick
    word, grid = _ints(cycle.tick_words[0]), _ints(cycle.grid)
    state_word = placed(tick_dtype(memory.n_axes), "state")[1] // 8
    read, decide, write, record, now = backend.read, cycle.decide, backend.write, cycle.record, clock.now
    if isinstance(backend, CompiledBackend):
        backend.warm_up(tick)
    whole = WholeCycles.of(backend, cycle, clock)
    # once: the words before `sample_count` are written by nobody else
    word[9] = waiver
    for name in OPTIONAL_FIELDS:  # no sensor, no value; a backend that has one overwrites it
        tick[name] = np.nan
    grid[PERIOD] = int(memory.header[0]["period_ns"])
    # a period from now: what is still to be done before the first sleep is no lateness
    grid[DEADLINE] = memory.header[0]["start_ns"] = clock.now() + grid[PERIOD]
    try:
        while True:
            # as many cycles as go without Python
            at = WAIT if whole is None or stop.requests else whole.run()
            if at == NEXT:
                continue
            if at == ENDED:
                break
            if at == WAIT:
                _wait(clock, grid, word)  # 1 wait for the slot; skip those that have passed
            woke = grid[WOKE]
            if at <= READ:
                read(tick)  # 2 read the devices
                t_read = now()
                # after the reading: the law ramps by a sample of this very cycle
                if stop.requests:
                    # no decision and no tick more: `finally` stops the actuator
                    if stop.requests > 1:
                        break
                    # in each cycle: the host's next command would overwrite it
                    cycle.command["shutdown_count"][0] = _NOW
                decide()  # 3 decide: newest command, law, gate
                word[3], word[4], word[6] = t_read - woke, now() - t_read, grid[RECORD_NS]
            if at <= WRITE:
                write(tick)  # 4 write to the devices
                worked = now() - woke
                word[5], word[7] = worked - word[3] - word[4], worked + word[6]
            began = now()
            record()  # 5 record
            if word[state_word] == _SHUTDOWN:
                break
            grid[SLOT], grid[DEADLINE] = grid[SLOT] + 1, grid[DEADLINE] + grid[PERIOD]
            grid[RECORD_NS] = now() - began
    finally:
        backend.stop()


def _wait(clock: Clock, grid: memoryview, word: memoryview) -> None:
    """Wait for the next slot that has not passed; write number, deadline and lateness of the tick."""
    period, deadline = grid[PERIOD], grid[DEADLINE]
    woke = clock.sleep_until(deadline)
    late = woke - deadline
    if late >= period:
        # never caught up: two cycles in a row would be one sample taken twice, and two steps of the law
        skipped = late // period
        grid[SLOT], grid[DEADLINE] = grid[SLOT] + skipped, deadline + skipped * period
        word[8] = grid[MISSED] = grid[MISSED] + skipped
        late -= skipped * period
    word[0], word[1], word[2], grid[WOKE] = grid[SLOT], grid[DEADLINE], late, woke


def _ints(array: np.ndarray) -> memoryview:
    """Plain integers, by word: what Python reads and stores at the least cost."""
    return array.view(np.ndarray).view(np.int64).data


assert [FIELDS[i].name for i in range(_LEADING)] == [
    "tick", "time_ns", "wakeup_ns", "read_ns", "law_ns", "write_ns", "record_ns", "cycle_ns", "missed_ticks",
    "waiver",
], "run_loop stores these by position"  # fmt: skip
