"""Whether a log can be what its map of columns says: units, sign, clipping, the rig file if there is one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hw.playback.reader import Recording
from rtctl.errors import DataError
from rtctl.friction.logs.dead_band import dead_band
from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.torque_faults import faults, lost_sign, much, require_on, require_two

if TYPE_CHECKING:
    from rtctl.friction.logs.regression import JointFit
    from rtctl.rig_file.axis_tables import AxisTable

BEYOND = 1.25
"""A log may go beyond a limit of the rig file by this factor: noise, a hand quicker than the motor."""

TRAVEL_SLACK_RAD, TRAVEL_SLACK_M = 0.05, 0.005
"""By how much a log may leave the travel: stops give way."""

TORQUE_SHARE_MIN = 1e-3
"""Torque below this share of the rig's limit moves no joint that has friction."""

RATE_LEAST_HZ, RATE_MOST_HZ = 4.0, 2e5
"""Rates of logs of a joint; beyond them the unit of the time is wrong."""

COUNTS_LEAST = 50
"""Whole numbers over a range of twice as many are no radians."""

HARDLY_KNOWN = 0.5
"""Half width of the inertia's interval, share of it, from which on the motion is said not to tell it."""

STEADY_SHARE = 0.1
"""A velocity within this share of its usual largest of the position's may stand still."""

OFFSET_SHARE = 0.1
"""An offset of a motor torque above this share of the Coulomb friction is worth a word."""

FRICTION_SHARE = 0.42
"""Friction at the largest speed below this share of the torque, RMS, is worth a word: that of geared joints
is as large as it."""


@dataclass(frozen=True)
class Limits:
    """What a log must stay within: speed (rad/s), torques (N m), travel (rad). `source` says who set them."""

    speed_rad_s: float = 100.0
    motor_nm: float = 1e3
    external_nm: float = 1e3
    torque_least_nm: float = 0.0
    travel_rad: tuple[float, float] = (-np.inf, np.inf)
    doubtful_rad_s: float = 25.0
    doubtful_nm: float = 30.0
    doubtful_kgm2: float = 5.0
    """Beyond these a log is taken with a warning; a rig file knows better."""
    source: str = "any hand-held joint"

    @classmethod
    def of_axis(cls, axis: AxisTable, path: Path | str) -> Limits:
        """The limits of an axis of the rig file `path`."""
        lever_m = float(np.linalg.norm(axis.lever_m))  # no direction of a force turns the joint by more
        slack = TRAVEL_SLACK_M if axis.motion == "linear" else TRAVEL_SLACK_RAD
        return cls(
            speed_rad_s=BEYOND * axis.velocity_limit_rad_s,
            motor_nm=BEYOND * axis.torque_limit_nm,
            external_nm=BEYOND * axis.force.limit_n * lever_m,
            torque_least_nm=TORQUE_SHARE_MIN * axis.torque_limit_nm,
            travel_rad=(axis.position_min_rad - slack, axis.position_max_rad + slack),
            doubtful_rad_s=np.inf,
            doubtful_nm=np.inf,
            doubtful_kgm2=np.inf,
            source=f"{axis.name or 'the axis'} of {path}",
        )


ANY_LINEAR = Limits(
    speed_rad_s=50.0,
    motor_nm=1e6,
    external_nm=1e5,
    doubtful_rad_s=5.0,
    doubtful_nm=5e3,
    doubtful_kgm2=1e3,
    source="any linear axis",
)
"""What a log of a linear axis of which nothing is known must stay within, m/s, N and kg."""


