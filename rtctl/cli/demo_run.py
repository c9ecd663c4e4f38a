"""The demonstration `make run` shows: the same hand, which wishes the same motion, without and with friction
compensation.

An observer in the host: it arms the simulated rig, switches the compensation, and gathers the torque of
the hand over whole periods of the motion."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from rtctl.control.vocabulary import State
from rtctl.host.auto_arm import AutoArm
from rtctl.host.supervisor import Host

SETTLE_S = 1.0

TRACE_HZ = 50.0
"""Samples a second that are kept for the picture."""


@dataclass
class Phase:
    """One part of the demonstration: name, share of compensation, and the hand torques gathered in it."""

    name: str
    compensation: float
    torque_sum_nm2: np.ndarray | float = 0.0
    count: int = 0

    def rms_nm(self) -> float:
        """RMS of the torque of the hand on the first axis, N m."""
        return math.sqrt(float(self.torque_sum_nm2) / self.count) if self.count else math.nan


@dataclass
class Demo:
    """Observer: arm, then run each phase for `measure_s` after it has settled; then finish.

    Parameters
    ----------
    rate_hz
        Ticks per second of the rig.
    measure_s
        Length of each measurement; a whole number of periods of the hand's motion.
    progress
        Called with (seconds done, seconds in all, phase name, RMS so far) at every batch."""

    rate_hz: float
    measure_s: float
    progress: Callable[[float, float, str, float], None]
    phases: tuple[Phase, ...] = field(default_factory=lambda: (Phase("off", 0.0), Phase("on", 1.0)))

    def __post_init__(self) -> None:
        self._arm = AutoArm()
        self._ticks = 0  # ticks at full authority, over all phases
        self._trace: list[np.ndarray] = []
        self._entered = -1
        self._epoch: int | None = None

    @property
    def total_s(self) -> float:
        """Length of all phases, s."""
        return len(self.phases) * (SETTLE_S + self.measure_s)

    @property
    def switch_s(self) -> float:
        """When the second phase begins, s."""
        return SETTLE_S + self.measure_s

    def trace(self) -> tuple[np.ndarray, np.ndarray]:
        """Time (s) and torque of the hand (N m) of the first axis, `TRACE_HZ` times a second."""
        torque = np.concatenate([np.zeros(0), *self._trace])
        return np.arange(len(torque)) * self._step / self.rate_hz, torque

    @property
    def _step(self) -> int:
        return max(1, round(self.rate_hz / TRACE_HZ))

    def __call__(self, host: Host, rows: np.ndarray) -> None:
        """Follow the ticks."""
        self._arm(host, rows)
        for part in self._at_authority(rows):
            self._take(host, part)
        # -1: no tick at full authority yet
        index = min(max(self._entered, 0), len(self.phases) - 1)
        self.progress(
            self._ticks / self.rate_hz, self.total_s, self.phases[index].name, self.phases[index].rms_nm()
        )
        if self._ticks >= round(self.total_s * self.rate_hz) or self._was_stopped(rows):
            host.finish()

    def _was_stopped(self, rows: np.ndarray) -> bool:
        """Whether a fault or somebody has stopped the rig: it is not armed again, and no phase would end."""
        if len(rows) == 0:
            return False
        self._epoch = int(rows["epoch"][0]) if self._epoch is None else self._epoch
        return int(rows["epoch"][-1]) != self._epoch

    @staticmethod
    def _at_authority(rows: np.ndarray) -> list[np.ndarray]:
        # while the authority rises less than all of the help acts
        good = rows[(rows["state"] == State.ACTIVE) & (rows["authority"] >= 1.0)]
        return [good] if len(good) else []

    def _take(self, host: Host, rows: np.ndarray) -> None:
        phase_ticks = round((SETTLE_S + self.measure_s) * self.rate_hz)
        settle_ticks = round(SETTLE_S * self.rate_hz)
        index = np.arange(self._ticks, self._ticks + len(rows))
        for number, phase in enumerate(self.phases):
            # what settles after a switch belongs to neither figure
            inside = (index >= number * phase_ticks + settle_ticks) & (index < (number + 1) * phase_ticks)
            torque = rows["hand_torque_nm"][inside, 0]
            phase.torque_sum_nm2 += float(torque @ torque)
            phase.count += len(torque)
        # begins at the next whole step since the first tick, not since this batch
        self._trace.append(rows["hand_torque_nm"][-self._ticks % self._step :: self._step, 0].copy())
        self._ticks += len(rows)
        now_in = min(int(index[-1]) // phase_ticks, len(self.phases) - 1)
        if now_in != self._entered:
            self._entered = now_in
            host.set_compensation(self.phases[now_in].compensation)
