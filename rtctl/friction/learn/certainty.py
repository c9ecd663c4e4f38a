"""How sure a held-out error is: errors that were measured together count as one."""

from __future__ import annotations

import numpy as np


def standard_error(errors: np.ndarray, blocks: np.ndarray | None = None) -> float:
    """Standard error of the root mean square of `errors`: that of the mean square, over twice the root.

    Parameters
    ----------
    blocks
        Block of each error, shape (n,): errors of one block (a lap, a log, a stretch of time) are alike and count as one.

    Notes
    -----
    The variance of a ratio of sums over blocks. One block says nothing of others: its standard error is infinite.
    """
    squares = errors**2
    rmse = np.sqrt(squares.mean()) if len(squares) else 0.0
    if not rmse > 0:
        return 0.0
    names, block = np.unique(np.arange(len(errors)) if blocks is None else blocks, return_inverse=True)
    n = len(names)
    if n == len(errors):
        return float(squares.std(ddof=1) / np.sqrt(n) / (2 * rmse))
    if n < 2:
        return float("inf")
    off = np.bincount(block, squares - squares.mean())
    variance = float(off @ off) * n / (n - 1) / len(errors) ** 2
    return float(np.sqrt(variance) / (2 * rmse))


BLOCKS_MIN = 5
"""Fewest blocks that know their own spread well enough to choose by."""


def doubt(errors: np.ndarray, blocks: np.ndarray | None) -> float:
    """Standard error that models are chosen within, N m: by blocks, or where there are too few of them error by error.

    The spread of two or three sessions is a matter of luck: as often as not it would let the plainest model through. What sessions differ
    by is common to all models, and says little of which one is better.
    """
    few = blocks is not None and len(np.unique(blocks)) < BLOCKS_MIN
    return standard_error(errors, None if few else blocks)
