"""Everything that is looked at in a log once it is filtered, before its parameters are given out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.logs import left_over
from rtctl.friction.logs.balance import Balance
from rtctl.friction.logs.balance_faults import CHANGES_WITHIN, diagnosed
from rtctl.friction.logs.clipping import ClippedError, require_unclipped
from rtctl.friction.logs.dynamics import SAMPLES_MIN, AxisLog, Plateau
from rtctl.friction.logs.held_still import held_still
from rtctl.friction.logs.in_place_of_torque import in_place_of_torque
from rtctl.friction.logs.power_of_torque import not_proportional
from rtctl.friction.logs.regressors import Regressors, of_stretches, pooled
from rtctl.friction.logs.row_noise import COARSE_STEP, rounded_again, row_noise, step_of
from rtctl.friction.logs.smoothed import smoothed
from rtctl.friction.logs.torque_shape import drifting
from rtctl.friction.logs.two_gains import of_two_gains
from rtctl.friction.logs.waves import without_waves

LOWER_CUTOFF = 0.4
"""Share of the cut-off at which noise of the acceleration is a tenth of what it was."""

BIAS_TOLD, BIAS_REFUSED = 0.15, 0.5
"""Share by which the coarseness of a position makes the inertia too small: told, refused. White noise is up
to twice what the steps of slow motion make."""

OF_POSITION = "column position: "

FEW_LEVELS = 0.01
"""Step of a position without a velocity, share of its range, that is told whatever it makes of the
inertia."""

SURE = 0.05
"""Largest standard error of an inertia that another is compared with, share of it."""

SURELY = 3.0
"""Standard errors from which on the two differ."""


def diagnose(logs: Sequence[Sequence[AxisLog]], signals: Regressors) -> tuple[str, ...]:
    """Warnings about the logs (each a tuple of stretches) of which `signals` were made.

    Raises
    ------
    DataError
        A cause that makes the parameters useless; named with column, amount and remedy."""
    v = signals.velocity_rad_s[signals.sliding]
    if min(int((v > 0).sum()), int((v < 0).sum())) < SAMPLES_MIN:
        _require_levels(logs, signals)
        return ()  # the fit itself says what is missing
    balance = Balance.of(signals)
    # clipping first: a torque that was cut off looks like friction that bends, and would be told as that
    require_unclipped(balance, _plateaus(logs), signals.source)
    noted = tuple(
        dict.fromkeys(note for stretches in logs for stretch in stretches for note in stretch.notes)
    )
    coarse = _coarse_position(logs, signals)
    held = held_still(balance)
    # a cause with a name explains what is left over; the bound is for causes that have none (decision 0044)
    step_rad = max(step_of(one) for stretches in logs for one in stretches)
    causes = diagnosed(balance, (*noted, *held))
    # a curve through the values of a slower device is smooth, and that is told; a position whose noise or
    # steps make the inertia short is told as that, and nobody smoothed it
    known = bool(coarse) or any("it is of a slower" in note for note in noted)
    left = () if causes else left_over.told(balance, step_rad)
    found = (
        *causes,
        *(one for one in left if not (coarse and OF_POSITION in one)),
        *(() if known else smoothed(balance, logs, beside=bool(causes))),
    )
    # two torques may each bend by itself, and their sum tells neither
    shape = (*not_proportional(signals), *of_two_gains(signals)) if balance.external is None else ()
    return (
        *found,
        *held,
        *shape,
        # a change in the middle of a log is a drift as well: it is told once
        *(() if any(CHANGES_WITHIN in one for one in found) else drifting(signals)),
        *coarse,
    )


def clipped_logs(
    logs: Sequence[Sequence[AxisLog]], signals: Regressors, speed_min_rad_s: float
) -> dict[int, str]:
    """Numbers of the logs, of several, whose torque is clipped, with what is said of each; empty, too, where
    all are, or where a log is too short to be asked."""
    if len(logs) < 2:
        return {}
    found: dict[int, str] = {}
    signals = replace(signals, external_nm=external_of(logs, signals.cutoff_hz, speed_min_rad_s))
    for k in range(len(logs)):
        # by itself: beside others that are sound its rows hardly change what is left over
        mine = _alone(signals, k)
        v = mine.velocity_rad_s[mine.sliding]
        if min(int((v > 0).sum()), int((v < 0).sum())) < SAMPLES_MIN:
            continue
        try:
            require_unclipped(Balance.of(mine), _plateaus(logs[k : k + 1]), mine.source)
        except ClippedError as error:
            found[k] = f"{error}; it is left out, and the other logs are used"
        except DataError:
            continue  # too short for it: what is asked of all logs together says so
    return found if len(found) < len(logs) else {}


def _alone(signals: Regressors, k: int) -> Regressors:
    """The rows of one log, as if it were the only one."""
    mine = signals.log == k
    columns = {each.name: getattr(signals, each.name) for each in fields(signals)}
    rows = {name: one[mine] for name, one in columns.items() if isinstance(one, np.ndarray)}
    by_place = {name: column[mine] for name, column in signals.by_place.items()}
    rows["log"] = np.zeros(int(mine.sum()), int)
    return replace(signals, **rows, by_place=by_place, sources=signals.sources[k : k + 1])


def _plateaus(logs: Sequence[Sequence[AxisLog]]) -> list[tuple[int, Plateau]]:
    """Runs of equal extreme torques, each with the number of its log."""
    return [(k, one) for k, stretches in enumerate(logs) for stretch in stretches for one in stretch.plateaus]


def external_of(
    logs: Sequence[Sequence[AxisLog]], cutoff_hz: float, speed_min_rad_s: float
) -> np.ndarray | None:
    """The external torque alone, on the rows of the signals of both torques; None where only one is
    recorded."""
    if any(stretch.external_nm is None for stretches in logs for stretch in stretches):
        return None
    return in_place_of_torque(logs, lambda one: np.asarray(one.external_nm), cutoff_hz, speed_min_rad_s)


def with_coarseness(
    logs: Sequence[Sequence[AxisLog]], signals: Regressors, speed_min_rad_s: float
) -> Regressors:
    """The signals with the acceleration that noise makes, that of the steps of the position alone, and the
    share by which noise makes the inertia too small, for the acceleration drowns in it.

    Notes
    -----
    Noise in a regressor makes its coefficient too small by the noise's share of the regressor's power (of
    what of it the others do not have). As much noise as the steps make, and as there is above the cut-off, is
    made once more, and its power measured. Of a recorded velocity the steps of the position make no
    acceleration."""
    v = signals.velocity_rad_s[signals.sliding]
    if min(int((v > 0).sum()), int((v < 0).sum())) < SAMPLES_MIN:
        return signals
    balance = Balance.of(signals)
    # an encoder that interpolates is uneven below the cut-off: that shows only against a lower one
    short = _gained_by_lower_cutoff(logs, balance, speed_min_rad_s)
    steps, noise = 0.0, float(row_noise(logs, signals.cutoff_hz).motion[:, 0].std())
    if all(stretch.velocity_rad_s is None for stretches in logs for stretch in stretches):
        coarse = [[rounded_again(stretch, signals.cutoff_hz) for stretch in stretches] for stretches in logs]
        again = pooled([of_stretches(stretches, signals.cutoff_hz, speed_min_rad_s) for stretches in coarse])
        steps = float((again.acceleration_rad_s2 - signals.acceleration_rad_s2)[signals.sliding].std())
    signals = replace(signals, steps_rad_s2=steps, noise_rad_s2=max(steps, noise))
    return replace(signals, inertia_short=max(short, _short_by(signals.noise_rad_s2, balance)))


def _short_by(noise_rad_s2: float, balance: Balance) -> float:
    # against the acceleration that no other column has: the inertia is learned from that part alone
    own = max(float(balance.own_acceleration().var()), 1e-300)
    return min(1.0, noise_rad_s2**2 / own)


def _require_levels(logs: Sequence[Sequence[AxisLog]], signals: Regressors) -> None:
    """Refuse a position of few levels: between them it rests, and hardly a row slides."""
    # of a recorded velocity it is not the position that says where the joint rests
    for stretch in (one for stretches in logs for one in stretches if one.velocity_rad_s is None):
        step, range_rad = step_of(stretch), float(np.ptp(stretch.position_rad))
        if step > COARSE_STEP * range_rad:
            raise DataError(
                f"{signals.source}: column position: too coarse: {round(range_rad / step)} steps of "
                f"{step:.3g} rad are all its range, so that it seems to rest between them; record more "
                "digits, or a velocity too"
            )


def _coarse_position(logs: Sequence[Sequence[AxisLog]], signals: Regressors) -> list[str]:
    """What is to be said of positions whose steps make the inertia too small."""
    short = signals.inertia_short
    if short <= BIAS_TOLD:
        return _few_levels(logs, signals)
    each = [one for stretches in logs for one in stretches]
    step = max(step_of(one) for one in each)
    balance = Balance.of(signals)
    if _short_by(signals.noise_rad_s2, balance) < 0.5 * short:
        lower_hz = LOWER_CUTOFF * signals.cutoff_hz
        return [
            f"{signals.source}: the inertia is {100 * short:.0f} % smaller than with a cut-off of "
            f"{lower_hz:.3g} Hz, and not by the steps of the position ({step:.1g} rad): play that rattles, "
            "an encoder that interpolates, an elastic shaft, or a torque that "
            f"is filtered, echoes or is not proportional; try --cutoff-hz {lower_hz:.3g}, move more briskly"
        ]
    if _short_by(signals.steps_rad_s2, balance) < 0.5 * short:
        column = "position" if all(one.velocity_rad_s is None for one in each) else "velocity"
        return [
            f"{signals.source}: column {column}: its noise makes the inertia {100 * short:.0f} % too small, "
            "or more; move more briskly, lower --cutoff-hz, or record it at a higher rate and with less noise"
        ]
    text = (
        f"{signals.source}: column position: too coarse: steps of {step:.3g} rad make the inertia "
        f"{100 * short:.0f} % too small, or more; record more digits, a velocity too, move more briskly, or "
        "lower --cutoff-hz"
    )
    # digits that a logger cut off are worth a refusal, since they can be had; steps of an encoder cannot
    lost = any(step_of(one) > COARSE_STEP * np.ptp(one.position_rad) for one in each)
    if lost and short > BIAS_REFUSED:
        raise DataError(text)
    return [text]  # of an encoder's steps friction is right, and the interval of the inertia is as wide


def _few_levels(logs: Sequence[Sequence[AxisLog]], signals: Regressors) -> list[str]:
    """What is to be said of a position of few levels although the inertia comes out of it: velocity and its
    sign are of the steps."""
    stretches = [one for stretches in logs for one in stretches if one.velocity_rad_s is None]
    step, range_rad = max(
        ((step_of(one), float(np.ptp(one.position_rad))) for one in stretches), default=(0.0, 0.0)
    )
    if step <= FEW_LEVELS * range_rad:
        return []
    return [
        f"{signals.source}: column position: too coarse: {round(range_rad / step)} steps of {step:.3g} rad "
        "are all its range: viscous friction, and a delay, are those of the steps; record more digits, or "
        "a velocity too"
    ]


def _gained_by_lower_cutoff(
    logs: Sequence[Sequence[AxisLog]], balance: Balance, speed_min_rad_s: float
) -> float:
    """Share that the inertia surely lacks against that of a lower cut-off, where the noise of an acceleration
    is far less, whatever makes it."""
    cutoff_hz = LOWER_CUTOFF * balance.signals.cutoff_hz
    try:
        # as the signals were made: waves that stay at one cut-off alone would be a difference between the two
        lower = without_waves(
            pooled([of_stretches(stretches, cutoff_hz, speed_min_rad_s) for stretches in logs]),
            logs,
            speed_min_rad_s,
        )
    except DataError:
        return 0.0  # too short for it
    v = lower.velocity_rad_s[lower.sliding]
    if min(int((v > 0).sum()), int((v < 0).sum())) < SAMPLES_MIN:
        return 0.0
    (inertia, own_error), (found, error) = balance.inertia(), Balance.of(lower).inertia()
    # two cut-offs see different parts of an elastic joint: only a difference beyond chance is noise
    if not (error < SURE * found and found - inertia > SURELY * math.hypot(own_error, error)):
        return 0.0
    return 1 - inertia / found
