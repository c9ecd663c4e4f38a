"""Virtual time: speed of the compiled closed loop, and what the compensation does for the hand in it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation
from tests.bench.row import Row

RELEASE_S = 5.0
"""The fast sine passes its middle then, at full speed."""


def rows(fast: Path, slow: Path, seconds: float) -> Iterator[Row]:
    """Those of a rig with a fast hand, and of one with a slow hand."""
    yield from speed_rows(fast, 5, seconds)
    yield from torque_rows(fast, "fast sine", 20.0)
    yield from torque_rows(slow, "slow triangle", 36.0)
    yield from kick_rows(fast)


def speed_rows(config: Path, rounds: int, seconds: float) -> list[Row]:
    """How much faster than real time law and plant run, compiled end to end, armed and moving."""
    simulation = Simulation(load(config))
    simulation.arm()
    speeds = []
    for _ in range(rounds):
        began = time.perf_counter()
        simulation.run(seconds)
        speeds.append(seconds / (time.perf_counter() - began))
    text = f"median of {rounds} x {seconds:g} s, slowest {min(speeds):.0f}"
    return [Row("virtual time, law and plant", float(np.median(speeds)), "x real time", text, 500.0, ">=")]


def torque_rows(config: Path, motion: str, measure_s: float) -> list[Row]:
    """RMS torque of a hand that wishes the same motion, without and with compensation."""
    rms = []
    for compensation in (0.0, 1.0):
        simulation = Simulation(load(config))
        simulation.arm(compensation=compensation)
        simulation.run(2.0)
        trace = simulation.run(measure_s)
        rms.append(float(np.sqrt(np.mean(trace["hand_torque_nm"][:, 0] ** 2))))
    text = f"off {rms[0]:.4f} N m, on {rms[1]:.4f} N m, {measure_s:g} s"
    return [Row(f"hand torque reduction, {motion}", 100 * (1 - rms[1] / rms[0]), "%", text, 75.0, ">=")]


def kick_rows(config: Path) -> list[Row]:
    """RMS speed of the joint after the hand has let go of it in full motion, compensation on."""
    simulation = Simulation(load(config))
    grip = simulation.plant_params[0]
    grip["grip_count"][0], grip["grip_from_s"][0, 0], grip["grip_to_s"][0, 0] = 1, 0.0, RELEASE_S
    simulation.arm()
    simulation.run(RELEASE_S - simulation.time_s)
    kick_rad_s = abs(float(simulation.plant_state["velocity_rad_s"][0, 0]))
    simulation.run(1.0)
    simulation.run(4.0)
    speed_rad_s = float(np.sqrt(np.mean(simulation.truth["velocity_rad_s"] ** 2)))
    text = f"let go at {kick_rad_s:.2f} rad/s; true speed from 1 to 5 s later"
    return [Row("hands-off speed after a kick", speed_rad_s, "rad/s", text, 1e-3)]
