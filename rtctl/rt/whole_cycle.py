"""Whole cycles in compiled code: wait, read, decide, write, record, without Python in between.

The same steps, in the same order and on the same records, as `rtctl.rt.loop`, which takes over wherever a step needs Python: a device
that is lost, its words, a signal. `run` says at which step. A person's hand feels no difference; the cycle takes a third of the time.

Wherever the clock is a wall, Python is back after `PYTHON_EVERY_S` at the latest, to see signals.
"""

from __future__ import annotations

import numpy as np

from hw.entry_points import call, call_for_int, entry_point
from hw.interface import Backend, CompiledCycle
from hw.jit import JIT_DISABLED
from rtctl.control import law, mailbox
from rtctl.control.jit import bound, compiled, records
from rtctl.control.records import Record
from rtctl.control.vocabulary import State
from rtctl.rt.clock import Clock, VirtualClock, WallClock, now_ns, wait
from rtctl.rt.cycle import Cycle
from rtctl.rt.replug import Replug

PYTHON_EVERY_S = 0.005
"""A signal is seen so late at most."""

WAIT, READ, WRITE, RECORD, NEXT, ENDED = range(6)
"""Where Python goes on: with one of the steps of this cycle; after some whole cycles (NEXT); after the last (ENDED)."""

_SHUTDOWN = int(State.SHUTDOWN)

ORDER = np.dtype([(name, "<i8") for name in ("read_at", "write_at", "law_at", "virtual", "most", "faults")])
"""Addresses of what is called; whether time is virtual; cycles to make; faults at which Python last looked."""


@compiled
def _clock(order: Record, grid: Record, timespec: np.ndarray) -> int:
    """Time now, ns; virtual time stands still within a tick."""
    return grid.woke_ns if order.virtual else now_ns(timespec)


@compiled
def _wait(order: Record, grid: Record, tick: Record, timespec: np.ndarray, early: np.ndarray) -> bool:
    """1 wait for the slot; skip those that have passed. False where the clock refuses: asked by Python, it says why."""
    deadline = grid.deadline_ns
    woke = max(grid.woke_ns, deadline) if order.virtual else wait(timespec, deadline, early)
    if woke < 0:
        return False
    late = woke - deadline
    if late >= grid.period_ns:
        skipped = late // grid.period_ns
        grid.missed += skipped
        grid.slot += skipped
        grid.deadline_ns += skipped * grid.period_ns
        late -= skipped * grid.period_ns
        tick.missed_ticks = grid.missed
    grid.woke_ns = woke
    tick.tick, tick.time_ns, tick.wakeup_ns = grid.slot, grid.deadline_ns, late
    return True


@compiled
def _run(
    order: np.ndarray,
    grid: np.ndarray,
    timespec: np.ndarray,
    early: np.ndarray,
    header: np.ndarray,
    slot_words: np.ndarray,
    command_words: np.ndarray,
    ring_words: np.ndarray,
    tick_words: np.ndarray,
    law_arguments: tuple[np.ndarray, ...],
    read_arguments: tuple[np.ndarray, ...],
    write_arguments: tuple[np.ndarray, ...],
) -> int:
    """Make `order.most` cycles, or fewer; returns where Python goes on."""
    o, g, t = order[0], grid[0], law_arguments[0][0]
    for _ in range(o.most):
        if not _wait(o, g, t, timespec, early):  # 1 wait for the slot; skip those that have passed
            return WAIT
        if call_for_int(o.read_at, read_arguments) != 0:  # 2 read the devices
            return READ
        t_read = _clock(o, g, timespec)
        mailbox.take(
            header, slot_words, command_words
        )  # 3 decide: newest command if there is a new one, law, gate
        call(o.law_at, law_arguments)
        t_law = _clock(o, g, timespec)
        t.read_ns, t.law_ns, t.record_ns = t_read - g.woke_ns, t_law - t_read, g.record_ns
        if call_for_int(o.write_at, write_arguments) != 0:  # 4 write to the devices
            return WRITE
        t_write = _clock(o, g, timespec)
        t.write_ns, t.cycle_ns = t_write - t_law, t_write - g.woke_ns + g.record_ns
        if t.enabled == 0 and t.faults != o.faults:  # what the devices say of it is told before the tick is
            o.faults = t.faults
            return RECORD
        mailbox.publish(header, ring_words, tick_words)  # 5 record
        if t.state == _SHUTDOWN:
            return ENDED
        g.slot += 1
        g.deadline_ns += g.period_ns
        g.record_ns = _clock(o, g, timespec) - t_write
    return NEXT


class WholeCycles:
    """The compiled cycles of one loop. Made by `of`."""

    def __init__(
        self, device: Replug, parts: CompiledCycle, cycle: Cycle, clock: WallClock | VirtualClock
    ) -> None:
        self._device, self._cycle, self._clock = device, cycle, clock
        law_arguments = (cycle.tick, cycle.state, cycle.params, cycle.command, cycle.model)
        memory = cycle.memory
        self._order = order = records(np.zeros(1, ORDER))
        order["read_at"] = entry_point(parts.read, *parts.read_arguments)
        order["write_at"] = entry_point(parts.write, *parts.write_arguments)
        order["law_at"] = entry_point(law.step, *law_arguments)
        order["most"] = max(1, round(PYTHON_EVERY_S * 1e9 / memory.header[0]["period_ns"]))
        order["virtual"] = isinstance(clock, VirtualClock)
        scratch = np.zeros(3, np.int64)
        timespec, early = (
            (clock.timespec, clock.early) if isinstance(clock, WallClock) else (scratch[:2], scratch)
        )
        own = (order, cycle.grid, timespec, early)
        shared = (memory.header, memory.slot_words, cycle.command_words, memory.ring_words, cycle.tick_words)
        self._run = bound(_run, *own, *shared, law_arguments, parts.read_arguments, parts.write_arguments)

    @classmethod
    def of(cls, backend: Backend, cycle: Cycle, clock: Clock) -> WholeCycles | None:
        """Those of this loop; None where its device or its clock needs Python in every cycle, or nothing is compiled."""
        if JIT_DISABLED or not isinstance(backend, Replug) or type(clock) not in (WallClock, VirtualClock):
            return None
        parts = backend.compiled_cycle(cycle.tick)
        return None if parts is None else cls(backend, parts, cycle, clock)  # type: ignore[arg-type]

    def run(self) -> int:
        """Make cycles; returns where Python goes on. At once (WAIT) while a device is lost or a reader is behind."""
        clock, device = self._clock, self._device
        if not device.is_there:
            return WAIT
        if not isinstance(clock, VirtualClock):
            at: int = self._run()
        elif (room := clock.room()) <= 0:
            return WAIT
        else:
            self._order["most"] = min(room, clock.AHEAD)
            at = self._run()
            clock.jump(int(self._cycle.grid["woke_ns"][0]))
        if at in (RECORD, NEXT):  # with torque too: who listens must know that there was some
            device.listen(self._cycle.tick)
        return at
