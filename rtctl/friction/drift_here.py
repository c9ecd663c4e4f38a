"""What the friction was before, at the place where the hand works now.

A curve of speed alone is off by what places differ by, and no motion at one place tells that from a change
of the friction. The same place, seen before and now, does: what changed there is no place."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

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


SURE = 3.0
"""Standard errors by which viscous friction changed since, for sure."""


BETTER = 0.7
"""Share of the standard error from which on an estimate of viscous friction takes another's place: a handful
of times, so that it cannot follow a slow change."""


# mixed windows told 1.12 +- .015 of a joint whose dry friction had not changed (decision 0109)
MIXED = 1.5
"""Strokes that tell viscous friction by so many times the standard error of a motion as quick are not of one
friction: it changes within them, and what of it is dry they do not say."""

# with .025 the factor fell back by .12 for some seconds (decision 0109)
BESIDE_BEFORE = 0.04
"""Standard error of the factor beside free viscous friction up to which a change of both is told apart, where
the same motion told it before: what both err by together goes into the interval."""


@dataclass(frozen=True)
class Here:
    """Where a motion was (its middle and the RMS about it, rad), and what was found there."""

    middle_rad: float
    reach_rad: float
    found: Estimate

    def like(self, other: Here) -> bool:
        """Whether both are of one place."""
        return (
            # in shares of the reach: what is the same place to a wide stroke is another to a narrow one
            abs(self.middle_rad - other.middle_rad) <= ALIKE * self.reach_rad
            and abs(math.log(self.reach_rad / other.reach_rad)) <= ALIKE
            and abs(self.found.place_trust - other.found.place_trust) <= ALIKE
        )

    def as_quick(self, other: Here) -> bool:
        """Whether both are of such speeds that a model errs alike over them."""
        # by the size of viscous friction: it goes with the RMS speed, and over it a model errs alike
        slow, quick = sorted((self.found.viscous_nm, other.found.viscous_nm))
        return quick <= slow * math.exp(ALIKE)


class Places:
    """The places of one axis since the host started: an encoder may count from elsewhere after that."""

    def __init__(self) -> None:
        self._seen: deque[Here] = deque(maxlen=PLACES)

    def before(
        self, found: Estimate, strokes: Strokes, *, keep: bool
    ) -> tuple[Estimate | None, Estimate | None]:
        """What was found here first, and what a motion as quick as this told of viscous friction best; None
        where nothing was. This motion is remembered then, or where it tells more and the same, if `keep`."""
        here = _here(found, strokes)
        if here is None:
            return None, None
        alike = [one for one in self._seen if one.like(here)]
        quick = [one.found for one in alike if one.as_quick(here)]
        as_quick = min(quick, key=lambda one: one.viscous_error, default=None)
        # appended: the first of a place stays first, since a slow change must not become its reference
        if keep and found.factor_error <= FOUND and (as_quick is None or _tells_more(found, as_quick)):
            self._seen.append(here)
        return alike[0].found if alike else None, as_quick


def _tells_more(found: Estimate, of: Estimate) -> bool:
    """Whether viscous friction is told better by this estimate, and as the other has it."""
    sure = found.viscous_error < BETTER * of.viscous_error
    return sure and abs(found.viscous - of.viscous) < math.hypot(found.viscous_error, of.viscous_error)


def beside_viscous(found: Estimate, before: Estimate | None) -> Estimate:
    """The estimate where viscous friction has surely changed since `before`, of a motion as quick; with a
    wider interval while it may be changing.

    What the model errs by over speed looks like viscous friction, but alike in both: the difference is
    changes alone."""
    if before is None:
        return found
    # a window of two frictions: the interval says so, the factor is not mended by half of a change
    if found.viscous_error > MIXED * before.viscous_error:
        return replace(found, factor_error=math.hypot(found.factor_error, found.beside_error))
    if max(found.beside_error, before.beside_error) >= BESIDE_BEFORE:
        return found
    error = math.hypot(found.viscous_error, before.viscous_error)
    if not abs(found.viscous - before.viscous) > SURE * error:
        return found
    # what both err by over speed is alike in both and goes out of their difference
    factor = before.factor + found.beside - before.beside
    return replace(
        found,
        factor=factor,
        factor_error=math.hypot(before.factor_error, before.beside_error, found.beside_error),
        forward=found.forward + factor - found.factor,
        backward=found.backward + factor - found.factor,
    )


def stayed(found: Estimate, strokes: Strokes) -> bool:
    """Whether the present session's strokes were at one place: those of two have the middle and the reach of
    a third, where friction is neither's."""
    table = strokes.table[strokes.table[:, 0] == strokes.session]
    rows = np.cumsum(table[:, 1])
    # by rows and not by strokes: half of the motion, however many turns it has
    early = rows <= rows[-1:] / 2
    first, second = (_at(table[half], found, strokes) for half in (early, ~early))
    return first is not None and second is not None and first.like(second)


def _here(found: Estimate, strokes: Strokes) -> Here | None:
    """Where the present session's strokes were; None where they are few, or too much is of earlier ones."""
    table = strokes.table[strokes.table[:, 0] == strokes.session]
    # the factor is of all the window: where most of it is older, this place did not make it
    if found.session_seconds < AFTER_S or table[:, 1].sum() < strokes.rows / 2:
        return None
    return _at(table, found, strokes)


def _at(table: np.ndarray, found: Estimate, strokes: Strokes) -> Here | None:
    """Where these strokes were; None of no strokes, or at one point."""
    # sums of place and place squared are kept with each stroke: no position need be
    rows, squares = max(float(table[:, 1].sum()), 1.0), unpacked(table)[0].sum(axis=0)
    middle = squares[PLACE, -1] / rows
    reach = math.sqrt(max(squares[PLACE, PLACE] / rows - middle**2, 0.0))
    return Here(strokes.from_rad + middle, reach, found) if reach > 0.0 else None
