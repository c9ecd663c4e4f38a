"""Friction of one axis from a recorded log of free motion.

The balance of the joint (docs/theory.md 1.1) is ``J a = tau_m + tau_h - F(v) - bias``, so torque
minus inertia times acceleration is friction plus the bias of the torque sensor
(`rtctl.friction.logs.dynamics`)."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from hw.interface import Rig
from hw.playback.reader import Recording
from rtctl.errors import DataError
from rtctl.friction.logs.dynamics import (
    CUTOFF_HZ,
    SPEED_MIN_RAD_S,
    AxisLog,
    differentiate,
    regress,
    require_both_directions,
)
from rtctl.friction.point_columns import BETWEEN, COLUMNS
from rtctl.friction.points import FrictionPoints

LEVELS_MAX = 60
SAMPLES_PER_LEVEL = 8
LEVELS_OF_A_LOG = 12
"""Levels that each of several logs has at least, each direction."""
LOADS = 9
"""Parts of a level whose load is known, of equally many rows: loads that help, that hinder, and between."""

# another session is taken to differ from this one as its stretches do (decision 0098)
PARTS = 5
"""Stretches of time between which a point is told to differ: as many as there are folds."""


@dataclass(frozen=True)
class FrictionSamples:
    """Friction along a log, signed as the velocity is for a rig with friction. Arrays of one length."""

    time_s: np.ndarray
    velocity_rad_s: np.ndarray
    friction_nm: np.ndarray
    source: str
    sha256: str
    columns: Mapping[str, np.ndarray] = field(default_factory=dict)
    """What else was measured, by the names of `rtctl.friction.point_columns`."""

    def between(self, start_s: float, end_s: float | np.ndarray) -> FrictionSamples:
        """The samples with start_s <= time < end_s, which may be of each sample (n,)."""
        kept = (self.time_s >= start_s) & (self.time_s < end_s)
        return replace(
            self,
            time_s=self.time_s[kept],
            velocity_rad_s=self.velocity_rad_s[kept],
            friction_nm=self.friction_nm[kept],
            columns={name: column[kept] for name, column in self.columns.items()},
        )


def file_sha256(path: Path) -> str:
    """Checksum of a file, hex."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def files_sha256(files: Sequence[Path]) -> str:
    """Checksum of several files together, hex. Raises DataError for one that is given twice."""
    digests = [file_sha256(file) for file in files]
    for digest in digests:
        if digests.count(digest) > 1:
            first, second, *_ = (file for file, each in zip(files, digests, strict=True) if each == digest)
            raise DataError(f"{second}: the same as {first}; give each file once")
    return digests[0] if len(files) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()


def axis_log(recording: Recording, rig: Rig, use: Literal["both", "motor", "hand"] = "both") -> AxisLog:
    """Torque and position of the first axis of a recording.

    Parameters
    ----------
    use
        Which of the recorded torques enter the balance.

    Raises
    ------
    DataError
        The recording maps none of the torques asked for, or force columns only."""
    torques = []
    if use != "hand" and recording.current_a is not None:
        per_ampere = rig.gear_ratio[0] * rig.gear_efficiency[0] * rig.torque_constant_nm_a[0]
        torques.append(recording.current_a[:, 0] * per_ampere)
    if use != "motor" and recording.hand_torque_nm is not None:
        torques.append(recording.hand_torque_nm[:, 0])
    # a force at the handle turns the joint by its lever, given as three parts in the sensor's axes
    if use != "motor" and recording.force_n is not None:
        torques.append(recording.force_n @ rig.lever_m[0])
    if not torques:
        wanted = {"both": "motor or hand", "motor": "motor", "hand": "hand"}[use]
        raise DataError(
            f"{recording.path}: no {wanted} torque is mapped: map current, motor_torque or hand_torque"
        )
    return AxisLog(
        rate_hz=recording.rate_hz,
        position_rad=recording.position_rad[:, 0],
        torque_nm=np.sum(torques, axis=0),
        source=str(recording.path),
        sha256=file_sha256(recording.path),
        velocity_rad_s=None if recording.velocity_rad_s is None else recording.velocity_rad_s[:, 0],
        start_s=recording.start_s,
        notes=recording.notes,
        step_rad=recording.steps_rad[0] if recording.steps_rad else 0.0,
        unsaid=recording.unsaid,
    )


