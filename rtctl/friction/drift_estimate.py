"""Factor of the dry friction and offset from sums over strokes, with honest intervals (docs/theory.md 5.9).

Least squares over  tau - J a - b v = m s F + d F + e J a + c b v + k x + o  (`rtctl.friction.drift_strokes`),
an offset for each session that may wander: taken as constant, a sensor's zero that moves within the window is
told as friction of strokes that are mostly one way early and the other way late. What a motion cannot tell is
bounded by what is known before it: the two directions rarely drift apart (d), the rig file's inertia is about
right (e), and so are the sensors' zeros (o) and what a spring or a weight may pull with (k). Viscous friction
is what was learned (c) unless the motion says otherwise, surely: at one speed it is not told from dry
friction, over many it is. Forward stronger than backward and an offset are nearly the same thing where F
changes little with speed: the factor of one direction therefore has the wider interval.

Rows of one stroke are no independent witnesses. So a stroke counts as one observation against what is known
before, and standard errors are clustered by stroke: cov = A^-1 (sum of u u' + P) A^-1, u the score of one
stroke."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rtctl.friction.drift_deployed import Deployed
from rtctl.friction.drift_strokes import COLUMNS, Strokes, unpacked

DIRECTION, INERTIA, VISCOUS, PLACE = range(1, COLUMNS - 1)
"""Places of the unknowns; 0 is the factor, the offsets come last: of each session, at times a few seconds
apart."""

STROKES_MIN = 6
"""Fewest strokes in each direction that tell."""

DIRECTIONS_DIFFER = 0.1
"""Known before: standard deviation of half the difference of the directions' factors,"""

INERTIA_OFF = 0.1
"""of the share that the inertia is off by,"""

OFFSET_SHARE = 0.15
"""of the offset, share of the dry friction,"""

WANDER_S = 8.0
"""of what it moves by in so many seconds of sliding,"""

WANDER_SHARE = 0.04
"""likewise, or as much more as the strokes themselves show, to"""

WANDER_MOST = 0.25
"""of it: a sensor's zero that swings within a minute,"""

_WANDER_ROUNDS = 3

PULL_SHARE = 0.3
"""of what a spring pulls with where the joint is mostly, likewise,"""

VISCOUS_OFF = 1.0
"""and of the share that viscous friction is off by, where the motion tells it by"""

VISCOUS_SURE = 2.0
"""standard errors, and beyond what the model errs by over speed; else it is as learned, to"""

SHAPE_MOST = 0.04
"""(of the dry friction at most; its largest error is no error of its shape)"""

BESIDE_VISCOUS = 0.025
"""and where the factor is left known to this standard error: in motion of few speeds it is not, and would
jump. Else it only widens the interval, the more the surer it is, by what the factor would be."""

VISCOUS_CALM = 0.02
"""a share with this standard deviation."""

METHOD_FLOOR = 0.01
"""What the method itself may be off by, as a standard deviation of the factor: bristles, cogging, lateness of
the torques."""

DIRECTION_FLOOR = 0.03
"""What it may be off by in the factor of one direction, and in the offset as a share of the dry friction:
what tells the two apart is how F changes with speed, which the model has to a hundredth of F, and that is a
good part of the change."""

_SESSIONS = 8


@dataclass(frozen=True)
class Estimate:
    """What the last strokes of one axis say. Factors are of the model's dry friction, each with its standard
    error."""

    factor: float
    factor_error: float
    forward: float
    forward_error: float
    backward: float
    backward_error: float
    offset_nm: float
    offset_error_nm: float
    dry_nm: float
    """Mean dry friction of the model over these strokes, N m."""
    strokes: int
    seconds: float
    """Sliding motion that this is from, s."""
    session_seconds: float
    """Part of it in the present session, s."""
    place_trust: float
    """Share by which the places of this motion were trusted, 0 to 1: by speed alone, to by place."""
    viscous_nm: float
    """Viscous friction of the model over these strokes (RMS), N m."""
    viscous: float
    viscous_error: float
    """Share that it seems to be off by, with what the model errs by over speed in it;"""
    beside: float
    beside_error: float
    """and the factor beside such a share: errors are of the motion alone."""


