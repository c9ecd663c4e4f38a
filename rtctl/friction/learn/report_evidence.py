"""What a report of a fit stands on: every learned curve with its errors, trained, held out and predicted.

Everything here is computed from the points, the ladder and the model; the pages only show it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from statistics import NormalDist

import numpy as np

from rtctl.friction.kind_curve import Curve
from rtctl.friction.kind_spline import UNIT
from rtctl.friction.kind_table import FORMULAS
from rtctl.friction.learn import fit, search
from rtctl.friction.learn.beside_speed import LoadVerdict, judge
from rtctl.friction.learn.hold_out import TRAINS, folds_of
from rtctl.friction.learn.ladder import Ladder
from rtctl.friction.learn.machines import Candidate, FailedFitError, train
from rtctl.friction.learn.score import Score
from rtctl.friction.learn.selection import Rung, climb
from rtctl.friction.learn.warmth import Warmth
from rtctl.friction.model import FrictionModel
from rtctl.friction.points import FrictionPoints

CONFIDENCE = 0.95
REGIMES = ("low speed", "high speed")
EXTRA_COLUMNS = {"position_rad": "position [rad]", "time_s": "time [s]"}
"""Columns of the points beside speed that residuals are drawn against, with their axis labels."""


@dataclass(frozen=True)
class Errors:
    """Model minus measurement (N m) at each speed (rad/s) of one direction. Arrays of one length."""

    speed: np.ndarray
    error_nm: np.ndarray

    def within(self, low: float, high: float) -> Errors:
        """Keep low <= speed < high."""
        # one end only: a point on the boundary counts in one regime, not in both or in none
        kept = (self.speed >= low) & (self.speed < high)
        return Errors(self.speed[kept], self.error_nm[kept])


@dataclass(frozen=True)
class Learned:
    """One family learned from one direction; `limit` is the bound of each dual coefficient."""

    family: str
    direction: int
    curve: Curve
    epsilon_nm: float
    limit: np.ndarray
    trained: Errors
    held_out: Errors
    predicted: Errors | None

    @property
    def bounded(self) -> np.ndarray:
        """Whether each support vector's dual coefficient is at its bound: the point lies outside the tube."""
        bounded: np.ndarray = np.abs(self.curve.dual_coef) >= self.limit * (1 - 1e-9)
        return bounded

    @property
    def judged(self) -> Errors:
        """Prediction errors: on the test points, else on speeds held out of training."""
        return self.held_out if self.predicted is None else self.predicted


@dataclass(frozen=True)
class Evidence:
    """Everything a report says. `boundary_rad_s` parts low from high speed.

    `lost` names the families that could not be trained on all points, and why. `folds` is how points were
    held out, of `hold_out.WAYS`. `beside` is what is known of load and temperature; None: not looked at."""

    points: FrictionPoints
    test: FrictionPoints | None
    model: FrictionModel
    ladder: Ladder | None
    rungs: tuple[Rung, ...]
    learned: tuple[Learned, ...]
    chosen: str
    boundary_rad_s: float
    lost: dict[str, str] = field(default_factory=dict)
    extra: dict[str, np.ndarray] = field(default_factory=dict)
    folds: str = "speed"
    beside: tuple[LoadVerdict, Warmth] | None = None

    def of(self, family: str) -> list[Learned]:
        """Both directions of one family; empty when it was not learned."""
        return [one for one in self.learned if one.family == family]

    @property
    def families(self) -> list[str]:
        """Learned families, in the order of the ladder."""
        return list(dict.fromkeys(one.family for one in self.learned))

    def regime(self, name: str, errors: Errors) -> Errors:
        """Errors of one of `REGIMES`."""
        b = self.boundary_rad_s
        return errors.within(0, b) if name == REGIMES[0] else errors.within(b, math.inf)


def interval_nm(rung: Rung) -> tuple[float, float]:
    """Confidence interval of a rung's held-out RMSE, N m, from its standard error: normal, of few blocks
    Student's t."""
    n = len(rung.errors) if rung.blocks is None else len(np.unique(rung.blocks))
    # by blocks where they are known: a thousand samples of five laps are five
    wide = _quantile(n) * rung.se_nm
    # an RMS is not below 0, and the interval of few blocks may be
    return max(0.0, rung.rmse_nm - wide), rung.rmse_nm + wide


# of 20 Student's is 7 % wider than the normal, of 5 two fifths, of 3 twice as wide
FEW_BLOCKS = 20
"""Fewer blocks know their own spread badly, and their interval is wider for it."""


def _quantile(blocks: int) -> float:
    """Half width of the interval, standard errors."""
    if blocks >= FEW_BLOCKS or blocks < 2:
        return NormalDist().inv_cdf(0.5 + CONFIDENCE / 2)
    from scipy.special import stdtrit

    return float(stdtrit(blocks - 1, 0.5 + CONFIDENCE / 2))


