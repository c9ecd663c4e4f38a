"""The ladder of models: search every rung, choose with a reason, and learn the chosen one for the loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.kind_table import FAMILIES, MACHINES
from rtctl.friction.learn import bands, fit, foretold, grids, mean, pool, search, sharing
from rtctl.friction.learn.machines import Candidate, FailedFitError, train
from rtctl.friction.learn.score import Score
from rtctl.friction.learn.search import Side
from rtctl.friction.learn.selection import Choice, Rung, as_good, choose, climb, tolerance_nm
from rtctl.friction.model import Branch, FrictionModel
from rtctl.friction.points import FrictionPoints

_POOLED_MAX = 12
"""Most candidates of the chosen rung that are tried on both directions as one curve; of a mean of many rungs
two of each."""


@dataclass(frozen=True)
class Options:
    """How to climb: `families` of `FAMILIES`, `strategy` full or halving, symmetry, workers, `hold_out.WAYS`.

    Held-out errors up to `tolerance_share` (0 to 1) of the largest friction are as good as smaller ones.
    `max_support_vectors`: most that a curve may have when trained on all points; None: any number. `mean`:
    the mean of the rungs may be taken (`learn.mean`), which has the numbers of all of them; not where their
    number is bounded."""

    families: tuple[str, ...] = FAMILIES
    strategy: str = "halving"
    symmetric: str = "auto"
    backend: str = "loky"
    n_jobs: int = -1
    break_away_weight: float = search.BREAK_AWAY_WEIGHT
    folds: str = "speed"
    tolerance_share: float = grids.RESOLUTION_SHARE
    max_support_vectors: int | None = None
    mean: bool = True


@dataclass(frozen=True)
class Ladder:
    """What was found. `symmetric`: one curve serves both directions; `symmetric_rung` what was tried of it.

    `folds` is how it was held out, of `hold_out.WAYS`; `tolerance_nm` the held-out error below which models
    were equal, N m; `max_support_vectors` what was asked for. `expected_next_nm` is what the next session may
    be expected to err, N m: most of what was held out, what each errs that those before it foretell, and one
    whose stretches differ. `next_range_nm` is between what it errs, N m (`bands.next_session`)."""

    choice: Choice
    sides: tuple[Side, ...]
    symmetric: bool
    symmetric_rung: Rung | None
    explanation: str
    folds: str = "speed"
    tolerance_nm: float = 0.0
    max_support_vectors: int | None = None
    expected_next_nm: float = 0.0
    next_range_nm: tuple[float, float] | None = None


def ascend(
    points: FrictionPoints, options: Options | None = None, progress: search.Progress | None = None
) -> Ladder:
    """Search all rungs by cross-validation in blocks of speed or time, and choose.

    The result is the same whatever the backend and the number of workers.

    A rung whose curve is not positive or cannot be compiled is refused, and the choice is among the others.

    Raises
    ------
    DataError
        Nothing could be learned, or an unknown family, or dask asked for and not installed."""
    found = _climbed(points, options or Options(), progress)
    rung = found.symmetric_rung if found.symmetric and found.symmetric_rung else found.choice.chosen
    tasks = [(score.candidate, data) for score, data in zip(rung.scores, found.sides, strict=True)]
    ahead = foretold.foretold(tasks)
    said = found.explanation + foretold.said(ahead, rung.rmse_nm)
    between = bands.next_session(points, found.sides, rung.scores, found.folds, ahead)
    said += "" if between is None else foretold.said_of_next(*between, rung.rmse_nm)
    # what was held out is too kind to wear, and to one session that drifts (docs/theory.md 8.8)
    next_nm = max(rung.rmse_nm, ahead.rmse_nm if ahead else 0.0, between[0][0] if between else 0.0)
    return replace(found, explanation=said, expected_next_nm=next_nm, next_range_nm=between and between[0])


def _climbed(points: FrictionPoints, options: Options, progress: search.Progress | None) -> Ladder:
    directions = (0,) if options.symmetric == "yes" else (1, -1)
    weight, folds, most = options.break_away_weight, options.folds, options.max_support_vectors
    sides = tuple(search.side(points, d, weight, folds) for d in directions)
    share = options.tolerance_share
    # by the stronger direction: both are judged by one number, and it is what a hand could tell at all
    equal_nm = max(tolerance_nm(data, share) for data in sides)
    unit = grids.unit_of(points.motion, float(np.abs(points.velocity_rad_s).max()))
    look = search.score_all if options.strategy == "full" else search.halving
    with pool.workers(options.backend, options.n_jobs) as crew:
        scores = look(crew, _tasks(options.families, sides, unit), sides, progress=progress, max_terms=most)
        climbed = [climb(family, scores, sides, share) for family in options.families]
        # usable before chosen: a rung that no loop could run must not win and then fail
        choice = choose([_usable(rung, points, sides) for rung in climbed], equal_nm)
        # a bound on support vectors is one of numbers, of which the mean has those of all its rungs
        if options.mean and most is None:
            choice = _with_mean(choice, points, sides, equal_nm)
        bound = _terms_of_choice(equal_nm, share, most)
        if options.symmetric != "auto":
            note = bound + (" One symmetric curve, as asked." if options.symmetric == "yes" else "")
            return Ladder(
                choice,
                sides,
                options.symmetric == "yes",
                None,
                choice.explanation + note,
                folds,
                equal_nm,
                most,
            )
        # only now and for the chosen rung: whether to share is asked of what is deployed (decision 0043)
        pooled = search.side(points, 0, weight, folds)
        tried = search.score_all(
            crew, _pooled_tasks(choice.chosen, scores, sides, share), [pooled], max_terms=most
        )
    rung = _usable(_together(choice.chosen, tried, pooled, share), points, [pooled])
    shared = sharing.as_good_together(rung, pooled, choice.chosen, sides, equal_nm)
    note = bound + sharing.said(rung, shared=shared)
    explanation = choice.explanation + note
    return Ladder(choice, (pooled,) if shared else sides, shared, rung, explanation, folds, equal_nm, most)


def _with_mean(choice: Choice, points: FrictionPoints, sides: Sequence[Side], equal_nm: float) -> Choice:
    """The choice with the mean of its rungs in the place of the plainest (decision 0049), which it is said
    beside.

    Where errors are so small that they count as equal (decision 0012), the fewest numbers stand; so they do
    where no loop could run the mean."""
    # held-out errors judge a curve whatever its numbers mean (decision 0145)
    curves = [_usable(rung.curve, points, sides) if rung.untold else rung for rung in choice.rungs]
    usable = [rung for rung in curves if not rung.refused]
    one = choice.chosen
    # among errors that count as equal fewer numbers are worth more than a smaller error (decision 0012)
    if one.compared_nm <= equal_nm:
        return choice
    shares = mean.shares(usable)
    made = mean.mean_of(usable, shares)
    if made is None:
        one = next((rung for rung in usable if rung.family in shares), one)
        return mean.alone(one, choice) if one.untold else choice
    made = _usable(made, points, sides)
    rungs = (*choice.rungs, made)
    # a mean of curves that bend at different speeds may need more cells than the law has
    if made.refused:
        return replace(choice, rungs=rungs)
    said = " ".join(part for part in (mean.explained(made, one), choice.of_formulas) if part)
    return replace(choice, rungs=rungs, chosen=made, runner_up=one, explanation=said)


def _together(chosen: Rung, tried: Sequence[Score], pooled: Side, share: float) -> Rung:
    """The chosen rung as one curve for both directions: of a mean the mean of its rungs', each by its
    share."""
    parts = chosen.scores[0].candidate.parts
    if not parts:
        rung = climb(chosen.family, tried, [pooled], share)
        return rung.curve if chosen.untold else rung
    rungs = [climb(candidate.family, tried, [pooled], share).curve for _, candidate in parts]
    wanted = {candidate.family: one for one, candidate in parts}
    lost = "; ".join(f"{rung.family}: {rung.refused}" for rung in rungs if rung.refused)
    # no mean of one: then both directions have their own
    return mean.mean_of(rungs, wanted) or Rung(chosen.family, (), lost)


def _usable(rung: Rung, points: FrictionPoints, sides: Sequence[Side]) -> Rung:
    """Refuse a rung whose curves, trained on all points, no loop could run; `sides` is how they are
    learned."""
    if rung.refused:
        return rung
    try:
        _branches(rung, points, sides)
    except DataError as error:
        return replace(rung, refused=str(error))
    return rung


def _branches(rung: Rung, points: FrictionPoints, sides: Sequence[Side]) -> tuple[Branch, Branch]:
    """Both directions of a rung, trained on all points and compiled. Raises DataError, naming the
    direction."""
    found = []
    for direction in (1, -1):
        # a shared curve has the one score of direction 0
        score = next(score for score in rung.scores if score.direction in (0, direction))
        data = next(data for data in sides if data.direction == score.direction)
        try:
            found.append(_branch(score, data, *points.branch(direction)))
        except (DataError, FailedFitError) as error:
            raise DataError(f"direction {direction:+d}: {error}") from error
    return found[0], found[1]


def _terms_of_choice(equal_nm: float, share: float, most: int | None) -> str:
    """Say what was asked of the choice."""
    said = "" if most is None else f" No curve may have more than {most} support vectors, as asked."
    if equal_nm > 0:
        said += (
            f" Held-out errors below {1e3 * equal_nm:.3g} mN m, {100 * share:g} % of the largest friction, "
            "count as equal."
        )
    return said


def _tasks(families: Sequence[str], sides: Sequence[Side], unit: float) -> list[tuple[Candidate, int]]:
    try:
        return [
            (one, at)
            for family in families
            for at, data in enumerate(sides)
            for one in grids.candidates(family, data.speed, data.friction_nm, unit, data.session)
        ]
    except ValueError as error:
        raise DataError(str(error)) from error


def _pooled_tasks(
    chosen: Rung, scores: Sequence[Score], sides: Sequence[Side], share: float
) -> list[tuple[Candidate, int]]:
    """Candidates good for either direction, each once, the chosen ones first; of a mean those of its rungs,
    fewer of each."""
    parts = chosen.scores[0].candidate.parts
    families = [candidate.family for _, candidate in parts] or [chosen.family]
    # twice: either direction names candidates of its own
    most = max(1, _POOLED_MAX // (2 * len(families)))
    candidates = []
    for family in families:
        for data in sides:
            mine = (
                score
                for score in scores
                if score.candidate.family == family and score.direction == data.direction
            )
            near = as_good(mine, tolerance_nm(data, share))
            candidates += [score.candidate for score in near[:most]]
    # candidates hold a dict, which no set takes; both directions often name the same ones
    return [(one, 0) for i, one in enumerate(candidates) if one not in candidates[:i]]


def learn(
    points: FrictionPoints,
    ladder: Ladder,
    *,
    rig: str,
    rung: Rung | None = None,
    fade_rad_s: float | None = None,
) -> FrictionModel:
    """Train the chosen candidates on all points and compile them.

    Parameters
    ----------
    rung : Rung, optional
        Another rung than the chosen one, to look at.

    Raises
    ------
    DataError
        A curve that is not positive, or that cannot be compiled; the direction is named."""
    if rung is None:
        rung = ladder.symmetric_rung if ladder.symmetric and ladder.symmetric_rung else ladder.choice.chosen
    # the rung's own sides: another rung than the chosen one may be learned apart where that one shares
    ways = {score.direction for score in rung.scores}
    sides = [search.side(points, way, _weight(ladder), ladder.folds) for way in ways]
    try:
        branches = _branches(rung, points, sides)
    except DataError as error:
        what = f"{points.source}: {rung.family}: {error}"
        raise DataError(f"{what}; choose another family (--kernel)") from error
    band = bands.of_scores(points, rung.scores, ladder.folds, _weight(ladder))
    branches = bands.with_band(branches, band)
    # the mean is a kind of the branches, whatever the family is called
    model = fit.assemble(points, branches, rig=rig, fade_rad_s=fade_rad_s, selection=ladder.explanation)
    return replace(model, kind=branches[0].kind)


def _weight(ladder: Ladder) -> float:
    # of any side: break-away may have been measured in one direction alone
    of_rest = [data.weight[data.speed == 0] for data in ladder.sides]
    return float(next((weight[0] for weight in of_rest if len(weight)), 1.0))


def _branch(score: Score, data: Side, speed: np.ndarray, friction_nm: np.ndarray) -> Branch:
    """Train on `data` (one direction, or both), describe on the points of one direction."""
    one = score.candidate
    trained = train(one, data.speed, data.learned_nm(), data.weight)
    hyper = {"symmetric": 1.0} if score.direction == 0 else {}
    hyper |= {f"share of {part.family}": share for share, part in one.parts}
    if one.machine in MACHINES:
        hyper |= {"C": one.c, "epsilon_nm": trained.epsilon_nm, **one.parameters}
    if one.machine == "nu":
        hyper["nu"] = one.tube
    return fit.describe_branch(trained.curve, speed, friction_nm, score.errors, hyper)
