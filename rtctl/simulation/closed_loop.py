"""The control law and the simulated rig as one compiled loop: experiments far faster than real time.

The loop is the same three steps as the real-time one (read, decide, write) on the same records, without
clock, processes and network. Needs a rig file whose device is the mock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hw.entry_points import Address, call, call_for_int, entry_point
from hw.fault_options import read_faults
from hw.fault_script import fill_schedule
from hw.simulators.mock_plant import next_slot, plant_read, plant_write
from hw.simulators.mock_records import plant_records
from rtctl.check.law_plan import Plan, build
from rtctl.control import law
from rtctl.control.jit import compiled, records
from rtctl.control.records import state_dtype
from rtctl.control.vocabulary import State, state_and_cause
from rtctl.errors import ConfigError, FaultError
from rtctl.rig_file.config import LoadedConfig
from rtctl.tick import new_ticks

ARM_PATIENCE_S = 30.0
"""How long `Simulation.arm` waits: ready takes half a second and the tare, plus any noise in between."""


@compiled
def simulate(
    read_at: Address,
    law_at: Address,
    write_at: Address,
    law_arguments: tuple[np.ndarray, ...],
    plant_arguments: tuple[np.ndarray, ...],
    trace: np.ndarray,
    truth: np.ndarray,
    period_ns: int,
    every: int,
) -> None:
    """Run `len(trace) * every` ticks in place, from slot `tick[0].tick` on; keep each last of `every`.

    Parameters
    ----------
    read_at, law_at, write_at
        Where `plant_read`, the law and `plant_write` are: the machine code that the loop runs, compiled once
        for all.
    law_arguments
        Records of the law (`rtctl.control.records`): tick, state, parameters, command, model. The tick
        carries the slot to run next, so that a run can be continued.
    plant_arguments
        Tick, and state and parameters of the rig (`hw.simulators.mock_records`).
    trace, truth : array, shape (n,)
        Ticks, and states of the rig at the end of each one's period."""
    tick, plant_state, _ = plant_arguments
    for row in range(len(trace)):
        for k in range(every):
            tick[0].time_ns = tick[0].tick * period_ns
            call_for_int(read_at, plant_arguments)
            call(law_at, law_arguments)
            call_for_int(write_at, plant_arguments)
            # the last of them: beside it stands the truth of the same instant
            if k == every - 1:
                trace[row] = tick[0]
                truth[row] = plant_state[0]
            next_slot(tick, plant_state)


