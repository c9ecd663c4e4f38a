"""Short runs of the simulated rig with their commands, as the host would hand them to a recorder."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from rtctl.recording.limits import Limits
from rtctl.recording.parts import Parts
from rtctl.recording.setup import Setup, setup_of
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation

CONFIGS = Path(__file__).parents[3] / "configs"


def setup(config="mock.toml", **about) -> Setup:
    sim = Simulation(load(CONFIGS / config))
    made = setup_of(load(CONFIGS / config), sim.plan, 7, 10**18)
    return Setup({**made.about, **about}, made.attachments)


@cache
def run(config="mock.toml", seconds=2.0):
    """Ticks of an armed run from its first tick, and every command in force in it."""
    sim = Simulation(load(CONFIGS / config))
    rows, commands = [], []

    def step(duration, **fields):
        sim.change(**fields)
        commands.append(np.array(sim.command.copy()))
        rows.append(np.array(sim.run(duration)))

    sim.command["seq"] = 0
    for k in range(100):
        step(0.05, arm_count=k + 1, epoch=int(sim.state["epoch"][0]))
        if rows[-1]["state"][-1] == 3:
            break
    step(seconds / 2, compensation=0.0)
    step(seconds / 2, compensation=1.0)
    return np.concatenate(rows), np.concatenate(commands)


def write(folder, rows, commands, made=None, limits=None, batch=20, events=(), first_row=0, end=True):
    """Record rows in batches of `batch`, each command with the first batch it is in force."""
    parts = Parts(folder, made or setup(), limits or Limits(free_bytes=0))
    seen = 0
    for first in range(0, len(rows), batch):
        some = rows[first : first + batch]
        fresh = commands[(commands["seq"] > seen) & (commands["seq"] <= some["command_seq"].max())]
        seen = max(seen, int(some["command_seq"].max()))
        told = [e for e in events if some["tick"][0] <= e["tick"] <= some["tick"][-1]]
        parts.add(first_row + first, some, told, fresh)
    if end:
        parts.close({"reason": "test"})
    return parts
