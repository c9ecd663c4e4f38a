"""The playback backend: one recorded sample per tick, at the log's own rate.

Nothing moves: `write` keeps the torque that the controller would have applied, the motion stays the
recorded one. What a run over a log can and cannot tell is written in docs/playback.md.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hw.fault_script import SampleScript
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


def _view(array: Any) -> Any:  # noqa: ANN401 - memoryview's stubs know neither numpy nor floats
    """Plain memory of an array: a read costs 0.7 us with it, 0.9 us (1.3 us repeating) with numpy."""
    return memoryview(array)


def _flat(array: np.ndarray) -> Any:  # noqa: ANN401
    """All numbers of an array, row by row."""
    return _view(np.ascontiguousarray(array, dtype=np.float64).reshape(-1))


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
        self._script: SampleScript | None = None
        self._loop = bool(options.get("loop", False))
        self._tick: np.ndarray | None = None
        self._shift = [0.0] * rig.n_axes
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
        self._positions = _flat(recording.position_rad)
        self._currents = _flat(zeros if recording.current_a is None else recording.current_a)
        self._forces = _flat(np.zeros((n, 3)) if force is None else force)
        self._shift = [0.0] * self._rig.n_axes
        self._next, self._count, self._n = 0, 0, n
        self._tick = None
        if faults := self._options.get("faults"):
            self._script = SampleScript(faults, self._rig, self._options["seed"])
        self.recording = recording

    def warm_up(self, tick: np.ndarray) -> None:
        """Compile (or load) what scripted faults call, for ticks like `tick`; changes nothing."""
        if self._script is not None:
            self._script.bind(tick)
            self._tick = None

    def _bind(self, tick: np.ndarray) -> None:
        """Keep views of the fields: looking them up costs more than filling them."""
        self._tick = tick
        row = tick.view(np.ndarray)
        self._sample_count, self._link_faults = _view(row["sample_count"]), _view(row["link_faults"])
        self._position = _view(row["position_rad"][0])
        self._current = _view(row["current_a"][0])
        self._force = _view(row["force_n"][0])
        self._applied = row["torque_applied_nm"][0]
        self._link_faults[0] = 0
        if self._script is not None:
            self._script.bind(tick)

    def read(self, tick: np.ndarray) -> None:
        """Put the next sample into the tick; after the last one, END_OF_LOG and no fresh sample."""
        if tick is not self._tick:
            if self.recording is None:
                raise LinkLost("playback is not open")
            self._bind(tick)
        if self._next == self._n and not self._loop:
            self._put(self._n - 1)
            self._link_faults[0] = _END_OF_LOG
        else:
            if self._next == self._n:
                self._start_over()
            self._count += 1
            self._put(self._next)
            self._next += 1
        if self._script is not None:
            self._script.after_read()

    def _put(self, i: int) -> None:
        """Write sample `i` and the count of samples so far."""
        n = len(self._shift)
        if self._loop:
            for axis in range(n):
                self._position[axis] = self._positions[i * n + axis] + self._shift[axis]
        else:
            self._position[:] = self._positions[i * n : i * n + n]
        self._current[:] = self._currents[i * n : i * n + n]
        self._force[:] = self._forces[3 * i : 3 * i + 3]
        self._sample_count[0] = self._count
        if self._script is not None:
            self._link_faults[0] = 0  # the last sample's may still stand

    def _start_over(self) -> None:
        """Go on from the first sample, the angle where it ended."""
        n = len(self._shift)
        for axis in range(n):
            self._shift[axis] += self._positions[(self._n - 1) * n + axis] - self._positions[axis]
        self._next = 0

    def write(self, tick: np.ndarray) -> None:
        """Keep the torque the motor would have got."""
        if tick is not self._tick:
            if self.recording is None:
                raise LinkLost("playback is not open")
            self._bind(tick)
        if self._script is None or self._script.before_write():
            self.torque_applied_nm[:] = self._applied

    def stop(self) -> None:
        """Forget the torque."""
        self.torque_applied_nm[:] = 0.0

    def close(self) -> None:
        """Release the log. Reading after it raises LinkLost."""
        self.recording = None
        self._script = None
        self._tick = None
        self._n = self._next = 0
        self.stop()
