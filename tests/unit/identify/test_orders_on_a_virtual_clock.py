"""On a virtual clock the loop waits for a host that gives orders: seconds of ticks lay between them before,
and no speed of an identification became steady.
"""

from types import SimpleNamespace

import pytest

from rtctl.host.supervisor import Host
from rtctl.identify.motion import Order
from rtctl.identify.observer import Identifier
from rtctl.rt.shared_memory import Memory

PERIOD_S, BATCH_S = 1e-3, 0.02


@pytest.mark.parametrize(("clock", "ahead", "batch_s"), [("virtual", 20, 1e-3), ("wall", 4000, BATCH_S)])
def test_an_identification_has_virtual_time_wait_for_a_batch(clock, ahead, batch_s):
    host = object.__new__(Host)
    host.loaded = SimpleNamespace(config=SimpleNamespace(loop=SimpleNamespace(clock=clock)))
    host.plan, host._batch_s = SimpleNamespace(period_s=PERIOD_S), BATCH_S
    host.memory = Memory.create(1, 8000, 1_000_000)
    host.writer = SimpleNamespace(command={"shutdown_count": [0], "seq": [0]}, send=lambda: None)
    Identifier(iter([Order()]), 0)(host, None)
    assert host.memory.header["ahead_rows"] == ahead
    assert host._batch_s == batch_s
    host.memory.close()
