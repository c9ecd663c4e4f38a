"""Folds of a cross-validation in blocks: what belongs together is held out together.

Shuffled folds put a point's neighbour, or its repeat, in the training set, and then reward over-fitting.
"""

from __future__ import annotations

import numpy as np

from rtctl.errors import DataError

FOLDS = 5
TRAINS = -1
"""Fold of points that always train."""


def folds_by_speed(speed: np.ndarray, n_folds: int = FOLDS) -> np.ndarray:
    """Fold of each point, shape (n,): all points of one speed share it; `TRAINS` at both ends.

    The lowest and highest speed always train: the model is never used beyond them, and break-away at v = 0
    cannot be guessed from motion.

    Raises
    ------
    DataError
        Fewer than 4 different speeds.
    """
    levels, block = np.unique(speed, return_inverse=True)
    if len(levels) < 4:
        raise DataError(f"{len(levels)} different speeds, at least 4 are needed; measure more speeds")
    end = (block == 0) | (block == len(levels) - 1)
    fold: np.ndarray = np.where(end, TRAINS, block % min(n_folds, len(levels) - 2))
    return fold


def folds_by_time(time_s: np.ndarray, n_folds: int = FOLDS) -> np.ndarray:
    """Fold of each sample of a log, shape (n,): `n_folds` stretches of equal duration.

    Raises
    ------
    DataError
        Times that are not finite, or that leave a stretch empty.
    """
    time_s = np.asarray(time_s, dtype=float)
    if not np.isfinite(time_s).all() or not np.ptp(time_s) > 0:
        raise DataError("the times of the log are not finite or all the same; correct the time column")
    share = (time_s - time_s.min()) / np.ptp(time_s)
    fold: np.ndarray = np.minimum((share * n_folds).astype(int), n_folds - 1)
    if len(np.unique(fold)) < n_folds:
        raise DataError(f"a gap leaves one of {n_folds} stretches of the log empty; use a longer log")
    return fold
