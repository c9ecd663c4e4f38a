"""A torque whose scale is another one for each of its signs: two halves of a bridge, two amplifiers.

Where a recorded torque is u (1 + g sgn u) of what the motion wants, u, it has |u| as one more column.
Friction that differs between the directions is an offset and |v|, which stand beside it: the sign of the
torque is that of the direction but where the joint is braked, and only what accelerates parts the two."""

from __future__ import annotations

import numpy as np

from rtctl.friction.logs.regressors import Regressors
from rtctl.friction.logs.torque_shape import EXPLAINS_MUCH, PlainBalance

LEAST = 0.05
"""Least g that is told: a scale that differs by a tenth."""


def of_two_gains(signals: Regressors) -> tuple[str, ...]:
    """The warning that a single torque is larger against the motion on one side of 0 than on the other."""
    plain = PlainBalance(signals)
    # viscous friction that differs between the directions is |v|, which |u| resembles
    speed = np.abs(signals.velocity_rad_s)[:, None]
    found = plain.effect(lambda u, _: np.abs(u), speed)
    by_direction = plain.coefficient(np.zeros(len(speed)), speed)[2]
    if not (found.sure() and abs(found.value) > LEAST and found.rest < EXPLAINS_MUCH * by_direction):
        return ()
    # u (1 + g) above 0 and u (1 - g) below it
    ratio, high = (1 + abs(found.value)) / (1 - abs(found.value)), "above" if found.value > 0 else "below"
    return (
        f"{signals.source}: the torque is {100 * (ratio - 1):.2g} % larger {high} 0 than on the other side, "
        "against what the motion wants (an amplifier or a bridge with a gain for each sign): inertia and "
        "friction are of their mean at best; load the sensor both ways with one weight, and give each sign "
        "its scale",
    )