def friction_samples(
    log: AxisLog,
    inertia_kgm2: float,
    *,
    bias_nm: float | Literal["midpoint"] = 0.0,
    cutoff_hz: float = CUTOFF_HZ,
    speed_min_rad_s: float = SPEED_MIN_RAD_S,
) -> FrictionSamples:
    """Friction along a log of free motion: torque minus inertia times acceleration minus bias.

    Parameters
    ----------
    inertia_kgm2
        Inertia below the torque sensor, kg m^2: of the maker, or from `regress`.
    bias_nm
        Bias of the torque, N m. "midpoint" takes half way between the directions (`Dynamics.midpoint_nm`):
        right for a strain gauge with an unknown zero, and then any true difference between the directions
        is lost; 0 for a motor current whose zero is known.

    Raises
    ------
    DataError
        See `differentiate`; too little motion in one direction; torque without the sign of friction."""
    motion = differentiate(log, cutoff_hz)
    if bias_nm == "midpoint":
        bias_nm = regress(motion, speed_min_rad_s, log.source).midpoint_nm
    moving = np.abs(motion.velocity_rad_s) >= speed_min_rad_s
    velocity = motion.velocity_rad_s[moving]
    require_both_directions(velocity, log.source)
    friction = (motion.torque_nm - inertia_kgm2 * motion.acceleration_rad_s2)[moving] - bias_nm
    # a wrong sign would make points of help out of friction, which the loop would then add to the motion
    for name, mean in (
        ("forwards", friction[velocity > 0].mean()),
        ("backwards", -friction[velocity < 0].mean()),
    ):
        if not mean > 0:
            raise DataError(
                f"{log.source}: friction {name} is {mean:.4g} N m on average, it must oppose motion: "
                "turn the sign of the torque (scale = -1) or correct its bias"
            )
    return FrictionSamples(motion.time_s[moving], velocity, friction, log.source, log.sha256)


def level_points(samples: FrictionSamples, levels: int = LEVELS_MAX) -> FrictionPoints:
    """Average friction samples by speed, so that a learner sees at most `levels` points per direction.

    Levels hold equally many samples each (at least `SAMPLES_PER_LEVEL`), so they are narrow where the hand
    moved most. Each of several logs (column `log`) has levels of its own, so that whole logs can be held out.
    Where the load is known (column `load_nm`) there are twice as many, and each is of one load as well. A
    point is the mean speed, the median friction, its standard deviation at one speed, the one between
    stretches of time, the count, and of the other columns what holds for the whole level: a mean that says
    something, or the one value there is.

    Raises
    ------
    DataError
        Too few samples in one direction, or a level whose friction does not oppose the motion."""
    require_both_directions(samples.velocity_rad_s, samples.source)
    rows: list[tuple[float, ...]] = []
    part, between = _parts(samples), list[float]()
    means: dict[str, list[float]] = {name: [] for name in samples.columns}
    for direction in (1, -1):
        chosen = np.sign(samples.velocity_rad_s) == direction
        speed, friction = np.abs(samples.velocity_rad_s[chosen]), direction * samples.friction_nm[chosen]
        own = part[chosen]
        beside = {name: column[chosen] for name, column in samples.columns.items()}
        # `LEVELS_MAX` whatever is asked for: a machine's time grows with the square of its points
        for level in _levels(speed, beside.get("log"), min(levels, LEVELS_MAX), beside.get("load_nm")):
            # the median, since a spike or a bump in some rows is no friction of this speed
            value = float(np.median(friction[level]))
            if not value > 0:
                raise DataError(
                    f"{samples.source}: friction at {direction * speed[level].mean():.3g} rad/s is "
                    f"{value:.4g} N m: it does not oppose the motion; correct the bias or the inertia, and "
                    "leave out what turns round or stands still (rtctl identify --log does all of it)"
                )
            rows.append(
                (
                    direction * speed[level].mean(),
                    value,
                    direction,
                    _spread(speed[level], friction[level]),
                    len(level),
                )
            )
            between.append(_between(friction[level], own[level]))
            for name, column in beside.items():
                means[name].append(_of_level(name, column[level]))
    if {row[2] for row in rows} != {1, -1}:  # enough samples in all, but each log has levels of its own
        raise DataError(
            f"{samples.source}: too short: no log has {SAMPLES_PER_LEVEL} samples of motion in either "
            "direction, and a point is of one log; give longer logs"
        )
    beside = {name: np.array(column) for name, column in means.items()} | {BETWEEN.name: np.array(between)}
    return FrictionPoints.from_rows(rows, samples.source, samples.sha256, beside)


