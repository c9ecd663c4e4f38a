"""The control loop: one cycle on one screen.

wait -> read -> decide (newest command, law, gate) -> write -> record, on an absolute grid. Slots that
have passed are skipped and counted, never caught up. Every way out ends in `backend.stop()`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hw.interface import OPTIONAL_FIELDS, Backend, CompiledBackend
from rtctl.control import law, mailbox
from rtctl.control.jit import bound, records
from rtctl.control.records import command_dtype, state_dtype
from rtctl.control.vocabulary import State
from rtctl.rt.clock import Clock
from rtctl.shm import HEADER, CommandWriter, Memory, words
from rtctl.tick import FIELDS, new_ticks, tick_dtype

_SHUTDOWN = int(State.SHUTDOWN)
_MAILBOX_SEQ = (HEADER.names or ()).index("mailbox_seq")
_NOW = 1 << 62  # a shutdown count no host reaches: always a rise
_LEADING = [field.name for field in FIELDS].index("sample_count")
"""Words before `sample_count` are the loop's own scalars, one word each, in the order of `FIELDS`."""


@dataclass
class Stop:
    """How often the process was asked to end: once ramps the torque down, twice cuts it."""

    requests: int = 0


class Cycle:
    """The arrays of one running loop, private to this process but for the ring and the mailbox."""

    def __init__(self, memory: Memory) -> None:
        n = memory.n_axes
        self.memory = memory
        self.tick = records(new_ticks(1, n))
        self.state = records(np.zeros(1, state_dtype(n)))
        self.params = records(memory.params.copy())
        self.model = records(memory.model.copy())
        self.command = records(np.zeros(2, command_dtype(n)))  # row 1 is scratch of the intake
        self.command_words = words(self.command)
        self.tick_words = words(self.tick)
        header: Any = memory.header.view(np.int64)
        self._newest_seq: Any = memoryview(header)  # looked at every cycle: cheaper than a call
        self._seq: Any = memoryview(self.command_words.view(np.int64)[0])
        self._take = bound(mailbox.take, memory.header, memory.slot_words, self.command_words)
        self._step = bound(law.step, self.tick, self.state, self.params, self.command, self.model)
        self.record = bound(mailbox.publish, memory.header, memory.ring_words, self.tick_words)
        """Seal the tick and put it into the ring."""

    def decide(self) -> None:
        """Take the newest command if there is a new one; then the law."""
        if self._newest_seq[_MAILBOX_SEQ] != self._seq[0]:
            self._take()
        self._step()


def warm_up(memory: Memory, backend: Backend) -> None:
    """Compile (or load) everything the loop calls, on copies: nothing shared is touched, nothing moves."""
    if isinstance(backend, CompiledBackend):
        backend.warm_up(new_ticks(1, memory.n_axes))
    scratch = Memory.create(memory.n_axes, 8, int(memory.header[0]["period_ns"]))
    cycle = Cycle(scratch)
    cycle.params[:] = memory.params
    CommandWriter(scratch).send()
    cycle.decide()
    cycle.record()
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
        Watched every cycle; signal handlers raise `stop.requests`.
    waiver
        Stamped into every tick: the rig runs without granted real-time rights.

    Raises
    ------
    Exception
        Whatever a backend raised (LinkLost among others), after the actuator was stopped.
    """
    cycle = Cycle(memory)
    tick, period = cycle.tick, int(memory.header[0]["period_ns"])
    word = memoryview(cycle.tick_words.view(np.int64)[0])  # fields by word: the cheapest store from Python
    state_word = tick_dtype(memory.n_axes).fields["state"][1] // 8  # type: ignore[index]
    read, decide_, write, record, now = backend.read, cycle.decide, backend.write, cycle.record, clock.now
    if isinstance(backend, CompiledBackend):
        backend.warm_up(tick)
    slot, missed, record_ns = 0, 0, 0
    word[9] = waiver
    for name in OPTIONAL_FIELDS:  # no sensor, no value; a backend that has one overwrites it
        tick[name] = np.nan
    deadline = start = clock.now() + period
    memory.header[0]["start_ns"] = start
    try:
        while True:
            woke = clock.sleep_until(deadline)  # 1 wait for the slot; skip those that have passed
            late = woke - deadline
            if late >= period:
                skipped = late // period
                missed, slot, deadline = missed + skipped, slot + skipped, deadline + skipped * period
                late -= skipped * period
                word[8] = missed
            word[0], word[1], word[2] = slot, deadline, late
            read(tick)  # 2 read the devices
            t_read = now()
            if stop.requests:
                if stop.requests > 1:
                    break
                cycle.command["shutdown_count"][0] = _NOW
            decide_()  # 3 decide: newest command, law, gate
            t_law = now()
            write(tick)  # 4 write to the devices
            t_write = now()
            word[3], word[4], word[5], word[6] = t_read - woke, t_law - t_read, t_write - t_law, record_ns
            word[7] = t_write - woke + record_ns
            record()  # 5 record
            if word[state_word] == _SHUTDOWN:
                break
            slot, deadline = slot + 1, deadline + period
            record_ns = now() - t_write
    finally:
        backend.stop()


assert [FIELDS[i].name for i in range(_LEADING)] == [
    "tick", "time_ns", "wakeup_ns", "read_ns", "law_ns", "write_ns", "record_ns", "cycle_ns", "missed_ticks", "waiver",
], "run_loop stores these by position"  # fmt: skip
