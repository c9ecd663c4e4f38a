"""What the safety machine costs per tick, what the account of the help with friction and its observer do, and
an admittance.

The safety machine: detectors, state machine, gate and encoded-value check, without the law. The account: dry
friction's credit, energy account, disturbance observer, rest.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.control import arming, detectors, gate, intake, law, running_delay
from rtctl.control.assistance import keep_assistance, remember_compensation
from rtctl.control.disturbance_observer import observe_friction
from rtctl.control.dry_friction import credit_friction
from rtctl.control.jit import compiled
from rtctl.control.resting import advance_rest
from rtctl.control.states import advance
from rtctl.control.vocabulary import State
from rtctl.errors import RtctlError
from rtctl.experiments import admittance_runs
from rtctl.rig_file.config import LoadedConfig, load
from rtctl.simulation.closed_loop import Simulation
from tests.bench.row import Row

CHUNK = 500
"""Ticks timed together: a clock is read in as long as the machine takes."""


@compiled
def guard(ticks: np.ndarray, state: np.ndarray, params: np.ndarray, command: np.ndarray) -> None:
    """Run everything that was added for safety over recorded ticks, the law's own torque taken as it stands
    there.
    """
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
def account(
    ticks: np.ndarray, state: np.ndarray, params: np.ndarray, command: np.ndarray, model: np.ndarray
) -> None:
    """Run what keeps the help with friction quiet over recorded ticks: credit, account, observer, watch of
    the delay.
    """
    s, p = state[0], params[0]
    for k in range(len(ticks)):
        t = ticks[k]
        for axis in range(len(t.position_rad)):
            dx = t.position_rad[axis] - s.position_rad[axis]
            s.position_rad[axis] = t.position_rad[axis]
            advance_rest(s, p, axis, t.hand_torque_nm[axis], t.coupling_torque_nm[axis])
            credit_friction(s, p, model[axis], axis, dx, 1, t.velocity_rad_s[axis])
            keep_assistance(s, p, axis, dx, 1, t.velocity_rad_s[axis], True)
            observe_friction(t, s, p, axis, 1)
            law._compensate(t, s, p, model[axis], axis, 1)
            remember_compensation(t, s, axis, 1.0)
            running_delay.running_fault(t, s, p, axis, 0)
            s.hand_torque_before_nm[axis] = t.hand_torque_nm[axis]
            detectors.remember_torque(s, axis)
        s.ticks += 1


@compiled
def whole_law(
    ticks: np.ndarray, state: np.ndarray, params: np.ndarray, command: np.ndarray, model: np.ndarray
) -> None:
    """The whole law over the same ticks."""
    for k in range(len(ticks)):
        law.step(ticks[k : k + 1], state, params, command, model)


def _times_ns(simulation: Simulation, seconds: float) -> dict[str, list[float]]:
    """Ns per tick of each part, interleaved in chunks of `CHUNK` ticks over the same ticks."""
    start = simulation.state.copy()
    recorded = simulation.run(seconds)
    params, command, model = simulation.params, simulation.command, simulation.model
    parts: dict[str, tuple[Callable[..., None], tuple[Any, ...]]] = {
        "guard": (guard, ()),
        "account": (account, (model,)),
        "law": (whole_law, (model,)),
    }
    states = {name: start.copy() for name in parts}
    times: dict[str, list[float]] = {name: [] for name in parts}
    for first in range(0, len(recorded) - CHUNK + 1, CHUNK):
        for name, (function, more) in parts.items():
            chunk = recorded[first : first + CHUNK].copy()
            began = time.perf_counter_ns()
            function(chunk, states[name], params, command, *more)
            times[name].append((time.perf_counter_ns() - began) / CHUNK)
    for name in ("guard", "law"):
        state = State(int(states[name]["state"][0]))
        if state != State.ACTIVE:
            raise RtctlError(f"the replayed rig left ACTIVE for {state.name}")
    return {name: found[1:] for name, found in times.items()}  # the first compiles


def _display_ns(loaded: LoadedConfig, seconds: float) -> dict[str, list[float]]:
    """Ns per tick of the whole law with the joint displayed as an impedance and as an admittance, chunks of
    both in turn.
    """
    shown = {"impedance": None, "admittance": admittance_runs.usual(loaded)}
    runs: dict[str, tuple[np.ndarray, np.ndarray, Simulation]] = {}
    for name, one in shown.items():
        simulation = Simulation(admittance_runs.displayed(loaded, one))
        simulation.arm(compensation=1.0)
        start = simulation.state.copy()
        runs[name] = (simulation.run(seconds), start, simulation)
    times: dict[str, list[float]] = {name: [] for name in runs}
    for first in range(0, int(seconds / loaded.config.period_s) - CHUNK + 1, CHUNK):
        for name, (recorded, state, one_run) in runs.items():
            chunk = recorded[first : first + CHUNK].copy()
            began = time.perf_counter_ns()
            whole_law(chunk, state, one_run.params, one_run.command, one_run.model)
            times[name].append((time.perf_counter_ns() - began) / CHUNK)
    for name, (_, state, _) in runs.items():
        if State(int(state["state"][0])) != State.ACTIVE:
            raise RtctlError(f"the replayed {name} left ACTIVE")
    return {name: found[1:] for name, found in times.items()}


def _display_row(loaded: LoadedConfig, seconds: float) -> Row:
    """What an admittance costs per tick beyond an impedance: the difference of the least times, which no
    other program is in.
    """
    least = {name: min(found) / 1e3 for name, found in _display_ns(loaded, seconds).items()}
    text = f"least times, of the whole law: {least['impedance']:.3f} and {least['admittance']:.3f} us"
    return Row(
        "an admittance per tick, beyond an impedance",
        least["admittance"] - least["impedance"],
        "us",
        text,
        0.15,
    )


def rows(config: Path, seconds: float) -> list[Row]:
    """Median time per tick of the parts, on ticks of the mock in ACTIVE, beside the whole law's; and of
    either display.

    Raises
    ------
    RtctlError
        The ticks replayed did not stay in ACTIVE: something else would be measured.
    """
    simulation = Simulation(load(config))
    simulation.arm(compensation=1.0)
    times = _times_ns(simulation, seconds)
    p50_us = {name: float(np.median(found)) / 1e3 for name, found in times.items()}
    text = (
        f"the whole law with them {p50_us['law']:.3f} us; {CHUNK * len(times['law'])} ticks of the mock, "
        "ACTIVE"
    )
    return [
        Row("safety machine and gate per tick, p50", p50_us["guard"], "us", text, 1.0),
        Row(
            "account of the help, observer and delay watch per tick, p50", p50_us["account"], "us", text, 0.15
        ),
        _display_row(load(config), seconds),
    ]
