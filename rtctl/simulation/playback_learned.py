"""Friction that is learned of logs, by the points that `rtctl identify --log` makes of them, and how well it
predicts what it has not seen."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hw.interface import Rig
from rtctl.friction.learn.fit import fit_points
from rtctl.friction.learn.hold_out import way_for
from rtctl.friction.logs.dynamics import STRETCH_PERIODS, AxisLog, Dynamics
from rtctl.friction.logs.log_input import of_file
from rtctl.friction.logs.log_points import Checked, checked
from rtctl.friction.logs.logs import FrictionSamples, friction_samples, level_points, pool
from rtctl.friction.logs.regressors import Regressors
from rtctl.friction.model import FrictionModel
from rtctl.friction.points import FrictionPoints
from rtctl.simulation.playback_figures import Judged, Settings, with_inertia
from rtctl.simulation.playback_interaction import rms

ANOTHER = 3.0
"""Factor by which the inertia of a log hardly differs from that of its joint, blurred as it is by turns."""


@dataclass(frozen=True)
class Learned:
    """A model with the logs it comes from as `rtctl identify --log` has them, the inertia taken, the samples
    that its points are of, the points, and what was held out of it (or None)."""

    model: FrictionModel
    symmetric: FrictionModel
    found: Checked
    inertia_kgm2: float
    samples: FrictionSamples
    points: FrictionPoints
    held_out: FrictionSamples | None

    @property
    def dynamics(self) -> Dynamics:
        """The regression of all logs together; the levels are those of their mean offset."""
        fit = self.found.fit
        value = {
            name: one.value
            for form in (fit.per_direction, fit.symmetric)
            for name, one in form.parameters.items()
        }
        return Dynamics(
            inertia_kgm2=value["inertia_kgm2"],
            viscous_nms_rad=value["viscous_nms_rad"],
            level_forward_nm=value["level_forward_nm"],
            level_backward_nm=value["level_backward_nm"],
            rms_nm=fit.symmetric.rms_nm,
            n=fit.symmetric.n,
        )

    def summary(self) -> dict[str, Any]:
        """Plain figures for the report."""
        return {
            "logs": [
                {"file": one.source, "bias_nm": bias_nm}
                for one, bias_nm in zip(self.found.fit.offsets, _offsets(self.found), strict=True)
            ],
            "regression": {**asdict(self.dynamics), "coulomb_nm": self.dynamics.coulomb_nm},
            "inertia_kgm2": self.inertia_kgm2,
        }


def learn(
    files: Sequence[Path], options: Mapping[str, Any], rig: Rig, settings: Settings, rig_name: str
) -> Learned:
    """Learn a model from the points that `rtctl identify --log` makes of one or more logs that share the
    columns of `options`.

    Raises
    ------
    ConfigError, DataError
        A missing file, an unusable log, one that `rtctl identify --log` refuses, or a fit that fails."""
    # the columns of one log are those of all
    of_files = [of_file(options, file) for file in files]
    found = checked(of_files, rig, settings.cutoff_hz, settings.speed_min_rad_s)
    known = found.fit.symmetric.parameters["inertia_kgm2"].value
    inertia = known if settings.inertia_kgm2 is None else settings.inertia_kgm2
    rows = found.samples(remove_offset=settings.bias == "midpoint", inertia_kgm2=inertia)
    # by time, not at random: samples beside each other are not independent
    ends_s = _ends_s(found.signals, settings.train_share)
    seen = (
        rows
        if settings.train_share == 1
        else rows.between(0.0, ends_s[found.signals.log[found.signals.sliding]])
    )
    points = replace(level_points(seen), motion=rig.moves(0)[0])
    return Learned(
        model=fit_points(points, rig=rig_name, epsilon_nm=settings.epsilon_nm, folds=way_for(points)),
        # beside it, from the same points: what directions are worth is the difference
        symmetric=fit_points(mirrored(points), rig=rig_name, epsilon_nm=settings.epsilon_nm),
        found=found,
        inertia_kgm2=inertia,
        samples=seen,
        points=points,
        held_out=_held_out(found, settings, inertia) if settings.train_share < 1 else None,
    )


def _ends_s(signals: Regressors, share: float) -> np.ndarray:
    """Time of the signals up to which that share of each log goes, s, (logs,)."""
    began = [signals.began_s(k) for k in range(len(signals.sources))]
    ends = [signals.time_s[signals.log == k][-1] for k in range(len(began))]
    return np.array([first + share * (last - first) for first, last in zip(began, ends, strict=True)])


def _offsets(found: Checked) -> list[float]:
    """Offset of each log, N m."""
    return [found.fit.symmetric.parameters[one.parameter].value for one in found.fit.offsets]


def _held_out(found: Checked, settings: Settings, inertia_kgm2: float) -> FrictionSamples:
    """Friction of the rest of each log; unlike what is learned from, with the rows at turns."""
    held, signals = [], found.signals
    ends_s = _ends_s(signals, settings.train_share)
    for k, (stretches, offset_nm) in enumerate(zip(found.logs, _offsets(found), strict=True)):
        bias_nm = offset_nm if settings.bias == "midpoint" else 0.0
        for part in _long(stretches, settings):
            rows = friction_samples(
                part, inertia_kgm2, bias_nm=bias_nm, cutoff_hz=settings.cutoff_hz,
                speed_min_rad_s=settings.speed_min_rad_s,
            )  # fmt: skip
            held.append(rows.between(ends_s[k] - signals.began_s(k) - part.start_s, np.inf))
    return pool(held)


def _long(stretches: Sequence[AxisLog], settings: Settings) -> Sequence[AxisLog]:
    """Stretches that the low-pass leaves enough of; the longest where there is none."""
    least_s = STRETCH_PERIODS / settings.cutoff_hz
    long = [part for part in stretches if len(part.position_rad) >= least_s * part.rate_hz]
    return long or sorted(stretches, key=lambda part: len(part.position_rad))[-1:]


def judged_with(judged: Judged, learned: Learned, settings: Settings) -> Judged:
    """The log judged with the inertia of the logs learned from, where these tell one: turns are counted in
    its own regression, and the low-pass blurs the jump of friction there, which makes an inertia too small.
    """
    return with_inertia(judged, learned.inertia_kgm2, settings) if learned.inertia_kgm2 > 0 else judged


def another_inertia(judged: Judged, learned: Learned) -> list[str]:
    """What is said of a log with another inertia than those that friction was learned from: units, above
    all."""
    times = judged.dynamics.inertia_kgm2 / (learned.dynamics.inertia_kgm2 or math.nan)
    # so written that NaN, of logs that tell no inertia, says nothing
    if not (times >= ANOTHER or times <= 1 / ANOTHER):
        return []
    return [
        f"{judged.log.source}: its inertia by regression is {times:.3g} times that of the logs that friction "
        "was learned from: another unit of the torque or the position, another joint, or motion that does "
        "not tell it; the first two are not helped by this friction"
    ]


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


def prediction(
    learned: Learned, samples: FrictionSamples, sliding: FrictionSamples | None = None
) -> dict[str, Any]:
    """How well the models predict friction samples they have not seen, N m RMS; and those of rows that slide,
    NaN where nobody knows which."""
    v, friction = samples.velocity_rad_s, samples.friction_nm
    error = _error(learned, samples)
    return {
        "samples": len(v),
        "friction_rms_nm": rms(friction),
        "rmse_nm": rms(error),
        "rmse_sliding_nm": rms(np.zeros(0) if sliding is None else _error(learned, sliding)),
        "rmse_forward_nm": rms(error[v > 0]),
        "rmse_backward_nm": rms(error[v < 0]),
        "rmse_symmetric_nm": rms(friction - np.sign(v) * learned.symmetric.magnitude(v)),
        "in_range_share": in_range_share(learned.model, v),
    }


def _error(learned: Learned, samples: FrictionSamples) -> np.ndarray:
    """What the model misses of the samples, N m."""
    v = samples.velocity_rad_s
    # the model has magnitudes, samples have the sign of the motion
    return np.asarray(samples.friction_nm - np.sign(v) * learned.model.magnitude(v))


def in_range_share(model: FrictionModel, velocity_rad_s: np.ndarray) -> float:
    """Share of samples not faster than what the model was trained on, in their direction."""
    forward, backward = (branch.speed_max_rad_s for branch in model.branches)
    # each by its own direction's range: the two are seldom measured equally far
    inside = np.abs(velocity_rad_s) <= np.where(velocity_rad_s >= 0, forward, backward)
    return float(inside.mean()) if len(inside) else float("nan")