class Simulation:
    """A simulated rig and its controller, built from a rig file.

    Attributes
    ----------
    plan
        Arrays of the law; change `plan.params` or `plan.model` before running to study other settings.
    state, command, tick
        The law's other records.
    plant_params, plant_state
        The rig's (`hw.simulators.mock_records`); the state is the truth."""

    def __init__(self, loaded: LoadedConfig) -> None:
        """Build everything; nothing has moved yet.

        Raises
        ------
        ConfigError
            The rig file's device is not the mock.
        ModelError
            As `rtctl.check.law_plan.build`."""
        kinds = [device.kind for device in loaded.config.device]
        if kinds != ["mock"]:
            raise ConfigError(
                f"{loaded.path}: device[0].kind: only 'mock' can be simulated, alone, not {', '.join(kinds)}"
            )
        # kept for faults that are scripted later
        self._loaded = loaded
        self.motion = loaded.config.axis[0].motion
        """Motion of the first axis, "rotary" or "linear"."""
        self.plan: Plan = build(loaded)
        plant_params, plant_state = plant_records(loaded.options, loaded.config.hardware())
        # as records: one type for all code that is compiled, here and in the loop
        self.plant_params, self.plant_state = records(plant_params), records(plant_state)
        self.params, self.model = records(self.plan.params), records(self.plan.model)
        self.command = records(self.plan.command)
        # zeroed, as the loop begins
        self.state = records(np.zeros(1, state_dtype(self.plan.n_axes)))
        self.tick = records(new_ticks(1, self.plan.n_axes))
        self.truth = self.plant_state[:0].copy()
        """States of the rig of the last run, row by row with its trace."""
        self._bound_for: tuple[np.dtype[Any], ...] = ()
        self._bound: tuple[Address, Address, Address] = (0, 0, 0)

    @property
    def time_s(self) -> float:
        """Simulated time since the first tick, s."""
        return int(self.tick["tick"][0]) * self.plan.period_s

    def script(self, faults: str | Path | Sequence[Mapping[str, Any]]) -> None:
        """Script these faults into the rig, in place of any before; times count from the first tick of all.

        Parameters
        ----------
        faults
            A schedule file, or tables as in one (docs/faults.md).

        Raises
        ------
        ConfigError
            A fault that does not exist, or is out of bounds; the text names key, value and bound."""
        rig = self._loaded.config.hardware()
        try:
            tables = read_faults(faults, {"n_axes": rig.n_axes})
        except ValueError as error:
            raise ConfigError(str(error)) from error
        # in place: a run that is under way takes it up with the next tick
        fill_schedule(self.plant_params, tables, rig)

    def change(self, **fields: object) -> None:
        """Send a command: set fields of the command record, each a number or one per axis."""
        for name, value in fields.items():
            self.command[name][0] = value
        # the law takes a command by its number: one with the last number changes nothing
        self.command["seq"] += 1

    def run(self, seconds: float, every: int = 1, **fields: object) -> np.ndarray:
        """Run for `seconds` after changing the command's `fields`; returns every `every`-th tick.

        `truth` then holds the rig's states at the end of the same ticks."""
        # without any the command in force stays, under its number
        if fields:
            self.change(**fields)
        # one tick at least: who asks for less asks what is now
        rows = max(1, round(seconds / self.plan.period_s / every))
        # made before, and filled in place: compiled code must not allocate
        trace = records(new_ticks(rows, self.plan.n_axes))
        self.truth = records(np.zeros(rows, self.plant_state.dtype))
        at, of_law, of_plant = self.addresses(), self._of_law, self._of_plant
        simulate(*at, of_law, of_plant, trace, self.truth, self.plan.period_ns, every)
        return trace

    @property
    def _of_law(self) -> tuple[np.ndarray, ...]:
        return self.tick, self.state, self.params, self.command, self.model

    @property
    def _of_plant(self) -> tuple[np.ndarray, ...]:
        return self.tick, self.plant_state, self.plant_params

    def addresses(self) -> tuple[Address, Address, Address]:
        """Where reading, law and writing of this rig are: the machine code that the loop runs, too, compiled
        once for all."""
        dtypes = tuple(array.dtype for array in (*self._of_law, *self._of_plant))
        # looked up anew only for other types: that takes .3 ms, as long as forty ticks, and many runs are as
        # short
        # by identity: comparing them takes as long as looking up (0072)
        if tuple(map(id, dtypes)) != tuple(map(id, self._bound_for)):
            self._bound_for = dtypes
            self._bound = (
                entry_point(plant_read, *self._of_plant),
                entry_point(law.step, *self._of_law),
                entry_point(plant_write, *self._of_plant),
            )
        return self._bound

    def arm(self, **fields: object) -> np.ndarray:
        """Bring the rig to ACTIVE with full authority, as an operator would; returns the ticks until then.

        Raises
        ------
        FaultError
            If it does not get there within `ARM_PATIENCE_S` of simulated time."""
        parts, until_s = [], self.time_s + ARM_PATIENCE_S
        while self.time_s < until_s:
            # asked for again and again: a request before `ready` is refused and used up
            asked = {"arm_count": int(self.command["arm_count"][0]) + 1, "epoch": int(self.state["epoch"][0])}
            self.change(**asked, **fields)
            parts.append(self.run(0.05))
            # by its last tick: at full authority for a moment is not armed
            last = parts[-1][-1]
            if last["state"] == State.ACTIVE and last["authority"] >= 1.0:
                # as bytes: of records NumPy finds out a common type first, 12 ms where all are of one
                together = np.concatenate([one.view(np.uint8) for one in parts])
                return records(together.view(self.tick.dtype))
        raise FaultError(f"not armed after {ARM_PATIENCE_S:g} simulated s: state {state_and_cause(last)}")