def plausible(
    recording: Recording, log: AxisLog, motor_nm: np.ndarray | None, limits: Limits
) -> tuple[str, ...]:
    """Refuse a log whose signals cannot be right, with column and remedy; warnings about doubtful ones.

    Raises
    ------
    DataError
        Speed, travel or torque beyond `limits`, a torque too small to move anything, or constant."""
    _require_rate(log)
    _require_motion(log, limits)
    external = None if recording.hand_torque_nm is None else recording.hand_torque_nm[:, 0]
    if np.ptp(log.torque_nm) == 0:
        if motor_nm is not None and external is not None:
            require_two(motor_nm, external, log.source)
        raise DataError(f"{log.source}: the torque is constant; map the column that was measured")
    warnings = _doubtful_motion(log, limits)
    for name, signal, most in (
        ("motor torque", motor_nm, limits.motor_nm),
        ("external torque", external, limits.external_nm),
    ):
        if signal is None:
            continue
        largest = float(np.abs(signal).max())
        if largest > most:
            raise DataError(
                f"{log.source}: {name}: {largest:.3g} N m is not plausible (at most {most:.4g} for "
                f"{limits.source}); correct the unit of the torque, or the torque constant and the gearing"
            )
        where, off = f"{log.where}: {name}", signal == 0 if name == "motor torque" else None
        alone = motor_nm is None or external is None
        warnings += (*faults(signal, log.rate_hz, where, may_rest=off), *dead_band(signal, where))
        warnings += lost_sign(signal, log.position_rad, where) if alone else []
        if largest > limits.doubtful_nm:
            warnings.append(much(signal, where))
    warnings += _doubtful_velocity(log)
    if external is None and motor_nm is not None:
        require_on(motor_nm, log.position_rad, log.rate_hz, f"{log.where}: motor torque")
    elif external is not None and motor_nm is not None:
        require_two(motor_nm, external, log.source)
    largest = float(np.abs(log.torque_nm).max())
    if largest < limits.torque_least_nm:
        raise DataError(
            f"{log.source}: no torque above {largest:.3g} N m, which is not plausible (at least "
            f"{limits.torque_least_nm:.3g} for {limits.source}); correct the unit of the torque, or map the "
            "one that moved the joint"
        )
    return tuple(warnings)


def _require_rate(log: AxisLog) -> None:
    if not RATE_LEAST_HZ <= log.rate_hz <= RATE_MOST_HZ:
        raise DataError(
            f"{log.source}: column time: one row every {1 / log.rate_hz:.3g} s is not plausible "
            f"({1 / RATE_MOST_HZ:.2g} to {1 / RATE_LEAST_HZ:.2g} s); correct the unit of the time (s, ms, "
            "us, ns, min, h, days)"
        )


def _doubtful_motion(log: AxisLog, limits: Limits) -> list[str]:
    x, told = log.position_rad, []
    speed = largest_speed(log.position_rad, log.rate_hz)
    if speed > limits.doubtful_rad_s:
        told.append(
            f"{log.source}: column position: {speed:.3g} rad/s is quick for what a hand moves: is "
            "it in deg or mm, or of the motor before the gear (scale 1/ratio)? Correct it, or give --config "
            "RIG, whose limits count then"
        )
    if len(x) > 100 and np.ptp(x) > 2 * COUNTS_LEAST and np.all(x == np.round(x)):
        raise DataError(
            f"{log.source}: column position: all values are whole numbers, {x.min():.0f} to {x.max():.0f} "
            "rad: they are counts, or deg; give the unit (counts needs --counts-per-rev)"
        )
    return told


def _doubtful_velocity(log: AxisLog) -> list[str]:
    """What is wrong with a recorded velocity; it may stand still where the position goes by it."""
    velocity = log.velocity_rad_s
    if velocity is None:
        return []
    stride = max(1, round(0.05 * log.rate_hz))  # 50 ms: of row to row it is the encoder
    at = np.arange(len(velocity))
    before, after = np.maximum(at - stride, 0), np.minimum(at + stride, len(at) - 1)
    by_position = (log.position_rad[after] - log.position_rad[before]) * log.rate_hz / (after - before)
    usual = float(np.quantile(np.abs(velocity), 0.95))
    steady = np.abs(velocity - by_position) < STEADY_SHARE * usual
    return faults(velocity, log.rate_hz, f"{log.where}: column velocity", may_rest=steady, unit="rad/s")


def largest_speed(x: np.ndarray, rate_hz: float) -> float:
    """Largest mean speed over 50 ms of a position (n,), rad/s."""
    stride = max(1, round(0.05 * rate_hz))
    return float(np.abs(x[stride:] - x[:-stride]).max(initial=0.0)) * rate_hz / stride


