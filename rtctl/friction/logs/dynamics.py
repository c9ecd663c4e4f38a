"""Motion and rigid-body dynamics of one axis from a recorded log, without delay between the signals.

Velocity, acceleration and torque all pass the same zero-phase low-pass: both sides of the balance
``tau = J a + F(v) + bias`` stay aligned in time and lose the same bandwidth.

=======  ==========  ===============================================
v, a     rad/s, ...  velocity, acceleration
tau      N m         motor torque plus hand torque
J, b     kg m^2, ..  inertia, viscous friction (N m s/rad)
f+, f-   N m         torque level of slow motion forwards, backwards
=======  ==========  ==============================================="""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from hw.jit import JIT_DISABLED
from rtctl.control.jit import compiled
from rtctl.errors import DataError
from rtctl.friction.logs.signal_shift import derivatives

CUTOFF_HZ = 20.0
"""Default low-pass: hand motion lies below it, structural vibration and encoder steps above."""

# one is dropped at either end: of ten, eight are left
STRETCH_PERIODS = 10
"""Least length of a log without gaps, periods of the cut-off."""

CUTOFF_SHARE = 0.2
"""Highest cut-off, share of the rate: five points err by (.4 pi)^4/30 there, 8 % of a velocity."""

SPEED_MIN_RAD_S = 0.03
"""Default least speed: below it pre-sliding and the estimate of the direction spoil the samples."""

SAMPLES_PER_CUTOFF = 10
"""Samples kept per period of the cut-off frequency: more would only repeat each other."""

SAMPLES_MIN = 40
"""Fewest friction samples of one direction."""

# what scipy's `sosfiltfilt` takes by default for one section: 3 (2 + 1)
BEYOND = 9
"""Rows that the filter runs through before the first and behind the last."""

RANK_TOLERANCE = 1e-6
"""Least singular value of the regression against its largest, columns scaled to unit size."""


@dataclass(frozen=True)
class Plateau:
    """A run of `rows` equal extreme values of a torque, from `row` on; `side` 1 at the largest, -1 at the
    smallest, `where` the file and the column."""

    where: str
    level_nm: float
    side: float
    row: int
    rows: int


@dataclass(frozen=True)
class Recorded:
    """Rows of a whole file as they were recorded: s after its first row (None without stamps), the position
    (n,), and what else was mapped by its name."""

    time_s: np.ndarray | None
    place: np.ndarray
    beside: dict[str, np.ndarray]


@dataclass(frozen=True)
class AxisLog:
    """One axis of a log: arrays of one length on an even grid; `torque_nm` is motor plus hand torque.

    `external_nm` is the hand's part of it, None where only one of the two is mapped.
    `velocity_rad_s` is a recorded velocity, None where there is none. `start_s` is when it begins after the
    first row of its file, above 0 for a stretch behind a gap; `notes` say what was done to the file. `radian`
    is what stands for a radian in every threshold of the logs: 1 of a rotary axis, so many m of a linear one
    (`rtctl.friction.logs.log_input`); `step_rad` is the step of the recorded position, 0 where not known;
    `plateaus` are those of its torques, as recorded; `settle_rad` is the travel behind a turn over which its
    bristles bend, 0 where that is not longer than usual; `unsaid` are columns of whose unit the file says
    nothing; `torque_step_nm` is the largest step of its torques as recorded; `recorded` is its whole
    file."""

    rate_hz: float
    position_rad: np.ndarray
    torque_nm: np.ndarray
    source: str
    sha256: str
    velocity_rad_s: np.ndarray | None = None
    external_nm: np.ndarray | None = None
    start_s: float = 0.0
    notes: tuple[str, ...] = ()
    radian: float = 1.0
    step_rad: float = 0.0
    plateaus: tuple[Plateau, ...] = ()
    settle_rad: float = 0.0
    unsaid: tuple[str, ...] = ()
    torque_step_nm: float = 0.0
    recorded: Recorded | None = None

    @property
    def where(self) -> str:
        """The file in a message that numbers rows: those of a stretch behind a gap are counted from its
        begin."""
        return f"{self.source} (rows from {self.start_s:.6g} s on)" if self.start_s else self.source


