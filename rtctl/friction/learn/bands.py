"""Learn the band of a curve from what was held out of it: whole sessions where there are some.

Conformal prediction, of normalised errors: the scale of the held-out errors by region of speed, times that
quantile of the errors in their scale which a further one exceeds once in twenty. Nothing is supposed of their
distribution, only that the next session is another one of the same kind."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rtctl.friction.band import LEVEL, Band
from rtctl.friction.learn import certainty, search
from rtctl.friction.learn.foretold import Foretold, foretold, next_nm, next_of_one_nm
from rtctl.friction.learn.hold_out import TRAINS, several_logs
from rtctl.friction.learn.machines import Candidate
from rtctl.friction.learn.score import Score
from rtctl.friction.learn.search import Side
from rtctl.friction.model import Branch
from rtctl.friction.point_columns import BETWEEN
from rtctl.friction.points import FrictionPoints

# without them 86 to 97 % of what was held out lay in the band, with them 93 to 99 (decision 0031)
SURE = 2.0
"""Standard errors of the held-out error by which the band is stretched: candidates are chosen for a small
one, which is partly luck."""

REGIONS = 3
"""Most regions of speed."""

REGION_MIN = 20
"""Fewest held-out errors of a region: fewer do not know their own scale."""


def way_of(points: FrictionPoints, folds: str) -> str:
    """What is held out for the band: sessions where there are two or more, else what the fit holds out."""
    return "log" if several_logs(points) else folds


def band_of(
    points: FrictionPoints,
    candidates: Sequence[tuple[Candidate, int]],
    folds: str,
    break_away_weight: float = search.BREAK_AWAY_WEIGHT,
) -> Band | None:
    """The band of a fit.

    Parameters
    ----------
    candidates
        What was learned, with the direction it was learned from: +1 and -1, or 0 alone for one symmetric
        curve.
    folds
        How the fit held out, of `hold_out.WAYS`.

    Returns
    -------
    Band or None
        None where it cannot be learned without each of the units held out: nothing is known of a session
        then."""
    # sessions before all else, even where the ladder was held out by speed: the band is for another session
    way = way_of(points, folds)
    sides = [search.side(points, direction, break_away_weight, way) for _, direction in candidates]
    # with all effort: a band of machines that stopped early would be of curves that nobody deploys
    scores = [search.cross_validate(one, data) for (one, _), data in zip(candidates, sides, strict=True)]
    return _of_sides(points, sides, scores, way)


def _of_sides(
    points: FrictionPoints, sides: Sequence[Side], scores: Sequence[Score], way: str
) -> Band | None:
    # a direction alone would have a band of half of what is deployed
    if any(score.failed for score in scores):
        return None
    held, directions = held_out(points, sides, scores, apart=way != "log")
    ahead = foretold([(score.candidate, data) for score, data in zip(scores, sides, strict=True)])
    band = of_both(held, directions, ahead, way)
    slowest = min(float(data.speed.min()) for data in sides)
    return None if band is None else replace(band, slowest_rad_s=slowest)


def held_out(
    points: FrictionPoints, sides: Sequence[Side], scores: Sequence[Score], *, apart: bool = False
) -> tuple[Foretold, np.ndarray]:
    """What was held out of all sides, and the direction of each error, +1 or -1, (n,). `apart`: with what
    levels of one log differ by between its stretches; whole logs held out differ as logs do."""
    rows = [_rows(points, data)[data.fold != TRAINS] for data in sides]
    # whole logs differ by what their stretches do already; the levels of one log do not, and would look too
    # good (decision 0098)
    errors_nm = [
        _with_parts(points, data, score.errors) if apart else score.errors
        for data, score in zip(sides, scores, strict=True)
    ]
    held = Foretold(
        speed=np.concatenate([data.speed[data.fold != TRAINS] for data in sides]),
        error_nm=np.concatenate(errors_nm),
        block=np.concatenate([score.blocks for score in scores if score.blocks is not None]),
    )
    return held, points.direction[np.concatenate(rows)]


def next_session(
    points: FrictionPoints, sides: Sequence[Side], scores: Sequence[Score], folds: str, ahead: Foretold | None
) -> tuple[tuple[float, float], int] | None:
    """Between what the RMS error of the next session lies, N m, and how many sessions know it
    (`foretold.next_nm`, `foretold.next_of_one_nm`). None where there are several and none was held out."""
    # one session: its stretches are all that it knows of others (decision 0174)
    held, directions = held_out(points, sides, scores, apart=folds != "log")
    if folds == "log":
        return next_nm(held, directions, ahead), len(np.unique(held.block))
    friction_nm = np.concatenate([data.friction_nm for data in sides])
    return None if several_logs(points) else (next_of_one_nm(held.rmse_nm, friction_nm), 1)


def _with_parts(points: FrictionPoints, data: Side, error_nm: np.ndarray) -> np.ndarray:
    """Held-out errors with what each point differs by between stretches of its log, where that is known.

    The means of one session over one speed and the next agree in whatever that session's motion, places and
    bristles were; another one's are as those of a stretch."""
    apart = points.columns.get(BETWEEN.name)
    if apart is None or not np.isfinite(apart).any():
        return error_nm
    # a level seen in one stretch does not know its own; squares are what adds up
    apart = np.where(np.isfinite(apart), apart, math.sqrt(float(np.nanmean(apart**2))))
    rows = _rows(points, data)
    # the sign stays: `another_session` asks what a session's errors share
    held: np.ndarray = np.copysign(np.hypot(error_nm, apart[rows][data.fold != TRAINS]), error_nm)
    return held


