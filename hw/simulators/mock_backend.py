"""The simulated rig as a backend. Runs in the loop process: no pydantic here."""

from __future__ import annotations

import numpy as np

from hw.fault_script import raise_in_write, raise_or_stall
from hw.interface import CompiledCycle, Options, Rig
from hw.jit import bound
from hw.simulators.jit import records
from hw.simulators.mock_plant import plant_read, plant_write
from hw.simulators.mock_records import plant_records
from hw.simulators.mock_sensors import measured


class MockBackend:
    """Plant, sensors and hand described by `options` (a dumped `MockOptions`) on the given `rig`.

    Attributes
    ----------
    params, state : ndarray
        One-row structured arrays (`hw.simulators.mock_records`). `state` is the truth, for tests and reports.
    """

    consumes = frozenset({"current_command"})

    def __init__(self, options: Options, rig: Rig) -> None:
        self.provides = measured(options)
        params, state = plant_records(options, rig)
        self.params, self.state = records(params), records(state)
        self._tick: np.ndarray | None = None
        # a script raises and blocks, which no compiled cycle can: it is known before the first one
        self._scripted = bool(params["fault_count"][0])
        self._period_s = rig.period_s

    def open(self) -> None:
        """Nothing to acquire."""

    def warm_up(self, tick: np.ndarray) -> None:
        """Compile (or load) what `read` and `write` call, for ticks like `tick`; changes nothing."""
        self._bind(tick)

    def _bind(self, tick: np.ndarray) -> None:
        # types are looked up here, once: at each call that would take longer than the call (0004)
        self._tick = tick
        self._read = bound(plant_read, records(tick), self.state, self.params)
        self._write = bound(plant_write, records(tick), self.state, self.params)

    def compiled_cycle(self, tick: np.ndarray) -> CompiledCycle | None:
        """See `CompiledCycleBackend`; None where faults are scripted, which raise and block."""
        if self._scripted:
            return None
        arguments = (records(tick), self.state, self.params)
        return CompiledCycle(plant_read, arguments, plant_write, arguments, (self.state,))

    def read(self, tick: np.ndarray) -> None:
        """Show the sensors at slot `tick["tick"]`. Raises LinkLost, and blocks, only where a fault is
        scripted."""
        if tick is not self._tick:
            self._bind(tick)
        self._read()
        if self._scripted:
            raise_or_stall(self.state, self._period_s)

    def write(self, tick: np.ndarray) -> None:
        """Apply the current sent and let one period pass. Raises LinkLost only as a scripted fault."""
        if tick is not self._tick:
            self._bind(tick)
        self._write()
        if self._scripted:
            raise_in_write(self.state)

    def stop(self) -> None:
        """Motor torque-free from now on. Cannot raise."""
        # what is on its way to the motor, too: a device that was stopped takes no late command
        self.state["current_line_a"] = 0.0
        self.state["current_a"] = 0.0
        self.state["motor_torque_nm"] = 0.0

    def close(self) -> None:
        """Torque-free; there is nothing to release."""
        self.stop()