def gather(
    points: FrictionPoints,
    model: FrictionModel,
    ladder: Ladder | None,
    test: FrictionPoints | None = None,
    folds: str = "speed",
    beside: tuple[LoadVerdict, Warmth] | None = None,
) -> Evidence:
    """Learn every rung again on all points, and gather its errors.

    Without a ladder: the fitted model and the formulas, which cost nothing. `folds` says how the points were
    held out; a ladder knows it itself."""
    folds = folds if ladder is None else ladder.folds
    lost: dict[str, str] = {}
    # formulas cost nothing beside a fit, and without them a page would have nothing to compare with
    if ladder is None:
        learned = [_of_model(model, points, test, at, folds) for at in (0, 1)]
        chosen, weight = learned[0].family, search.BREAK_AWAY_WEIGHT
        rungs = (*_formulas(points, folds), _rung(model, learned))
    else:
        rungs, weight = ladder.choice.rungs, float(np.max(ladder.sides[0].weight))
        learned, chosen = [], ladder.choice.chosen.family
    for rung in rungs:
        if not rung.refused and (ladder or rung.family != chosen):
            # what is deployed: both directions share it, whatever each had by itself
            shown = ladder.symmetric_rung if ladder and ladder.symmetric and rung.family == chosen else rung
            try:
                learned += [_learned(points, test, shown or rung, d, weight, folds) for d in (1, -1)]
            except FailedFitError as error:  # it learned every fold, and the whole must not fail for it
                lost[rung.family] = error.reason
    # break-away has no place on the logarithm that parts low from high speed
    moving = np.abs(points.velocity_rad_s[points.velocity_rad_s != 0])
    return Evidence(
        points=points,
        test=test,
        model=model,
        ladder=ladder,
        rungs=tuple(rungs),
        learned=tuple(learned),
        chosen=chosen,
        # `rtctl identify` measures speeds by ratio: about as many levels lie on either side
        boundary_rad_s=math.sqrt(float(moving.min()) * float(moving.max())),
        lost=lost,
        extra={name: points.columns[name] for name in EXTRA_COLUMNS if name in points.columns},
        folds=folds,
        beside=beside or judge(model, points, folds),
    )


def _formulas(points: FrictionPoints, folds: str) -> tuple[Rung, ...]:
    sides = [search.side(points, direction, folds=folds) for direction in (1, -1)]
    return tuple(
        climb(name, [search.cross_validate(Candidate("formula", name), data) for data in sides], sides)
        for name in FORMULAS
    )


def _rung(model: FrictionModel, learned: list[Learned]) -> Rung:
    """Put the fitted model itself beside the formulas."""
    scores = [
        Score(
            Candidate("epsilon", branch.kind, branch.hyper_parameters["C"], one.epsilon_nm),
            one.direction,
            one.held_out.error_nm,
            float(len(branch.support_vectors)),
        )
        for one, branch in zip(learned, model.branches, strict=True)
    ]
    return Rung(learned[0].family, tuple(scores), tried=len(scores))


def _learned(
    points: FrictionPoints, test: FrictionPoints | None, rung: Rung, direction: int, weight: float, folds: str
) -> Learned:
    """Train one rung's candidate as `ladder.learn` does; look at one direction of it."""
    score = next(score for score in rung.scores if score.direction in (0, direction))
    data = search.side(points, score.direction, weight, folds)
    trained = train(score.candidate, data.speed, data.learned_nm(), data.weight)
    n = len(points.branch(1)[0])
    # `search.side` puts the forward points first
    of_all = np.arange(len(data.speed)) < n if direction > 0 else np.arange(len(data.speed)) >= n
    mine = of_all if score.direction == 0 else np.ones(len(data.speed), dtype=bool)
    held = data.fold != TRAINS
    # a weight of a point is one of its bound C
    limit = score.candidate.c * np.where(trained.curve.support_vectors == 0, weight, 1.0)
    return Learned(
        family=rung.family,
        direction=direction,
        curve=trained.curve,
        epsilon_nm=trained.epsilon_nm,
        limit=limit,
        trained=_errors(trained.curve, points, direction),
        held_out=Errors(data.speed[held & mine], score.errors[mine[held]]),
        predicted=None if test is None else _errors(trained.curve, test, direction),
    )


def _of_model(
    model: FrictionModel, points: FrictionPoints, test: FrictionPoints | None, at: int, folds: str
) -> Learned:
    """One branch of a model of `fit.fit_points`, with the errors its cross-validation held out."""
    branch, direction = model.branches[at], (1, -1)[at]
    speed, friction_nm = points.branch(direction)
    c, epsilon_nm = (branch.hyper_parameters[name] for name in ("C", "epsilon_nm"))
    unit = branch.source.parameters.get(UNIT, 1.0)
    fold = folds_of(points, (direction,), folds)
    # fold by fold, as `validation_errors` has them
    held = np.concatenate([speed[fold == k] for k in np.unique(fold[fold != TRAINS])])
    return Learned(
        family=f"epsilon-{branch.kind}",
        direction=direction,
        curve=branch.source,
        epsilon_nm=epsilon_nm,
        limit=np.full(len(branch.dual_coef), c),
        trained=_errors(branch.source, points, direction),
        held_out=Errors(held, fit.validation_errors(speed, friction_nm, c, epsilon_nm, fold, unit)),
        predicted=None if test is None else _errors(branch.source, test, direction),
    )


def _errors(curve: Curve, points: FrictionPoints, direction: int) -> Errors:
    speed, friction_nm = points.branch(direction)
    return Errors(speed, curve(speed) - friction_nm)