def _rows(points: FrictionPoints, data: Side) -> np.ndarray:
    """Rows of the points of a side, in its order."""
    return np.concatenate([points.rows_of(one) for one in ((data.direction,) if data.direction else (1, -1))])


def of_both(held_out: Foretold, directions: np.ndarray, ahead: Foretold | None, way: str) -> Band | None:
    """The band of errors held out, each in its direction (+1 or -1), or of sessions foretold by those before
    them where they are the larger ones.

    What another session may err is known by all sessions, and is larger by as much as these errors are."""
    least_nm = certainty.another_session(held_out.error_nm, held_out.block, directions, LEVEL)
    # whichever is the larger: with wear the next session is beyond all, without it foretelling knows less
    if ahead is not None and ahead.rmse_nm > held_out.rmse_nm > 0:
        least_nm *= ahead.rmse_nm / held_out.rmse_nm
        return of_errors(ahead.speed, ahead.error_nm, ahead.block, way, least_nm)
    return of_errors(held_out.speed, held_out.error_nm, held_out.block, way, least_nm)


def of_scores(
    points: FrictionPoints, scores: Sequence[Score], folds: str, break_away_weight: float
) -> Band | None:
    """The band of the candidates that a ladder chose, from the errors it held out itself where it held out
    the same."""
    if way_of(points, folds) == folds:
        sides = [search.side(points, one.direction, break_away_weight, folds) for one in scores]
        return _of_sides(points, sides, scores, folds)
    return band_of(points, [(one.candidate, one.direction) for one in scores], folds, break_away_weight)


def with_band(branches: tuple[Branch, Branch], band: Band | None) -> tuple[Branch, Branch]:
    """Both branches, with this band."""
    forward, backward = (replace(branch, band=band) for branch in branches)
    return forward, backward


def of_errors(
    speed: np.ndarray, error_nm: np.ndarray, block: np.ndarray, way: str, least_nm: float = 0.0
) -> Band | None:
    """The band of held-out errors (N m) at their speeds (rad/s), each of its block (`hold_out.units_of`),
    shape (n,); None of no errors. No region is narrower than `least_nm`, in its scale.

    Notes
    -----
    Of n errors in their own scale the one of rank ceil((n + 1) LEVEL) bounds another one with probability
    LEVEL at least; where n is below 19 there is no such rank, and the largest is stretched by 1 + 1/n. The
    RMS of the errors is known to some standard errors only, by blocks (few blocks: error by error), and is
    the least of many candidates': the band is stretched by `SURE` of them. Where few sessions share most of
    their errors, the largest of them are not the largest there are: `least_nm` is what another one may err
    (`certainty.another_session`)."""
    n = len(error_nm)
    if not n:
        return None
    size = np.abs(error_nm)
    regions = min(REGIONS, max(1, n // REGION_MIN))
    # equally many errors to a region, so that each knows its scale; equal speeds make edges fall together
    edges = np.unique(np.quantile(speed, np.arange(1, regions) / regions))
    region = np.searchsorted(edges, speed)
    squares = np.bincount(region, size**2, len(edges) + 1)
    count = np.bincount(region, minlength=len(edges) + 1)
    whole = math.sqrt(float(np.mean(size**2)))
    known = count >= REGION_MIN // 2  # equal speeds may leave a region nearly empty
    scale = np.where(known, np.sqrt(squares / np.maximum(count, 1)), whole)
    scale = np.maximum(scale, np.finfo(float).tiny)  # errors of 0 are divided by it
    # n + 1: the error that is to come may have any rank among those that are here, each as likely
    rank = math.ceil((n + 1) * LEVEL)
    # one quantile for all regions: a twentieth of twenty errors is one, which says little
    quantile = float(np.sort(size / scale[region])[min(rank, n) - 1])
    if rank > n:
        quantile *= 1 + 1 / n
    # errors of 0 have no share to be stretched by; a curve through exact points is as good as it looks
    if whole > 0:
        quantile *= 1 + SURE * certainty.doubt(error_nm, block) / whole
        quantile = max(quantile, least_nm / whole)
    widths = tuple(float(width) for width in quantile * scale)
    return Band(tuple(float(edge) for edge in edges), widths, way, len(np.unique(block)), n)
