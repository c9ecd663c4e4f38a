"""Awake before its deadline the loop rehearses the law on copies: nothing of it stays."""

import numpy as np
import pytest

from hw.rig import compose
from rtctl.check import law_plan as plan
from rtctl.rig_file import config
from rtctl.rt import whole_cycle
from rtctl.rt.clock import VirtualClock, now_ns
from rtctl.rt.loop import Stop, run_loop
from rtctl.rt.replug import Replug
from rtctl.rt.shared_memory import CommandWriter, Memory
from rtctl.simulation.shipped_files import shipped_config

pytestmark = pytest.mark.compiled


def rig():
    loaded = config.load(shipped_config("mock.toml"))
    found = plan.build(loaded)
    memory = Memory.create(found.n_axes, 3010, found.period_ns)
    memory.params[:], memory.model[:] = found.params, found.model
    writer = CommandWriter(memory)
    writer.command[:] = found.command
    writer.send()
    backend = compose(loaded.members(), loaded.config.hardware())
    backend.open()
    return memory, backend


@pytest.mark.parametrize(("early_ms", "simulated"), [(60, True), (60, False), (0, True)])
def test_awake_before_its_deadline_it_rehearses_on_copies_and_changes_nothing(
    early_ms, simulated, monkeypatch
):
    memory, backend = rig()
    if not simulated:
        parts = backend.compiled_cycle
        monkeypatch.setattr(backend, "compiled_cycle", lambda tick: parts(tick)._replace(simulated=()))
    stop, seen = Stop(), []

    def listen(tick):
        seen.append(1)
        stop.requests = len(seen) > 2

    made, original = [], whole_cycle.WholeCycles.__init__

    def init(self, *given):
        original(self, *given)
        made.append(self)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(whole_cycle.WholeCycles, "__init__", init)
        run_loop(Replug(backend, listen=listen), memory, VirtualClock(), stop)
    one = made[0]
    cycle, rehearsal = one._cycle, one.rehearsal
    kept = (cycle.tick, cycle.state, cycle.params, cycle.command, cycle.model, backend.state, backend.params)
    before = [array.tobytes() for array in kept]
    ticks = int(cycle.state["ticks"][0])
    timespec, early = np.zeros(2, np.int64), np.array([early_ms * 1_000_000, 0, 0], np.int64)
    for _ in range(50):  # a machine that stands still has no time for it
        deadline = now_ns(timespec) + 20_000_000
        given = (one._order[0], deadline, timespec, early, tuple(rehearsal))
        assert whole_cycle._until_deadline(*given) >= deadline
        assert [array.tobytes() for array in kept] == before
        if early_ms == 0 or rehearsal.law[1]["ticks"][0] == ticks + 1:
            break
    rehearsed = rehearsal.law[1]["ticks"][0] == ticks + 1
    assert rehearsed == (early_ms > 0)
    assert (rehearsal.law[0]["tick"][0] == cycle.tick["tick"][0] + 1) == rehearsed
    if rehearsed:
        assert rehearsal.read[1]["tick"][0] - backend.state["tick"][0] == simulated
    memory.close()
