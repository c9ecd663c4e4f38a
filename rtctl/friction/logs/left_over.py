"""What a balance of torques leaves over that is no noise, and by how much it may have moved the parameters.

A torque that is in the balance and not in its model (a hand that was not mapped, a shaft that twists, play,
friction by place) goes into the parameters by as much as it looks like their columns; what of it does not is
left over. Nothing tells how it was shared out, but of what is seen left over a bound follows
(docs/theory.md 9.5)."""

from __future__ import annotations

import numpy as np

from rtctl.friction.logs.balance import Balance
from rtctl.friction.logs.dynamics import SAMPLES_PER_CUTOFF

SMOOTH_LEAST = 0.015
"""Share of the torque left over without being noise from which on the bounds below count."""

# a hand that nobody recorded took 13 % of an inertia without a word, play 23 (decision 0044)
MOST_OFF = {"inertia": 0.15, "viscous friction": 0.3, "Coulomb friction": 0.15}
"""Largest share by which a parameter may be off before that is told."""

HARDLY_KNOWN = 0.5
"""Share by which the inertia may be off that is told however little is left over: it makes so little of the
torque that a small error of the model is as large."""

LAGS = (1.0, 1.3, 1.7, 2.1)
"""Times over which what is left over is compared with itself, periods of the cut-off."""

PAIRS_LEAST = 30
"""Fewest pairs of rows, in periods of the cut-off, that a covariance is taken from."""

NOISE_SHARE = 0.2
"""Smallest share of what is left over, by power, that is called no noise."""

STEPS_SHARE = 0.5
"""Share of what is left over, by power, from which on it is of the steps of the position, which make as much
of an acceleration times the inertia."""

NORMAL = 1.4826
"""RMS of noise against the median of its size."""


def no_noise(balance: Balance) -> float:
    """RMS of what is left over and is no noise, N m: it still follows from itself a period of the cut-off
    later and more, in the same stroke, or it comes in bursts.

    Notes
    -----
    Noise behind a low-pass is uncorrelated after a period of its cut-off, so the covariance over such times
    is of what is no noise. Several are tried, since a shaft that swings crosses 0 at one of them. Noise is
    as large everywhere, so its median says its power; what is more is in bursts, as where play closes."""
    rest = balance.residual()
    power, usual = float(np.mean(rest**2)), NORMAL * float(np.median(np.abs(rest)))
    smooth = (abs(_covariance(balance, rest, round(lag * SAMPLES_PER_CUTOFF))) for lag in LAGS)
    # either sign of bursts and of what lasts: play has no covariance over a period, a shaft no bursts
    told = max(power - usual**2, *smooth)
    return float(np.sqrt(told)) if told > NOISE_SHARE * power else 0.0


def _covariance(balance: Balance, rest: np.ndarray, lag: int) -> float:
    """Covariance of what is left over on two rows of a stroke, `lag` rows apart; 0 where there are hardly
    such rows."""
    # fewer than two spans: the mean of the products would be of one swing
    if len(rest) <= 2 * lag:
        return 0.0
    time, log, ahead = balance.time_s, balance.log, balance.velocity > 0
    step = float(np.median(np.diff(time)))
    pairs = (
        (time[lag:] - time[:-lag] < (lag + 0.5) * step)
        & (log[lag:] == log[:-lag])
        # in another stroke friction has turned over, and with it what a wrong model of it leaves
        & (ahead[lag:] == ahead[:-lag])
    )
    if pairs.sum() < PAIRS_LEAST * SAMPLES_PER_CUTOFF:
        return 0.0
    return float(np.mean(rest[lag:][pairs] * rest[:-lag][pairs]))


def bounds(balance: Balance, rest: float) -> dict[str, float]:
    """Share by which each parameter is off when a torque of `rest` N m, RMS, looks wholly like what its
    column has beyond the others."""
    fit = balance.fit()
    values = {"inertia": fit.inertia, "viscous friction": fit.viscous, "Coulomb friction": fit.coulomb}
    found = {}
    for k, (name, value) in enumerate(values.items()):
        others = np.column_stack([np.delete(balance.motion, k, axis=1), balance.nuisance])
        column = balance.motion[:, k]
        # only by what no other column has can a hidden torque move this parameter
        own = column - others @ np.linalg.lstsq(others, column, rcond=1e-9)[0]
        # Cauchy and Schwarz: no torque of that size moves the parameter further than one that is its column
        found[name] = rest / max(float(own.std()) * abs(value), 1e-300)
    return found


def told(balance: Balance, step_rad: float) -> tuple[str, ...]:
    """The warning that what is left over is no noise, where it may have moved a parameter much; or that it is
    what the steps of the position, `step_rad`, leave over."""
    rest = no_noise(balance)
    share, off = rest / balance.spread, bounds(balance, rest)
    much = {name: by for name, by in off.items() if share > SMOOTH_LEAST and by > MOST_OFF[name]}
    if off["inertia"] > HARDLY_KNOWN:
        much["inertia"] = off["inertia"]
    if not much:
        return ()
    named = ", ".join(
        f"{name} by {100 * by:.0f} %" if by < 1 else f"{name} wholly" for name, by in much.items()
    )
    source, plain = balance.signals.source, balance.fit()
    for noise_rad_s2, cause in (
        (balance.signals.steps_rad_s2, f"too coarse: steps of {step_rad:.3g} rad leave"),
        (balance.signals.noise_rad_s2, "its noise, and that of a velocity, leaves"),
    ):
        if (plain.inertia * noise_rad_s2) ** 2 > STEPS_SHARE * plain.rest**2:
            return (
                f"{source}: column position: {cause} {100 * share:.2g} % of the torque over, and may have "
                f"moved the parameters, {named}; record more digits, a velocity too, or lower --cutoff-hz",
            )
    return (
        f"{source}: {100 * share:.2g} % of the torque is left over and is no noise (a hand "
        "or another torque that is not mapped, an elastic shaft, play, a command that the drive cut off at "
        "a limit of its own, counts that are lost, friction that "
        "varies with the place or is not Coulomb + viscous): what looks like it may have gone into the "
        f"parameters, {named}; map every torque, or record brisker strokes of many speeds with nothing else "
        "touching the joint",
    )
