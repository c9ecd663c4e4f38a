"""Whole compiled cycles record what the loop in Python records, tick by tick, and come back to it where they
must.
"""

import numpy as np
import pytest

from hw.interface import CompiledCycle, LinkLost
from hw.jit import compiled
from hw.rig import compose
from rtctl.check import law_plan as plan
from rtctl.control.vocabulary import State
from rtctl.rig_file import config
from rtctl.rt import whole_cycle
from rtctl.rt.clock import VirtualClock
from rtctl.rt.loop import Stop, run_loop, warm_up
from rtctl.rt.replug import Replug
from rtctl.rt.shared_memory import CommandWriter, Memory, RingReader
from rtctl.simulation.shipped_files import shipped_config

pytestmark = pytest.mark.compiled

CLOCKED = ("wakeup_ns", "read_ns", "law_ns", "write_ns", "record_ns", "cycle_ns")


class Counted:
    """A device that counts how often Python was asked, and does what a test scripts at some of its cycles."""

    def __init__(self, backend, script=None, *, compiled=True):
        self.backend, self.script, self.compiled = backend, script or {}, compiled
        self.provides, self.consumes = backend.provides, backend.consumes
        self.reads = self.writes = self.stops = 0

    def compiled_cycle(self, tick):
        return self.backend.compiled_cycle(tick) if self.compiled else None

    def warm_up(self, tick):
        self.backend.warm_up(tick)

    def open(self):
        self.backend.open()

    def read(self, tick):
        self.reads += 1
        self.script.get(int(tick["tick"][0]), lambda: None)()
        self.backend.read(tick)

    def write(self, tick):
        self.writes += 1
        self.backend.write(tick)

    def stop(self):
        self.stops += 1
        self.backend.stop()

    def close(self):
        self.backend.close()


def rig(*, n=3000):
    loaded = config.load(shipped_config("mock.toml"))
    found = plan.build(loaded)
    memory = Memory.create(found.n_axes, n + 10, found.period_ns)
    memory.params[:], memory.model[:] = found.params, found.model
    writer = CommandWriter(memory)
    writer.command[:] = found.command
    writer.send()
    backend = compose(loaded.members(), loaded.config.hardware())
    backend.open()
    return memory, writer, backend


class At:
    """What is done after so many ticks were recorded, from the listener of disabled ticks on: arm, and
    end.
    """

    def __init__(self, memory, writer, stop, *, arm=700, end=2500):
        self.memory, self.writer, self.stop, self.arm, self.end = memory, writer, stop, arm, end

    def __call__(self):
        head = int(self.memory.header[0]["head"])
        if self.arm and head >= self.arm:
            self.arm = 0
            self.writer.command["arm_count"] += 1
            self.writer.send()
        if head >= self.end:
            self.stop.requests = 1


class StepClock(VirtualClock):
    """The loop in Python with virtual time; `At` is asked before each tick."""

    def __init__(self, at):
        super().__init__()
        self.at = at

    def sleep_until(self, deadline_ns):
        self.at()
        return super().sleep_until(deadline_ns)


def recorded(memory):
    return RingReader(memory, from_start=True).read()


def scripted(memory, writer, stop, *, whole, monkeypatch):
    """Both kinds of loop, commanded at the same ticks: one cycle a time when it is whole."""
    _, _, backend = rig()
    at = At(memory, writer, stop)
    if not whole:
        run_loop(Replug(backend), memory, StepClock(at), stop)
        return backend
    one = whole_cycle.WholeCycles.run

    def stepwise(self):
        at()
        if stop.requests:
            return whole_cycle.WAIT
        self._clock.AHEAD = 1
        return one(self)

    monkeypatch.setattr(whole_cycle.WholeCycles, "run", stepwise)
    run_loop(Replug(backend), memory, VirtualClock(), stop)
    return backend


def test_every_field_of_every_tick_is_that_of_the_loop_in_python(monkeypatch):
    rows = []
    for whole in (False, True):
        memory, writer, _ = rig()
        scripted(memory, writer, Stop(), whole=whole, monkeypatch=monkeypatch)
        rows.append(recorded(memory))
        memory.close()
    in_python, compiled_ = rows
    assert len(in_python) == len(compiled_) > 2500
    assert State.ACTIVE in in_python["state"]
    for name in in_python.dtype.names:
        if name not in (*CLOCKED, "checksum", "command_stamp_ns"):
            assert in_python[name].tobytes() == compiled_[name].tobytes(), name


