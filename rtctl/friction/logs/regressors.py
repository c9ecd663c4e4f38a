"""What the joint regression reads of a log: filtered, thinned-out signals, and rows of true sliding."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hw.playback.quantum import quantum
from rtctl.errors import DataError
from rtctl.friction.logs.dynamics import (
    CUTOFF_HZ,
    CUTOFF_SHARE,
    SAMPLES_MIN,
    SAMPLES_PER_CUTOFF,
    SPEED_MIN_RAD_S,
    STRETCH_PERIODS,
    AxisLog,
    rows_of_a_period,
    smooth,
)
from rtctl.friction.logs.recorded_velocity import aligned_velocity
from rtctl.friction.logs.signal_shift import derivatives

SETTLE_RAD, SETTLE_SHARE, SETTLE_MOST_SHARE = 0.01, 0.05, 0.25
"""Travel after a reversal before friction is that of sliding; its share of the range at most; most."""

SPAN_MIN_RAD = 0.005
"""Least range of position that is called motion."""

LOW_SPEED_SHARE = 0.25
"""Speeds below this share of the largest tell Coulomb from viscous friction."""

MARGIN_PERIODS = 1.0
"""Periods of the cut-off left out beside a reversal: the filter blurs the jump of friction over so much."""

_SIGNALS = ("position_rad", "velocity_rad_s", "acceleration_rad_s2", "jerk_rad_s3", "direction", "torque_nm")

FALLBACK_PERIODS = 0.5
"""Taken with a warning where the usual margin leaves no slow rows: a brisk log has only short strokes."""


@dataclass(frozen=True)
class Regressors:
    """Filtered, thinned-out signals of one log or several. Arrays of one length.

    `sliding` marks the rows to regress on, `log` is each row's index into `sources`, `radian` and
    `torque_step_nm` those of `AxisLog`, `inertia_short` by what share coarse positions make the inertia too
    small, `steps_rad_s2` and `noise_rad_s2` the acceleration that their steps, and all noise, make (RMS, of
    the sliding rows), `share_nm` the torque that friction is a share of, if there is one, `waves` (n, k)
    those over the position that were taken out, `place_nm` a torque that goes by the place and `by_place`
    its columns by the names of their parameters (`rtctl.friction.logs.springs`); of two torques
    `external_nm` is the hand's, `held_s` by what the motor's was put back."""

    time_s: np.ndarray
    position_rad: np.ndarray
    velocity_rad_s: np.ndarray
    acceleration_rad_s2: np.ndarray
    jerk_rad_s3: np.ndarray
    direction: np.ndarray
    torque_nm: np.ndarray
    sliding: np.ndarray
    log: np.ndarray
    cutoff_hz: float
    sources: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    radian: float = 1.0
    torque_step_nm: float = 0.0
    inertia_short: float = 0.0
    steps_rad_s2: float = 0.0
    noise_rad_s2: float = 0.0
    share_nm: np.ndarray | None = None
    waves: np.ndarray | None = None
    place_nm: np.ndarray | float = 0.0
    by_place: Mapping[str, np.ndarray] = field(default_factory=dict)
    external_nm: np.ndarray | None = None
    held_s: float = 0.0

    @property
    def source(self) -> str:
        """All files, for messages."""
        return ", ".join(self.sources)

    @property
    def besides(self) -> np.ndarray:
        """What is unknown of the torque besides joint and offset, (n, k): its share, what goes by the place,
        and `waves`, which stay unknown though they are taken out: what they have in common with the motion,
        neither tells."""
        columns = [one for one in (self.share_nm, *self.by_place.values(), self.waves) if one is not None]
        return np.column_stack([np.zeros((len(self.time_s), 0)), *columns])

    def began_s(self, log: int) -> float:
        """`time_s` of the begin of a log: logs follow one after the other (`pooled`)."""
        return float(self.time_s[self.log == log - 1][-1]) if log else 0.0

    def slow(self) -> tuple[int, float]:
        """Number of sliding rows below `LOW_SPEED_SHARE` of the largest speed, and that speed in rad/s."""
        speed = np.abs(self.velocity_rad_s[self.sliding])
        below = LOW_SPEED_SHARE * float(speed.max(initial=0.0))
        return int((speed < below).sum()), below

    def enough(self) -> bool:
        """Whether slow rows, and rows of both directions, are left to regress on."""
        v = self.velocity_rad_s[self.sliding]
        both = min(int((v > 0).sum()), int((v < 0).sum()))
        return both >= SAMPLES_MIN and self.slow()[0] >= SAMPLES_MIN // 2


def cutoff_for(logs: Sequence[AxisLog], wanted_hz: float | None = None) -> float:
    """Cut-off that suits every one of the logs, Hz: the one that is wanted, else the usual one, or what the
    lowest rate carries. Raises DataError for a wanted one that the rate of some log cannot carry."""
    cutoff_hz = wanted_hz or min(CUTOFF_HZ, *(CUTOFF_SHARE * log.rate_hz for log in logs))
    for log in logs:
        rows_of_a_period(log, cutoff_hz)
    return cutoff_hz


def regressors(
    log: AxisLog,
    cutoff_hz: float = CUTOFF_HZ,
    speed_min_rad_s: float = SPEED_MIN_RAD_S,
    margin_periods: float | None = None,
) -> Regressors:
    """Filter every column and the torque by one zero-phase low-pass, and thin them out on the same instants.

    Parameters
    ----------
    margin_periods
        Periods of the cut-off left out beside a reversal; None: the usual, or fewer with a warning.

    Raises
    ------
    DataError
        A cut-off the rate cannot carry, a log too short for it, hardly any motion, or a recorded velocity
        that is not that of the position (`rtctl.friction.logs.recorded_velocity`).

    Notes
    -----
    The direction is a column of the regression and is filtered too: around a reversal both sides of the
    balance are then blurred alike. A recorded velocity takes the place of the first derivative. Not `sliding`
    are rows within margin or `settle_rad` of a reversal, where bristles bend."""
    edge, span = _checked(log, cutoff_hz)
    rate, n = log.rate_hz, len(log.position_rad)
    x, torque = smooth(np.stack([log.position_rad, log.torque_nm]), rate, cutoff_hz)
    v, a, notes = _motion(log, x, cutoff_hz)
    jerk = derivatives(a, 1 / rate)[0]  # tells a torque that is late (docs/theory.md 9.5)
    direction = smooth(np.sign(v), rate, cutoff_hz)
    kept = slice(edge, n - edge, max(1, edge // SAMPLES_PER_CUTOFF))
    # in short strokes a share of the range, or no row of them would slide
    settle_rad = max(
        min(SETTLE_RAD * log.radian, SETTLE_SHARE * span), min(log.settle_rad, SETTLE_MOST_SHARE * span)
    )

    def with_margin(periods: float) -> Regressors:
        reach = max(1, round(periods * edge))  # counted before thinning
        sliding = _sliding(x, v, settle_rad, speed_min_rad_s, reach)
        return Regressors(
            time_s=log.start_s + (np.arange(n) / rate)[kept],
            position_rad=x[kept],
            velocity_rad_s=v[kept],
            acceleration_rad_s2=a[kept],
            jerk_rad_s3=jerk[kept],
            direction=direction[kept],
            torque_nm=torque[kept],
            sliding=sliding[kept],
            log=np.zeros(len(x[kept]), int),
            cutoff_hz=cutoff_hz,
            sources=(log.source,),
            warnings=(*log.notes, *notes),
            radian=log.radian,
        )

    usual = with_margin(MARGIN_PERIODS if margin_periods is None else margin_periods)
    if margin_periods is not None or usual.enough():
        return usual
    return replace(
        with_margin(FALLBACK_PERIODS), warnings=(*log.notes, *notes, _short_strokes(log, cutoff_hz))
    )


def _short_strokes(log: AxisLog, cutoff_hz: float) -> str:
    return (
        f"{log.source}: strokes too short for the usual margin beside reversals: half a period of the "
        f"cut-off ({1e3 * FALLBACK_PERIODS / cutoff_hz:.3g} ms) is left out; Coulomb friction may be biased "
        "(by how much was not measured); slower, longer strokes avoid it"
    )


def of_stretches(
    parts: Sequence[AxisLog], cutoff_hz: float = CUTOFF_HZ, speed_min_rad_s: float = SPEED_MIN_RAD_S
) -> Regressors:
    """Stretches of one log between its gaps as one log; too short ones are left out, and that is said.

    Raises
    ------
    DataError
        As `regressors`, of the longest stretch where all are too short."""
    need = STRETCH_PERIODS * rows_of_a_period(parts[0], cutoff_hz)
    kept = [part for part in parts if len(part.position_rad) >= need]
    if len(parts) == 1 or not kept:
        longest = max(parts, key=lambda part: len(part.position_rad))
        return regressors(longest, cutoff_hz, speed_min_rad_s)

    def with_margin(periods: float) -> Regressors:
        return _one_log([regressors(part, cutoff_hz, speed_min_rad_s, periods) for part in kept])

    found, more = with_margin(MARGIN_PERIODS), []
    if not found.enough():
        found, more = with_margin(FALLBACK_PERIODS), [_short_strokes(parts[0], cutoff_hz)]
    if len(kept) < len(parts):
        lost_s = (
            sum(len(part.position_rad) for part in parts if len(part.position_rad) < need) / parts[0].rate_hz
        )
        more.append(
            f"{parts[0].source}: {len(parts) - len(kept)} stretches between gaps are shorter than {need} "
            f"rows, {lost_s:.3g} s in all: left out"
        )
    return replace(found, warnings=(*found.warnings, *more))


def _one_log(parts: list[Regressors]) -> Regressors:
    """Rows of stretches of one log, in the order of time."""
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in ("time_s", *_SIGNALS, "sliding", "log")
    }
    return replace(
        parts[0],
        **columns,
        warnings=tuple(dict.fromkeys(warning for part in parts for warning in part.warnings)),
    )


def _motion(
    log: AxisLog, position: np.ndarray, cutoff_hz: float
) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Velocity and acceleration of a log, from its velocity where it has one, and notes about that one."""
    step = 1 / log.rate_hz
    v, a = derivatives(position, step)
    if log.velocity_rad_s is None:
        return v, a, ()
    recorded = smooth(log.velocity_rad_s, log.rate_hz, cutoff_hz)
    step_rad = log.step_rad or quantum(log.position_rad)
    try:
        grain = quantum(log.velocity_rad_s)
        v, notes = aligned_velocity(recorded, v, log.rate_hz, cutoff_hz, log.source, step_rad, grain)
    except DataError as error:  # what was found in the rows may be why
        raise DataError("; besides: ".join([str(error), *log.notes])) from error
    return v, derivatives(v, step)[0], notes


