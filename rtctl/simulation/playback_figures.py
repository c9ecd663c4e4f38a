"""Friction that is learned from one recording and judged on another, as figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hw.interface import Rig
from rtctl.errors import DataError
from rtctl.friction.learn.fit import fit_points
from rtctl.friction.learn.hold_out import way_for
from rtctl.friction.logs.dynamics import (
    CUTOFF_HZ,
    SPEED_MIN_RAD_S,
    STRETCH_PERIODS,
    AxisLog,
    Dynamics,
    differentiate,
    regress,
)
from rtctl.friction.logs.log_input import aligned, of_file, radian_of
from rtctl.friction.logs.log_points import checked, read_in_time
from rtctl.friction.logs.logs import FrictionSamples, friction_samples, level_points, pool
from rtctl.friction.logs.regressors import regressors
from rtctl.friction.logs.springs import Spring, spring_in
from rtctl.friction.model import FrictionModel
from rtctl.friction.points import FrictionPoints
from rtctl.simulation.playback_doubts import Log, against_identify
from rtctl.simulation.playback_interaction import rms
from rtctl.simulation.playback_run import load_log

EPSILON_NM = 0.001
"""Default tube, N m: a friction of a few hundredths of a newton metre would vanish in a wider one."""


@dataclass(frozen=True)
class Settings:
    """How friction is taken out of a log.

    `inertia_kgm2` None: by regression, in each log for itself. `bias` "midpoint": see `friction_samples`.
    `train_share` below 1 trains on the first part of each log's time and holds the rest out."""

    inertia_kgm2: float | None = None
    bias: Literal["midpoint", "zero"] = "midpoint"
    cutoff_hz: float = CUTOFF_HZ
    speed_min_rad_s: float = SPEED_MIN_RAD_S
    epsilon_nm: float = EPSILON_NM
    train_share: float = 1.0


@dataclass(frozen=True)
class Judged:
    """One log with its dynamics, the inertia and bias taken, and its friction samples; all without the torque
    of `spring`, where something that goes by the place plainly acts."""

    log: AxisLog
    dynamics: Dynamics
    inertia_kgm2: float
    bias_nm: float
    samples: FrictionSamples
    spring: Spring | None = None

    @property
    def regressed(self) -> Log:
        """File and regression."""
        return self.log.source, self.dynamics

    def summary(self) -> dict[str, Any]:
        """Plain figures for the report."""
        return {
            "file": self.log.source,
            "regression": {**asdict(self.dynamics), "coulomb_nm": self.dynamics.coulomb_nm},
            "inertia_kgm2": self.inertia_kgm2,
            "bias_nm": self.bias_nm,
            "samples": len(self.samples.time_s),
        }


@dataclass(frozen=True)
class Learned:
    """A model with the logs it comes from (each stretch without a gap), the points it saw, the samples held
    out of it (or None), and what `rtctl identify --log` would say of the logs."""

    model: FrictionModel
    symmetric: FrictionModel
    logs: tuple[Judged, ...]
    points: FrictionPoints
    held_out: FrictionSamples | None
    warnings: tuple[str, ...] = ()


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
    return Judged(log, dynamics, inertia, bias, samples)


def learn(
    files: Sequence[Path], options: Mapping[str, Any], rig: Rig, settings: Settings, rig_name: str
) -> Learned:
    """Learn a model from one or more logs that share the columns of `options`, mended and looked at as by
    `rtctl identify --log`.

    Raises
    ------
    ConfigError, DataError
        A missing file, an unusable log, one that `rtctl identify --log` refuses, or a fit that fails."""
    # the columns of one log are those of all
    of_files = [of_file(options, file) for file in files]
    # the same checks as of `rtctl identify --log`: what that refuses nothing is learned from
    found = checked(of_files, rig, settings.cutoff_hz, settings.speed_min_rad_s)
    logs = tuple(_judged(part, settings) for stretches in found.logs for part in _long(stretches, settings))
    seen, held = [], []
    for each in logs:
        # by time, not at random: samples beside each other are not independent
        end = settings.train_share * len(each.log.position_rad) / each.log.rate_hz
        seen.append(each.samples.between(0.0, end) if settings.train_share < 1 else each.samples)
        # empty where all is trained on
        held.append(each.samples.between(end, np.inf))
    points = replace(level_points(pool(seen)), motion=rig.moves(0)[0])
    regressed, given = [each.regressed for each in logs], settings.inertia_kgm2 is not None
    return Learned(
        model=fit_points(points, rig=rig_name, epsilon_nm=settings.epsilon_nm, folds=way_for(points)),
        # beside it, from the same points: what directions are worth is the difference
        symmetric=fit_points(mirrored(points), rig=rig_name, epsilon_nm=settings.epsilon_nm),
        logs=logs,
        points=points,
        held_out=pool(held) if settings.train_share < 1 else None,
        warnings=(*found.warnings, *against_identify(found.fit, regressed, inertia_given=given)),
    )


def _long(stretches: Sequence[AxisLog], settings: Settings) -> Sequence[AxisLog]:
    """Stretches that the low-pass leaves enough of; the longest where there is none."""
    least_s = STRETCH_PERIODS / settings.cutoff_hz
    long = [part for part in stretches if len(part.position_rad) >= least_s * part.rate_hz]
    return long or sorted(stretches, key=lambda part: len(part.position_rad))[-1:]


def mirrored(points: FrictionPoints) -> FrictionPoints:
    """Each point in both directions: what a learner sees that takes friction for symmetric."""
    speed, one = np.abs(points.velocity_rad_s), np.ones(len(points.count))  # magnitudes, both ways
    return replace(
        points,
        velocity_rad_s=np.concatenate([speed, -speed]),
        friction_nm=np.tile(points.friction_nm, 2),
        direction=np.concatenate([one, -one]),
        std_nm=np.tile(points.std_nm, 2),
        count=np.tile(points.count, 2),
        columns={name: np.tile(column, 2) for name, column in points.columns.items()},
    )


def prediction(learned: Learned, samples: FrictionSamples) -> dict[str, Any]:
    """How well the models predict friction samples they have not seen, N m RMS."""
    v, friction = samples.velocity_rad_s, samples.friction_nm
    # the model has magnitudes, samples have the sign of the motion
    error = friction - np.sign(v) * learned.model.magnitude(v)
    return {
        "samples": len(v),
        "friction_rms_nm": rms(friction),
        "rmse_nm": rms(error),
        "rmse_forward_nm": rms(error[v > 0]),
        "rmse_backward_nm": rms(error[v < 0]),
        "rmse_symmetric_nm": rms(friction - np.sign(v) * learned.symmetric.magnitude(v)),
        "in_range_share": in_range_share(learned.model, v),
    }


def in_range_share(model: FrictionModel, velocity_rad_s: np.ndarray) -> float:
    """Share of samples not faster than what the model was trained on, in their direction."""
    forward, backward = (branch.speed_max_rad_s for branch in model.branches)
    # each by its own direction's range: the two are seldom measured equally far
    inside = np.abs(velocity_rad_s) <= np.where(velocity_rad_s >= 0, forward, backward)
    return float(inside.mean()) if len(inside) else float("nan")
