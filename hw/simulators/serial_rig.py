"""The simulated board: the reference firmware around the simulated rig, one step of a board cycle per
method."""

from __future__ import annotations

import math
import time
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from hw.channels import device_fields
from hw.interface import Rig
from hw.jit import records
from hw.serial.described_options import DescribedOptions
from hw.serial.lines_options import LinesOptions
from hw.simulators.mock_backend import MockBackend
from hw.simulators.mock_options import MockOptions
from hw.simulators.serial_described_board import DescribedBoard
from hw.simulators.serial_firmware import Board, Taken
from hw.simulators.serial_line import Line
from hw.simulators.serial_lines_board import LineBoard
from hw.simulators.serial_observation import Observation, row_dtype

DEFAULT_AXIS = {
    "encoder_counts_per_rev": 160_000.0,
    "gear_ratio": 80.0,
    "gear_efficiency": 0.72,
    "torque_constant_nm_a": 0.0134,
    "lever_m": [0.0, 0.1, 0.0],
}
"""The axis of configs/mock.toml."""


def read_rig(path: Path | None, rate_hz: float | None) -> tuple[Rig, dict[str, Any]]:
    """Facts of the rig and options of the simulated plant, out of a rig file (its mock device, if any)."""
    table = tomllib.loads(path.read_text()) if path else {}
    axes = [{**DEFAULT_AXIS, **axis} for axis in table.get("axis", [{}])]
    rate_hz = rate_hz or table.get("loop", {}).get("rate_hz", 1000.0)
    mocks = [device for device in table.get("device", []) if device.get("kind") == "mock"]
    options = MockOptions.model_validate(mocks[0].get("options", {}) if mocks else {})
    facts = {name: np.array([axis[name] for axis in axes], dtype=float) for name in DEFAULT_AXIS}
    rig = Rig(n_axes=len(axes), period_s=1.0 / rate_hz, **facts)
    return rig, options.model_dump(mode="json")


def _tick_dtype(n_axes: int) -> np.dtype[np.void]:
    """The fields of a tick that the plant reads and writes."""
    return np.dtype(
        [("tick", "<i8"), ("enabled", "<i8"), ("current_command_a", "<f8", (n_axes,)), *device_fields(n_axes)]
    )


def read_described(path: Path) -> dict[str, Any]:
    """Options of the first device of a rig file that describes a board. ValueError if it has none."""
    for device in tomllib.loads(path.read_text()).get("device", []):
        models: dict[str, Any] = {"serial-described": DescribedOptions, "serial-lines": LinesOptions}
        if device.get("kind") in models:
            valid = models[device["kind"]].model_validate(device.get("options", {}))
            options: dict[str, Any] = valid.model_dump(mode="json")
            return options
    raise ValueError(f"{path}: no [[device]] of kind 'serial-described' or 'serial-lines'")


def _tells(described: dict[str, Any], channel: str) -> bool:
    return any(field["channel"] == channel for field in described["sample"]["field"])


def _with_what_is_told(options: dict[str, Any], described: dict[str, Any]) -> dict[str, Any]:
    """The plant with a tacho, and a force sensor with moments, where it has none and the board tells them."""
    full = MockOptions.model_validate({"velocity": {}, "force": {"moment": {}}}).model_dump(mode="json")
    force, tacho = options["force"], options["velocity"]
    # a board that tells what its plant does not measure would send zeros, and a test would learn nothing
    if _tells(described, "velocity"):
        tacho = tacho or full["velocity"]
    if _tells(described, "moment"):
        force = {**force, "moment": force["moment"] or full["force"]["moment"]}
    return {**options, "velocity": tacho, "force": force}


class Simulation:
    """Board, plant and line together; `cycle` is one period of the board."""

    def __init__(
        self,
        rig: Rig,
        options: dict[str, Any],
        line: Line,
        name: str,
        first_count: int,
        described: dict[str, Any] | None = None,
    ) -> None:
        self.rig, self.line = rig, line
        self.options = _with_what_is_told(options, described) if described else options
        self.name, self.first_count = name, first_count
        self.described = described
        self.observation: Observation | None = None
        self._torque_per_ampere = rig.gear_ratio * rig.gear_efficiency * rig.torque_constant_nm_a
        self._row = np.zeros(1, row_dtype(rig.n_axes))
        self.tick = records(np.zeros(1, _tick_dtype(rig.n_axes)))
        # on a board of its own: a rehearsal leaves its own sequence, hold and damage behind
        self._make_board().rehearse(self.tick)
        self.power_up()

    def power_up(self) -> None:
        """Everything starts over."""
        self.board = self._make_board()
        self.plant = MockBackend(self.options, self.rig)
        self.plant.warm_up(self.tick)
        self.slot = 0

    def listen(self) -> Taken:
        """Take in what the host sent; an identify is answered at once."""
        taken = self.board.take(self.line.read())
        if taken.identifies:
            self.line.send(self.board.identity_packet())
        return taken

    def _make_board(self) -> Board | DescribedBoard | LineBoard:
        if self.described is not None and "columns" in self.described["sample"]:
            return LineBoard(self.described, self.rig, self.name)
        if self.described is not None:
            return DescribedBoard(self.described, self.rig, int(self.name))
        counts_per_rad = self.rig.encoder_counts_per_rev / (2 * math.pi)
        return Board(
            self.rig.n_axes,
            self.name,
            round(self.rig.period_s * 1e6),
            None if self.options["velocity"] is None else counts_per_rad,
            moments=self.options["force"]["moment"] is not None,
        )

    def advance(self, cycles: int = 1) -> None:
        """Let the board's clock go on: commands grow older."""
        self.board.begin_cycle(cycles)
        self.slot += cycles

    def sense(self) -> None:
        """Bring the plant to the present slot and measure."""
        self.tick["tick"] = self.slot
        self.plant.read(self.tick)

    def send(self) -> None:
        """Send the sample as a state packet."""
        turns = self.tick["position_rad"][0] / (2 * math.pi)
        # the angle lies on the grid of the counts: rounding takes off what its unit has cost, and no more
        counts = np.rint(turns * self.rig.encoder_counts_per_rev).astype(np.int64) + self.first_count
        # from the slot and not added up: periods that are no whole us would drift
        time_us = round(self.slot * self.rig.period_s * 1e6)
        packet = self.board.state_packet(self.tick, counts, time_us)
        if packet:  # a board that waits to be asked has none
            self.line.send_sample(packet)

    def apply(self) -> None:
        """Drive the motor with the command in force and put it on record."""
        board, row = self.board, self._row[0]
        value = board.output
        # the plant takes amperes, a board may be told N m: what is on record has both
        current_a = value / self._torque_per_ampere if board.command[0]["torque_mode"] else value
        self.tick["enabled"], self.tick["current_command_a"] = int(board.enabled), current_a
        self.plant.write(self.tick)
        if self.observation is None:
            return
        row["time_ns"], row["slot"], row["enabled"] = time.monotonic_ns(), self.slot, board.enabled
        row["status"], row["command_age"] = int(board.status), board.age
        row["command_sequence"] = board.command[0]["sequence"]
        row["current_a"], row["torque_nm"] = current_a, current_a * self._torque_per_ampere
        row["position_rad"] = self.plant.state["position_rad"][0]
        self.observation.append(self._row[0])
