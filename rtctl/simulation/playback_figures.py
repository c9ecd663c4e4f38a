"""The friction in one recording that a model is judged by, as figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

from hw.interface import Rig
from rtctl.errors import DataError
from rtctl.friction.logs.dynamics import (
    CUTOFF_HZ,
    SPEED_MIN_RAD_S,
    AxisLog,
    Dynamics,
    differentiate,
    regress,
)
from rtctl.friction.logs.log_input import aligned, radian_of
from rtctl.friction.logs.log_points import read_in_time
from rtctl.friction.logs.logs import FrictionSamples, friction_samples
from rtctl.friction.logs.regressors import regressors
from rtctl.friction.logs.springs import Spring, spring_in
from rtctl.simulation.playback_run import load_log

EPSILON_NM = 0.001
"""Default tube, N m: a friction of a few hundredths of a newton metre would vanish in a wider one."""


@dataclass(frozen=True)
class Settings:
    """How friction is taken out of a log.

    `inertia_kgm2` None: that of the logs learned from (`rtctl identify --log`); of a log alone by its own
    regression. `bias` "midpoint": see `friction_samples`.
    `train_share` below 1 trains on the first part of each log's time and holds the rest out."""

    inertia_kgm2: float | None = None
    bias: Literal["midpoint", "zero"] = "midpoint"
    cutoff_hz: float = CUTOFF_HZ
    speed_min_rad_s: float = SPEED_MIN_RAD_S
    epsilon_nm: float = EPSILON_NM
    train_share: float = 1.0


@dataclass(frozen=True)
class Judged:
    """One log with its dynamics, the inertia and bias taken, its friction samples, and those of rows that
    slide, where that can be told; all without the torque of `spring`, where something that goes by the
    place plainly acts."""

    log: AxisLog
    dynamics: Dynamics
    inertia_kgm2: float
    bias_nm: float
    samples: FrictionSamples
    sliding: FrictionSamples | None = None
    spring: Spring | None = None

    def summary(self) -> dict[str, Any]:
        """Plain figures for the report."""
        return {
            "file": self.log.source,
            "regression": {**asdict(self.dynamics), "coulomb_nm": self.dynamics.coulomb_nm},
            "inertia_kgm2": self.inertia_kgm2,
            "bias_nm": self.bias_nm,
            "samples": len(self.samples.time_s),
        }


def judge(options: Mapping[str, Any], rig: Rig, settings: Settings) -> Judged:
    """Read a log and take the friction out of its first axis; its torque is put back as those of logs to
    learn from.

    Raises
    ------
    DataError
        An unusable log, or one that is not plausible."""
    recording, delay_s = load_log(options, rig), None
    if recording.current_a is not None:
        found = read_in_time(
            [options], rig, cutoff_hz=settings.cutoff_hz, speed_min_rad_s=settings.speed_min_rad_s
        )
        (delay_s,) = found.torque_delays_s
    log = replace(aligned(recording, rig, delay_s), radian=radian_of([recording], rig))
    spring = _spring(log, settings)
    ((free,),) = spring.taken_out(((log,),)) if spring else ((log,),)
    return replace(_judged(free, settings), spring=spring)


def _spring(log: AxisLog, settings: Settings) -> Spring | None:
    """The torque that goes by the place in a log; None, too, of one that is too poor to look for it."""
    try:
        signals = regressors(log, settings.cutoff_hz, settings.speed_min_rad_s)
        return spring_in(signals, ((log,),), settings.speed_min_rad_s)
    except DataError:
        return None  # a log to be judged is held to less than one to learn from: its regression decides


def _judged(log: AxisLog, settings: Settings) -> Judged:
    # by this log alone: zeros of sensors differ from log to log
    dynamics = regress(differentiate(log, settings.cutoff_hz), settings.speed_min_rad_s, log.source)
    inertia = dynamics.inertia_kgm2 if settings.inertia_kgm2 is None else settings.inertia_kgm2
    # so written that NaN is refused, too
    if not inertia > 0:
        raise DataError(
            f"{log.source}: the regression gives inertia {inertia:.3g} kg m^2: "
            "turn the sign of the torque (scale = -1), or give the inertia"
        )
    # half of the sum of both directions: an offset, not friction
    bias = dynamics.midpoint_nm if settings.bias == "midpoint" else 0.0
    samples = friction_samples(
        log, inertia, bias_nm=bias, cutoff_hz=settings.cutoff_hz, speed_min_rad_s=settings.speed_min_rad_s
    )
    return Judged(log, dynamics, inertia, bias, samples, _sliding(log, inertia, bias, settings))


def with_inertia(judged: Judged, inertia_kgm2: float, settings: Settings) -> Judged:
    """The same log with another inertia."""
    return replace(_judged(judged.log, replace(settings, inertia_kgm2=inertia_kgm2)), spring=judged.spring)


def _sliding(log: AxisLog, inertia_kgm2: float, bias_nm: float, settings: Settings) -> FrictionSamples | None:
    """Friction on the rows that `rtctl identify --log` would take: those behind a turn are not among them."""
    try:
        signals = regressors(log, settings.cutoff_hz, settings.speed_min_rad_s)
    except DataError:
        return None
    rows = signals.sliding
    friction = signals.torque_nm - inertia_kgm2 * signals.acceleration_rad_s2 - bias_nm
    return FrictionSamples(
        signals.time_s[rows], signals.velocity_rad_s[rows], friction[rows], log.source, log.sha256
    )
