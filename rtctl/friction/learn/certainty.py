"""How sure a held-out error is: errors that were measured together count as one."""

from __future__ import annotations

import math

import numpy as np


def standard_error(errors: np.ndarray, blocks: np.ndarray | None = None) -> float:
    """Standard error of the root mean square of `errors`: that of the mean square, over twice the root.

    Parameters
    ----------
    blocks
        Block of each error, shape (n,): errors of one block (a lap, a log, a stretch of time) are alike and
        count as one.

    Notes
    -----
    The variance of a ratio of sums over blocks. One block says nothing of others: its standard error is
    infinite."""
    squares = errors**2
    # d sqrt(m) = dm/(2 sqrt m)
    rmse = np.sqrt(squares.mean()) if len(squares) else 0.0
    return float(of_mean(squares, blocks) / (2 * rmse)) if rmse > 0 else 0.0


def of_mean(values: np.ndarray, blocks: np.ndarray | None = None) -> float:
    """Standard error of the mean of `values`, shape (n,), in their unit; `blocks` and one block as in
    `standard_error`."""
    names, block = np.unique(np.arange(len(values)) if blocks is None else blocks, return_inverse=True)
    n = len(names)
    if n < 2:
        return float("inf")
    # sums and not means of blocks: one of few errors says as little as it holds
    off = np.bincount(block, values - values.mean())
    return float(np.sqrt(float(off @ off) * n / (n - 1)) / len(values))


# decision 0064: by two the band holds 80 to 90 %, by one 91 to 97 and is as wide as the friction
FREEDOM_MIN = 2
"""Degrees of freedom that two blocks are taken for: by the one that they have, another lies within
12.7 standard errors, a band that no one would use."""

BLOCKS_MIN = 5
"""Fewest blocks that know their own spread well enough to choose by."""


def doubt(errors: np.ndarray, blocks: np.ndarray | None) -> float:
    """Standard error that models are chosen within, N m: by blocks, or where there are too few of them error
    by error.

    The spread of two or three sessions is a matter of luck: as often as not it would let the plainest model
    through. What sessions differ by is common to all models, and says little of which one is better."""
    return standard_error(errors, _known(blocks))


def another_session(errors: np.ndarray, blocks: np.ndarray, directions: np.ndarray, level: float) -> float:
    """What an error of another block (session) exceeds in 1 - `level` of all cases, of normal numbers; in
    their unit. 0 of one block, which says nothing of another. `directions` has that of each error, +1 or -1.

    Notes
    -----
    An error is what its block shares in its direction and what is its own: a zero that moved is on the other
    side in the other direction, so that over both nothing of it would be shared. Of the own part there are
    many; the shared one is known by as few numbers as there are blocks, one of which is spent: each is held
    against the mean of the others. So its quantile is Student's of blocks - 1 degrees of freedom
    (`FREEDOM_MIN` at least)."""
    from scipy.stats import norm, t

    n_blocks = len(np.unique(blocks))
    if n_blocks < 2:
        return 0.0
    shared, own = _parted(errors, blocks, directions)
    side = 0.5 * (1 + level)
    # the shared part is known by as few numbers as there are sessions, the own one by all errors: so
    # Student's for one and the normal quantile for the other
    others, own_ones = float(t.ppf(side, max(n_blocks - 1, FREEDOM_MIN))), float(norm.ppf(side))
    return math.sqrt(others**2 * shared + own_ones**2 * own)


def next_session(
    errors: np.ndarray, blocks: np.ndarray, directions: np.ndarray, share: float
) -> tuple[float, float]:
    """Between what the root mean square error of one more session lies in `share` (0 to 1) of all cases, in
    the unit of `errors`: those of sessions held out, `blocks` the session of each, `directions` as in
    `another_session`. 0 to infinity of one session, which says nothing of another.

    Notes
    -----
    What a session shares is one normal number, whose spread as many numbers tell as there are sessions less
    one: its square goes by Fisher's F, and of two sessions, unlike the band, by the one number they have. A
    session held out of S is held against S - 1 others, the next one against all: its square is 1 - 1/S^2 of
    theirs. Both parts are taken at their ends at once, which is a little wide."""
    from scipy.special import fdtri

    sessions = len(np.unique(blocks))
    if sessions < 2:
        return 0.0, math.inf
    shared, own = _parted(errors, blocks, directions)
    points, ends = len(errors) / sessions, np.array([0.5 * (1 - share), 0.5 * (1 + share)])
    square = shared * fdtri(1, sessions - 1, ends) + own * fdtri(points, points * (sessions - 1), ends)
    low, high = np.sqrt((1 - 1 / sessions**2) * square)
    return float(low), float(high)


def _parted(errors: np.ndarray, blocks: np.ndarray, directions: np.ndarray) -> tuple[float, float]:
    """Mean square of `errors` in two parts: what blocks share in a direction, and what is each error's
    own."""
    # in each direction by itself: a zero that moved is on the other side in the other one, and over both
    # nothing of it is left (decision 0123)
    _, half, count = np.unique([blocks, directions], axis=1, return_inverse=True, return_counts=True)
    mean = np.bincount(half, errors) / count
    # what chance alone makes of a mean of so many: the rest of its square is shared
    own = np.bincount(half, (errors - mean[half]) ** 2) / np.maximum(count - 1, 1) / count
    own[count == 1] = np.inf  # one error says nothing of what others share with it
    whole = float(np.mean(errors**2))
    # sums over halves may exceed the mean square by rounding; a share is not more than all
    shared = min(float(np.sum(count * np.maximum(mean**2 - own, 0.0))) / len(errors), whole)
    return shared, whole - shared


def excess(errors: np.ndarray, others: np.ndarray, blocks: np.ndarray | None) -> tuple[float, float]:
    """Mean square of `errors` less that of `others`, made on the same points, and its standard error, unit
    squared; blocks as in `doubt`.

    Point by point, for what is hard to say for one model is hard for the other: their difference is known
    better than either."""
    # squares, since they are what is compared: a signed difference would let two errors cancel
    difference = errors**2 - others**2
    return float(difference.mean()), of_mean(difference, _known(blocks))


def _known(blocks: np.ndarray | None) -> np.ndarray | None:
    """The blocks, or None where they are too few to know their own spread."""
    return None if blocks is not None and len(np.unique(blocks)) < BLOCKS_MIN else blocks


def less_shared(errors: np.ndarray, sessions: np.ndarray) -> np.ndarray:
    """Errors less what each session's own mean differs by from the mean of all errors, shape (n,).

    What a session lies above or below the others is the same for every model, and squared it drowns what is
    not. The mean of all stays: a curve that lies too high everywhere is worse."""
    session = np.unique(sessions, return_inverse=True)[1]
    mean = np.bincount(session, errors) / np.bincount(session)
    left: np.ndarray = errors - mean[session] + errors.mean()
    return left
