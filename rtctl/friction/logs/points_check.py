"""Whether friction points can be of the rig that a rig file describes: the units, above all."""

from __future__ import annotations

import math

import numpy as np

from hw.playback.quantum import quantum
from rtctl.errors import DataError
from rtctl.friction.logs.plausibility import ANY_LINEAR, Limits
from rtctl.friction.points import FrictionPoints, levels_of
from rtctl.rig_file.config import LoadedConfig

UNEQUAL = 0.3
"""Share of the friction by which the directions differ, on the median over speed, that is worth a word."""

SCATTER = 0.25
"""Share of the friction by which rows of one speed scatter, on the median over speed, that is worth a
word."""


SLOW_SHARE = 1e-6
"""Share of a doubtfully quick speed below which the quickest one is doubtful, too: a telescope is faster."""

REPEATS_LEAST = 3
"""Fewest points that repeat another one exactly that are worth a word."""

CHANCE = 2.0
"""Repeats that are told, over those that are expected by chance."""

LINE_ROWS = 3
"""A point and its two neighbours."""

DIGITS, UNEVEN = 0.02, 0.1
"""Rounding error of the friction, and its scatter from point to point, shares of it, that are worth a
word."""


def doubtful_points(points: FrictionPoints, *, known: bool) -> list[str]:
    """What makes points of other programs' columns look like something else than friction, in sentences that
    name the cause.

    A constant in the torque, gravity, a load or acceleration go into friction points unseen: nothing opposes
    them there, as the balance of `rtctl identify --log` does. `known`: a rig file says what speeds and
    torques there may be."""
    told = [*([] if known else _doubtful_units(points)), *_doubtful_rows(points)]
    (v, f), (w, g) = points.branch(1), points.branch(-1)
    # only where both were measured: beyond, a branch would be held at its end
    shared = v[(v >= w[0]) & (v <= w[-1])]
    if len(shared):
        # the median over speed: a peak that differs at one end is no zero that is off
        apart = float(np.median(np.interp(shared, v, f) - np.interp(shared, w, g)))
        share = abs(apart) / float(np.mean(np.concatenate([f, g])))
        if share > UNEQUAL:
            told.append(
                f"{points.source}: friction differs by {apart:.3g} N m between the directions, {share:.0%} "
                f"of it: a torque whose zero is off by {apart / 2:.3g} N m, a payload or a slope of the "
                "axis looks the same; take the zero away (the torque at rest), or take it for the joint's"
            )
    rows = np.concatenate([points.rows_of(direction) for direction in (1, -1)])
    spread = points.std_nm[rows] / points.friction_nm[rows]
    if np.isfinite(spread).any() and (scatter := float(np.nanmedian(spread))) > SCATTER:
        told.append(
            f"{points.source}: rows of one speed scatter by {scatter:.0%} of the friction: noise averages "
            "out, but acceleration, gravity, a load or a drifting zero do not; use steady speeds, or rtctl "
            "identify --log, which parts friction from them or says what it cannot"
        )
    return told


def _doubtful_rows(points: FrictionPoints) -> list[str]:
    """Points given twice, friction of few digits, and points that scatter."""
    told = []
    if again := _repeated(points):
        told.append(
            f"{points.source}: {again} of {len(points.friction_nm)} points repeat another one in speed and "
            "friction: they count as measured anew, and every interval is too narrow by it; give each once"
        )
    usual = float(np.median(points.friction_nm))
    step = quantum(points.friction_nm)
    if step / math.sqrt(12) > DIGITS * usual:
        told.append(
            f"{points.source}: friction of few digits: steps of {step:.3g} N m, {step / usual:.0%} of it; "
            "give more digits"
        )
    elif (scatter := _scatter(points)) > UNEVEN:  # whatever rows of one speed do: a mean hides what moved it
        told.append(
            f"{points.source}: the friction scatters by {scatter:.0%} from one speed to the next: average "
            "longer at each, or look for what else was in the torque (acceleration, gravity, a load, other "
            "places, a zero that wanders from run to run)"
        )
    return told


def _repeated(points: FrictionPoints) -> int:
    """How many points repeat another one to the last digit of all that was measured; 0 where as many would
    agree by chance, as those of set speeds do whose friction has three digits.

    Notes
    -----
    Two normal numbers of spread s that are rounded to steps q < s are equal with the probability
    q/(2 sqrt(pi) s): their difference has the spread sqrt(2) s, and its density at 0 is 1/(2 sqrt(pi) s)."""
    friction, others = points.friction_nm * points.direction, points.columns.items()
    # two files of one session differ by their number alone
    beside = [np.nan_to_num(column) for name, column in others if name != "log"]
    own, times = np.unique(
        np.column_stack([points.velocity_rad_s, friction, *beside]), axis=0, return_counts=True
    )
    # of each speed and direction: rest has both
    level = np.column_stack([own[:, 0], np.sign(own[:, 1])])
    of, values = np.unique(level, axis=0, return_inverse=True, return_counts=True)[1:]
    apart = own[:, 1] - (np.bincount(of, own[:, 1]) / values)[of]
    again = int(times.sum()) - len(own)
    by_chance = 0.0
    if apart.any():  # else nothing scatters, and what is the same was copied
        spread = math.sqrt(apart @ apart / (len(own) - len(values)))
        rows = np.bincount(of, times)
        pairs = float((rows * (rows - 1) / 2).sum())
        by_chance = pairs * quantum(points.friction_nm) / (2 * math.sqrt(math.pi) * spread)
    return again if again >= REPEATS_LEAST + CHANCE * by_chance else 0


