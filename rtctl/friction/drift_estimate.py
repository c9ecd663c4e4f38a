"""Factor of the dry friction and offset from sums over strokes, with honest intervals (docs/theory.md 5.9).

Least squares over  tau - J a - b v = m s F + d F + e J a + o  (`rtctl.friction.drift_strokes`), an offset for each session.
What a motion cannot tell is bounded by what is known before it: the two directions rarely drift apart (d), the rig file's
inertia is about right (e), and so are the sensors' zeros (o). Forward stronger than backward and an offset are nearly the same
thing where F changes little with speed: the factor of one direction therefore has the wider interval.

Rows of one stroke are no independent witnesses. So a stroke counts as one observation against what is known before,
and standard errors are clustered by stroke: cov = A^-1 (sum of u u' + P) A^-1, u the score of one stroke.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtctl.friction.drift_strokes import COLUMNS, Strokes, unpacked

STROKES_MIN = 6
"""Fewest strokes in each direction that tell."""

DIRECTIONS_DIFFER = 0.1
"""Known before: standard deviation of half the difference of the directions' factors,"""

INERTIA_OFF = 0.1
"""of the share that the inertia is off by,"""

OFFSET_SHARE = 0.15
"""and of the offset, share of the dry friction."""

METHOD_FLOOR = 0.01
"""What the method itself may be off by, as a standard deviation of the factor: bristles, cogging, lateness of the torques."""

DIRECTION_FLOOR = 0.03
"""What it may be off by in the factor of one direction, and in the offset as a share of the dry friction: what tells the two apart is how F changes with
speed, which the model has to a hundredth of F, and that is a good part of the change."""

_SESSIONS = 8


@dataclass(frozen=True)
class Estimate:
    """What the last strokes of one axis say. Factors are of the model's dry friction, each with its standard error."""

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


def estimate(strokes: Strokes, rate_hz: float) -> Estimate | None:
    """Estimate from what is remembered; None with too few strokes in one of the directions."""
    table = _newest_sessions(strokes.table)
    n = table[:, 1]
    zz, zy, yy = unpacked(table)
    forward = zz[:, 0, 1] > 0
    if min(int(forward.sum()), int((~forward).sum())) < STROKES_MIN:
        return None
    sessions, at = np.unique(table[:, 0], return_inverse=True)
    k = COLUMNS - 1 + len(sessions)
    place = np.tile(np.arange(COLUMNS), (len(table), 1))
    place[:, -1] += at  # the offset of its session
    A, b = np.zeros((k, k)), np.zeros(k)
    np.add.at(A, (place[:, :, None], place[:, None, :]), zz)
    np.add.at(b, place, zy)
    dry = float(zz[:, 1, COLUMNS - 1].sum() / n.sum())
    known = np.zeros(k)
    known[1], known[2] = DIRECTIONS_DIFFER**-2, INERTIA_OFF**-2
    known[3:] = (OFFSET_SHARE * dry) ** -2
    least = (METHOD_FLOOR * dry) ** 2 * len(table)  # what the model errs by is the same in every stroke
    found, scale = _solved(A, b, known, float(yy.sum()), n, least)
    inverse = np.linalg.inv(A / scale + np.diag(known))
    clusters = len(table)
    score = np.zeros((clusters, k))
    np.add.at(score, (np.arange(clusters)[:, None], place), zy - np.einsum("nij,nj->ni", zz, found[place]))
    score /= scale
    cov = inverse @ (score.T @ score * (clusters / (clusters - 1)) + np.diag(known)) @ inverse
    newest = COLUMNS - 1 + len(sessions) - 1
    present = table[:, 0] == strokes.session

    def error(column: np.ndarray, floor: float) -> float:
        return float(np.sqrt(column @ cov @ column + floor**2))

    one = np.eye(k)
    return Estimate(
        factor=float(found[0]),
        factor_error=error(one[0], METHOD_FLOOR),
        forward=float(found[0] + found[1]),
        forward_error=error(one[0] + one[1], DIRECTION_FLOOR),
        backward=float(found[0] - found[1]),
        backward_error=error(one[0] - one[1], DIRECTION_FLOOR),
        offset_nm=float(found[newest]),
        offset_error_nm=error(one[newest], DIRECTION_FLOOR * dry),
        dry_nm=dry,
        strokes=clusters,
        seconds=float(n.sum()) / rate_hz,
        session_seconds=float(n[present].sum()) / rate_hz,
        place_trust=float(table[:, 2].sum() / n.sum()),
    )


def _newest_sessions(table: np.ndarray) -> np.ndarray:
    sessions = np.unique(table[:, 0])[-_SESSIONS:]
    return table[np.isin(table[:, 0], sessions)]


def _solved(
    A: np.ndarray, b: np.ndarray, known: np.ndarray, yy: float, n: np.ndarray, least: float
) -> tuple[np.ndarray, float]:
    """Coefficients, and the variance that one row stands for when a stroke is one observation; of a row itself at least `least`."""
    rows, per_stroke = float(n.sum()), float(n.mean())
    scale = per_stroke * max(yy / rows, least)
    found: np.ndarray = np.zeros(len(b))
    for _ in range(3):
        found = np.linalg.solve(A / scale + np.diag(known), b / scale)
        left = max(yy - 2 * found @ b + found @ A @ found, 0.0) / rows
        scale = per_stroke * max(left, least)
    return found, scale
