"""A torque that is a power of what acts: a gauge that is not linear, a column of roots or logarithms.

Where a recorded torque is U |u/U|^(1 + c) of what the motion wants, u, with U the largest u, it has
u ln(|u|/U) as one more column, and c as its coefficient while that is small. Friction of any speed is a curve
of speed, which stands beside it: what accelerates tells the two apart, and even strokes tell nothing."""

from __future__ import annotations

import numpy as np

from rtctl.friction.logs.regressors import Regressors
from rtctl.friction.logs.torque_shape import Effect, PlainBalance, bent

LEAST, ALIKE = 0.1, 0.3
"""Least c that is told, and share of it by which it may differ beside other columns: of 24 foreign logs none
had more than .02 that was sure; the same with powers of .75 and 1.3 had .19 and more, where they tell it."""

SMALLEST = 1e-6
"""Share of the largest torque below which it counts as that: a logarithm of 0 is none."""


def not_proportional(signals: Regressors) -> tuple[str, ...]:
    """The warning that a single torque does not grow as the motion wants: as a power of it, or bent at its
    largest, whichever leaves less over."""
    plain = PlainBalance(signals)
    found = _power(plain)
    over_speed = plain.coefficient(np.zeros(len(plain.rows)), plain.others[:, 1:3])[2]
    told = (
        found.sure()
        and abs(found.value) > LEAST
        and abs(found.beside / found.value - 1) < ALIKE
        and found.rest < over_speed
    )
    # what saturates at its largest only is that
    if not told or plain.bend().rest <= found.rest:
        text = bent(signals)
        if text or not told:
            return text
    return (
        f"{signals.source}: the torque is not proportional to what the motion wants: it grows about as the "
        f"power {1 + found.value:.2g} of it (a gauge that is not linear, a column of roots or logarithms, a "
        "sensor or drive that saturates from small torques on): inertia and friction are of no unit; load "
        "the sensor with known weights, and record the torque itself",
    )


def _power(plain: PlainBalance) -> Effect:
    def column(u: np.ndarray, _: float) -> np.ndarray:
        largest = max(float(np.quantile(np.abs(u[plain.rows]), 0.99)), 1e-300)
        return np.asarray(u * np.log(np.maximum(np.abs(u) / largest, SMALLEST)))

    return plain.effect(column)
