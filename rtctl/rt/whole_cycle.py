"""Whole cycles in compiled code: wait, read, decide, write, record, without Python in between.

The same steps, in the same order and on the same records, as `rtctl.rt.loop`, which takes over wherever a
step needs Python: a device that is lost, its words, a signal. `run` says at which step. A person's hand feels
no difference; the cycle takes a third of the time.

Wherever the clock is a wall, Python is back after `PYTHON_EVERY_S` at the latest, to see signals. While such
a loop waits for its deadline awake, it rehearses: the law decides on copies of everything, and what it
decides is thrown away. After a sleep the processor has forgotten the law's code and numbers; fetched before
the deadline, they cost nothing after it. So does a device that is only simulated; one that is there is
reached once in a cycle."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hw.entry_points import call, call_for_int, entry_point
from hw.interface import Backend, CompiledCycle
from hw.jit import JIT_DISABLED
from rtctl.control import law, mailbox
from rtctl.control.jit import bound, compiled, records
from rtctl.control.records import Record
from rtctl.control.vocabulary import State
from rtctl.rt.clock import Clock, VirtualClock, WallClock, doze, look, now_ns
from rtctl.rt.cycle import Cycle
from rtctl.rt.early import PLACES
from rtctl.rt.replug import Replug
from rtctl.rt.shared_memory import words

PYTHON_EVERY_S = 0.005
"""A signal is seen so late at most."""

# ended 25 or 50 us before the deadline, p99 of start and cycle was 10 us and more, not 6 (decision 0106)
REHEARSAL_NS = 12_000
"""A rehearsal begins no nearer to the deadline than this for each axis: it takes up to half of that."""

WAIT, READ, WRITE, RECORD, NEXT, ENDED = range(6)
"""Where Python goes on: with one of the steps of this cycle; after some whole cycles (NEXT); after the last
(ENDED)."""

_SHUTDOWN = int(State.SHUTDOWN)

ORDER = np.dtype(
    [
        (name, "<i8")
        for name in (
            "read_at",
            "write_at",
            "law_at",
            "virtual",
            "most",
            "faults",
            "simulated",
            "rehearsal_ns",
        )
    ]
)
"""Addresses of what is called; whether time is virtual; cycles to make; faults at which Python last looked;
whether the device rehearses too; time that a rehearsal needs."""


@compiled
def _clock(order: Record, grid: Record, timespec: np.ndarray) -> int:
    """Time now, ns; virtual time stands still within a tick."""
    return grid.woke_ns if order.virtual else now_ns(timespec)


@compiled
def _rehearse(order: Record, rehearsal: tuple[tuple[np.ndarray, ...], ...]) -> None:
    """Let the law decide on copies, as if the next sample had come. Nothing of it stays but what the
    processor remembers."""
    law_arguments, read_arguments, write_arguments, originals, copies = rehearsal
    for k in range(len(originals)):
        for row in range(len(originals[k])):
            for word in range(originals[k].shape[1]):
                copies[k][row, word] = originals[k][row, word]
    t = law_arguments[0][0]
    # as the next sample: with the same count the law would rehearse a stale one
    t.tick += 1
    t.sample_count += 1
    if order.simulated:
        call_for_int(order.read_at, read_arguments)
    call(order.law_at, law_arguments)
    if order.simulated:
        call_for_int(order.write_at, write_arguments)


@compiled
def _until_deadline(
    order: Record,
    deadline_ns: int,
    timespec: np.ndarray,
    early: np.ndarray,
    rehearsal: tuple[tuple[np.ndarray, ...], ...],
) -> int:
    """Sleep, rehearse as long as there is time, look; the time then, ns, or minus the C error number."""
    woke = doze(timespec, deadline_ns, early)
    if woke < 0:
        return woke
    while deadline_ns - woke > order.rehearsal_ns:
        _rehearse(order, rehearsal)
        woke = now_ns(timespec)
    return look(timespec, deadline_ns)


@compiled
def _start(grid: Record, tick: Record, woke: int) -> bool:
    """Skip slots that have passed, and stamp the tick. False where the clock refused (`woke` < 0): asked by
    Python, it says why."""
    deadline = grid.deadline_ns
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
    rehearsal: tuple[tuple[np.ndarray, ...], ...],
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
        if o.virtual:  # 1 wait for the slot; skip those that have passed
            woke = max(g.woke_ns, g.deadline_ns)
        else:
            woke = _until_deadline(o, g.deadline_ns, timespec, early, rehearsal)
        if not _start(g, t, woke):
            return WAIT
        if call_for_int(o.read_at, read_arguments) != 0:  # 2 read the devices
            return READ
        t_read = _clock(o, g, timespec)
        # 3 decide: newest command if there is a new one, law, gate
        mailbox.take(header, slot_words, command_words)
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
        # after it was recorded: the host sees the last state, and knows that nothing follows
        if t.state == _SHUTDOWN:
            return ENDED
        g.slot += 1
        g.deadline_ns += g.period_ns
        g.record_ns = _clock(o, g, timespec) - t_write
    return NEXT


class Rehearsal(NamedTuple):
    """Arguments of a rehearsal; words of `originals` are copied to `copies`, which are all that it
    changes."""

    law: tuple[np.ndarray, ...]
    read: tuple[np.ndarray, ...]
    write: tuple[np.ndarray, ...]
    originals: tuple[np.ndarray, ...]
    copies: tuple[np.ndarray, ...]

    @classmethod
    def of(cls, law_arguments: tuple[np.ndarray, ...], cycle: Cycle, parts: CompiledCycle) -> Rehearsal:
        """That of one loop. What is only read, parameters among them, is the loop's own."""
        changed = (cycle.tick, cycle.state, cycle.command, *parts.simulated)
        copies = tuple(records(one.copy()) for one in changed)

        def practised(arguments: tuple[np.ndarray, ...]) -> tuple[np.ndarray, ...]:
            """Arguments with copies in place of what is changed."""
            pairs = list(zip(changed, copies, strict=True))
            return tuple(next((copy for one, copy in pairs if one is given), given) for given in arguments)

        return cls(
            practised(law_arguments),
            practised(parts.read_arguments),
            practised(parts.write_arguments),
            tuple(map(words, changed)),
            tuple(map(words, copies)),
        )


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
        # by address: the very machine code of simulation and replay, bit for bit (decision 0025)
        order["law_at"] = entry_point(law.step, *law_arguments)
        # one at least, at 100 Hz too: a cycle takes twice that time there
        order["most"] = max(1, round(PYTHON_EVERY_S * 1e9 / memory.header[0]["period_ns"]))
        order["rehearsal_ns"] = REHEARSAL_NS * memory.n_axes
        order["virtual"], order["simulated"] = isinstance(clock, VirtualClock), bool(parts.simulated)
        scratch = np.zeros(PLACES, np.int64)
        timespec, early = (
            (clock.timespec, clock.early) if isinstance(clock, WallClock) else (scratch[:2], scratch)
        )
        self.rehearsal = Rehearsal.of(law_arguments, cycle, parts)
        own = (order, cycle.grid, timespec, early, tuple(self.rehearsal))
        shared = (memory.header, memory.slot_words, cycle.command_words, memory.ring_words, cycle.tick_words)
        self._run = bound(_run, *own, *shared, law_arguments, parts.read_arguments, parts.write_arguments)

    @classmethod
    def of(cls, backend: Backend, cycle: Cycle, clock: Clock) -> WholeCycles | None:
        """Those of this loop; None where its device or its clock needs Python in every cycle, or nothing is
        compiled."""
        if JIT_DISABLED or not isinstance(backend, Replug) or type(clock) not in (WallClock, VirtualClock):
            return None
        parts = backend.compiled_cycle(cycle.tick)
        return None if parts is None else cls(backend, parts, cycle, clock)  # type: ignore[arg-type]

    def run(self) -> int:
        """Make cycles; returns where Python goes on. At once (WAIT) while a device is lost or a reader is
        behind."""
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