def estimate(strokes: Strokes, by: Deployed, rate_hz: float) -> Estimate | None:
    """Estimate from what is remembered; None with too few strokes in one of the directions."""
    table = newest_sessions(strokes.table)
    n = table[:, 1]
    zz = unpacked(table)[0]
    forward = zz[:, 0, 1] > 0
    if min(int(forward.sum()), int((~forward).sum())) < STROKES_MIN:
        return None
    sessions, at = np.unique(table[:, 0], return_inverse=True)
    dry, trust = _dry_nm(table), float(table[:, 2].sum() / n.sum())
    of, known, moves = unknowns(table, rate_hz)
    sums = summed(table, of)
    known = wandering(sums, known, moves)
    doubt_nm = min(max(METHOD_FLOOR * dry, by.doubt_of_sliding_nm(trust)), SHAPE_MOST * dry)
    free, free_cov = solved(sums, freed(known))
    found, cov, hidden = _beside_viscous(sums, known, doubt_nm, free, free_cov)
    present = table[:, 0] == strokes.session

    def error(column: np.ndarray, floor: float) -> float:
        return float(np.sqrt(column @ cov @ column + floor**2))

    one = np.eye(len(found))
    last = at == len(sessions) - 1  # an offset is told of now, not of earlier tares
    now = np.einsum("nck,nc->k", of[last], zz[last][:, -1]) / n[last].sum()
    now[:PLACE] = 0.0  # in the middle of where it was in the last session
    return Estimate(
        factor=float(found[0]),
        factor_error=error(one[0], math.hypot(METHOD_FLOOR, hidden)),
        forward=float(found[0] + found[1]),
        forward_error=error(one[0] + one[1], DIRECTION_FLOOR),
        backward=float(found[0] - found[1]),
        backward_error=error(one[0] - one[1], DIRECTION_FLOOR),
        offset_nm=float(now @ found),
        offset_error_nm=error(now, DIRECTION_FLOOR * dry),
        dry_nm=dry,
        strokes=len(table),
        seconds=float(n.sum()) / rate_hz,
        session_seconds=float(n[present].sum()) / rate_hz,
        place_trust=trust,
        viscous_nm=math.sqrt(float(zz[:, VISCOUS, VISCOUS].sum() / n.sum())),
        viscous=float(free[VISCOUS]),
        viscous_error=math.sqrt(free_cov[VISCOUS, VISCOUS]),
        beside=float(free[0]),
        beside_error=math.sqrt(free_cov[0, 0]),
    )


