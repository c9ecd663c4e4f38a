"""What the safety machine costs per tick: detectors, state machine, gate and encoded-value check, without the law."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from rtctl.bench.row import Row
from rtctl.config import load
from rtctl.control import arming, detectors, gate, intake, law, running_delay
from rtctl.control.jit import compiled
from rtctl.control.states import advance
from rtctl.control.vocabulary import State
from rtctl.errors import RtctlError
from rtctl.simulation import Simulation

CHUNK = 500
"""Ticks timed together: a clock is read in as long as the machine takes."""


@compiled
def guard(ticks: np.ndarray, state: np.ndarray, params: np.ndarray, command: np.ndarray) -> None:
    """Run everything that was added for safety over recorded ticks, the law's own torque taken as it stands there."""
    s, p, c = state[0], params[0], command[0]
    for k in range(len(ticks)):
        t = ticks[k]
        skipped = detectors.count_late(t, s)
        faults = (
            detectors.late_fault(s, p, skipped) | detectors.realtime_fault(t, p) | detectors.age_fault(s, p)
        )
        for axis in range(len(t.position_rad)):
            t.torque_share[axis] = detectors.temperature_share(t, s, p, axis)
            faults |= detectors.temperature_fault(s, p, axis) | detectors.window_fault(s, p, axis)
            faults |= detectors.follow_fault(t, s, p, axis, 1, skipped)
            faults |= arming.arming_faults(t, s, p, axis, 1, skipped)
            faults |= running_delay.running_fault(t, s, p, axis, skipped)
        faults |= intake.target_fault(s, p, c)
        advance(s, p, t.tick, faults, 0, False, arming.tested(s, p), intake.holding(s, p, c))
        law._send(t, s, p)
        for axis in range(len(t.position_rad)):
            s.torque_applied_nm[axis] = t.torque_applied_nm[axis]
            detectors.remember_torque(s, axis)
            s.window_mean_nm[axis] = gate.push_window(
                s.window_mean_nm[axis], t.torque_applied_nm[axis], p.window_share
            )
        s.ticks += 1


@compiled
def whole_law(
    ticks: np.ndarray, state: np.ndarray, params: np.ndarray, command: np.ndarray, model: np.ndarray
) -> None:
    """The whole law over the same ticks."""
    for k in range(len(ticks)):
        law.step(ticks[k : k + 1], state, params, command, model)


def rows(config: Path, seconds: float) -> list[Row]:
    """Median time per tick of the machine and gate, on ticks of the mock in ACTIVE, beside the whole law's.

    Raises
    ------
    RtctlError
        The ticks replayed did not stay in ACTIVE: something else would be measured.
    """
    simulation = Simulation(load(config))
    simulation.arm(compensation=1.0)
    start = simulation.state.copy()
    recorded = simulation.run(seconds)
    params, command, model = simulation.params, simulation.command, simulation.model
    added_ns: list[float] = []
    law_ns: list[float] = []
    for kind in ("warm-up", "measured"):
        for times, function, more in ((added_ns, guard, ()), (law_ns, whole_law, (model,))):
            state, ticks = start.copy(), recorded.copy()
            for first in range(0, len(ticks) - CHUNK + 1, CHUNK):
                part = ticks[first : first + CHUNK]
                began = time.perf_counter_ns()
                function(part, state, params, command, *more)
                if kind == "measured":
                    times.append((time.perf_counter_ns() - began) / CHUNK)
            if state["state"][0] != State.ACTIVE:
                raise RtctlError(
                    f"{config}: the replayed rig left ACTIVE for {State(int(state['state'][0])).name}"
                )
    text = (
        f"the whole law with them {np.median(law_ns) / 1e3:.3f} us; {len(recorded)} ticks of the mock, ACTIVE"
    )
    return [Row("safety machine and gate per tick, p50", float(np.median(added_ns)) / 1e3, "us", text, 1.0)]