def _spread(speed: np.ndarray, friction: np.ndarray) -> float:
    """Standard deviation of friction about its line over speed, N m: what the width of a level adds to it is
    not its spread."""
    v = speed - speed.mean()
    slope = float(v @ friction) / float(v @ v) if v.any() else 0.0
    # a level of fast speeds is wide, and friction rises across it: as spread that would be noise which is
    # none
    rest = friction - friction.mean() - slope * v
    # the line took two degrees of freedom; a level has `SAMPLES_PER_LEVEL` rows at least
    return float(np.sqrt(rest @ rest / (len(rest) - 2)))


def _parts(samples: FrictionSamples) -> np.ndarray:
    """Number of the stretch of time of each sample: `PARTS` of equally many, logs one after the other."""
    log = samples.columns.get("log", np.zeros(len(samples.time_s)))
    # the last key leads: log by log, and by time within
    order = np.lexsort((samples.time_s, log))
    part = np.empty(len(order), dtype=int)
    part[order] = np.arange(len(order)) * PARTS // len(order)
    return part


def _between(friction: np.ndarray, part: np.ndarray) -> float:
    """Standard deviation of friction between stretches of time, N m; NaN of fewer than two."""
    medians = [float(np.median(friction[part == one])) for one in np.unique(part)]
    # NaN and not 0: one stretch says nothing of another session, and 0 would claim that nothing differs
    return float(np.std(medians, ddof=1)) if len(medians) > 1 else math.nan


def _levels(
    speed: np.ndarray, log: np.ndarray | None, most: int, load_nm: np.ndarray | None = None
) -> list[np.ndarray]:
    """Rows of each level of one direction: `most` of them of one log, of several about as many together."""
    if load_nm is not None:
        # of fewer speeds each, or a level of a slow joint would have no row of some loads
        whole = _levels(speed, log, max(2 * most // LOADS, 1))
        by_load = (level[np.argsort(load_nm[level], kind="stable")] for level in whole)
        parts = (np.array_split(each, min(LOADS, max(len(each) // SAMPLES_PER_LEVEL, 1))) for each in by_load)
        return [part for level in parts for part in level]
    # stable: equal speeds keep the order of time, so that the same file gives the same points everywhere
    order = np.argsort(speed, kind="stable")
    names = np.unique(log) if log is not None else np.zeros(0)
    if log is None or len(names) < 2:
        return np.array_split(order, min(most, len(order) // SAMPLES_PER_LEVEL))
    found = []
    for name in names:
        mine = order[log[order] == name]
        # a log of a few rows gives fewer levels, or none, rather than levels that know no spread
        count = min(max(LEVELS_OF_A_LOG, most // len(names)), len(mine) // SAMPLES_PER_LEVEL)
        found += np.array_split(mine, count) if count else []
    return found


def _of_level(name: str, values: np.ndarray) -> float:
    """What a column says of a whole level; NaN where it differs within."""
    if name in COLUMNS and COLUMNS[name].of_levels:
        return float(values.mean())
    return float(values[0]) if (values == values[0]).all() else math.nan


def pool(parts: list[FrictionSamples]) -> FrictionSamples:
    """Samples of several logs as one set, each with its number as `log`; the checksum is that of their
    checksums."""
    if len(parts) == 1:
        return parts[0]
    # a column that one of the logs lacks would be half empty, and levels average over logs
    names = set.intersection(*(set(part.columns) for part in parts))
    # sorted: sets have no order, and a file of points must come out alike each time
    columns = {name: np.concatenate([part.columns[name] for part in parts]) for name in sorted(names)}
    numbers = [np.full(len(part.time_s), float(k)) for k, part in enumerate(parts)]
    return FrictionSamples(
        time_s=np.concatenate([part.time_s for part in parts]),
        velocity_rad_s=np.concatenate([part.velocity_rad_s for part in parts]),
        friction_nm=np.concatenate([part.friction_nm for part in parts]),
        source=", ".join(part.source for part in parts),
        sha256=hashlib.sha256("".join(part.sha256 for part in parts).encode()).hexdigest(),
        columns={"log": np.concatenate(numbers)} | columns,
    )
