"""Recorded logs checked and made ready for the joint regression, and its result as friction samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from hw.interface import BackendError, Rig
from hw.motion import of_coordinate
from hw.plain_words import explain
from hw.playback.options import PlaybackOptions
from hw.playback.quantum import quantum
from hw.playback.reader import Recording, load_stretches
from rtctl.errors import ConfigError, DataError
from rtctl.friction.logs.clipping import plateaus
from rtctl.friction.logs.dynamics import AxisLog, Recorded
from rtctl.friction.logs.logs import FrictionSamples, axis_log
from rtctl.friction.logs.plausibility import ANY_LINEAR, Limits, largest_speed, plausible
from rtctl.friction.logs.regression import JointFit, offset_rows
from rtctl.friction.logs.regressors import SPAN_MIN_RAD, Regressors
from rtctl.friction.logs.row_faults import Rows, mended
from rtctl.friction.logs.signal_shift import advanced


@dataclass(frozen=True)
class Gearing:
    """What turns a motor current into a torque at the joint, and counts into an angle; of a linear axis as
    `hw.interface.Rig` has it."""

    torque_constant_nm_a: float = 1.0
    gear_ratio: float = 1.0
    gear_efficiency: float = 1.0
    counts_per_rev: float = 1.0
    motion: str = "rotary"
    lead_m: float = 0.0

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
        # below 0 is how `Rig.moves` tells a joint; 0 is a linear motor, which has no screw
        lead_m = np.array([self.lead_m if self.motion == "linear" else -1.0])
        return Rig(1, 1e-3, ratio, efficiency, constant, counts, np.zeros((1, 3)), lead_m=lead_m)

    def of_screw(self) -> Gearing:
        """Ratio and counts of a screw's turn, or of a metre where there is no lead, as those of the
        coordinate."""
        ratio, counts = of_coordinate(self.motion, self.lead_m)
        return replace(self, gear_ratio=self.gear_ratio * ratio, counts_per_rev=self.counts_per_rev * counts)


TOP_RAD_S = 2.0
"""Speed that logs of joints reach, as `rtctl identify` drives: the largest of a linear log stands for it."""


STRETCH_MIN_ROWS = 16
"""Fewest rows between two gaps that say anything."""


def read_log(
    options: Mapping[str, Any],
    gearing: Gearing | Rig,
    torque_delay_s: float | None = None,
    limits: Limits | None = None,
) -> tuple[AxisLog, ...]:
    """One axis of a log, motor torque plus external torque, ready for the regression: a part for each stretch
    between gaps.

    Parameters
    ----------
    options
        Validated options of the playback backend (`of_file`); the first axis is looked at.
    torque_delay_s
        How late the motor torque is recorded against the position. None: half a period.
    limits
        What is plausible. None: what is for any hand-held joint.

    Raises
    ------
    DataError
        Faults of the file, time of which no even rate can be made, constant torque, implausible units.

    Notes
    -----
    A current measured at slot k was held since slot k - 1, so on average it is half a period old. The
    external torque of a sensor is taken as of its own instant. What a longer delay leaves without torque at
    the ends of the log is cut off. A stretch in which nothing moves, or nearly empty, is left out if there
    are others."""
    rig = gearing.rig() if isinstance(gearing, Gearing) else gearing
    recorded: list[Recorded] = []

    def mended_rows(
        path: Path, time_s: np.ndarray | None, position: np.ndarray, beside: dict[str, np.ndarray]
    ) -> tuple[str, ...]:
        # before anything is mended: a curve through held values differs from one copy to the next
        since_s = None if time_s is None else time_s - time_s[0]
        columns = {name: column[:, 0].copy() for name, column in beside.items()}
        recorded.append(Recorded(since_s, position[:, 0].copy(), columns))
        return mend(path, time_s, position, beside)

    try:
        stretches = load_stretches(options, rig, mended_rows)
    except BackendError as error:
        raise DataError(str(error)) from error
    # by all stretches: each with its own would have rows of one log judged by two thresholds
    radian = radian_of(stretches, rig)
    least = SPAN_MIN_RAD * radian
    # a rest before the motion is no fault of a log, and would be refused as "hardly any motion"
    moving = [one for one in stretches if len(one) >= STRETCH_MIN_ROWS and np.ptp(one.position_rad) > least]
    return tuple(
        replace(aligned(one, rig, torque_delay_s, limits), radian=radian, recorded=recorded[0])
        # where nothing moves the longest is read all the same: its refusal says what is wrong with the file
        for one in moving or sorted(stretches, key=len)[-1:]
    )


def radian_of(stretches: Sequence[Recording], rig: Rig) -> float:
    """What stands for a radian in the thresholds of the logs: of a linear axis half of the travel that its
    largest speed makes in 1 s.

    Not a radian of its screw: a carriage at .2 m/s on a lead of 5 mm turns it at 250 rad/s, and what is slow
    for a joint, .03 rad/s, would be 24 um/s, where bristles still bend."""
    if rig.moves(0)[0] != "linear":
        return 1.0
    speeds = [largest_speed(one.position_rad[:, 0], one.rate_hz) for one in stretches]
    # 1: nothing moved at all, which is refused with the range of the position
    return max(speeds) / TOP_RAD_S or 1.0


def of_one_radian(read: Sequence[Sequence[AxisLog]]) -> list[tuple[AxisLog, ...]]:
    """Several logs with the thresholds of the quickest of them."""
    # one carriage has one scale: a slow log beside a quick one is slow, and not as quick in its own units
    radian = max(stretch.radian for stretches in read for stretch in stretches)
    return [tuple(replace(stretch, radian=radian) for stretch in stretches) for stretches in read]


def mend(
    path: Path, time_s: np.ndarray | None, position: np.ndarray, beside: dict[str, np.ndarray]
) -> tuple[str, ...]:
    """Mend held columns, spikes, jumps and repeated rows of the first axis in place
    (`rtctl.friction.logs.row_faults`); what was done."""
    rows = Rows(str(path), time_s, position[:, 0], {name: column[:, 0] for name, column in beside.items()})
    return tuple(mended(rows).notes)


def aligned(
    recording: Recording, rig: Rig, torque_delay_s: float | None = None, limits: Limits | None = None
) -> AxisLog:
    """One stretch, checked, its motor torque put back by its delay; parameters and errors as of
    `read_log`."""
    # without a rig file: m and N of a carriage have other usual sizes than rad and N m
    limits = limits or (ANY_LINEAR if rig.moves(0)[0] == "linear" else Limits())
    log = axis_log(recording, rig)
    motor = None if recording.current_a is None else axis_log(recording, rig, use="motor").torque_nm
    external = None if recording.hand_torque_nm is None else recording.hand_torque_nm[:, 0]
    # each torque by itself, and before anything shifts or adds it: equal values are only seen as recorded
    flat = tuple(
        one
        for name, signal in (("motor torque", motor), ("external torque", external))
        if signal is not None
        for one in plateaus(signal, f"{log.where}: {name}")
    )
    step_nm = max((quantum(each) for each in (motor, external) if each is not None), default=0.0)
    notes = (*log.notes, *plausible(recording, log, motor, limits))
    log = replace(log, notes=notes, plateaus=flat, torque_step_nm=step_nm)
    if motor is None:
        return log
    # a value held over the period before its row is half a period old on average
    delay_s = 0.5 / log.rate_hz if torque_delay_s is None else torque_delay_s
    rest = log.torque_nm - motor
    in_time = rest + advanced(motor, log.rate_hz, delay_s)
    # the hand's sensor was read at its row: only the motor's torque is put back
    both = rest if external is not None else None
    # behind these rows no torque is known: `advanced` repeats the last one there
    return _without_ends(replace(log, torque_nm=in_time, external_nm=both), abs(round(delay_s * log.rate_hz)))


def require_different(logs: Sequence[AxisLog]) -> None:
    """Refuse a log given twice, whatever its name: it would narrow the intervals without adding anything.

    Raises
    ------
    DataError
        Names both files."""
    first: dict[str, str] = {}
    for log in logs:
        # by its bytes: the same log under two names would halve every interval's square
        if log.sha256 in first:
            raise DataError(f"{log.source}: the same log as {first[log.sha256]}; give each log once")
        first[log.sha256] = log.source


def _without_ends(log: AxisLog, samples: int) -> AxisLog:
    """The log without so many samples at both ends."""
    kept = slice(samples, len(log.position_rad) - samples)
    velocity, external = log.velocity_rad_s, log.external_nm
    return replace(
        log,
        position_rad=log.position_rad[kept],
        torque_nm=log.torque_nm[kept],
        velocity_rad_s=None if velocity is None else velocity[kept],
        external_nm=None if external is None else external[kept],
        start_s=log.start_s + samples / log.rate_hz,
    )


def samples(
    signals: Regressors,
    fit: JointFit,
    sha256: str,
    *,
    remove_offset: bool,
    zero_known: bool = False,
    inertia_kgm2: float | None = None,
) -> FrictionSamples:
    """Friction of the sliding rows: torque - inertia * acceleration (- offset and its drift).

    An offset that was removed may be a difference between the directions: unless `zero_known`, the samples
    carry it as `zero_doubt_nm`. `inertia_kgm2` None: that of the fit."""
    found = fit.symmetric.parameters
    rows = signals.sliding
    # viscous friction stays in: it is part of the curve that is learned of these points
    inertia = found["inertia_kgm2"].value if inertia_kgm2 is None else inertia_kgm2
    friction = signals.torque_nm - inertia * signals.acceleration_rad_s2
    for name, column in signals.by_place.items():
        friction = friction - found[name].value * column
    if remove_offset:
        friction = friction - offset_rows(signals, fit)
    beside = {"position_rad": signals.position_rad[rows], "log": signals.log[rows].astype(float)}
    if remove_offset and not zero_known:
        # all of it: the two directions may differ by twice an offset, one of them being less by all of it
        doubt = np.array([abs(found[each.parameter].value) for each in fit.offsets])
        beside["zero_doubt_nm"] = doubt[signals.log[rows]]
    return FrictionSamples(
        signals.time_s[rows], signals.velocity_rad_s[rows], friction[rows], signals.source, sha256, beside
    )


def of_file(options: Mapping[str, Any], file: Path) -> dict[str, Any]:
    """Options for the same columns in another file, read whole: window and repetition belong to the file they
    were set for.

    Raises
    ------
    ConfigError
        There is no such file."""
    # a window of another file would cut this one somewhere
    table = {**options, "file": str(file), "start_s": 0.0, "end_s": None, "loop": False}
    try:
        return PlaybackOptions.model_validate(table, context={"folder": Path.cwd()}).model_dump(mode="json")
    except ValidationError as error:
        faults = (f"{told.where}: {told.text}" for told in explain(error, PlaybackOptions, table))
        raise ConfigError(f"{file}: {'; '.join(faults)}") from error


def options_of(
    file: Path, columns: Mapping[str, Any], rate_hz: float | None, text: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Options of the playback reader for one file. `columns`: role -> option table; `text`: `delimiter` and
    `decimal`, if given.

    Raises
    ------
    ConfigError
        A table or a file that cannot be."""
    axis = {name: table for name, table in columns.items() if name != "time"}
    time = {} if rate_hz else {"time": columns.get("time", {"column": "time_s"})}
    return of_file({**time, "rate_hz": rate_hz, "axis": [axis], **(text or {})}, file)
