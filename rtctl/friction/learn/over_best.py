"""What the choice errs beside the best rung, and how well the points that say so know it.

The least of a dozen errors on a test is partly luck: what any of them errs there in truth is more. Against
the rung that the other points call the best, the choice and its rival have both been chosen by other points
than those that judge them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rtctl.friction.learn.certainty import of_mean

LEVEL = 0.95


@dataclass(frozen=True)
class OverBest:
    """The error of the choice over the least one, RMS, with its interval of `LEVEL` from `low` to `high`;
    `by_others` is that over the rungs that are the best on all other blocks, block by block."""

    times: float
    low: float
    high: float
    by_others: float


def over_best(chosen: np.ndarray, rivals: Mapping[str, np.ndarray], blocks: np.ndarray) -> OverBest:
    """Compare the errors of the choice with those of each rival at the same points, all in one unit, shape
    (n,), by the block of each point: its session, or its speed.

    Notes
    -----
    The interval is of the logarithm, point by point and by blocks, by Student's t; that the best one was the
    best by luck is not in it. One block says nothing: 0 to infinity. A rival of error 0 leaves nothing to
    compare with: 1 where the choice has none either, else infinity."""
    block = np.unique(blocks, return_inverse=True)[1]
    ours = np.bincount(block, chosen**2)
    theirs = {name: np.bincount(block, errors**2) for name, errors in rivals.items()}
    best = min(theirs, key=lambda name: float(theirs[name].sum()))
    others = [
        min(theirs, key=lambda name: float(np.delete(theirs[name], at).sum())) for at in range(len(ours))
    ]
    by_others = float(np.array([theirs[name][at] for at, name in enumerate(others)]).sum())
    times = _root(float(ours.sum()), float(theirs[best].sum()))
    # one block: an infinite standard error, and no degree of freedom
    wide = math.inf if len(ours) < 2 else _quantile(len(ours)) * _of_log(chosen, rivals[best], blocks)
    return OverBest(
        times, times * math.exp(-wide), times * math.exp(wide), _root(float(ours.sum()), by_others)
    )


def _root(ours: float, theirs: float) -> float:
    """Root of the ratio of two sums of squares."""
    if theirs > 0:
        return math.sqrt(ours / theirs)
    return math.inf if ours > 0 else 1.0


def _of_log(chosen: np.ndarray, best: np.ndarray, blocks: np.ndarray) -> float:
    """Standard error of the logarithm of the ratio of their RMS."""
    squares = [errors**2 / mean for errors in (chosen, best) if (mean := float(np.mean(errors**2))) > 0]
    # half: of the root; one without errors leaves the ratio 0, 1 or infinite, whatever is drawn
    return 0.5 * of_mean(squares[0] - squares[1], blocks) if len(squares) == 2 else 0.0


def _quantile(blocks: int) -> float:
    from scipy.special import stdtrit

    return float(stdtrit(blocks - 1, 0.5 * (1 + LEVEL)))
