"""Recordings of a joint in motion, looked at as `rtctl identify --log` does, and the friction points in
them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from hw.interface import Rig
from rtctl.errors import DataError, of_file
from rtctl.friction.logs.copied_rows import counted_once
from rtctl.friction.logs.dynamics import SAMPLES_MIN, SPEED_MIN_RAD_S, AxisLog
from rtctl.friction.logs.log_checks import clipped_logs, diagnose, external_of, with_coarseness
from rtctl.friction.logs.log_input import (
    Gearing,
    of_one_radian,
    options_of,
    read_log,
    require_different,
    samples,
)
from rtctl.friction.logs.logs import FrictionSamples, level_points
from rtctl.friction.logs.plausibility import Limits
from rtctl.friction.logs.presliding_in_logs import presliding_of_logs
from rtctl.friction.logs.regression import JointFit, joint_fit, taken_late
from rtctl.friction.logs.regressors import SETTLE_RAD, Regressors, cutoff_for, of_stretches, pooled
from rtctl.friction.logs.speeds_seen import below_the_slowest
from rtctl.friction.logs.springs import Spring, hidden, spring_in
from rtctl.friction.logs.taken_off import taken_off
from rtctl.friction.logs.torque_shape import with_share
from rtctl.friction.logs.two_shares import with_share_of_two
from rtctl.friction.logs.waves import without_waves
from rtctl.friction.points import FrictionPoints
from rtctl.friction.presliding import Presliding

# at .01 rad for all, bristles of 30 mrad made viscous friction 35 % too large, now .7 (decision 0080)
SETTLE_LENGTHS = 5.0
"""Presliding lengths behind a turn after which bristles are bent: all but e^-5 of those that bend as LuGre's
do."""

ONE_RATE = 1.01
"""Rates of logs that are so near to each other are one: what stamps of one device make of it."""

MEASURED_TOGETHER = (
    "the motor torque was measured at the instants of the position, and is taken so: put back by half a "
    "period, as a command that is held would be, it looks that much early (--torque-delay says otherwise)"
)

HELD_ON = (
    "the motor torque is the command that each row begins, held until the next row, and is taken so: put "
    "back by half a period, as one that was held until its row, it looks a whole period early "
    "(--torque-delay says otherwise)"
)


@dataclass(frozen=True)
class InTime:
    """Logs whose torques are of the instants of the position: stretches of each, all together, and how that
    was come by.

    `torque_delays_s` is what the motor's torque of each log was put back by. `notes` are warnings; `taken` is
    what was put right and leaves nothing to do, `untold` what such a log cannot tell, `bent` the presliding
    length of all together. `options` are those of the logs that are used: of several, one whose torque is
    clipped is left out."""

    logs: tuple[tuple[AxisLog, ...], ...]
    signals: Regressors
    cutoff_hz: float
    speed_min_rad_s: float
    torque_delays_s: tuple[float, ...]
    notes: tuple[str, ...] = ()
    taken: tuple[str, ...] = ()
    untold: tuple[str, ...] = ()
    bent: Presliding | None = None
    options: tuple[Mapping[str, Any], ...] = ()


def read_in_time(
    options: Sequence[Mapping[str, Any]],
    gearing: Gearing | Rig,
    torque_delay_s: float | None = None,
    limits: Limits | None = None,
    cutoff_hz: float | None = None,
    speed_min_rad_s: float | None = None,
) -> InTime:
    """Read logs (validated options of the reader, one axis each).

    Parameters
    ----------
    torque_delay_s
        See `read_log`. None: half a period, or what `taken_late` finds.
    cutoff_hz
        None: what suits their rates.
    speed_min_rad_s
        None: `SPEED_MIN_RAD_S` times what stands for a radian of the axis.

    Raises
    ------
    DataError
        What cannot be read, a log given twice."""

    def read(delays_s: Sequence[float | None]) -> tuple[tuple[AxisLog, ...], ...]:
        found = []
        for each, delay_s in zip(options, delays_s, strict=True):
            with of_file(Path(each["file"])):
                found.append(read_log(each, gearing, delay_s, limits))
        return tuple(of_one_radian(found))

    def looked_at(
        logs: tuple[tuple[AxisLog, ...], ...],
    ) -> tuple[tuple[tuple[AxisLog, ...], ...], Regressors, Presliding | None]:
        # first of all: a turn on a spring is no turn of the friction alone
        spring = spring_in(_pool(logs, cutoff, slowest), logs, slowest)
        logs = spring.taken_out(logs) if spring else logs
        # before the rows are chosen: which of them slide goes by it (decision 0080)
        bent = presliding_of_logs([one for stretches in logs for one in stretches], cutoff, slowest)
        long = settled(logs, bent)
        signals = _signals_of(long, cutoff, slowest, spring)
        # strokes shorter than these bristles: rows that still bend a little are better than none
        if long is not logs and not signals.enough():
            return logs, _signals_of(logs, cutoff, slowest, spring), bent
        return long, signals, bent

    logs = read([torque_delay_s] * len(options))
    parts = [stretches[0] for stretches in logs]
    require_different(parts)
    cutoff = cutoff_for(parts, cutoff_hz)
    logs, copied = counted_once(logs, cutoff)
    slowest = SPEED_MIN_RAD_S * parts[0].radian if speed_min_rad_s is None else speed_min_rad_s
    logs, signals, bent = looked_at(logs)
    if clipped := clipped_logs(logs, signals, slowest):
        sound = [each for k, each in enumerate(options) if k not in clipped]
        found = read_in_time(sound, gearing, torque_delay_s, limits, cutoff_hz, speed_min_rad_s)
        return replace(found, notes=(*clipped.values(), *found.notes))
    driven = any(options[0]["axis"][0].get(name) for name in ("current", "motor_torque"))
    guessed, half_s = torque_delay_s is None and driven, [0.5 / part.rate_hz for part in parts]
    # the lateness is read off a torque put back by half a period, which is what most drives record
    halves = _halves(logs, signals, cutoff, slowest) if guessed else 1
    delays_s = [halves * one if torque_delay_s is None else torque_delay_s for one in half_s]
    taken = {0: (MEASURED_TOGETHER,), -1: (HELD_ON,)}.get(halves, ())
    if taken:
        # anew from the file: a torque that was shifted twice would be smoothed twice
        logs, signals, bent = looked_at(counted_once(read(delays_s), cutoff)[0])
    # what of half a period is a guess: a doubt where the log did not tell it (`other_readings`)
    held_s = halves * max(half_s) if guessed else 0.0
    signals = replace(signals, external_nm=external_of(logs, cutoff, slowest), held_s=held_s)
    signals, told, untold = _shared(signals)
    off, unseen = taken_off([one for stretches in logs for one in stretches], cutoff, slowest, signals.source)
    unknown = (*untold, *unseen, *hidden(signals), *below_the_slowest(signals))
    told = (*copied, *told, *off)
    return InTime(logs, signals, cutoff, slowest, tuple(delays_s), told, taken, unknown, bent, tuple(options))


def _halves(
    logs: Sequence[Sequence[AxisLog]], signals: Regressors, cutoff_hz: float, slowest_rad_s: float
) -> int:
    """By how many halves of its own period each torque is late: 1, 0 or -1 (`taken_late`), by the logs of the
    lowest rate, whose period shows most: of several rates together no delay is that of any."""
    slowest_hz = min(stretches[0].rate_hz for stretches in logs)
    mine = [stretches for stretches in logs if stretches[0].rate_hz < ONE_RATE * slowest_hz]
    half_s = 0.5 / slowest_hz
    if len(mine) < len(logs):
        signals = _signals_of(mine, cutoff_hz, slowest_rad_s)
    return round(taken_late(signals, half_s) / half_s)


def _pool(logs: Sequence[Sequence[AxisLog]], cutoff_hz: float, slowest_rad_s: float) -> Regressors:
    found = []
    for stretches in logs:
        with of_file(Path(stretches[0].source)):
            found.append(of_stretches(stretches, cutoff_hz, slowest_rad_s))
    return pooled(found)


def _signals_of(
    logs: Sequence[Sequence[AxisLog]], cutoff_hz: float, slowest_rad_s: float, spring: Spring | None = None
) -> Regressors:
    """Signals of logs that `spring` was taken out of, with its columns."""
    pool = without_waves(_pool(logs, cutoff_hz, slowest_rad_s), logs, slowest_rad_s)
    pool = spring.put_back(pool) if spring else pool
    step_nm = max(one.torque_step_nm for stretches in logs for one in stretches)
    return replace(with_coarseness(logs, pool, slowest_rad_s), torque_step_nm=step_nm)


def settled(
    logs: tuple[tuple[AxisLog, ...], ...], bent: Presliding | None
) -> tuple[tuple[AxisLog, ...], ...]:
    """Logs whose rows count as sliding only where bristles as long as that are bent; the same where that is
    what is usual."""
    if (
        bent is None
        or not bent.spread_rad
        or SETTLE_LENGTHS * bent.length_rad <= SETTLE_RAD * logs[0][0].radian
    ):
        return logs
    far = SETTLE_LENGTHS * bent.length_rad
    return tuple(tuple(replace(one, settle_rad=far) for one in stretches) for stretches in logs)


def _shared(signals: Regressors) -> tuple[Regressors, tuple[str, ...], tuple[str, ...]]:
    """The signals with friction as a share of the torque where the log tells it, with what is to be said."""
    v = signals.velocity_rad_s[signals.sliding]
    if min(int((v > 0).sum()), int((v < 0).sum())) < SAMPLES_MIN:
        return signals, (), ()
    external_nm = signals.external_nm
    try:
        return with_share(signals) if external_nm is None else with_share_of_two(signals, external_nm)
    except DataError:
        return signals, (), ()  # too short for intervals: the fit itself says so


@dataclass(frozen=True)
class Checked:
    """Logs that can be used: stretches of each, signals and regression of all together, what is to be said of
    them, and their presliding length, where they tell it."""

    logs: tuple[tuple[AxisLog, ...], ...]
    signals: Regressors
    fit: JointFit
    warnings: tuple[str, ...]
    bent: Presliding | None = None

    def samples(self, *, remove_offset: bool = True, inertia_kgm2: float | None = None) -> FrictionSamples:
        """Friction of the sliding rows (`rtctl.friction.logs.log_input.samples`)."""
        # of the checksums: no file is read once more
        digests = "".join(stretches[0].sha256 for stretches in self.logs)
        sha256 = hashlib.sha256(digests.encode()).hexdigest()
        return samples(self.signals, self.fit, sha256, remove_offset=remove_offset, inertia_kgm2=inertia_kgm2)


def checked(
    options: Sequence[Mapping[str, Any]],
    gearing: Gearing | Rig,
    cutoff_hz: float | None = None,
    speed_min_rad_s: float | None = None,
) -> Checked:
    """Read logs (validated options of the reader, one axis each) and look for all that makes their friction
    wrong.

    `cutoff_hz` and `speed_min_rad_s` as of `read_in_time`.

    Raises
    ------
    DataError
        What `rtctl identify --log` refuses (docs/logs.md), a log given twice."""
    found = read_in_time(options, gearing, cutoff_hz=cutoff_hz, speed_min_rad_s=speed_min_rad_s)
    told = diagnose(found.logs, found.signals)
    fit = joint_fit(found.signals)
    return Checked(found.logs, found.signals, fit, (*fit.warnings, *found.notes, *told), found.bent)


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
        What `rtctl identify --log` refuses."""
    found = checked([options_of(file, columns, None) for file in files], gearing)
    return level_points(found.samples()), found.warnings
