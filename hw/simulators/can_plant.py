"""What the simulated drives turn: a bare inertia, or the mock rig with its friction, gear and hand."""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np

from hw.channels import device_fields
from hw.interface import Options, Rig


class Plant(Protocol):
    """Axes driven by motor currents."""

    def advance(self, seconds: float, currents_a: list[float]) -> None:
        """Let `seconds` pass with these motor currents."""

    def motor_turns(self, axis: int) -> float:
        """Angle of the motor's shaft, turns."""

    def motor_turns_s(self, axis: int) -> float:
        """Speed of the axis' motor, turns/s."""

    def motor_current_a(self, axis: int) -> float:
        """Current that flows, A."""


class Inertia:
    """Each axis an inertia with viscous friction at the motor's shaft. Stable for any step."""

    def __init__(
        self, n_axes: int, torque_constant_nm_a: float, inertia_kgm2: float = 2e-6, viscous: float = 1e-5
    ) -> None:
        self._constant, self._inertia, self._viscous = torque_constant_nm_a, inertia_kgm2, viscous
        self._angle, self._speed, self._current = [0.0] * n_axes, [0.0] * n_axes, [0.0] * n_axes

    def advance(self, seconds: float, currents_a: list[float]) -> None:
        """See Plant."""
        for axis, current in enumerate(currents_a):
            # friction by the new speed: by the old one steps above 2 J / b, .4 s here, would run off
            speed = self._speed[axis] + seconds / self._inertia * self._constant * current
            self._speed[axis] = speed / (1.0 + seconds * self._viscous / self._inertia)
            self._angle[axis] += seconds * self._speed[axis]
            self._current[axis] = current

    def motor_turns(self, axis: int) -> float:
        """See Plant."""
        return self._angle[axis] / (2 * math.pi)

    def motor_turns_s(self, axis: int) -> float:
        """See Plant."""
        return self._speed[axis] / (2 * math.pi)

    def motor_current_a(self, axis: int) -> float:
        """See Plant."""
        return self._current[axis]


class MockRig:
    """The mock rig (`mock_backend`), seen from its motors: `options` are a dumped `MockOptions`."""

    def __init__(self, options: Options, rig: Rig) -> None:
        from hw.simulators.mock_backend import MockBackend

        self._mock, self._rig = MockBackend(options, rig), rig
        told = [("tick", "<i8"), ("enabled", "<i8"), ("current_command_a", "<f8", (rig.n_axes,))]
        self._tick = np.zeros(1, [*told, *device_fields(rig.n_axes)])
        self._mock.warm_up(self._tick)
        self._left_s = 0.0

    def advance(self, seconds: float, currents_a: list[float]) -> None:
        """See Plant: whole periods of the rig; the rest of `seconds` is kept for the next call."""
        self._left_s += seconds
        tick: Any = self._tick
        while self._left_s >= self._rig.period_s:
            self._left_s -= self._rig.period_s
            tick["enabled"], tick["current_command_a"][0] = 1, currents_a
            # write before read, as a loop does between two readings: the current holds over the period
            self._mock.write(tick)
            tick["tick"] += 1
            self._mock.read(tick)

    @property
    def force_n(self) -> list[float]:
        """What the rig's force sensor shows, N."""
        force: list[float] = self._tick["force_n"][0].tolist()
        return force

    def motor_turns(self, axis: int) -> float:
        """See Plant."""
        # behind an elastic joint the motor stands elsewhere than the link
        angle_rad = self._mock.state["position_rad"] + self._mock.state["joint_twist_rad"]
        return float(angle_rad[0, axis] * self._rig.gear_ratio[axis] / (2 * math.pi))

    def motor_turns_s(self, axis: int) -> float:
        """See Plant."""
        speed_rad_s = self._mock.state["velocity_rad_s"] + self._mock.state["joint_twist_rate_rad_s"]
        return float(speed_rad_s[0, axis] * self._rig.gear_ratio[axis] / (2 * math.pi))

    def motor_current_a(self, axis: int) -> float:
        """See Plant."""
        return float(self._mock.state["current_a"][0, axis])
