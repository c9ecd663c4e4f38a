"""The playback backend: one recorded sample per tick, at the log's own rate.

Nothing moves: `write` keeps the torque that the controller would have applied, the motion stays the
recorded one. What a run over a log can and cannot tell is written in docs/playback.md.
"""

from __future__ import annotations

import numpy as np

from hw.interface import BackendError, LinkFault, LinkLost, Options, Rig
from hw.playback.reader import Recording, load

MAX_RATE_ERROR = 0.01
"""Largest relative difference between the loop's rate and the log's."""

_END_OF_LOG = int(LinkFault.END_OF_LOG)


def tip_force(hand_torque_nm: np.ndarray, lever_m: np.ndarray) -> np.ndarray:
    """Smallest tip force whose torque on the joints is the recorded one.

    Parameters
    ----------
    hand_torque_nm
        Torque of the hand on the joints, shape (n, n_axes).
    lever_m
        Shape (n_axes, 3); joint torque = lever @ force.

    Returns
    -------
    numpy.ndarray
        Force, N, shape (n, 3); `force @ lever_m.T` gives the torque back.

    Raises
    ------
    BackendError
        The levers cannot produce independent torques (more than three axes, or parallel levers).
    """
    inverse = np.linalg.pinv(lever_m)
    if not np.allclose(lever_m @ inverse, np.eye(len(lever_m)), atol=1e-9):
        raise BackendError(
            f"lever_m {lever_m.tolist()}: no tip force gives these joints independent torques; "
            "map force columns instead"
        )
    return np.asarray(hand_torque_nm @ inverse.T)


class PlaybackBackend:
    """A recorded log as the sensor stream. `options` are those of `PlaybackOptions`, dumped."""

    consumes = frozenset({"torque"})

    def __init__(self, options: Options, rig: Rig) -> None:
        self._options, self._rig = dict(options), rig
        axis = options["axis"][0]
        provides = {"position"}
        if axis.get("current") or axis.get("motor_torque"):
            provides.add("current")
        if axis.get("hand_torque") or options.get("force"):
            provides.add("force")
        self.provides = frozenset(provides)
        self.recording: Recording | None = None
        self.torque_applied_nm = np.zeros(rig.n_axes)
        self._loop = bool(options.get("loop", False))
        self._tick: np.ndarray | None = None
        self._shift = np.zeros(rig.n_axes)
        self._next = self._count = self._n = 0

    def open(self) -> None:
        """Load the whole log into memory. Raises BackendError; see `hw.playback.reader`."""
        if self.recording is not None:
            return
        recording = load(self._options, self._rig)
        rate_hz = 1.0 / self._rig.period_s
        if abs(recording.rate_hz / rate_hz - 1.0) > MAX_RATE_ERROR:
            raise BackendError(
                f"{recording.path}: the log was sampled at {recording.rate_hz:.6g} Hz, "
                f"the loop runs at {rate_hz:.6g} Hz: set [loop] rate_hz = {recording.rate_hz:.6g}"
            )
        n = len(recording)
        zeros = np.zeros((n, self._rig.n_axes))
        force = recording.force_n
        if recording.hand_torque_nm is not None:
            force = tip_force(recording.hand_torque_nm, self._rig.lever_m)
        self._positions = recording.position_rad
        self._currents = zeros if recording.current_a is None else np.ascontiguousarray(recording.current_a)
        self._forces = np.zeros((n, 3)) if force is None else np.ascontiguousarray(force)
        self._shift[:] = 0.0
        self._next, self._count, self._n = 0, 0, n
        self._tick = None
        self.recording = recording

    def _bind(self, tick: np.ndarray) -> None:
        """Keep views of the fields: looking them up costs more than filling them."""
        self._tick = tick
        row = tick.view(np.ndarray)
        self._sample_count, self._link_faults = row["sample_count"], row["link_faults"]
        self._position, self._current, self._force = (
            row["position_rad"][0],
            row["current_a"][0],
            row["force_n"][0],
        )
        self._applied = row["torque_applied_nm"][0]
        row["estop"], row["temperature_c"] = 0, 0.0
        self._link_faults[0] = 0

    def read(self, tick: np.ndarray) -> None:
        """Put the next sample into the tick; after the last one, END_OF_LOG and no fresh sample."""
        if tick is not self._tick:
            if self.recording is None:
                raise LinkLost("playback is not open")
            self._bind(tick)
        i = self._next
        if i == self._n:
            if not self._loop:
                self._repeat_last()
                return
            self._shift += self._positions[-1] - self._positions[0]
            i = 0
        if self._loop:
            np.add(self._positions[i], self._shift, self._position)
        else:
            self._position[:] = self._positions[i]
        self._current[:] = self._currents[i]
        self._force[:] = self._forces[i]
        self._count += 1
        self._sample_count[0] = self._count
        self._next = i + 1

    def _repeat_last(self) -> None:
        self._position[:] = self._positions[-1]
        self._current[:] = self._currents[-1]
        self._force[:] = self._forces[-1]
        self._sample_count[0] = self._count
        self._link_faults[0] = _END_OF_LOG

    def write(self, tick: np.ndarray) -> None:
        """Keep the torque the motor would have got."""
        if tick is not self._tick:
            if self.recording is None:
                raise LinkLost("playback is not open")
            self._bind(tick)
        self.torque_applied_nm[:] = self._applied

    def stop(self) -> None:
        """Forget the torque."""
        self.torque_applied_nm[:] = 0.0

    def close(self) -> None:
        """Release the log. Reading after it raises LinkLost."""
        self.recording = None
        self._tick = None
        self._n = self._next = 0
        self.stop()
