"""Search the hyper-parameters by cross-validation in blocks, on one machine or many.

The work is a list of independent chunks handed to joblib; results come back in the order of the list, so
the outcome does not depend on the backend or on the number of workers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rtctl.errors import UnidentifiableError
from rtctl.friction.kind_table import KERNELS
from rtctl.friction.learn.gram import MANY, Gram
from rtctl.friction.learn.grids import in_scale_of
from rtctl.friction.learn.hold_out import FOLDS, TRAINS, common_levels, folds_of, less_offsets, units_of
from rtctl.friction.learn.machines import MAX_ITERATIONS, Candidate, FailedFitError, Trained, train
from rtctl.friction.learn.score import Score
from rtctl.friction.points import FrictionPoints

if TYPE_CHECKING:
    from joblib import Parallel

BREAK_AWAY_WEIGHT = 3.0
"""Weight of break-away points: one of 55, and the only one that says what a rig at rest holds."""


@dataclass(frozen=True)
class Effort:
    """What a round spends on a candidate: solver iterations, folds held out and points trained on, at most
    (None: all)."""

    iterations: int = MAX_ITERATIONS
    folds: int | None = None
    points: int | None = None


ALL = Effort()

# fewer points and folds rank candidates well enough to drop two thirds of them (decision 0032)
ROUNDS = (Effort(5_000, 2, MANY), Effort(50_000, None, 2 * MANY), ALL)
"""Rounds of successive halving: few iterations, folds and points for all candidates, everything for the
best."""

KEEP = 3
"""Each round keeps one in this many candidates of a family."""

# candidates that follow each other in a grid share a kernel matrix, which a chunk makes once
CHUNK = 12

Progress = Callable[[int, int], None]
"""Called with (done, all) candidates."""


@dataclass(frozen=True)
class Side:
    """Points of one direction, ready to be learned: +1, -1, or 0 for both as one symmetric curve."""

    direction: int
    speed: np.ndarray
    friction_nm: np.ndarray
    weight: np.ndarray
    fold: np.ndarray
    block: np.ndarray | None = None
    """What each point was measured with (`hold_out.units_of`): errors within are alike. None: nobody says."""
    session: np.ndarray | None = None
    """Session of each point, where whole sessions are held out; else None."""
    level: np.ndarray | None = None
    """Level of each point's speed, where sessions that are held out are measured at the same speeds; else
    None."""
    between: np.ndarray | None = None
    """Fold of each point by speed, beside `fold`, where there is a `level`: sessions vouch for each other's
    speeds, and what a curve does between them is seen by no session held out."""

    @property
    def compared_folds(self) -> np.ndarray:
        """Fold of each of the errors that candidates are compared by (`Score.compared`)."""
        folds: np.ndarray = self.fold[self.fold != TRAINS]
        if self.between is None:
            return folds
        return np.concatenate([folds, FOLDS + self.between[self.between != TRAINS]])

    def learned_nm(self, kept: np.ndarray | None = None) -> np.ndarray:
        """Friction (N m) to learn the points of `kept` (default all) from, shape (k,): less what their
        sessions differ by, where that can be told.

        A machine has small errors for nothing: between two sessions it may lie anywhere. The next one is
        nearest to their mean."""
        rows = np.arange(len(self.speed)) if kept is None else np.flatnonzero(kept)
        if self.level is None or self.session is None:
            known: np.ndarray = self.friction_nm[rows]
            return known
        return less_offsets(self.friction_nm[rows], self.level[rows], self.session[rows])


def side(
    points: FrictionPoints, direction: int, break_away_weight: float = BREAK_AWAY_WEIGHT, folds: str = "speed"
) -> Side:
    """Points of one direction (0: both as one) with their weights and their folds (`hold_out.WAYS`)."""
    directions = (direction,) if direction else (1, -1)
    parts = [points.branch(one) for one in directions]
    speed, friction_nm = (np.concatenate(column) for column in zip(*parts, strict=True))
    # by the speed and not by a column: break-away is what stands at 0, whoever measured it
    weight = np.where(speed == 0, break_away_weight, 1.0)
    rows = np.concatenate([points.rows_of(one) for one in directions])
    block = units_of(points, folds)[rows]
    fold = folds_of(points, directions, folds)
    # only between sessions can what they differ by be told from what friction does over speed
    if folds != "log":
        return Side(direction, speed, friction_nm, weight, fold, block)
    level = common_levels(speed, block)
    between = None if level is None else folds_of(points, directions, "speed")
    return Side(direction, speed, friction_nm, weight, fold, block, block, level, between)


def cross_validate(
    candidate: Candidate,
    data: Side,
    gram: Gram | None = None,
    effort: Effort = ALL,
    max_terms: int | None = None,
) -> Score:
    """Score of one candidate on held-out folds.

    A fit that fails gives a score that says so: "not finite", "not converged" (only in the last round: the
    early ones stop early on purpose), "refused", or "more than N support vectors" when it has more than
    `max_terms` trained on all points; `n_terms` is then their number."""
    final, errors, terms = effort == ALL, [], []
    converged, ways = True, (data.fold, *(() if data.between is None else (data.between,)))
    blocks = []
    try:
        for fold in ways:
            # by rows: errors then come in the order of the points, whatever the order of the folds
            found = np.zeros(len(data.speed))
            folds = np.unique(fold[fold != TRAINS])[: effort.folds]
            for k in folds:
                trained, off = _held_out(candidate, data, fold == k, fold != k, gram, effort)
                # where it stopped hangs on the iterations allowed, and is no curve of the machine
                if final and not trained.converged:
                    raise FailedFitError("not converged")
                converged = converged and trained.converged
                found[fold == k] = off
                terms.append(trained.curve.n_terms)
            held = np.isin(fold, folds)
            errors.append(found[held])
            blocks.append(None if data.block is None else data.block[held])
        count = float(np.mean(terms))
        if final or (max_terms is not None and converged):
            whole = train(candidate, data.speed, data.learned_nm(), data.weight, gram=gram)
            if final and not whole.converged:
                raise FailedFitError("not converged")
            count = float(whole.curve.n_terms)
            # trained on all points, since folds have fewer and would let through what is too many in the end
            if max_terms is not None and candidate.machine != "formula" and count > max_terms:
                reason = f"more than {max_terms} support vectors"
                return Score(candidate, data.direction, np.zeros(0), count, reason)
    except FailedFitError as error:
        # infinitely many numbers: no rule that prefers fewer can choose what failed
        return Score(candidate, data.direction, np.zeros(0), np.inf, error.reason)
    except UnidentifiableError as error:
        return Score(candidate, data.direction, np.zeros(0), np.inf, str(error))
    # speeds held out of all sessions: what a curve does between them no session sees (decision 0130)
    beside = (errors[1], blocks[1]) if len(errors) > 1 else ()
    return Score(candidate, data.direction, errors[0], count, None, converged, blocks[0], *beside)


def _held_out(
    candidate: Candidate, data: Side, held: np.ndarray, kept: np.ndarray, gram: Gram | None, effort: Effort
) -> tuple[Trained, np.ndarray]:
    """Train on what is kept, and errors (N m) of what is held out."""
    weight, n = data.weight, int(kept.sum())
    if effort.points is not None and n > effort.points:
        kept = _thinned(kept, data.speed, effort.points)
        weight = weight * n / effort.points  # fewer points pull as much at the curve together
    trained = train(
        in_scale_of(candidate, data.speed, data.friction_nm, kept, data.session),
        data.speed[kept],
        data.learned_nm(kept),
        weight[kept],
        gram=None if gram is None else gram.part(kept),
        max_iterations=effort.iterations,
    )
    if gram is None or gram.factor is None or trained.weights is None:
        return trained, trained.curve(data.speed[held]) - data.friction_nm[held]
    # by the factor: a sum of kernels costs points times support vectors, a factor its rank
    said = gram.factor[held] @ trained.weights + trained.curve.intercept
    return trained, said - data.friction_nm[held]


def _thinned(kept: np.ndarray, speed: np.ndarray, points: int) -> np.ndarray:
    """As many of the points kept, evenly among them by speed: the slowest and the fastest stay."""
    rows = np.flatnonzero(kept)
    rows = rows[np.argsort(speed[rows], kind="stable")]
    fewer = np.zeros(len(kept), dtype=bool)
    fewer[rows[np.linspace(0, len(rows) - 1, points).round().astype(int)]] = True
    return fewer


def _chunk(
    batch: Sequence[tuple[Candidate, int]], sides: Sequence[Side], effort: Effort, max_terms: int | None
) -> list[Score]:
    """Score a batch of (candidate, index of its side); one kernel matrix serves all that share it."""
    grams: dict[tuple[Any, ...], Gram] = {}
    scores = []
    for one, at in batch:
        # the side, too: its speeds make the matrix
        key = (one.kind, at, *one.parameters.items())
        if one.kind in KERNELS and key not in grams:
            grams[key] = Gram.of(one.kind, one.parameters, sides[at].speed)
        scores.append(cross_validate(one, sides[at], grams.get(key), effort, max_terms))
    return scores


def score_all(
    pool: Parallel,
    tasks: Sequence[tuple[Candidate, int]],
    sides: Sequence[Side],
    effort: Effort = ALL,
    *,
    progress: Progress | None = None,
    max_terms: int | None = None,
) -> list[Score]:
    """Score every task on the pool; the result has the order of `tasks`."""
    import joblib

    batches = [tasks[i : i + CHUNK] for i in range(0, len(tasks), CHUNK)]
    scores: list[Score] = []
    for done in pool(joblib.delayed(_chunk)(batch, sides, effort, max_terms) for batch in batches):
        scores += done
        if progress:
            progress(len(scores), len(tasks))
    return scores


def halving(
    pool: Parallel,
    tasks: Sequence[tuple[Candidate, int]],
    sides: Sequence[Side],
    *,
    progress: Progress | None = None,
    max_terms: int | None = None,
) -> list[Score]:
    """Successive halving, family by family and side by side: few folds, points and iterations for all, more
    for the best.

    What has converged early stays beside the most promising of the rest, so that a family whose best
    candidates never converge still has one. Returns the scores of the last round (all converged or failed),
    and every failure of the earlier ones."""
    lost: list[Score] = []
    # in the order of the tasks: the outcome does not hang on which worker was first
    left = list(tasks)
    for effort in ROUNDS:
        scores = score_all(pool, left, sides, effort, progress=progress, max_terms=max_terms)
        if effort == ALL:
            return [*scores, *lost]
        # failures of early rounds are told as well: why a family has no candidate is else nobody's to say
        lost += [score for score in scores if score.failed]
        left = _promising(scores, sides)
    return lost


def _promising(scores: Sequence[Score], sides: Sequence[Side]) -> list[tuple[Candidate, int]]:
    """Best of each family and side: one in `KEEP`, and the best that converged already."""
    index = {data.direction: at for at, data in enumerate(sides)}
    groups: dict[tuple[str, int], list[Score]] = {}
    for score in scores:
        if not score.failed:
            groups.setdefault((score.candidate.family, score.direction), []).append(score)
    kept = []
    for members in groups.values():
        # by what candidates are compared by in the end, or halving would drop what the choice wants
        ranked = sorted(members, key=lambda score: score.compared_nm)
        best = ranked[: -(-len(ranked) // KEEP)]  # rounded up: a family keeps one at least
        # `is`: scores hold arrays, which have no one answer to ==
        done = [score for score in ranked if score.converged and not any(score is one for one in best)]
        kept += best + done[:1]
    return [(score.candidate, index[score.direction]) for score in kept]
