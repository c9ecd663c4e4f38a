"""A torque without its slow part: AC-coupled (an oscilloscope's input, a charge amplifier of a piezo), or
high-passed by a program.

A high-pass of the first order leaves of a torque u the m with ``m' + w m = u'``, so ``u = m + w int m``: the
balance of what was recorded has one more column, its own integral, and all other parameters are again those
of the joint (docs/theory.md 9.5)."""

from __future__ import annotations

import math

import numpy as np

from rtctl.friction.logs.balance import Balance, Fit
from rtctl.friction.logs.regressors import Regressors

GAP = 3.5
"""A step of so many usual ones is a gap, over which nothing is integrated."""


def high_passed(balance: Balance, plain: Fit) -> tuple[str, Fit] | None:
    """The corner of a high-pass of the only torque that leaves least over."""
    # of two torques one may be AC-coupled and one not: the integral of their sum is then nobody's column
    if balance.external is not None:
        return None
    column = _integral(balance.signals)[balance.signals.sliding]
    # minus: m = u - w int m, so that the coefficient is the corner itself, rad/s
    other = balance.fit(added=-column[:, None])
    corner = float(other.added[0])
    if not (corner > 0 and other.inertia > 0 and other.coulomb > 0):
        return None
    return (
        f"the torque looks AC-coupled: as behind a high-pass of {corner / 2 / math.pi:.2g} Hz, "
        f"{100 * other.rest / balance.spread:.2g} % of it is left over instead of "
        f"{100 * plain.rest / balance.spread:.2g} %, and its slow part, with the Coulomb friction, is "
        "missing; couple it DC, or map the torque before the filter",
        other,
    )


def _integral(signals: Regressors) -> np.ndarray:
    """Integral of the torque over each log, about its mean, (n,), N m s."""
    found = np.zeros(len(signals.time_s))
    for k in range(len(signals.sources)):
        mine = signals.log == k
        steps = np.diff(signals.time_s[mine])
        # what a high-pass forgot over a pause is not in the log
        steps[steps > GAP * np.median(steps)] = 0.0
        # about its mean: a zero of the sensor would be integrated to a ramp, which is the drift's column
        torque = signals.torque_nm[mine] - signals.torque_nm[mine].mean()
        found[mine] = np.concatenate([[0.0], np.cumsum(0.5 * (torque[1:] + torque[:-1]) * steps)])
    return found
