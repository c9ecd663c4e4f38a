"""Many test pulses in a row: an observer that arms a rig, stops it behind its test, and arms it again.

Each pulse is the one of any arming (`control.arming`), with all that guards it; nothing else is sent. What
its ticks show of the current is for `identify.current_shape`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rtctl.control.vocabulary import State, state_and_cause
from rtctl.errors import DataError, FaultError
from rtctl.identify.settings import without_feedforward
from rtctl.tick import joined

if TYPE_CHECKING:
    from rtctl.host.supervisor import Host
    from rtctl.rig_file.config import LoadedConfig

PATIENCE_S = 30.0
"""So long a rig may need to be ready for its next pulse, in its own time."""

ARM_EVERY_S = 0.2
FEWEST = 5
"""Pulses that came whole, without which nothing is told."""


class PulseRun:
    """Observer: takes the ticks of `number` test pulses, then ends the run.

    Attributes
    ----------
    blocks
        Ticks of each pulse, and the one behind it.
    complete
        True once all are taken; False when the run was ended before (Ctrl-C)."""

    def __init__(self, number: int, progress: Callable[[int], None] = lambda _taken: None) -> None:
        self._number, self._progress = number, progress
        self._epoch, self._asked_s, self._began_s = -1, -ARM_EVERY_S, 0.0
        self._rows: list[np.ndarray] = []
        self.blocks: list[np.ndarray] = []
        self.complete = False

    def __call__(self, host: Host, rows: np.ndarray) -> None:
        """Follow the ticks. Raises FaultError where the rig refuses its pulse or somebody else stops it."""
        # Ctrl-C is the loop's: how the rig ramps down then is no pulse
        if self.complete or host.writer.command["shutdown_count"][0] > 0 or not len(rows):
            return
        last = dict(zip(rows.dtype.names or (), rows[-1], strict=True))
        if self._epoch < 0:  # that of the first ticks seen: a stop from then on is meant for this run
            self._epoch, self._began_s = int(last["epoch"]), int(last["tick"]) * host.plan.period_s
            host.set_compensation(0.0)
        now_s = int(last["tick"]) * host.plan.period_s
        self._require_own(last, now_s)
        # ticks before the last stop are of the pulse before
        begun = (rows["epoch"] == self._epoch) & (
            len(self._rows) > 0 or np.maximum.accumulate(rows["state"] == State.ARMING)
        )
        if np.any(begun):
            self._rows.append(rows[begun])
        seen = joined(self._rows) if self._rows else rows[:0]
        if len(seen) and seen[-1]["state"] != State.ARMING:
            self._take(host, seen[: int(np.sum(seen["state"] == State.ARMING)) + 1])
        elif last["state"] in (State.INIT, State.IDLE) and now_s - self._asked_s >= ARM_EVERY_S:
            # each request counts as one: not in every batch
            self._asked_s = now_s
            host.arm(self._epoch)

    def _require_own(self, last: Mapping[str, Any], now_s: float) -> None:
        """Raise FaultError unless the rig is where this run has brought it."""
        if int(last["epoch"]) > self._epoch:
            raise FaultError(f"the rig was stopped, or refused its test pulse: state {state_and_cause(last)}")
        if now_s - self._began_s > PATIENCE_S:
            raise FaultError(f"no test pulse within {PATIENCE_S:g} s: state {state_and_cause(last)}")

    def _take(self, host: Host, block: np.ndarray) -> None:
        self.blocks.append(block)
        self._progress(len(self.blocks))
        self._rows, self._asked_s, self._began_s = (
            [],
            -ARM_EVERY_S,
            int(block[-1]["tick"]) * host.plan.period_s,
        )
        if len(self.blocks) == self._number:
            self.complete = True
            host.finish()
            return
        # before it is sent: ticks of the epoch that begins with it are those of the next pulse
        self._epoch += 1
        host.gateway.stop()


def sent_and_shown(blocks: Sequence[np.ndarray], axis: int, ticks: int) -> tuple[np.ndarray, np.ndarray]:
    """Torque sent, shape (ticks,), and torque by the current at the end of each tick, shape (pulses, ticks).

    Parameters
    ----------
    ticks
        Length of the test. A pulse beside a late tick, or in which something else was sent, is left out.

    Raises
    ------
    DataError
        Fewer than `FEWEST` are left, or the axis sends or shows nothing."""
    whole = [rows for rows in blocks if len(rows) == ticks + 1 and np.all(np.diff(rows["tick"]) == 1)]
    if len(whole) < FEWEST:
        raise DataError(f"only {len(whole)} of {len(blocks)} test pulses came without a late tick")
    every = np.stack([rows["torque_applied_nm"][:-1, axis] for rows in whole])
    sent = np.median(every, axis=0)
    top = float(np.max(np.abs(sent)))
    same = np.max(np.abs(every - sent), axis=1) <= 1e-3 * top
    # a sample that is not fresh shows the current of a tick before
    shown = np.stack([
        np.where(np.diff(rows["sample_count"]) > 0, rows["motor_torque_nm"][1:, axis], np.nan)
        for rows in whole
    ])[same]  # fmt: skip
    if not top > 0 or len(shown) < FEWEST or np.all(np.isnan(shown)):
        raise DataError("no test pulse shows a current: none is measured, or what was sent was not the same")
    return sent, shown


def only_pulses(loaded: LoadedConfig) -> LoadedConfig:
    """The same rig without coupling, help and world: nothing but its test pulse acts, and a current loop
    that is not as the file says is measured, not refused."""
    plain, axes = without_feedforward(loaded), []
    for axis in plain.config.axis:
        # an overshoot is of a lag: where none is told, of one that is none
        drive = {"current_overshoot": 0.6, "current_loop_hz": axis.drive.current_loop_hz or 1e5}
        soft = {"stiffness_nm_rad": 0.0, "damping_nms_rad": 0.0}
        axes.append(
            axis.model_copy(
                update={
                    "drive": axis.drive.model_copy(update=drive),
                    "coupling": axis.coupling.model_copy(update=soft),
                    "display": "impedance",
                    "display_change": False,
                }
            )
        )
    config = plain.config.model_copy(update={"axis": tuple(axes)})
    return plain.model_copy(update={"config": config})