@dataclass(frozen=True)
class Motion:
    """A log differentiated and filtered: time (s), v, a, tau, of one length, the filter's ends cut off."""

    time_s: np.ndarray
    velocity_rad_s: np.ndarray
    acceleration_rad_s2: np.ndarray
    torque_nm: np.ndarray


@dataclass(frozen=True)
class Dynamics:
    """Result of `regress`: tau = J a + b v + f+ (v > 0) or f- (v < 0).

    `level_forward_nm` > `level_backward_nm` for a rig with friction; `rms_nm` is the residual, `n` the
    number of samples."""

    inertia_kgm2: float
    viscous_nms_rad: float
    level_forward_nm: float
    level_backward_nm: float
    rms_nm: float
    n: int

    @property
    def midpoint_nm(self) -> float:
        """Half way between the two levels: the sensor's bias if friction is alike in both directions."""
        return 0.5 * (self.level_forward_nm + self.level_backward_nm)

    @property
    def coulomb_nm(self) -> float:
        """Half the distance of the two levels: the mean Coulomb friction of both directions."""
        return 0.5 * (self.level_forward_nm - self.level_backward_nm)


def smooth(signal: np.ndarray, rate_hz: float, cutoff_hz: float) -> np.ndarray:
    """Low-pass without delay of each row, (n,) or (rows, n): second-order Butterworth, forwards and backwards
    (-6 dB at the cut-off).

    It is `scipy.signal.sosfiltfilt` to the last bit, in a third of its time.

    Raises
    ------
    ValueError
        `BEYOND` rows or fewer."""
    # contiguous: the compiled loop is made for one layout, and counts of an encoder may come as integers
    signal = np.ascontiguousarray(signal, dtype=float)
    if signal.shape[-1] <= BEYOND:
        raise ValueError(
            f"{signal.shape[-1]} rows: too few for the filter, which runs {BEYOND} beyond each end"
        )
    section, settled = _section(rate_hz, cutoff_hz)
    # the same filter, so that the tests of seeded bugs, which run without a compiler, see the same numbers
    if JIT_DISABLED:  # a hundred times slower than scipy
        from scipy.signal import sosfiltfilt

        return np.asarray(sosfiltfilt(section[None], signal))
    return _there_and_back(np.atleast_2d(signal), section, settled).reshape(signal.shape)


@lru_cache
def _section(rate_hz: float, cutoff_hz: float) -> tuple[np.ndarray, np.ndarray]:
    """The low-pass of `smooth`, b0 b1 b2 1 a1 a2, and its two states after a long 1: its design takes longer
    than the filtering of a short log."""
    from scipy.signal import butter, sosfilt_zi

    sections = butter(2, cutoff_hz, fs=rate_hz, output="sos")
    return sections[0], sosfilt_zi(sections)[0]


@compiled
def _there_and_back(signal: np.ndarray, section: np.ndarray, settled: np.ndarray) -> np.ndarray:
    """All rows (k, n) side by side: what one of them waits for, the processor does of another."""
    k, n = signal.shape
    passed = np.empty((n + 2 * BEYOND, k))
    passed[BEYOND : n + BEYOND] = signal.T
    for row in range(BEYOND):  # turned about its ends
        # a point reflection keeps value and slope, so that a joint that moves at an end is not braked there
        passed[row] = 2 * signal[:, 0] - signal[:, BEYOND - row]
        passed[n + BEYOND + row] = 2 * signal[:, n - 1] - signal[:, n - 2 - row]
    b0, b1, b2, _, a1, a2 = section
    # once each way: what the first pass delays the second one advances
    for _ in range(2):
        # as if the signal had been at its first value for ever: from 0 it would ring at the begin
        state = settled[0] * passed[0], settled[1] * passed[0]
        for row in range(len(passed)):
            for column in range(k):
                old = passed[row, column]
                new = b0 * old + state[0][column]
                state[0][column] = b1 * old - a1 * new + state[1][column]
                state[1][column] = b2 * old - a2 * new
                passed[row, column] = new
        passed = passed[::-1]
    return np.ascontiguousarray(passed[BEYOND : n + BEYOND].T)


