"""The playback backend: one recorded sample per tick, at the log's own rate.

Nothing moves: `write` keeps the torque that the controller would have applied, the motion stays the
recorded one. What a run over a log can and cannot tell is written in docs/playback.md."""

from __future__ import annotations

from typing import Any

import numpy as np

from hw.fault_script import SampleScript
from hw.interface import BackendError, CompiledCycle, LinkFault, LinkLost, Options, Rig
from hw.jit import bound, compiled, records
from hw.playback.reader import Recording, load

# velocities come out wrong by as much
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
        The levers cannot produce independent torques (more than three axes, or parallel levers)."""
    # the pseudo-inverse gives the smallest of all forces: none that turns no joint is added
    inverse = np.linalg.pinv(lever_m)
    if not np.allclose(lever_m @ inverse, np.eye(len(lever_m)), atol=1e-9):
        raise BackendError(
            f"lever_m {lever_m.tolist()}: no tip force gives these joints independent torques; "
            "map force columns instead"
        )
    return np.asarray(hand_torque_nm @ inverse.T)


PLACE = np.dtype([("next", "<i8"), ("count", "<i8"), ("n", "<i8"), ("loop", "<i8")])
"""Sample to show next, samples shown so far, samples there are (0 while closed), and whether it starts over
at the end."""


@compiled
def _put(
    tick: np.record, place: np.record, shift: np.ndarray, samples: tuple[np.ndarray, ...], i: int
) -> None:
    """Write sample `i` and the count of samples so far."""
    position, current, force = samples
    for axis in range(len(shift)):
        tick.position_rad[axis] = position[i, axis] + shift[axis] if place.loop != 0 else position[i, axis]
        tick.current_a[axis] = current[i, axis]
    for k in range(3):
        tick.force_n[k] = force[i, k]
    tick.sample_count = place.count


@compiled
def show_next(
    tick: np.ndarray, places: np.ndarray, shift: np.ndarray, samples: tuple[np.ndarray, ...]
) -> int:
    """Put the next sample into the tick; after the last one, END_OF_LOG and no fresh sample. 0, or 1 while
    there is no log."""
    t, place = tick[0], places[0]
    if place.n == 0:
        return 1
    t.link_faults = 0
    # asked before: a log of which the last sample was shown is over in the next cycle, not in that one
    if place.next == place.n:
        # the last sample stays in the tick: a position of 0 would be a jump
        if place.loop == 0:
            _put(t, place, shift, samples, place.n - 1)
            t.link_faults = _END_OF_LOG
            return 0
        for axis in range(len(shift)):  # from the first sample on, the angle where it ended
            # an angle that starts over would jump back by all that the log has moved
            shift[axis] += samples[0][place.n - 1, axis] - samples[0][0, axis]
        place.next = 0
    # counted by what was shown, not by the place in the log: it rises over the seam, too
    place.count += 1
    _put(t, place, shift, samples, place.next)
    place.next += 1
    return 0


@compiled
def keep_torque(tick: np.ndarray, applied_nm: np.ndarray, places: np.ndarray) -> int:
    """Keep the torque the motor would have got. 0, or 1 while there is no log."""
    if places[0].n == 0:
        return 1
    for axis in range(len(applied_nm)):
        applied_nm[axis] = tick[0].torque_applied_nm[axis]
    return 0


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
        self._shift = np.zeros(rig.n_axes)
        self._place = records(np.zeros(1, PLACE))

    def open(self) -> None:
        """Load the whole log into memory. Raises BackendError; see `hw.playback.reader`."""
        if self.recording is not None:
            return
        # all of it now: a disk that is slow for once would stall the loop
        recording = load(self._options, self._rig)
        rate_hz = 1.0 / self._rig.period_s
        if abs(recording.rate_hz / rate_hz - 1.0) > MAX_RATE_ERROR:
            raise BackendError(
                f"{recording.path}: the log was sampled at {recording.rate_hz:.6g} Hz, "
                f"the loop runs at {rate_hz:.6g} Hz: set [loop] rate_hz = {recording.rate_hz:.6g}"
            )
        n = len(recording)
        # a channel that the log lacks is not provided (`provides`); compiled code wants an array all the same
        zeros = np.zeros((n, self._rig.n_axes))
        force = recording.force_n
        if recording.hand_torque_nm is not None:
            force = tip_force(recording.hand_torque_nm, self._rig.lever_m)
        current = zeros if recording.current_a is None else recording.current_a
        # contiguous float64: one type for every log, so compiled once
        given = (recording.position_rad, current, np.zeros((n, 3)) if force is None else force)
        self._samples = tuple(np.ascontiguousarray(values, dtype=np.float64) for values in given)
        self._shift[:] = 0.0
        self._place[0] = (0, 0, n, int(self._loop))
        self._tick = None
        if faults := self._options.get("faults"):
            # made anew: faults count from the first sample of this opening
            self._script = SampleScript(faults, self._rig, self._options["seed"])
        self.recording = recording

    def warm_up(self, tick: np.ndarray) -> None:
        """Compile (or load) what `read` and `write` call, for ticks like `tick`; changes nothing."""
        if self.recording is not None:
            self._bind(tick)

    def _bind(self, tick: np.ndarray) -> None:
        # the compiled halves hold the memory of one tick: of another one they are made anew
        self._tick = tick
        shown, kept = self._halves(tick)
        self._show, self._keep = bound(show_next, *shown), bound(keep_torque, *kept)
        if self._script is not None:
            self._script.bind(tick)

    def _halves(self, tick: np.ndarray) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        """What `show_next` and `keep_torque` are called with."""
        row = records(tick)
        return (row, self._place, self._shift, self._samples), (row, self.torque_applied_nm, self._place)

    def compiled_cycle(self, tick: np.ndarray) -> CompiledCycle | None:
        """See `CompiledCycleBackend`; None where faults are scripted, which raise and block."""
        if self._script is not None or self.recording is None:
            return None
        shown, kept = self._halves(tick)
        return CompiledCycle(show_next, shown, keep_torque, kept)

    def _bind_open(self, tick: np.ndarray) -> None:
        if self.recording is None:
            raise LinkLost("playback is not open")
        self._bind(tick)

    def read(self, tick: np.ndarray) -> None:
        """Put the next sample into the tick; after the last one, END_OF_LOG and no fresh sample."""
        if tick is not self._tick:
            self._bind_open(tick)
        self._show()
        if self._script is not None:
            self._script.after_read()

    def write(self, tick: np.ndarray) -> None:
        """Keep the torque the motor would have got."""
        if tick is not self._tick:
            self._bind_open(tick)
        if self._script is None or self._script.before_write():
            self._keep()

    def stop(self) -> None:
        """Forget the torque."""
        self.torque_applied_nm[:] = 0.0

    def close(self) -> None:
        """Release the log. Reading after it raises LinkLost."""
        self.recording = None
        self._script = None
        self._tick = None
        self._place[0] = (0, 0, 0, 0)
        self.stop()
