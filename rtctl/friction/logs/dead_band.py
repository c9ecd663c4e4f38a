"""A torque that was set to 0 where it was small: a sensor, an intention or an amplifier with a dead band.

What is beyond the band is less by it as a rule, and so is the Coulomb friction, whatever the motion: the
balance of a joint that is mostly driven cannot tell one from the other."""

from __future__ import annotations

import numpy as np

SHARE, ENTRIES, NEAR, NEAR_SHARE = 0.01, 20, 0.05, 0.4
"""Rows that are exactly 0, share of all; times that the torque gets there or leaves; how small it is then,
share of its usual largest, and how often at least: a motor that is switched off comes from far."""

LIKE_OTHERS = 0.2
"""Rows of the two next values, share of those of 0, from which on 0 is a step as any other."""


def dead_band(torque: np.ndarray, where: str) -> tuple[str, ...]:
    """The warning that a torque (n,), of any unit, stands at exactly 0 where it passes it."""
    still, size = torque == 0, np.abs(torque)
    turns = np.flatnonzero(still[1:] != still[:-1])
    if still.mean() < SHARE or len(turns) < ENTRIES:
        return ()
    # of the two rows at an edge one is 0: the larger tells from how far it came
    near = np.maximum(size[turns], size[turns + 1]) < NEAR * float(np.quantile(size, 0.95))
    # a coarse torque stands on its next steps as often as on 0; a dead band leaves them empty
    next_ones = np.isin(size, np.unique(size)[1:3])
    if near.mean() < NEAR_SHARE or next_ones.sum() > LIKE_OTHERS * still.sum():
        return ()
    return (
        f"{where}: {100 * still.mean():.2g} % of the rows are exactly 0, and it comes there from small "
        "values: a dead band set small torques to 0; where it was taken off larger ones, too, Coulomb "
        "friction is too small by it: record the torque without, or add the band to what is not 0",
    )
