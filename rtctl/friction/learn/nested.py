"""The error of a whole fit on points it never saw: chosen anew without each fold, then judged by that fold.

A held-out error of a ladder is the least of hundreds, so it is smaller than that of the next log. Nested in another
cross-validation it is not: what is held out outside has chosen nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.learn import ladder, search
from rtctl.friction.learn.hold_out import TRAINS, folds_of, units_of
from rtctl.friction.points.measured import FrictionPoints


@dataclass(frozen=True)
class Generalisation:
    """Errors (N m) of the fits on what each never saw, `rmse_nm` with its standard error `se_nm`; `chosen` rung of each fold."""

    errors: np.ndarray
    rmse_nm: float
    se_nm: float
    chosen: tuple[str, ...]

    def __str__(self) -> str:
        """In a sentence."""
        rungs = ", ".join(f"{name} {self.chosen.count(name)} times" for name in dict.fromkeys(self.chosen))
        return (
            f"Generalisation error (nested: chosen anew without each fold): {1e3 * self.rmse_nm:.3g} +- {1e3 * self.se_nm:.2g} mN m; "
            f"chosen was {rungs}."
        )


def generalisation(points: FrictionPoints, options: ladder.Options) -> Generalisation:
    """Climb the ladder once for each fold of the points, without it, and judge the choice by it.

    Both directions of a fold are held out at once. What is faster than anything a fit saw is not judged.

    Raises
    ------
    DataError
        A fold without which nothing can be learned.
    """
    fold = _folds(points, options.folds)
    unit = units_of(points, options.folds)
    errors, blocks, chosen = [], [], []
    folds = np.unique(fold[fold != TRAINS])
    if len(folds) < 3:  # one log is left, which has no other to be held out with
        options = replace(options, folds="speed")
    for k in folds:
        held = fold == k
        hidden = held if points.left_out is None else held | points.left_out
        training = replace(points, left_out=hidden)
        found = ladder.ascend(training, options)
        model = ladder.learn(training, found, rig="nested")
        chosen.append(found.choice.chosen.family)
        rows = np.flatnonzero(held)
        speed = np.abs(points.velocity_rad_s[rows])
        side = (points.direction[rows] < 0).astype(int)
        rows = rows[speed <= np.array([branch.speed_max_rad_s for branch in model.branches])[side]]
        errors.append(_predicted(model, points, rows) - points.friction_nm[rows])
        blocks.append(unit[rows])
    if not errors:
        raise DataError(f"{points.source}: no fold to hold out; add points")
    together = np.concatenate(errors)
    return Generalisation(
        together,
        float(np.sqrt(np.mean(together**2))),
        search.standard_error(together, np.concatenate(blocks)),
        tuple(chosen),
    )


def _predicted(model: ladder.FrictionModel, points: FrictionPoints, rows: np.ndarray) -> np.ndarray:
    """Friction (N m) that the model says at these points, each in its own direction."""
    speed = np.abs(points.velocity_rad_s[rows])
    forward, backward = (branch.magnitude(speed) for branch in model.branches)
    return np.where(points.direction[rows] > 0, forward, backward)


def _folds(points: FrictionPoints, way: str) -> np.ndarray:
    """Fold of every point, (n,): `TRAINS` of those left out, too."""
    fold = np.full(len(points.direction), TRAINS)
    for direction in (1, -1):
        fold[points.rows_of(direction)] = folds_of(points, (direction,), way)
    return fold