def test_python_is_not_asked_in_ordinary_cycles_and_a_stop_is_seen():
    memory, _writer, backend = rig()
    stop, device = Stop(), Counted(backend)
    heard = []

    def listen(tick):
        heard.append(int(tick["tick"][0]))
        if len(heard) == 5:
            stop.requests = 1

    run_loop(Replug(device, listen=listen), memory, VirtualClock(), stop)
    rows = recorded(memory)
    assert rows["state"][-1] == State.SHUTDOWN
    whole = int(np.argmax(rows["tick"] == heard[4])) + 1
    assert whole >= 3 * VirtualClock.AHEAD
    assert device.reads == device.writes == len(rows) - whole, "Python took over for the end alone"
    assert device.stops == 1
    memory.close()


@compiled
def leave(tick, count, _state):
    """A compiled half that leaves every hundredth cycle to Python."""
    count[0] += 1
    if count[0] % 100 == 0:
        return 1
    tick[0].link_faults = 0
    return 0


class Leaving:
    """A device whose compiled parts leave some cycles to Python."""

    provides, consumes = frozenset({"position"}), frozenset({"torque"})

    def __init__(self, stop, lost_after=10**9):
        self.counts, self.spare = np.zeros((2, 1), np.int64), np.zeros(1, np.int64)
        self.stop_, self.lost_after = stop, lost_after
        self.reads = self.writes = self.opened = 0

    def compiled_cycle(self, tick):
        one, other = self.counts
        return CompiledCycle(leave, (tick, one, self.spare), leave, (tick, other, self.spare))

    def open(self):
        self.opened += 1

    def read(self, tick):
        self.reads += 1
        if self.reads == self.lost_after:
            raise LinkLost("gone")
        tick["link_faults"] = 0
        if self.reads >= 20:
            self.stop_.requests = 2

    def write(self, tick):
        self.writes += 1

    def stop(self):
        pass

    def close(self):
        pass


def test_what_a_compiled_part_leaves_is_done_in_the_same_cycle():
    memory, _, _ = rig(n=4000)
    stop = Stop()
    device = Leaving(stop)
    run_loop(Replug(device), memory, VirtualClock(), stop)
    rows = recorded(memory)
    assert rows["tick"].tolist() == list(range(len(rows))), "no tick twice, none left out"
    assert device.reads == 20
    assert device.counts[0, 0] == 2000, "every cycle asked the compiled part first"
    assert np.all(np.diff(rows["time_ns"]) == 1_000_000)
    memory.close()


def test_a_device_that_is_lost_is_pythons_until_it_is_back():
    memory, _, _ = rig(n=6000)
    stop, said = Stop(), []
    device = Leaving(stop, lost_after=2)
    run_loop(Replug(device, said.append), memory, VirtualClock(), stop)
    rows = recorded(memory)
    lost = np.flatnonzero(rows["link_faults"])
    assert said == ["lost: gone", "found again"]
    assert 499 <= len(lost) <= 501
    assert np.all(np.diff(lost) == 1)
    assert device.opened == 1
    memory.close()


def test_warm_up_compiles_it_and_moves_nothing():
    memory, _, backend = rig()
    before = backend.state.tobytes()
    warm_up(memory, Replug(backend))
    assert backend.state.tobytes() == before
    assert int(memory.header[0]["head"]) == 0
    assert whole_cycle._run.overloads
    memory.close()


def test_who_listens_hears_of_ticks_with_torque_too(monkeypatch):
    memory, writer, backend = rig()
    stop = Stop()
    at, heard = At(memory, writer, stop, arm=VirtualClock.AHEAD * 3), []

    def listen(tick):
        heard.append(int(tick["enabled"][0]))
        at()

    run_loop(Replug(backend, listen=listen), memory, VirtualClock(), stop)
    assert 1 in heard
    assert heard[0] == 0
    memory.close()


def test_late_slots_are_skipped_and_counted_in_compiled_cycles_too():
    memory, _, backend = rig()
    stop = Stop()
    seen = []

    def listen(tick):
        seen.append(int(tick["tick"][0]))
        clock.jump(clock.now() + 5_400_000)
        loop_grid["woke_ns"] += 5_400_000
        if len(seen) == 3:
            stop.requests = 2

    clock = VirtualClock()
    original = whole_cycle.WholeCycles.of.__func__

    def of(cls, *given):
        nonlocal loop_grid
        made = original(cls, *given)
        loop_grid = given[1].grid
        return made

    loop_grid = None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(whole_cycle.WholeCycles, "of", classmethod(of))
        run_loop(Replug(backend, listen=listen), memory, clock, stop)
    rows = recorded(memory)
    steps = np.diff(rows["tick"])
    assert set(steps.tolist()) == {1, 5}, "5.4 periods late: four slots passed"
    assert np.array_equal(np.diff(rows["missed_ticks"]), steps - 1)
    assert np.all(rows["wakeup_ns"] < 1_000_000)
    memory.close()
