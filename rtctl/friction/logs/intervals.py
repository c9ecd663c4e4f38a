"""Intervals of a least-squares fit to filtered logs, whose residuals repeat each other.

The textbook formula is several times too narrow there. The log is cut into G long blocks of time, which are
independent of each other, and the scores of each, grown by what it fitted away of itself
(docs/theory.md 9.7), are summed as squares, times ``(G - 1)/(G - 1 - K)``, with a t distribution of G - 1 - K
degrees of freedom give the interval (Bester, Conley and Hansen, J. Econometrics 165, 2011, where K = 0 and
all blocks are alike). K counts the columns slower than a block, such as drift: each takes the freedom of one
block. A column that few blocks tell has their freedom only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.logs.regressors import Regressors

BLOCK_PERIODS = 10
"""Shortest block, periods of the cut-off: residuals of two blocks are then independent."""

BLOCKS_MIN, BLOCKS_MAX = 6, 20
"""Fewest blocks in all, most of one log."""


@dataclass(frozen=True)
class Estimate:
    """One parameter: value, standard error and 95 % interval, in the parameter's unit; `doubt` is the part of
    the interval's half width that is not random."""

    value: float
    standard_error: float
    low: float
    high: float
    doubt: float = 0.0

    def doubted(self, by: float) -> Estimate:
        """The estimate with `by` added to both sides of the interval
        (`rtctl.friction.logs.other_readings`)."""
        return Estimate(self.value, self.standard_error, self.low - by, self.high + by, self.doubt + by)

    def holds(self, truth: float) -> bool:
        """Whether the 95 % interval contains `truth`."""
        return self.low <= truth <= self.high


RANK = 1e-10
"""Share of the largest eigenvalue of X'X below which a direction is not told at all."""
LEAST_LEFT = 1e-3
"""Least share of a block's errors that is taken to be left over: one that alone tells a column leaves
nothing."""


def blocks_in(duration_s: float, cutoff_hz: float) -> int:
    """How many blocks a log of that duration is cut into."""
    # t with 19 degrees of freedom is a fifteenth wider than the normal: more blocks would gain little, and
    # longer ones are the safer where friction wanders
    return max(1, min(BLOCKS_MAX, int(duration_s * cutoff_hz / BLOCK_PERIODS)))


def recorded_s(time_s: np.ndarray) -> np.ndarray:
    """When each row was recorded on a clock that begins with the first and stands still in the gaps (steps
    half as long again as most), s."""
    steps = np.diff(time_s, prepend=time_s[:1])
    return np.asarray(np.cumsum(np.where(steps > 1.5 * np.median(steps), 0.0, steps)))


def time_blocks(signals: Regressors) -> np.ndarray:
    """Number of the block of each sliding row, counted over all logs; no block spans two logs.

    Raises
    ------
    DataError
        Logs too short for `BLOCKS_MIN` blocks, or a log with no sliding rows."""
    block = np.empty(len(signals.sliding), int)
    first, spent_s = 0, 0.0
    for k, source in enumerate(signals.sources):
        rows = np.flatnonzero(signals.sliding & (signals.log == k))
        if len(rows) < BLOCKS_MIN:
            raise DataError(f"{source}: no steady sliding in this log; leave it out, or record wider motion")
        # from the first to the last sliding row: a rest at an end is no time in which anything was told
        between = (
            (signals.log == k) & (np.arange(len(block)) >= rows[0]) & (np.arange(len(block)) <= rows[-1])
        )
        duration_s = float(recorded_s(signals.time_s[between])[-1])
        for part in np.array_split(rows, blocks_in(duration_s, signals.cutoff_hz)):
            block[part] = first
            first += 1
        spent_s += duration_s
    if first < BLOCKS_MIN:
        raise DataError(
            f"{signals.source}: {spent_s:.3g} s are too short for intervals; "
            f"{BLOCKS_MIN * BLOCK_PERIODS / signals.cutoff_hz:.3g} s are needed at a cut-off of "
            f"{signals.cutoff_hz:g} Hz"
        )
    return np.asarray(block[signals.sliding])


def covariance(X: np.ndarray, residual: np.ndarray, block: np.ndarray, slow_columns: int) -> np.ndarray:
    """Covariance of the solution. X (n, p) has what it shares with the `slow_columns`, K of the module, taken
    off; residual and block (n,).

    Notes
    -----
    What a block leaves over is what it was, times (1 - h), h its leverage along each axis: so it is grown by
    (1 - h)^-1/2, which makes the variance right for errors that are alike."""
    blocks = int(block[-1]) + 1
    power, axes = np.linalg.eigh(X.T @ X)
    # columns that say the same leave a direction of which nothing is known: none of it is told
    told = power > RANK * power[-1]
    # half of (X'X)^-1: in its axes the leverage of a block is a share, whatever the units of the columns
    half = axes[:, told] / np.sqrt(power[told])
    changes = np.empty((blocks, X.shape[1]))
    for k in range(blocks):
        mine = X[block == k] @ half
        # the leverage along each axis: 1 where this block alone tells that direction
        share, axes = np.linalg.eigh(mine.T @ mine)
        grown = axes / np.sqrt(np.maximum(1 - share, LEAST_LEFT)) @ axes.T
        changes[k] = half @ (grown @ (mine.T @ residual[block == k]))
    return np.asarray(changes.T @ changes * (blocks - 1) / max(1, blocks - 1 - slow_columns))


def telling_blocks(X: np.ndarray, block: np.ndarray) -> np.ndarray:
    """How many blocks tell each column of X (n, p): fewer where most of a column's own variation lies in
    some; (sum w_g)^2/sum w_g^2, w_g the share of a block in its variance."""
    influence = np.linalg.pinv(X.T @ X, rcond=RANK, hermitian=True) @ X.T
    shares = np.array([(influence[:, block == k] ** 2).sum(axis=1) for k in range(int(block[-1]) + 1)])
    return np.asarray(shares.sum(axis=0) ** 2 / np.maximum((shares**2).sum(axis=0), 1e-300))


def estimates(
    names: Sequence[str], value: np.ndarray, error: np.ndarray, freedom: Sequence[float]
) -> dict[str, Estimate]:
    """Parameters with their 95 % intervals; `freedom` holds the degrees of freedom of each."""
    from scipy.stats import t

    found = {}
    for name, x, e, degrees in zip(names, value, error, freedom, strict=False):
        # below one degree of freedom there is no t; with one it is 12.7: hardly anything is known
        half = float(t.ppf(0.975, max(1, degrees))) * float(e)
        found[name] = Estimate(float(x), float(e), float(x) - half, float(x) + half)
    return found
