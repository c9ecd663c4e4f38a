"""Joint least squares of inertia, viscous friction, Coulomb friction and offset from one log, with intervals.

=======  ==========  ==========================================================
v, a     rad/s, ...  velocity, acceleration
tau      N m         motor torque plus external torque
J, b     kg m^2, ..  inertia, viscous friction (N m s/rad)
F_c, o   N m         Coulomb friction, offset (bias of the torque)
s        1           direction of motion, +1 or -1, low-passed as everything else
=======  ==========  ==========================================================

Symmetric ``tau = J a + b v + F_c s + o``; per direction ``tau = J a + b+ v+ + b- v- + f+ H(s) + f- H(-s)``,
where offset and a difference of Coulomb friction cannot be told apart: both are in f+ and f-. In both the
offset of each log drifts slowly (`rtctl.friction.logs.offsets`); o, f+ and f- are those of its mean.

The intervals cover what is random in a log, and what other readings of it say
(`rtctl.friction.logs.other_readings`). A torque recorded early or late against the position, or bristles that
still bend, shift the parameters: d seconds of delay add J d w^2 to the viscous friction seen at the angular
frequency w. Correct a known delay before (`rtctl.friction.logs.signal_shift.advanced`)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.logs.balance import Balance
from rtctl.friction.logs.balance_faults import TOLD_CHANGE
from rtctl.friction.logs.dynamics import require_both_directions
from rtctl.friction.logs.even_motion import TooEvenError, completed, require_acceleration, said, told_apart
from rtctl.friction.logs.intervals import Estimate
from rtctl.friction.logs.least_squares import Columns, Regression, columns_of, solve
from rtctl.friction.logs.offsets import Offset, OffsetColumns, drift_beside_friction, offset_columns
from rtctl.friction.logs.other_readings import doubted, doubts
from rtctl.friction.logs.regressors import Regressors
from rtctl.friction.logs.speeds_seen import Speeds, few_slow, speeds
from rtctl.friction.logs.two_clocks import two_clocks
from rtctl.friction.logs.whole_steps import of_whole_steps

UNEXPLAINED_MAX = 0.7
"""Largest relative error of a fit that says anything; real logs have .1 to .2."""

DELAY_SAID_S = 0.5e-3
"""Delay left in the torque that is worth a word where it changes a parameter by `TOLD_CHANGE`: what a logger
takes at other instants than it says moves right logs by less."""


@dataclass(frozen=True)
class JointFit:
    """Both fits, the offset of each log, and what a reader of the numbers must know besides (`warnings`).

    `speeds` are those of the rows forwards and backwards; `drift_nm` are the coefficients of the drift
    columns (`rtctl.friction.logs.offsets`)."""

    symmetric: Regression
    per_direction: Regression
    offsets: tuple[Offset, ...]
    drift_nm: tuple[float, ...]
    speeds: tuple[Speeds, Speeds]
    remaining_delay_s: Estimate | None
    warnings: tuple[str, ...] = ()


def joint_fit(signals: Regressors) -> JointFit:
    """Fit both forms to the sliding rows of a log.

    Raises
    ------
    DataError
        One direction only, no low speeds, a motion too even to tell the parameters apart, parameters of the
        wrong sign, or a torque that has little to do with the motion; each with the remedy.

    Notes
    -----
    Few slow rows are a warning as long as the condition number says that the parameters can be told apart:
    the standard errors then carry what the few rows leave open."""
    require_both_directions(signals.velocity_rad_s[signals.sliding], signals.source)
    offset = offset_columns(signals)
    columns, by_direction = columns_of(signals, offset)
    try:
        require_acceleration(signals)
        symmetric, per_direction = _both(signals, offset, columns, by_direction)
    except TooEvenError as error:
        return _even(signals, offset, columns, by_direction, error)
    _require_signs(symmetric, signals)
    _require_explained(symmetric, signals.source)
    # before the doubts: a motion that is so much earlier is one of the readings that make them
    late = _remaining_delay(signals, columns, offset)
    coulomb_nm = symmetric.parameters["coulomb_nm"].value
    # by the Coulomb friction of the plain fit: half a step matters by its share of that
    cut, whole = of_whole_steps(signals, columns, offset, coulomb_nm)
    by = doubts(signals, late) + cut
    symmetric, per_direction = (
        replace(fit, parameters=doubted(fit.parameters, by)) for fit in (symmetric, per_direction)
    )
    clocks = two_clocks(signals, columns, offset)
    # a delay that grows over the log has a mean as well, which alone would be put right wrongly
    told = (clocks,) if clocks else _misaligned(signals, late)
    return _joint(signals, offset, symmetric, per_direction, late, (*told, *whole))


def _both(
    signals: Regressors, offset: OffsetColumns, columns: Columns, by_direction: Columns
) -> tuple[Regression, Regression]:
    """The symmetric fit, and that per direction. Raises TooEvenError where the speeds part Coulomb from
    viscous friction in name alone: it comes out negative, and friction at the usual speed does not."""
    # levels of both directions hold the mean of the offsets: only what logs differ by is a column here
    relative = np.hstack([offset.relative(signals.sliding), offset.drift])
    fit = solve(signals, columns, offset, offset.drift)
    # below 0 for sure although the joint rubs: a line through one speed has any slope
    if fit.parameters["coulomb_nm"].high < 0 < _usual_friction(fit, signals):
        raise TooEvenError(
            f"{signals.source}: the speeds do not tell Coulomb from viscous friction; record more of them"
        )
    return fit, solve(signals, by_direction, offset, relative)


def _even(
    signals: Regressors, offset: OffsetColumns, columns: Columns, by_direction: Columns, error: TooEvenError
) -> JointFit:
    """What a motion too even for all parameters tells; raises `error` where that is nothing either."""
    for kept, ways in zip(told_apart(signals, columns), told_apart(signals, by_direction), strict=True):
        try:
            symmetric, per_direction = _both(signals, offset, kept, ways)
        # the next one asks for less
        except TooEvenError:
            continue
        _require_signs(symmetric, signals)
        _require_explained(symmetric, signals.source)
        told = said(signals, symmetric.parameters)
        symmetric, per_direction = (
            replace(fit, parameters=completed(fit.parameters, tuple(names), signals))
            for fit, names in ((symmetric, columns), (per_direction, by_direction))
        )
        return _joint(signals, offset, symmetric, per_direction, None, (told,))
    raise error


def _joint(
    signals: Regressors,
    offset: OffsetColumns,
    symmetric: Regression,
    per_direction: Regression,
    late: Estimate | None,
    told: tuple[str, ...],
) -> JointFit:
    both = speeds(signals)
    # with the inertia that was found: only what is slow is asked for anew, beside a friction of any shape
    drift = drift_beside_friction(signals, offset, symmetric.parameters["inertia_kgm2"].value)
    offsets = tuple(offset.describe(drift, signals.sources, signals.sliding))
    # an even motion, or one sine, is told as that: more slow rows would part nothing
    slow = few_slow(signals) if late is not None else ()
    warnings = (*signals.warnings, *slow, *told)
    coefficients = tuple(float(each) for each in drift)
    return JointFit(symmetric, per_direction, offsets, coefficients, both, late, warnings)


def _remaining_delay(
    signals: Regressors, columns: dict[str, np.ndarray], offset: OffsetColumns
) -> Estimate | None:
    """How late the torque is against the position, s.

    Notes
    -----
    While the joint slides, a torque late by d is J (a - d da/dt) + b (v - d a) + ...: the coefficient of the
    jerk is -d J. Friction that is not Coulomb + viscous goes into it too."""
    try:
        fit = solve(signals, {**columns, "jerk": signals.jerk_rad_s3}, offset, offset.drift)
    except DataError:
        return None  # jerk and velocity of a single sine are the same signal
    inertia, jerk = fit.parameters["inertia_kgm2"].value, fit.parameters["jerk"]
    if not inertia > 0:
        return None
    return Estimate(
        # the sign turns, and with it the ends of the interval
        -jerk.value / inertia,
        jerk.standard_error / inertia,
        -jerk.high / inertia,
        -jerk.low / inertia,
    )


def taken_late(signals: Regressors, half_period_s: float) -> float:
    """By how much later than the position the torque of a row acted, s, of signals whose torque was put back
    by half a period, as a command that was held until its row: that half period, 0 of one measured at the
    instants of the position, or less half a period of a command that is held from its row on.

    It then looks early by a half period or by two: surely nearer to that than to the one before, or near it
    and surely not the one before."""
    offset = offset_columns(signals)
    levels = dict(zip(offset.names, offset.logs.T, strict=True))
    columns = {"inertia_kgm2": signals.acceleration_rad_s2, "viscous_nms_rad": signals.velocity_rad_s}
    columns |= {"coulomb_nm": signals.direction, **signals.by_place}
    late = _remaining_delay(signals, {**columns, **levels}, offset)
    # what most drives record, where nothing tells
    if late is None:
        return half_period_s
    for halves in (1, 2):
        at = -halves * half_period_s
        # the whole interval: friction of another law looks late or early by some ms, too
        nearer = at - 0.5 * half_period_s < late.low and late.high < at + 0.5 * half_period_s
        if nearer or (late.high < at + half_period_s and late.holds(at)):
            return half_period_s + at
    return half_period_s


def _misaligned(signals: Regressors, late: Estimate | None) -> tuple[str, ...]:
    # surely there, and large enough to change a figure
    if late is None or late.holds(0.0) or abs(late.value) < DELAY_SAID_S:
        return ()
    if _moved_by(signals, late.value) < TOLD_CHANGE:
        return ()
    word = "late" if late.value > 0 else "early"
    # both ends have the sign of the value: 0 is not between them
    least, most = sorted((1e3 * abs(late.low), 1e3 * abs(late.high)))
    return (
        f"{signals.source}: the torque looks {1e3 * abs(late.value):.3g} ms {word} against the position "
        f"({least:.3g} to {most:.3g} ms): either it is (--torque-delay; viscous friction and inertia are "
        "then wrong), or an elastic shaft or belt is between motor and encoder, or friction is not Coulomb + "
        "viscous",
    )


def _moved_by(signals: Regressors, delay_s: float) -> float:
    """Largest share by which inertia, viscous or Coulomb friction change with the motion as it was so much
    earlier."""
    balance = Balance.of(signals)
    a, v, s = balance.motion.T
    earlier = np.column_stack([a - delay_s * signals.jerk_rad_s3[signals.sliding], v - delay_s * a, s])
    before, after = (
        np.array([fit.inertia, fit.viscous, fit.coulomb])
        for fit in (balance.fit(), balance.fit(motion=earlier))
    )
    return float(np.max(np.abs(before - after) / np.maximum(np.abs(after), 1e-12)))


def _usual_friction(fit: Regression, signals: Regressors) -> float:
    """Friction at the median of the speeds, N m."""
    usual = float(np.median(np.abs(signals.velocity_rad_s[signals.sliding])))
    viscous = fit.parameters.get("viscous_nms_rad")
    return fit.parameters["coulomb_nm"].value + (usual * viscous.value if viscous else 0.0)


def _require_signs(fit: Regression, signals: Regressors) -> None:
    source, friction = signals.source, _usual_friction(fit, signals)
    inertia, coulomb = fit.parameters.get("inertia_kgm2"), fit.parameters["coulomb_nm"]
    # all signs turned is a turned torque; the inertia alone is a matter of time (below)
    if coulomb.high < 0 or (inertia and inertia.high < 0 and friction < 0):
        raise DataError(
            f"{source}: the torque assists the motion (friction {friction:.3g} N m at the usual speed): "
            "turn its sign (scale -1, behind the unit), or that of the position"
        )
    if inertia and inertia.high < 0:
        raise DataError(
            f"{source}: the inertia comes out negative ({inertia.value:.3g} kg m^2): torque and position are "
            "not aligned in time, or a torque is missing; map the external torque too, or correct the time"
        )


def _require_explained(fit: Regression, source: str) -> None:
    if fit.relative_error > UNEXPLAINED_MAX:
        raise DataError(
            f"{source}: the motion explains too little of the torque ({100 * fit.relative_error:.0f} % of "
            f"it, RMS, is something else, at most {100 * UNEXPLAINED_MAX:.0f} %); map the torque of the "
            "same axis, and every torque on the joint"
        )


def offset_rows(signals: Regressors, fit: JointFit) -> np.ndarray:
    """Offset of every row of the signals that were fitted, its drift included, N m."""
    columns = offset_columns(signals)
    # the level beside Coulomb + viscous friction, the drift beside a curve: a curve of each direction would
    # have the level in it
    level = np.array([fit.symmetric.parameters[name].value for name in columns.names])
    return np.asarray(columns.logs @ level + columns.drift @ fit.drift_nm)