def unknowns(table: np.ndarray, rate_hz: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which unknowns each column of each stroke is of, what is known of them before, and the offsets' moves
    (`_offsets`) in N m."""
    at, dry = np.unique(table[:, 0], return_inverse=True)[1], _dry_nm(table)
    of, offsets, moves = _offsets(table[:, 1], at, WANDER_S * rate_hz)
    known = np.zeros((of.shape[2], of.shape[2]))
    for unknown, spread in ((DIRECTION, DIRECTIONS_DIFFER), (INERTIA, INERTIA_OFF), (VISCOUS, VISCOUS_CALM)):
        known[unknown, unknown] = spread**-2
    known[PLACE, PLACE] = _spread(unpacked(table)[0], at) / (PULL_SHARE * dry) ** 2
    known[COLUMNS - 1 :, COLUMNS - 1 :] = offsets / dry**2
    return of, known, moves / dry


def _dry_nm(table: np.ndarray) -> float:
    """Mean dry friction of the model over these strokes."""
    return float(unpacked(table)[0][:, 1, COLUMNS - 1].sum() / table[:, 1].sum())


def newest_sessions(table: np.ndarray) -> np.ndarray:
    """Strokes of the last sessions: each has an offset of its own."""
    sessions = np.unique(table[:, 0])[-_SESSIONS:]
    return table[table[:, 0] >= sessions[0]] if len(sessions) else table


def _offsets(
    rows: np.ndarray, session: np.ndarray, apart: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which unknowns each column of a stroke is of, (strokes, `COLUMNS`, unknowns), what is known of the
    offsets before, in shares of the dry friction, and their moves.

    The offset is linear between knots, some `apart` rows from one another, and moves from one to the next by
    chance: a row of the moves, (moves, unknowns), gives one as if it were over `apart` rows."""
    shares, known, moves = np.zeros((len(rows), 0)), np.zeros(0), np.zeros((0, COLUMNS - 1))
    for one in range(int(session.max()) + 1):
        there = np.flatnonzero(session == one)
        end = np.cumsum(rows[there])
        steps = math.ceil(end[-1] / apart)
        at = (end - 0.5 * rows[there]) / end[-1] * steps
        hats = np.zeros((len(rows), steps + 1))
        hats[there] = np.maximum(1.0 - np.abs(at[:, None] - np.arange(steps + 1)), 0.0)
        shares = np.hstack([shares, hats])
        known = np.append(known, np.full(steps + 1, 1.0 / ((steps + 1) * OFFSET_SHARE**2)))
        moves = np.pad(moves, ((0, steps), (0, steps + 1)))
        moves[-steps:, -steps - 1 :] = np.diff(np.eye(steps + 1), axis=0) / math.sqrt(
            end[-1] / (steps * apart)  # steps may be shorter than `apart`: chance grows as the root
        )
    of = np.zeros((len(rows), COLUMNS, COLUMNS - 1 + shares.shape[1]))
    same = np.arange(COLUMNS - 1)
    of[:, same, same] = 1.0
    of[:, -1, COLUMNS - 1 :] = shares
    return of, np.diag(known), moves


@dataclass(frozen=True)
class Sums:
    """Normal equations of each stroke (`zz`, `zy`) and of all (`A`, `b`), rows of each; the least variance of
    a row; rows of all, and their mean."""

    A: np.ndarray
    b: np.ndarray
    zz: np.ndarray
    zy: np.ndarray
    yy: float
    rows: np.ndarray
    least: float
    all_rows: float
    per_stroke: float


def summed(table: np.ndarray, of: np.ndarray) -> Sums:
    """Normal equations of strokes in the unknowns that their columns are `of`."""
    least = (METHOD_FLOOR * _dry_nm(table)) ** 2 * len(table)  # what the model errs by is in every stroke
    zz, zy, yy = unpacked(table)
    to = of.transpose(0, 2, 1)
    zz, zy = to @ zz @ of, (to @ zy[:, :, None])[:, :, 0]
    rows = table[:, 1]
    A, b, of_all = zz.sum(axis=0), zy.sum(axis=0), (float(rows.sum()), float(rows.mean()))
    return Sums(A, b, zz, zy, float(yy.sum()), rows, least, *of_all)


def wandering(sums: Sums, known: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """What is `known`, with offsets whose moves (shares of the dry friction) are as large as these strokes
    show them to be, within bounds.

    Each round takes the mean square of the moves that are found, and of what is left open of them, for their
    variance."""
    share = WANDER_SHARE
    for _ in range(_WANDER_ROUNDS):
        found, cov = solved(sums, known + moves.T @ moves / share**2)
        square = (moves @ found) ** 2 + np.einsum("ij,jk,ik->i", moves, cov, moves)
        share = min(max(math.sqrt(float(square.mean())), WANDER_SHARE), WANDER_MOST)
    wanders: np.ndarray = known + moves.T @ moves / share**2
    return wanders


def freed(known: np.ndarray) -> np.ndarray:
    """What is known before, with viscous friction that may be any."""
    free = known.copy()
    free[VISCOUS, VISCOUS] = VISCOUS_OFF**-2
    return free


def _beside_viscous(
    sums: Sums, known: np.ndarray, doubt_nm: float, found: np.ndarray, cov: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Coefficients and covariance, with viscous friction as learned unless the motion says otherwise, and
    what that may hide of the factor; `found` and `cov` are those with viscous friction free.

    What the model may err by over speed, `doubt_nm`, is no viscous friction."""
    square = float(sums.zz[:, VISCOUS, VISCOUS].sum())
    of_model = doubt_nm**2 * sums.all_rows / max(square, 1e-300)
    sure = abs(float(found[VISCOUS])) / math.sqrt(cov[VISCOUS, VISCOUS] + of_model)
    if sure > VISCOUS_SURE and cov[0, 0] < BESIDE_VISCOUS**2:
        return found, cov, 0.0
    likely = min(sure / VISCOUS_SURE, 1.0)
    calm, cov = solved(sums, known)
    return calm, cov, likely * abs(float(found[0] - calm[0]))


def _spread(zz: np.ndarray, session: np.ndarray) -> float:
    """Mean square of the places about the middle of their session."""
    n, first, second = (np.bincount(session, zz[:, *at]) for at in ((-1, -1), (PLACE, -1), (PLACE, PLACE)))
    return float((second - first**2 / n).sum() / n.sum())


def solved(sums: Sums, known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients and their covariance, clustered by stroke; a stroke is one observation against what is
    `known`."""
    rows, per_stroke, clusters = sums.all_rows, sums.per_stroke, len(sums.rows)
    scale = per_stroke * max(sums.yy / rows, sums.least)
    found: np.ndarray = np.zeros(len(sums.b))
    for _ in range(3):  # the variance is that of what is left, and weighs against what is known
        found = np.linalg.solve(sums.A / scale + known, sums.b / scale)
        left = max(sums.yy - 2 * found @ sums.b + found @ sums.A @ found, 0.0) / rows
        scale = per_stroke * max(left, sums.least)  # a stroke is one witness
    inverse = np.linalg.inv(sums.A / scale + known)
    score = (sums.zy - sums.zz @ found) / scale
    return found, inverse @ (score.T @ score * (clusters / (clusters - 1)) + known) @ inverse
