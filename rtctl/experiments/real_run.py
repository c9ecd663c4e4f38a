"""The same comparison on the real loop: an observer in the host that switches the compensation.

The rig arms, the hand moves it as it likes, and the loop runs without and then with compensation for the
same time. Everything goes through the daemon's own loop, gate and guards; a rig that leaves ACTIVE ends it.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np

from rtctl.control.vocabulary import State, state_and_cause
from rtctl.errors import FaultError
from rtctl.experiments.order import Order, Progress, silent
from rtctl.host.supervisor import Host

FIELDS = (
    "time_ns",
    "position_rad",
    "velocity_rad_s",
    "hand_torque_nm",
    "coupling_torque_nm",
    "feedforward_torque_nm",
    "torque_applied_nm",
    "energy_port_j",
    "energy_hand_j",
)
"""Columns kept of every tick, of the first axis."""

PREPARE_S = 3.0
"""After arming, before the first measurement."""

SETTLE_S = 2.0
"""After the compensation was switched."""

ARM_PATIENCE_S = 60.0

Columns = dict[str, np.ndarray]


@dataclass
class Phase:
    """One part of the run: compensation, how long it settles and is measured, s, and what was measured."""

    name: str
    compensation: float
    settle_s: float
    seconds: float
    parts: list[Columns] = field(default_factory=list)
    seen: int = 0

    def columns(self) -> Columns:
        """The ticks measured, column by column."""
        return {name: np.concatenate([part[name] for part in self.parts]) for name in FIELDS}


class Comparison:
    """Observer: arm, then each phase; then finish the run.

    Attributes
    ----------
    complete
        True once the last phase is measured; False when the run ended before (Ctrl-C)."""

    def __init__(self, phases: list[Phase], period_s: float, progress: Progress = silent) -> None:
        self.phases, self._period_s, self._progress = phases, period_s, progress
        self._at, self._armed, self._asked, self._since_seq = 0, False, 0.0, 0
        self._ticks, self._epoch = 0, -1
        self.complete = False

    def __call__(self, host: Host, rows: np.ndarray) -> None:
        """Follow the ticks."""
        # Ctrl-C is the loop's: what the rig does while it ramps down is no measurement
        if self.complete or host.writer.command["shutdown_count"][0] > 0 or len(rows) == 0:
            return
        if not self._armed:
            self._arm(host, rows)
            return
        self._require_active(rows)
        phase = self.phases[self._at]
        # those that ran under the command, not those under way when it was given
        self._take(phase, rows[rows["command_seq"] >= self._since_seq])
        total = sum(one.settle_s + one.seconds for one in self.phases)
        done = sum(one.settle_s + one.seconds for one in self.phases[: self._at])
        self._progress(min((done + phase.seen * self._period_s) / total, 1.0), phase.name)
        if phase.seen * self._period_s < phase.settle_s + phase.seconds:
            return
        if self._at + 1 == len(self.phases):
            self.complete = True
            host.finish()
            return
        self._begin(host, self._at + 1)

    def _begin(self, host: Host, at: int) -> None:
        self._at = at
        host.set_compensation(self.phases[at].compensation)
        # after it was sent: the number is that of this command
        self._since_seq = int(host.writer.command["seq"][0])

    def _arm(self, host: Host, rows: np.ndarray) -> None:
        last = rows[-1]
        # that of the first ticks seen: a stop from then on is meant for this run
        self._epoch = int(last["epoch"]) if self._epoch < 0 else self._epoch
        if last["epoch"] != self._epoch:  # a stop voids what was asked before it
            raise FaultError(f"the rig was stopped while it armed: state {state_and_cause(last)}")
        if last["state"] == State.ACTIVE and last["authority"] >= 1.0:
            self._armed = True
            self._begin(host, 0)
            return
        self._ticks += len(rows)
        if self._ticks * self._period_s > ARM_PATIENCE_S:
            raise FaultError(
                f"not armed after {ARM_PATIENCE_S:g} s: state {state_and_cause(last)}; "
                "the hand must rest while the sensor is tared"
            )
        # each request counts as one: not in every batch
        if last["state"] == State.IDLE and time.monotonic() - self._asked > 0.2:
            self._asked = time.monotonic()
            host.set_compensation(self.phases[0].compensation)
            host.arm(self._epoch)

    def _require_active(self, rows: np.ndarray) -> None:
        if np.all(rows["state"] == State.ACTIVE):
            return
        # the first tick that left: later ones are what followed from it
        first = rows[int(np.argmax(rows["state"] != State.ACTIVE))]
        raise FaultError(
            f"the rig left ACTIVE for {state_and_cause(first)}, "
            f"in phase {self.phases[self._at].name}; nothing was reported. Clear the cause and start again"
        )

    def _take(self, phase: Phase, rows: np.ndarray) -> None:
        # by ticks that ran under the command: a batch may begin before and end behind a phase
        start = round(phase.settle_s / self._period_s)
        end = start + round(phase.seconds / self._period_s)
        first, last = max(start - phase.seen, 0), end - phase.seen
        kept = rows[first:last]
        if len(kept):
            phase.parts.append({name: _column(kept[name]) for name in FIELDS})
        phase.seen += len(rows)


def _column(values: np.ndarray) -> np.ndarray:
    return (values[:, 0] if values.ndim == 2 else values).copy()


def compare(order: Order) -> dict[str, Columns]:
    """Run both phases on the rig; returns the columns of each by name.

    Raises
    ------
    FaultError
        The rig did not arm or left ACTIVE.
    KeyboardInterrupt
        Ctrl-C before the end: the torque was ramped down, nothing is reported."""
    phases = [Phase("off", 0.0, PREPARE_S, order.seconds), Phase("on", 1.0, SETTLE_S, order.seconds)]
    watcher = Comparison(phases, order.loaded.config.period_s, order.progress)
    with Host(
        order.loaded, observers=[watcher], runtime_dir=order.runtime_dir, announce=order.announce
    ) as host:
        host.run()
    # the host ends in peace at Ctrl-C: half a comparison is none
    if not watcher.complete:
        raise KeyboardInterrupt
    return {phase.name: phase.columns() for phase in phases}
