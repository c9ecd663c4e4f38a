"""Search the hyper-parameters by cross-validation in blocks, on one machine or many.

The work is a list of independent chunks handed to joblib; results come back in the order of the list, so
the outcome does not depend on the backend or on the number of workers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rtctl.errors import UnidentifiableError
from rtctl.friction.kinds.table import KERNELS
from rtctl.friction.learn.grids import in_scale_of
from rtctl.friction.learn.hold_out import TRAINS, folds_of, units_of
from rtctl.friction.learn.machines import MAX_ITERATIONS, Candidate, FailedFitError, train
from rtctl.friction.points.measured import FrictionPoints

if TYPE_CHECKING:
    from joblib import Parallel

BREAK_AWAY_WEIGHT = 3.0
"""Weight of break-away points: one of 55, and the only one that says what a rig at rest holds."""

RUNGS: tuple[tuple[int, int | None], ...] = ((5_000, 2), (50_000, None), (MAX_ITERATIONS, None))
"""Solver iterations, and folds held out at most (None: all), of the rounds of successive halving."""

KEEP = 3
"""Each round keeps one in this many candidates of a family."""

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


@dataclass(frozen=True)
class Score:
    """Held-out errors (N m) of one candidate on one side; `failed` says why there are none.

    `n_terms` is the number of support vectors, or parameters, trained on all points (before the last round of
    halving: mean over the folds).
    """

    candidate: Candidate
    direction: int
    errors: np.ndarray
    n_terms: float
    failed: str | None = None
    converged: bool = True
    blocks: np.ndarray | None = None
    """Block of each error, as of `Side`; None: each is its own."""

    @property
    def rmse_nm(self) -> float:
        """Root mean square of the held-out errors; infinite when the candidate failed."""
        return float("inf") if self.failed else float(np.sqrt(np.mean(self.errors**2)))

    @property
    def se_nm(self) -> float:
        """Standard error of `rmse_nm`."""
        return standard_error(self.errors, self.blocks)

    @property
    def doubt_nm(self) -> float:
        """See `doubt`, N m."""
        return doubt(self.errors, self.blocks)


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


def side(
    points: FrictionPoints,
    direction: int,
    break_away_weight: float = BREAK_AWAY_WEIGHT,
    folds: str = "speed",
) -> Side:
    """Points of one direction (0: both as one) with their weights and their folds (`hold_out.WAYS`)."""
    directions = (direction,) if direction else (1, -1)
    parts = [points.branch(one) for one in directions]
    speed, friction_nm = (np.concatenate(column) for column in zip(*parts, strict=True))
    weight = np.where(speed == 0, break_away_weight, 1.0)
    rows = np.concatenate([points.rows_of(one) for one in directions])
    block = units_of(points, folds)[rows]
    return Side(direction, speed, friction_nm, weight, folds_of(points, directions, folds), block)


def cross_validate(
    candidate: Candidate,
    data: Side,
    matrix: np.ndarray | None = None,
    max_iterations: int = MAX_ITERATIONS,
    *,
    final: bool = True,
    max_terms: int | None = None,
    most_folds: int | None = None,
) -> Score:
    """Score of one candidate on held-out folds, `most_folds` of them at most.

    A fit that fails gives a score that says so: "not finite", "not converged" (only when `final`: the early
    rounds of halving stop early on purpose), "refused", or "more than N support vectors" when it has more than
    `max_terms` trained on all points; `n_terms` is then their number.
    """
    errors, terms, converged = np.zeros(len(data.speed)), [], True
    folds = np.unique(data.fold[data.fold != TRAINS])[:most_folds]
    try:
        for k in folds:
            held, kept = data.fold == k, data.fold != k
            trained = train(
                in_scale_of(candidate, data.speed, data.friction_nm, kept),
                data.speed[kept],
                data.friction_nm[kept],
                data.weight[kept],
                matrix=None if matrix is None else matrix[np.ix_(kept, kept)],
                max_iterations=max_iterations,
            )
            if final and not trained.converged:
                raise FailedFitError("not converged")
            converged = converged and trained.converged
            errors[held] = trained.curve(data.speed[held]) - data.friction_nm[held]
            terms.append(trained.curve.n_terms)
        count = float(np.mean(terms))
        if final or (max_terms is not None and converged):
            whole = train(candidate, data.speed, data.friction_nm, data.weight, matrix=matrix)
            if final and not whole.converged:
                raise FailedFitError("not converged")
            count = float(whole.curve.n_terms)
            if max_terms is not None and candidate.machine != "formula" and count > max_terms:
                reason = f"more than {max_terms} support vectors"
                return Score(candidate, data.direction, np.zeros(0), count, reason)
    except FailedFitError as error:
        return Score(candidate, data.direction, np.zeros(0), np.inf, error.reason)
    except UnidentifiableError as error:
        return Score(candidate, data.direction, np.zeros(0), np.inf, str(error))
    held = np.isin(data.fold, folds)
    blocks = None if data.block is None else data.block[held]
    return Score(candidate, data.direction, errors[held], count, converged=converged, blocks=blocks)


def _chunk(
    batch: Sequence[tuple[Candidate, int]],
    sides: Sequence[Side],
    limit: int,
    final: bool,
    max_terms: int | None,
    most_folds: int | None,
) -> list[Score]:
    """Score a batch of (candidate, index of its side); one kernel matrix serves all that share it."""
    matrices: dict[tuple[Any, ...], np.ndarray] = {}
    scores = []
    for one, at in batch:
        key = (one.kind, at, *one.parameters.items())
        if one.kind in KERNELS and key not in matrices:
            speed = sides[at].speed
            matrices[key] = KERNELS[one.kind].matrix(one.parameters, speed, speed)
        matrix = matrices.get(key)
        scores.append(
            cross_validate(
                one, sides[at], matrix, limit, final=final, max_terms=max_terms, most_folds=most_folds
            )
        )
    return scores


def score_all(
    pool: Parallel,
    tasks: Sequence[tuple[Candidate, int]],
    sides: Sequence[Side],
    limit: int = MAX_ITERATIONS,
    *,
    final: bool = True,
    progress: Progress | None = None,
    max_terms: int | None = None,
    most_folds: int | None = None,
) -> list[Score]:
    """Score every task on the pool; the result has the order of `tasks`."""
    import joblib

    batches = [tasks[i : i + CHUNK] for i in range(0, len(tasks), CHUNK)]
    scores: list[Score] = []
    for done in pool(
        joblib.delayed(_chunk)(batch, sides, limit, final, max_terms, most_folds) for batch in batches
    ):
        scores += done
        if progress:
            progress(len(scores), len(tasks))
    return scores


def full(
    pool: Parallel,
    tasks: Sequence[tuple[Candidate, int]],
    sides: Sequence[Side],
    progress: Progress | None = None,
    *,
    max_terms: int | None = None,
) -> list[Score]:
    """Score every candidate to convergence."""
    return score_all(pool, tasks, sides, progress=progress, max_terms=max_terms)


def halving(
    pool: Parallel,
    tasks: Sequence[tuple[Candidate, int]],
    sides: Sequence[Side],
    progress: Progress | None = None,
    *,
    max_terms: int | None = None,
) -> list[Score]:
    """Successive halving, family by family and side by side: few folds and iterations for all, more for the best.

    What has converged early stays beside the most promising of the rest, so that a family whose best
    candidates never converge still has one. Returns the scores of the last round (all converged or failed),
    and every failure of the earlier ones.
    """
    lost: list[Score] = []
    left = list(tasks)
    for limit, most_folds in RUNGS:
        final = limit == MAX_ITERATIONS
        scores = score_all(
            pool,
            left,
            sides,
            limit,
            final=final,
            progress=progress,
            max_terms=max_terms,
            most_folds=most_folds,
        )
        if final:
            return [*scores, *lost]
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
        ranked = sorted(members, key=lambda score: score.rmse_nm)
        best = ranked[: -(-len(ranked) // KEEP)]
        done = [score for score in ranked if score.converged and not any(score is one for one in best)]
        kept += best + done[:1]
    return [(score.candidate, index[score.direction]) for score in kept]