def rows_of_a_period(log: AxisLog, cutoff_hz: float) -> int:
    """Rows of a log in one period of the cut-off. Raises DataError for a cut-off that its rate cannot
    carry."""
    most_hz = CUTOFF_SHARE * log.rate_hz
    if not 0 < cutoff_hz <= most_hz:
        raise DataError(f"{log.source}: cut-off {cutoff_hz:g} Hz must lie in 0..{most_hz:g} Hz (rate / 5)")
    return round(log.rate_hz / cutoff_hz)


def differentiate(log: AxisLog, cutoff_hz: float = CUTOFF_HZ) -> Motion:
    """Velocity, acceleration and torque of a log through one zero-phase filter, thinned out alike.

    Raises
    ------
    DataError
        A cut-off the rate cannot carry, or a log shorter than ten periods of it.

    Notes
    -----
    Central differences of the filtered position. One period of the cut-off is dropped at each end, where
    the filter does not know what came before."""
    # behind one period nothing of what the filter made up beyond the ends is left to see
    edge = rows_of_a_period(log, cutoff_hz)
    n = len(log.position_rad)
    least = STRETCH_PERIODS * edge
    if n < least:
        raise DataError(
            f"{log.source}: {n} samples are too few for a cut-off of {cutoff_hz:g} Hz; {least} are needed"
        )
    step = 1.0 / log.rate_hz
    # of five points: three, twice, made the inertia of a log of 100 Hz 3 % too large at 5 Hz
    velocity, acceleration = derivatives(smooth(log.position_rad, log.rate_hz, cutoff_hz), step)
    # every signal by the same slice: rows of one instant stay rows
    kept = slice(edge, n - edge, max(1, edge // SAMPLES_PER_CUTOFF))
    return Motion(
        time_s=(np.arange(n) * step)[kept],
        velocity_rad_s=velocity[kept],
        acceleration_rad_s2=acceleration[kept],
        torque_nm=smooth(log.torque_nm, log.rate_hz, cutoff_hz)[kept],
    )


def regress(motion: Motion, speed_min_rad_s: float = SPEED_MIN_RAD_S, source: str = "log") -> Dynamics:
    """Inertia, viscous friction and the torque level of each direction by least squares.

    Raises
    ------
    DataError
        Too little motion in one direction, or an acceleration too small to see an inertia.

    Notes
    -----
    tau = J a + b v + f+ H(v) + f- H(-v) over the samples with |v| >= `speed_min_rad_s`. A bias of the
    torque sensor and a difference of friction between the directions cannot be told apart from motion
    alone: both move f+ and f- together."""
    v = motion.velocity_rad_s
    moving = np.abs(v) >= speed_min_rad_s
    require_both_directions(v[moving], source)
    columns = (motion.acceleration_rad_s2, v, (v > 0).astype(float), (v < 0).astype(float))
    matrix = np.stack(columns, axis=1)[moving]
    torque = motion.torque_nm[moving]
    # columns of one size: the rank then is that of the motion, not of rad/s beside rad/s^2
    scale = np.sqrt((matrix**2).mean(axis=0))
    # the rank and not a condition number: whoever calls it has no interval by which a poor one would show
    solution, _, rank, _ = np.linalg.lstsq(
        matrix / np.where(scale > 0, scale, 1.0), torque, rcond=RANK_TOLERANCE
    )
    if rank < len(columns):
        raise DataError(f"{source}: the motion is too even to tell inertia, viscous and dry friction apart")
    inertia, viscous, forward, backward = solution / scale
    residual = torque - matrix @ np.array([inertia, viscous, forward, backward])
    return Dynamics(
        inertia_kgm2=float(inertia),
        viscous_nms_rad=float(viscous),
        level_forward_nm=float(forward),
        level_backward_nm=float(backward),
        rms_nm=float(np.sqrt(np.mean(residual**2))),
        n=int(moving.sum()),
    )


def require_both_directions(velocity: np.ndarray, source: str) -> None:
    """Raise DataError when one direction has fewer than `SAMPLES_MIN` samples."""
    for name, n in (("forwards", int((velocity > 0).sum())), ("backwards", int((velocity < 0).sum()))):
        if n < SAMPLES_MIN:
            raise DataError(
                f"{source}: {n} samples of motion {name}, at least {SAMPLES_MIN} are needed "
                "in each direction; use a longer log, a higher cut-off or a lower least speed"
            )