def _scatter(points: FrictionPoints) -> float:
    """Robust standard deviation of a point about the line through its neighbours in speed, share of the
    friction."""
    off = []
    for rows in _runs(points):  # repeats of a speed in the order they were measured in
        rows = rows[np.argsort(levels_of(np.abs(points.velocity_rad_s[rows])), kind="stable")]
        v, f = np.abs(points.velocity_rad_s[rows]), points.friction_nm[rows]
        wide = v[2:] - v[:-2]
        share = np.divide(v[1:-1] - v[:-2], wide, out=np.full(len(wide), 0.5), where=wide > 0).clip(0, 1)
        line = f[:-2] + share * (f[2:] - f[:-2])
        # the line through two noisy neighbours has noise of its own
        off.append((f[1:-1] - line) / np.sqrt(1 + share**2 + (1 - share) ** 2))
    # 1.4826: a normal distribution's; medians, since some bad points are named elsewhere
    return float(1.4826 * np.median(np.abs(np.concatenate(off))) / np.median(points.friction_nm))


def _runs(points: FrictionPoints) -> list[np.ndarray]:
    """Rows of each direction in their order, of each log by itself where all have some: what sessions differ
    by is no scatter."""
    log = points.columns.get("log", np.zeros(len(points.direction)))
    found: list[np.ndarray] = []
    for direction in (1, -1):
        rows = np.sort(points.rows_of(direction))
        parts = [rows[log[rows] == one] for one in np.unique(log[rows])]
        found += parts if min(map(len, parts), default=0) >= LINE_ROWS else [rows]
    return found


def _doubtful_units(points: FrictionPoints) -> list[str]:
    usual = ANY_LINEAR if points.motion == "linear" else Limits()
    speed, torque = float(np.abs(points.velocity_rad_s).max()), float(points.friction_nm.max())
    told = []
    if speed < SLOW_SHARE * usual.doubtful_rad_s:
        told.append(
            f"{points.source}: nothing moves faster than {speed:.3g} rad/s: is the velocity in another unit? "
            "Correct its unit or scale, or give --config RIG, whose limits count then"
        )
    if speed > usual.doubtful_rad_s:
        told.append(
            f"{points.source}: {speed:.3g} rad/s is quick for what a hand moves: is the velocity in "
            "rpm or deg/s, or of the motor before the gear? Correct its unit or scale, or give "
            "--config RIG, whose limits count then"
        )
    if torque > usual.doubtful_nm:
        told.append(
            f"{points.source}: {torque:.3g} N m of friction is much for what a hand moves: is the "
            "torque in mN m, or a current? Correct its unit or scale, or give --config RIG, whose limits "
            "count then"
        )
    return told


def require_plausible_points(points: FrictionPoints, loaded: LoadedConfig) -> None:
    """Refuse points that no axis of the rig could have given.

    Raises
    ------
    DataError
        Naming the column, its largest value, the bound of the rig file and the unit that is likely wrong;
        or that no axis of the rig is of that motion."""
    # an axis of the other motion has its limits in other units: a carriage may do 3 m/s, no joint 3 rad/s
    axes = [axis for axis in loaded.config.axis if axis.motion == points.motion]
    if not axes:
        raise DataError(
            f"{points.source}: is of a {points.motion} axis, and {loaded.path.name} has none; give the rig "
            "file of the axis that was measured"
        )
    refusals = [
        _refusal(points, Limits.of_axis(axis, loaded.path.name), axis.torque_limit_nm) for axis in axes
    ]
    # one axis that could have given them is enough: the file does not say which it was
    if all(refusals):
        raise DataError(refusals[0])


def require_held_out(test: FrictionPoints, training: FrictionPoints) -> None:
    """Refuse to judge a fit by the very file it was made of.

    Raises
    ------
    DataError
        Both files hold the same bytes."""
    if test.sha256 == training.sha256:
        raise DataError(
            f"{test.source}: the same points as {training.source}; --test needs points not trained on"
        )


def _refusal(points: FrictionPoints, limits: Limits, torque_limit_nm: float) -> str:
    speed, torque = float(np.abs(points.velocity_rad_s).max()), float(points.friction_nm.max())
    if speed > limits.speed_rad_s:
        return (
            f"{points.source}: column velocity_rad_s: {speed:.4g} rad/s is not plausible (at most "
            f"{limits.speed_rad_s:.4g} for {limits.source}); is it in degrees, or of the motor's side of "
            "the gear?"
        )
    if torque > limits.motor_nm:
        return (
            f"{points.source}: column friction_torque_nm: {torque:.4g} N m is not plausible (at most "
            f"{limits.motor_nm:.4g} for {limits.source}); is it in mN m, or does torque_limit_nm = "
            f"{torque_limit_nm:g} not belong to this rig?"
        )
    if torque < limits.torque_least_nm:
        return (
            f"{points.source}: column friction_torque_nm: no friction above {torque:.3g} N m, which is not "
            f"plausible (at least {limits.torque_least_nm:.3g} for {limits.source}); is it of the motor's "
            "side of the gear?"
        )
    return ""
