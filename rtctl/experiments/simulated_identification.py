"""Drives an identification on the simulated rig, in one process, far faster than real time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rtctl.identify.motion import Order, Steps
from rtctl.simulation.closed_loop import Simulation

CHUNK_S = 5.0
"""Longest piece simulated at once: how long a Ctrl-C may wait, in simulated time."""


def drive(
    simulation: Simulation,
    steps: Steps[None],
    axis: int,
    watch: Callable[[np.ndarray], None] = lambda _rows: None,
) -> None:
    """Run a procedure to its end on a simulation of the rig. `watch` receives every tick.

    Raises
    ------
    KeyboardInterrupt
        Ctrl-C, after the simulated rig was stopped like a real one. Errors of the procedure likewise."""
    # help would be measured as friction that is not there
    simulation.command["compensation"] = 0.0
    try:
        order = next(steps)
        while True:
            rows = _follow(simulation, order, axis)
            watch(rows)
            order = steps.send(rows)
    except StopIteration:
        return
    finally:
        # as `Host` ends a run: torque down, whatever ended the procedure
        simulation.run(0.1, stop_count=int(simulation.command["stop_count"][0]) + 1)


def _follow(simulation: Simulation, order: Order, axis: int) -> np.ndarray:
    command = simulation.command
    for name, value in order.fields.items():
        command[name][0, axis] = value
    if order.fields:
        command["seq"] += 1
    if order.arm_in is not None:
        command["arm_count"] += 1
        # the epoch that the procedure saw: a stop since then voids the request, as on a rig
        command["epoch"] = order.arm_in
        command["seq"] += 1
    # shorter than asked is allowed: the procedure counts ticks
    seconds = min(order.look_s, CHUNK_S)
    return simulation.run(seconds).view(np.ndarray)