def _require_motion(log: AxisLog, limits: Limits) -> None:
    x, speed = log.position_rad, largest_speed(log.position_rad, log.rate_hz)
    if speed > limits.speed_rad_s:
        raise DataError(
            f"{log.source}: column position: {speed:.3g} rad/s is not plausible (at most "
            f"{limits.speed_rad_s:.4g} for {limits.source}); correct the unit of the position (deg, mm, "
            "counts) or of the time; of a motor before a gear it is what the scale 1/ratio makes of it"
        )
    low, high = limits.travel_rad
    if x.min() < low or x.max() > high:
        raise DataError(
            f"{log.source}: column position: {x.min():.4g} to {x.max():.4g} rad leaves the travel {low:.4g} "
            f"to {high:.4g} rad of {limits.source}; correct the unit of the position, or its offset"
        )


def doubtful_parameters(fit: JointFit, limits: Limits) -> tuple[str, ...]:
    """An inertia that no hand would want to move (a wrong unit), and what the motion does not tell."""
    found = fit.symmetric.parameters["inertia_kgm2"]
    inertia = found.value
    told: tuple[str, ...] = ()
    if found.high - inertia > HARDLY_KNOWN * inertia:
        told = (
            f"this motion hardly tells the inertia ({found.low:.3g} to {found.high:.3g} kg m^2), as where a "
            "joint slides evenly; the friction points need the inertia little, everything else does: "
            "record brisk motion of changing speed besides",
        )
    coulomb = fit.symmetric.parameters["coulomb_nm"]
    if coulomb.high - coulomb.value > HARDLY_KNOWN * abs(coulomb.value):
        told = (
            *told,
            f"this log hardly tells the Coulomb friction ({coulomb.low:.3g} to {coulomb.high:.3g} N m), and "
            "the friction points may err by as much: record slower motion of longer strokes besides",
        )
    if inertia <= limits.doubtful_kgm2:
        return told
    return (
        *told,
        f"the inertia, {inertia:.3g} kg m^2, is much for what a hand moves: correct the unit of the "
        "torque (mN m?), of the position (deg, mm, counts) or of the time, or give --config RIG, which "
        "counts then",
    )


def doubtful_friction(fit: JointFit) -> tuple[str, ...]:
    """Little friction: what is called torque may have it taken off already."""
    found, rms = fit.symmetric.parameters, fit.symmetric.rms_nm / max(fit.symmetric.relative_error, 1e-12)
    weights = [found[each.parameter].value ** 2 for each in fit.offsets]
    rms = math.sqrt(max(rms**2 - float(np.mean(weights)), 0.0))  # what pulls moves nothing
    speed = max(each.highest_rad_s for each in fit.speeds)
    friction = found["coulomb_nm"].value + max(0.0, found["viscous_nms_rad"].value) * speed
    if friction > FRICTION_SHARE * rms:
        return ()
    return (
        f"little of the torque is friction ({friction:.3g} N m at {speed:.3g} rad/s, the torque is "
        f"{rms:.3g} N m RMS about its offset): a joint on air, or a column that has the friction taken off "
        "already (a drive that compensates it, an observer's torque of the load); map the current or the "
        "torque that the motor made",
    )


def doubtful_offsets(fit: JointFit) -> tuple[str, ...]:
    """Offsets of a motor torque that are taken out as its zero, or as the pull of a spring, and may be a
    difference between the directions as well: nothing in a log tells."""
    found, told = fit.symmetric.parameters, []
    coulomb = found["coulomb_nm"].value  # where a joint hardly rubs it may come out below 0
    for each in fit.offsets:
        offset = found[each.parameter]
        if not offset.holds(0.0) and abs(offset.value) > OFFSET_SHARE * coulomb:
            share = f"{100 * abs(offset.value) / coulomb:.0f} % of the" if coulomb > 0 else "beside no"
            of = "as the zero of the motor torque: where that zero is right, friction differs by so much "
            of += "between the directions (or a weight pulls)"
            if any(name.startswith(("stiffness", "gravity")) for name in found):
                of = "as the pull of what goes by the place at the mean position (a preload, a weight) and "
                of += "the zero of the motor torque: a difference of friction between the directions may be "
                of += "in it"
            told.append(
                f"{each.source}: an offset of {offset.value:.3g} N m, {share} Coulomb friction, is taken out "
                f"of the points {of}: --keep-offset leaves it in; until --offset-is-zero says that it is "
                "none, the points tell a fit that friction may be less by it"
            )
    return tuple(told)
