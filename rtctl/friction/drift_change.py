"""Where within the window the friction changed at once: what was before tells nothing of what is.

A window that holds strokes of before and after gives a factor between the two, and an interval of neither. So
the newest strokes that would do for an estimate alone are compared with those before: the same balance
(`rtctl.friction.drift_estimate`), with two more unknowns, by which the factor of the dry friction and the
share of the viscous one were others before. Where both together are surely not 0, and worth it, the strokes
of before are forgotten. What a sensor's zero, a spring or a weight do in between is in the balance as it
is."""

from __future__ import annotations

import math

import numpy as np

from rtctl.friction import drift_estimate as of_window
from rtctl.friction.drift_estimate import METHOD_FLOOR, STROKES_MIN, VISCOUS, VISCOUS_OFF
from rtctl.friction.drift_strokes import Strokes, unpacked

# small changes were up to 2.2 from 0, a tenth 5.6 to 6.7. With four a tenth was told after 21 s for 24, at
# half the distance from no change (decision 0120)
SURE = 5.0
"""Standard errors, of both unknowns together, by which friction was another one: each stroke asks anew."""

BEFORE_MIN = 3
"""Fewest strokes in each direction that tell what was before."""

LEAST = 0.03
"""Least change of the friction for which strokes are forgotten, RMS over them, share of the dry one."""

# chosen on two seeds of the geared joint: with 2 a stroke of before stayed on one (decision 0120)
BORDER = 4
"""Oldest of the newest strokes, which may be of before yet or of both, that go once later ones tell no change
any more: told as soon as it is sure, a change is not always before all of them."""

DRY_OFF = 0.3
"""Known before: standard deviation of a change of the factor."""


def forget_before_change(strokes: Strokes, rate_hz: float) -> None:
    """Forget the strokes of before, where the friction has surely changed since."""
    table = of_window.newest_sessions(strokes.table)
    newest = _newest(table)
    if newest == 0:
        return
    if _changed(table, newest, rate_hz):
        strokes.border = BORDER
        strokes.keep_newest(len(table) - newest)
    elif strokes.border:
        strokes.keep_newest(len(table) - strokes.border)
        strokes.border = 0


def _newest(table: np.ndarray) -> int:
    """First of the newest strokes that suffice for an estimate; 0 where those before do not."""
    zz = unpacked(table)[0]
    forward = zz[:, 0, 1] > 0
    ways = [np.flatnonzero(way) for way in (forward, ~forward)]
    if min(len(way) for way in ways) < STROKES_MIN:
        return 0
    # six of each direction: a stroke long one way may have many short ones the other way beside it
    first = int(min(way[-STROKES_MIN] for way in ways))
    before = forward[:first]
    return first if min(before.sum(), (~before).sum()) >= BEFORE_MIN else 0


def _changed(table: np.ndarray, newest: int, rate_hz: float) -> bool:
    """Whether friction before the stroke `newest` was surely another one than from it on."""
    zz = unpacked(table)[0]
    of, known, moves = of_window.unknowns(table, rate_hz)
    # the two unknowns more come last: what was known of the others stays at its place
    n = of.shape[2]
    then = np.zeros((*of.shape[:2], 2))
    # the same columns once more for the strokes of before alone: their coefficients are what changed
    then[:newest, 0, 0] = then[:newest, VISCOUS, 1] = 1.0
    of, moves = np.concatenate([of, then], axis=2), np.pad(moves, ((0, 0), (0, 2)))
    # viscous friction may be any: held at what was learned, its change would count as one of dry friction
    known = np.pad(of_window.freed(known), (0, 2))
    known[n, n], known[n + 1, n + 1] = DRY_OFF**-2, VISCOUS_OFF**-2
    sums = of_window.summed(table, of)
    columns = np.ix_((0, VISCOUS), (0, VISCOUS))
    squares = zz.sum(axis=0)[columns]

    def told(known: np.ndarray) -> bool:
        found, cov = of_window.solved(sums, known)
        # twice for the factor: what the method errs by before and after
        change, doubt = found[n:], cov[n:, n:] + np.diag([2.0 * METHOD_FLOOR**2, METHOD_FLOOR**2])
        worth = math.sqrt(float(change @ squares @ change) / squares[0, 0])
        return worth > LEAST and float(change @ np.linalg.solve(doubt, change)) > SURE**2

    # offsets that move no more than is usual make it look surer than it is, and are found at once
    return told(known + moves.T @ moves / of_window.WANDER_SHARE**2) and told(
        of_window.wandering(sums, known, moves)
    )
