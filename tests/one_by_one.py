"""The closed loop without its compiled cycle: the mock and the law are called tick by tick, as a loop process
does.
"""

import numpy as np

from hw.simulators.mock_backend import MockBackend
from rtctl.check.law_plan import build
from rtctl.control import law
from rtctl.control.jit import records
from rtctl.control.records import state_dtype
from rtctl.tick import new_ticks


def ticks_one_by_one(loaded, options, count, arm_at):
    """The first `count` ticks of a rig with these options of its mock, armed at tick `arm_at`."""
    plan, backend = build(loaded), MockBackend(options, loaded.config.hardware())
    params, command, model = records(plan.params), records(plan.command), records(plan.model)
    tick, state, found = records(new_ticks(1, 1)), records(np.zeros(1, state_dtype(1))), []
    for k in range(count):
        if k == arm_at:
            command["arm_count"] = 1
            command["seq"] += 1
        tick["tick"], tick["time_ns"] = k, k * 1_000_000
        backend.read(tick)
        law.step(tick, state, params, command, model)
        backend.write(tick)
        found.append(tick.copy())
    return np.concatenate(found)


def require_same(found, wanted):
    """Every bit of every tick; the first that differs is named."""
    for k in range(len(wanted)):
        assert found[k : k + 1].tobytes() == wanted[k : k + 1].tobytes(), f"tick {k}"
