"""Recordings of a joint in motion, looked at as `rtctl identify --log` does, and the friction points in them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hw.interface import Rig
from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.log_checks import diagnose
from rtctl.friction.logs.log_input import Gearing, options_of, read_log, require_different, samples
from rtctl.friction.logs.logs import level_points
from rtctl.friction.logs.regression import JointFit, joint_fit
from rtctl.friction.logs.regressors import Regressors, cutoff_for, of_stretches, pooled
from rtctl.friction.points.measured import FrictionPoints

SPEED_MIN_RAD_S = 0.03


@dataclass(frozen=True)
class Checked:
    """Logs that can be used: stretches of each, signals and regression of all together, and what is to be said of them."""

    logs: tuple[tuple[AxisLog, ...], ...]
    signals: Regressors
    fit: JointFit
    warnings: tuple[str, ...]


def checked(
    options: Sequence[Mapping[str, Any]],
    gearing: Gearing | Rig,
    cutoff_hz: float | None = None,
    speed_min_rad_s: float = SPEED_MIN_RAD_S,
) -> Checked:
    """Read logs (validated options of the reader, one axis each) and look for all that makes their friction wrong.

    `cutoff_hz` None: what suits their rates.

    Raises
    ------
    DataError
        What `rtctl identify --log` refuses (docs/logs.md), a log given twice.
    """
    read = tuple(read_log(each, gearing) for each in options)
    parts = [stretches[0] for stretches in read]
    require_different(parts)
    cutoff_hz = cutoff_hz or cutoff_for(parts)
    signals = pooled([of_stretches(stretches, cutoff_hz, speed_min_rad_s) for stretches in read])
    told = diagnose(read, signals, speed_min_rad_s)
    fit = joint_fit(signals)
    return Checked(read, signals, fit, (*fit.warnings, *told))


def points_of_logs(
    files: Sequence[Path], columns: Mapping[str, Any], gearing: Gearing
) -> tuple[FrictionPoints, tuple[str, ...]]:
    """Points of all logs, each of known log, and the warnings about them.

    Parameters
    ----------
    columns
        Role of the reader -> option table.

    Raises
    ------
    ConfigError, DataError
        What `rtctl identify --log` refuses.
    """
    found = checked([options_of(file, columns, None) for file in files], gearing)
    digests = "".join(stretches[0].sha256 for stretches in found.logs)
    sha256 = hashlib.sha256(digests.encode()).hexdigest()
    return level_points(samples(found.signals, found.fit, sha256, remove_offset=True)), found.warnings
