"""What the friction was before, at the place where the hand works now.

A curve of speed alone is off by what places differ by, and no motion at one place tells that from a change
of the friction. The same place, seen before and now, does: what changed there is no place."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from rtctl.friction.drift_estimate import PLACE, Estimate
from rtctl.friction.drift_strokes import Strokes, unpacked

PLACES = 256
"""Places remembered at most."""

FOUND = 0.015
"""Standard error of a factor that is remembered,"""

AFTER_S = 5.0
"""and sliding of the present session that tells a place: a joint that sticks and slips shows little more."""

ALIKE = 0.5
"""Two motions are at one place whose middles are so near, in shares of their reach, whose reaches are so
alike, and whose places were trusted so alike. Less, and each window of a hand's strokes is a place of its
own."""


@dataclass(frozen=True)
class Here:
    """Where a motion was (its middle and the RMS about it, rad), and the factor found there."""

    middle_rad: float
    reach_rad: float
    trust: float
    factor: float
    error: float

    def like(self, other: Here) -> bool:
        """Whether both are of one place."""
        return (
            abs(self.middle_rad - other.middle_rad) <= ALIKE * self.reach_rad
            and abs(math.log(self.reach_rad / other.reach_rad)) <= ALIKE
            and abs(self.trust - other.trust) <= ALIKE
        )


class Places:
    """The places of one axis since the host started: an encoder may count from elsewhere after that."""

    def __init__(self) -> None:
        self._seen: deque[Here] = deque(maxlen=PLACES)

    def before(self, found: Estimate, strokes: Strokes, *, keep: bool) -> Here | None:
        """What was found here first; None where nothing was: this motion is remembered then, if `keep`."""
        here = _here(found, strokes)
        if here is None:
            return None
        for one in self._seen:
            if one.like(here):
                return one
        if keep and here.error <= FOUND:
            self._seen.append(here)
        return None


def _here(found: Estimate, strokes: Strokes) -> Here | None:
    """Where the present session's strokes were; None where they are few, or too much is of earlier ones."""
    table = strokes.table[strokes.table[:, 0] == strokes.session]
    rows = float(table[:, 1].sum())
    if found.session_seconds < AFTER_S or rows < strokes.rows / 2:
        return None
    squares = unpacked(table)[0].sum(axis=0)
    middle = squares[PLACE, -1] / rows
    reach = math.sqrt(max(squares[PLACE, PLACE] / rows - middle**2, 0.0))
    if not reach > 0.0:
        return None
    return Here(strokes.from_rad + middle, reach, found.place_trust, found.factor, found.factor_error)
