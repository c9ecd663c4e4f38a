"""Recorded logs checked and made ready for the joint regression, and its result as friction samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from hw.interface import BackendError, Rig
from hw.playback.options import PlaybackOptions
from hw.playback.reader import Recording
from hw.playback.reader import load as load_recording
from rtctl.errors import ConfigError, DataError
from rtctl.friction.dynamics import AxisLog
from rtctl.friction.logs import FrictionSamples, axis_log
from rtctl.friction.regression import JointFit, offset_rows
from rtctl.friction.regressors import Regressors, advanced

SPEED_MAX_RAD_S = 100.0
"""A hand-held joint is slower: beyond it the unit of the position or of the time is wrong."""

TORQUE_MAX_NM = 1e3
"""Beyond it the unit of the torque is wrong."""

CLIPPED_RUN = 20
"""As many equal extreme values in a row are a signal that was cut off, unless it has few levels anyway."""

LEVELS_MIN = 32


@dataclass(frozen=True)
class Gearing:
    """What turns a motor current into a torque at the joint, and counts into an angle."""

    torque_constant_nm_a: float = 1.0
    gear_ratio: float = 1.0
    gear_efficiency: float = 1.0
    counts_per_rev: float = 1.0

    def rig(self) -> Rig:
        """One axis of it, for the reader; its period is not used."""
        ratio, efficiency, constant, counts = (
            np.array([value])
            for value in (
                self.gear_ratio,
                self.gear_efficiency,
                self.torque_constant_nm_a,
                self.counts_per_rev,
            )
        )
        return Rig(1, 1e-3, ratio, efficiency, constant, counts, np.zeros((1, 3)))


def read_log(options: Mapping[str, Any], gearing: Gearing, torque_delay_s: float | None = None) -> AxisLog:
    """One axis of a log, motor torque plus external torque, ready for the regression.

    Parameters
    ----------
    options
        Validated options of the playback backend (`of_file`), one axis.
    torque_delay_s
        How late the motor torque is recorded against the position. None: half a period.

    Raises
    ------
    DataError
        Faults of the file, uneven time, clipped or constant torque, implausible units.

    Notes
    -----
    A current measured at slot k was held since slot k - 1, so on average it is half a period old. The
    external torque of a sensor is taken as of its own instant.
    """
    rig = gearing.rig()
    try:
        recording = load_recording(options, rig)
    except BackendError as error:
        raise DataError(str(error)) from error
    log = axis_log(recording, rig)
    _require_plausible(recording, log)
    if recording.current_a is None:
        return log
    motor = axis_log(recording, rig, use="motor").torque_nm
    _require_unclipped(motor, f"{log.source}: motor torque")
    delay_s = 0.5 / log.rate_hz if torque_delay_s is None else torque_delay_s
    return replace(log, torque_nm=log.torque_nm - motor + advanced(motor, log.rate_hz, delay_s))


def _require_plausible(recording: Recording, log: AxisLog) -> None:
    x = log.position_rad
    stride = max(1, round(0.05 * log.rate_hz))
    speed = float(np.abs(x[stride:] - x[:-stride]).max(initial=0.0)) * log.rate_hz / stride
    if speed > SPEED_MAX_RAD_S:
        raise DataError(
            f"{log.source}: column position: {speed:.3g} rad/s is not plausible (at most {SPEED_MAX_RAD_S:g}); "
            "correct the unit of the position (deg, counts) or of the time"
        )
    largest = float(np.abs(log.torque_nm).max())
    if largest > TORQUE_MAX_NM:
        raise DataError(
            f"{log.source}: {largest:.3g} N m of torque is not plausible (at most {TORQUE_MAX_NM:g}); correct the "
            "unit of the torque, or the torque constant and the gearing"
        )
    if np.ptp(log.torque_nm) == 0:
        raise DataError(f"{log.source}: the torque is constant; map the column that was measured")
    if recording.hand_torque_nm is not None:
        _require_unclipped(recording.hand_torque_nm[:, 0], f"{log.source}: external torque")


def _require_unclipped(signal: np.ndarray, where: str) -> None:
    """Refuse a signal that stays at its largest or smallest value: the sensor or the drive cut it off."""
    if len(np.unique(signal)) < LEVELS_MIN:
        return  # a coarse or resting signal repeats its extremes by nature
    for extreme in (signal.max(), signal.min()):
        at = np.concatenate([[0], (signal == extreme).astype(int), [0]])
        begins, ends = np.flatnonzero(np.diff(at) > 0), np.flatnonzero(np.diff(at) < 0)
        longest = int(np.argmax(ends - begins))
        if ends[longest] - begins[longest] >= CLIPPED_RUN:
            raise DataError(
                f"{where}: clipped at {extreme:.4g} N m for {ends[longest] - begins[longest]} samples from row "
                f"{begins[longest] + 1} on; raise the range of the sensor, or move less briskly"
            )


def samples(signals: Regressors, fit: JointFit, sha256: str, *, remove_offset: bool) -> FrictionSamples:
    """Friction of the sliding rows: torque - inertia * acceleration (- offset and its drift)."""
    found = fit.symmetric.parameters
    rows = signals.sliding
    friction = signals.torque_nm - found["inertia_kgm2"].value * signals.acceleration_rad_s2
    if remove_offset:
        friction = friction - offset_rows(signals, fit)
    return FrictionSamples(
        signals.time_s[rows], signals.velocity_rad_s[rows], friction[rows], signals.source, sha256
    )


def of_file(options: Mapping[str, Any], file: Path) -> dict[str, Any]:
    """The same columns in another file, whole: window and repetition belong to the file they were set for.

    Raises
    ------
    ConfigError
        There is no such file.
    """
    table = {**options, "file": str(file), "start_s": 0.0, "end_s": None, "loop": False}
    try:
        return PlaybackOptions.model_validate(table, context={"folder": Path.cwd()}).model_dump(mode="json")
    except ValidationError as error:
        faults = tuple(fault["msg"] for fault in error.errors(include_url=False))
        raise ConfigError(f"{file}: {'; '.join(faults)}", faults) from error


def options_of(file: Path, columns: Mapping[str, Any], rate_hz: float | None) -> dict[str, Any]:
    """Options of the playback reader for one file. `columns`: role -> option table.

    Raises
    ------
    ConfigError
        A table or a file that cannot be.
    """
    axis = {name: table for name, table in columns.items() if name != "time"}
    time = {} if rate_hz else {"time": columns.get("time", {"column": "time_s"})}
    return of_file({**time, "rate_hz": rate_hz, "axis": [axis]}, file)