def _checked(log: AxisLog, cutoff_hz: float) -> tuple[int, float]:
    """Samples per period of the cut-off, and the range of the position in rad."""
    n, edge = len(log.position_rad), rows_of_a_period(log, cutoff_hz)
    if n < STRETCH_PERIODS * edge:
        raise DataError(
            f"{log.source}: {n} samples{' between two gaps' if log.start_s else ''} are too few for a "
            f"cut-off of {cutoff_hz:g} Hz; {STRETCH_PERIODS * edge} are needed"
        )
    span = float(np.ptp(log.position_rad))
    if not span >= SPAN_MIN_RAD * log.radian:
        raise DataError(
            f"{log.source}: the position covers {span:.3g} rad only, too little motion; record wider motion, "
            "or correct the unit of the position"
        )
    return edge, span


def pooled(parts: list[Regressors]) -> Regressors:
    """Rows of several logs (each a part of its own) as one, their times one after the other."""
    if len(parts) == 1:
        return parts[0]
    ends = np.cumsum([0.0, *(part.time_s[-1] for part in parts)])
    signals: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts]) for name in _SIGNALS
    }
    return Regressors(
        time_s=np.concatenate([part.time_s + end for part, end in zip(parts, ends, strict=False)]),
        **signals,
        sliding=np.concatenate([part.sliding for part in parts]),
        log=np.repeat(np.arange(len(parts)), [len(part.log) for part in parts]),
        cutoff_hz=parts[0].cutoff_hz,
        sources=tuple(part.source for part in parts),
        warnings=tuple(warning for part in parts for warning in part.warnings),
        radian=parts[0].radian,
    )


def _sliding(x: np.ndarray, v: np.ndarray, settle_rad: float, speed_min: float, reach: int) -> np.ndarray:
    """Rows that move, and have moved far enough since the last reversal, `reach` samples inside."""
    begins = np.flatnonzero(np.diff(np.sign(v), prepend=np.sign(v[0]) + 1))
    run = np.cumsum(np.isin(np.arange(len(v)), begins)) - 1
    good = (np.abs(x - x[begins][run]) >= settle_rad) & (np.abs(v) >= speed_min)
    # a row is kept where none within reach is not good: the filter has mixed it with these
    wide = np.convolve(~good, np.ones(2 * reach + 1), mode="same")
    return np.asarray(wide < 0.5)
