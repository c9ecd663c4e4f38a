"""The error of a whole fit on points it never saw: chosen anew without each fold, then judged by that fold.

A held-out error of a ladder is the least of hundreds, so it is smaller than that of the next log. Nested in
another cross-validation it is not: what is held out outside has chosen nothing."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field, replace

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.learn import ladder
from rtctl.friction.learn.certainty import standard_error
from rtctl.friction.learn.hold_out import TRAINS, folds_of, units_of
from rtctl.friction.model import FrictionModel
from rtctl.friction.points import FrictionPoints

CHOSEN = "chosen"


@dataclass(frozen=True)
class NextSession:
    """A session that no part of a fit has seen, N m: what the fit erred there, RMS, what its ladder expected
    (`ladder.Ladder.expected_next_nm`), and between what it said that it would; None: it said nothing."""

    came_nm: float
    expected_nm: float
    between_nm: tuple[float, float] | None


@dataclass(frozen=True)
class Generalisation:
    """Errors (N m) of the fits on what each never saw, `rmse_nm` with its standard error `se_nm`; `chosen`
    rung of each fold.

    `held_out_nm` is what the ladders themselves held out of the rungs they chose, RMS over the folds: what
    they promised. `of_rungs` has (error, its standard error) of every rung that each fit could learn, when
    they were asked for, N m. `covered` is the share of what was held out that lies within the band of the fit
    without it (`band.Band`), 0 to 1, of the choice (`CHOSEN`) and of every such rung; without a name where
    some fit has no band. `errors_nm` are the errors of the same, (n,), `unit` what each is held out with.
    `sessions` are those held out, where whole logs are."""

    rmse_nm: float
    se_nm: float
    held_out_nm: float
    chosen: tuple[str, ...]
    of_rungs: dict[str, tuple[float, float]] = field(default_factory=dict)
    covered: dict[str, float] = field(default_factory=dict)
    errors_nm: dict[str, np.ndarray] = field(default_factory=dict)
    unit: np.ndarray = field(default_factory=lambda: np.zeros(0))
    sessions: tuple[NextSession, ...] = ()

    def __str__(self) -> str:
        """In a sentence."""
        rungs = ", ".join(f"{name} {self.chosen.count(name)} times" for name in dict.fromkeys(self.chosen))
        return (
            f"Generalisation error (nested: chosen anew without each fold): {1e3 * self.rmse_nm:.3g} +- "
            f"{1e3 * self.se_nm:.2g} mN m; chosen was {rungs}."
        )


def generalisation(
    points: FrictionPoints, options: ladder.Options, *, every_rung: bool = False
) -> Generalisation:
    """Climb the ladder once for each fold of the points, without it, and judge the choice (and every rung) by
    it.

    Both directions of a fold are held out at once, and all of each unit: the slowest and the fastest point of
    a session held out train nothing. These two, and what is faster than anything a fit saw, are not judged.

    Raises
    ------
    DataError
        A fold without which nothing can be learned."""
    fold = _folds(points, options.folds)
    unit = units_of(points, options.folds)
    errors: dict[str, list[np.ndarray]] = {}
    inside: dict[str, list[np.ndarray]] = {}
    blocks, chosen, promised, sessions = [], [], [], []
    way, folds = options.folds, np.unique(fold[fold != TRAINS])
    if len(folds) < 3:  # one log is left, which has no other to be held out with
        options = replace(options, folds="speed")
    for k in folds:
        held = np.isin(unit, unit[fold == k])  # the ends of the speeds, too, which a ladder always trains on
        # left out in place: rows keep their folds, and a point that was bad stays bad (decision 0046)
        hidden = held if points.left_out is None else held | points.left_out
        training = replace(points, left_out=hidden)
        found = ladder.ascend(training, options)
        models = {CHOSEN: ladder.learn(training, found, rig="nested")}
        if every_rung:
            models |= _of_rungs(training, found)
        chosen.append(found.choice.chosen.family)
        # what the ladder said of itself before it saw these rows, to be held against what came
        promised.append(found.choice.chosen.rmse_nm)
        rows = np.flatnonzero(fold == k)
        speed = np.abs(points.velocity_rad_s[rows])
        side = (points.direction[rows] < 0).astype(int)
        fastest = np.array([branch.speed_max_rad_s for branch in models[CHOSEN].branches])
        # each direction by its own range: beyond it a model is held at its end, which is no prediction
        rows = rows[speed <= fastest[side]]
        for name, model in models.items():
            error = _predicted(model, points, rows) - points.friction_nm[rows]
            # fold by fold and not as one mean: a rung that misses a fold is found by its count
            errors.setdefault(name, []).append(error)
            band = model.branches[0].band  # both directions share it
            if band is not None:
                inside.setdefault(name, []).append(band.holds(np.abs(points.velocity_rad_s[rows]), error))
        blocks.append(unit[rows])
        if way == "log":
            sessions += _sessions(found, errors[CHOSEN][-1], unit[rows])
    if not blocks:
        raise DataError(f"{points.source}: no fold to hold out; add points")
    block = np.concatenate(blocks)
    whole = _of_all_folds(errors, len(blocks))
    figures = {name: _figures(error, block) for name, error in whole.items()}
    rmse_nm, se_nm = figures.pop(CHOSEN)
    held_out_nm = float(np.sqrt(np.mean(np.square(promised))))
    covered = {name: float(np.mean(held)) for name, held in _of_all_folds(inside, len(blocks)).items()}
    return Generalisation(
        rmse_nm, se_nm, held_out_nm, tuple(chosen), figures, covered, whole, block, tuple(sessions)
    )


def _of_all_folds(parts: dict[str, list[np.ndarray]], folds: int) -> dict[str, np.ndarray]:
    """Those that have a part of every fold, put together."""
    # a rung that missed a fold is judged by easier points than the others
    return {name: np.concatenate(some) for name, some in parts.items() if len(some) == folds}


def _sessions(found: ladder.Ladder, error: np.ndarray, session: np.ndarray) -> list[NextSession]:
    """What was expected of each session of a fold, and what came."""
    rmse = [float(np.sqrt(np.mean(error[session == one] ** 2))) for one in np.unique(session)]
    return [NextSession(came_nm, found.expected_next_nm, found.next_range_nm) for came_nm in rmse]


def _figures(error: np.ndarray, block: np.ndarray) -> tuple[float, float]:
    """RMS and its standard error, N m."""
    return float(np.sqrt(np.mean(error**2))), standard_error(error, block)


def _of_rungs(points: FrictionPoints, found: ladder.Ladder) -> dict[str, FrictionModel]:
    """Models of all rungs that can be learned from these points, also of formulas whose peak they do not
    tell: it may predict all the same."""
    models = {}
    for rung in found.choice.rungs:
        if len(rung.scores) == len(found.choice.chosen.scores):
            with contextlib.suppress(DataError):  # another fold tells; a rung that misses one has no figure
                models[rung.family] = ladder.learn(points, found, rig="nested", rung=rung)
    return models


def _predicted(model: FrictionModel, points: FrictionPoints, rows: np.ndarray) -> np.ndarray:
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
