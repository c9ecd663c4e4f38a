"""A torque or a position that somebody smoothed both ways, without delay: a moving mean, `smoothdata`,
`filtfilt`.

What is quick in it is too small then, by the more the quicker, and no delay says so: a smoothed torque makes
the inertia too small, a smoothed position too large. But one that is smoothed fits the other, smoothed
alike."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.friction.logs.balance import Balance, Fit
from rtctl.friction.logs.balance_faults import TOLD_CHANGE, TOLD_RATIO, changed
from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.row_noise import row_noise

MEANS_S = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6)
"""Lengths of a mean that are tried."""

INERTIA_LEAST = 0.45
"""Least share of an inertia that is left when a smoothed position is reckoned with: on a motion that hardly
tells it, any smoothing explains it away."""

LEFT_OF_SMOOTHED, BESIDE = 0.01, 0.5
"""Share of the torque left over from which on it is looked at; share of that, RMS, from which down it is told
beside another cause."""


def smoothed(balance: Balance, logs: Sequence[Sequence[AxisLog]], *, beside: bool = False) -> tuple[str, ...]:
    """The warning that torque or position looks smoothed: by the mean that leaves least over, where that is
    far less and changes a parameter, as of any cause in a balance (by more where another one was found
    `beside`), and not by the noise of the rows of `logs` alone."""
    signals, rows, plain = balance.signals, balance.signals.sliding, balance.fit()
    if plain.rest <= LEFT_OF_SMOOTHED * balance.spread:
        return ()
    # all rows, sliding or not: a mean reaches over turns as it did in whatever program took it
    motion = np.column_stack([signals.acceleration_rad_s2, signals.velocity_rad_s, signals.direction])
    found = []
    for mean_s in MEANS_S:
        of_torque = balance.fit(motion=_mean(motion, signals.log, balance, mean_s)[rows])
        # the recorded motion is a mean already, and its sign is not: friction turns over as slowly as that
        means = _mean(np.column_stack([signals.torque_nm, signals.direction]), signals.log, balance, mean_s)
        turned = np.column_stack([balance.acceleration, balance.velocity, means[rows, 1]])
        of_position = balance.fit(torque=means[rows, 0], motion=turned)
        found.append((of_torque.rest, mean_s, "torque", "position", of_torque))
        # the other way round: a torque smoothed as the position was has its quick part taken off, and the
        # inertia with it
        if of_position.inertia > INERTIA_LEAST * plain.inertia:
            found.append((of_position.rest, mean_s, "position", "torque", of_position))
    rest, mean_s, of, other, best = min(found, key=lambda each: each[0])
    sound = best.inertia > 0 and best.coulomb > 0
    most = BESIDE if beside else TOLD_RATIO
    if not (sound and rest <= most * plain.rest and changed(balance, plain, best) >= TOLD_CHANGE):
        return ()
    if _of_noise(balance, logs, best, of, mean_s):
        return ()
    return (
        f"{signals.source}: the {of} looks smoothed both ways, as by a mean over {1e3 * mean_s:.0f} ms "
        f"(smoothdata, movmean, filtfilt; an elastic shaft and play may look alike): with the {other} "
        f"smoothed as much, {100 * rest / balance.spread:.2g} % of the torque is left over instead of "
        f"{100 * plain.rest / balance.spread:.2g} %; give columns as they were recorded",
    )


def _of_noise(
    balance: Balance, logs: Sequence[Sequence[AxisLog]], found: Fit, of: str, mean_s: float
) -> bool:
    """Whether the noise of the rows leaves over as much as a cause may that is told, or the mean does not
    leave far less but for the noise; the inertia is that of `found`."""
    noise, plain = row_noise(logs, balance.signals.cutoff_hz), balance.fit()
    # noise of a regressor makes its coefficient smaller, and so leaves less over than with the true one
    smaller = min(1.0, max(plain.inertia, 0.0) / found.inertia)
    moved = np.sqrt(smaller) * noise.motion @ np.array([found.inertia, found.viscous])
    before = after = moved.var() + noise.torque_nm.var()
    if of == "torque":
        after += _mean(moved, noise.log, balance, mean_s).var() - moved.var()
    else:
        after += _mean(noise.torque_nm, noise.log, balance, mean_s).var() - noise.torque_nm.var()
    most = TOLD_RATIO**2
    return bool(before > most * plain.rest**2 or found.rest**2 - after > most * (plain.rest**2 - before))


def _mean(column: np.ndarray, log: np.ndarray, balance: Balance, mean_s: float) -> np.ndarray:
    """The moving mean of a column of rows of those logs, log by log."""
    from scipy.ndimage import uniform_filter1d

    signals, found = balance.signals, np.empty_like(column)
    # odd: a mean of an even number of rows is half a row late
    rows = max(3, round(mean_s / float(np.median(np.diff(signals.time_s)))) | 1)
    for k in range(len(signals.sources)):
        mine = log == k
        found[mine] = uniform_filter1d(column[mine], rows, axis=0, mode="nearest")
    return found
