"""Choose from the scores: the smallest error within one standard error, then the fewest numbers.

A rung is one family of the ladder; a score is one candidate's held-out errors. The same rule is used twice:
among the candidates of a rung, side by side, and among the rungs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from rtctl.errors import DataError, UnidentifiableError
from rtctl.friction.baselines import fit_formula, require_identifiable
from rtctl.friction.curves import FORMULAS
from rtctl.friction.search import Score, Side, standard_error


@dataclass(frozen=True)
class Rung:
    """One family: its chosen candidate per side, or why there is none.

    `failures` counts the candidates lost, by reason, all sides together.
    """

    family: str
    scores: tuple[Score, ...]
    refused: str | None = None
    failures: dict[str, int] = field(default_factory=dict)
    tried: int = 0

    @property
    def errors(self) -> np.ndarray:
        """Held-out errors of all sides, N m."""
        return np.concatenate([score.errors for score in self.scores])

    @property
    def rmse_nm(self) -> float:
        """Held-out RMSE over all sides, N m; infinite for a refused rung."""
        return float("inf") if self.refused else float(np.sqrt(np.mean(self.errors**2)))

    @property
    def se_nm(self) -> float:
        """Standard error of `rmse_nm`, N m."""
        return 0.0 if self.refused else standard_error(self.errors)

    @property
    def n_terms(self) -> float:
        """Support vectors, or parameters, of all sides together (mean over the folds)."""
        return float(sum(score.n_terms for score in self.scores))

    @property
    def is_formula(self) -> bool:
        """Whether the family is a closed formula."""
        return self.family in FORMULAS


@dataclass(frozen=True)
class Choice:
    """The ladder judged: every rung, the chosen one and the runner-up (None when alone)."""

    rungs: tuple[Rung, ...]
    chosen: Rung
    runner_up: Rung | None
    explanation: str


def within_one_standard_error(scores: Iterable[Score]) -> list[Score]:
    """Scores not worse than the best one's error plus its standard error, the chosen one first.

    The chosen one has the fewest numbers; among equals the smallest error.
    """
    usable = [score for score in scores if not score.failed]
    if not usable:
        return []
    best = min(usable, key=lambda score: score.rmse_nm)
    near = [score for score in usable if score.rmse_nm <= best.rmse_nm + best.se_nm]
    return sorted(near, key=lambda score: (score.n_terms, score.rmse_nm))


def climb(family: str, scores: Sequence[Score], sides: Sequence[Side]) -> Rung:
    """Judge one family on all sides. A formula the points cannot tell is refused."""
    mine = [score for score in scores if score.candidate.family == family]
    failures = dict(Counter(score.failed for score in mine if score.failed))
    chosen: list[Score] = []
    for data in sides:
        near = within_one_standard_error(score for score in mine if score.direction == data.direction)
        if not near:
            return Rung(family, (), "; ".join(failures) or "no candidate", failures, len(mine))
        chosen.append(near[0])
    try:
        if family in FORMULAS:
            for data in sides:
                fit = fit_formula(family, data.speed, data.friction_nm, data.weight)
                require_identifiable(fit, data.speed)
    except UnidentifiableError as error:
        return Rung(family, tuple(chosen), f"{error.reason}: {error}", failures, len(mine))
    return Rung(family, tuple(chosen), None, failures, len(mine))


def choose(rungs: Sequence[Rung]) -> Choice:
    """Choose a rung and say why.

    Raises
    ------
    DataError
        When every rung failed or was refused.
    """
    usable = [rung for rung in rungs if not rung.refused]
    if not usable:
        said = "; ".join(f"{rung.family}: {rung.refused}" for rung in rungs)
        raise DataError(f"no model of the ladder could be learned: {said}; add points")
    best = min(usable, key=lambda rung: rung.rmse_nm)
    limit = best.rmse_nm + best.se_nm
    near = sorted(
        (rung for rung in usable if rung.rmse_nm <= limit), key=lambda rung: (rung.n_terms, rung.rmse_nm)
    )
    chosen = near[0]
    others = sorted((rung for rung in usable if rung is not chosen), key=lambda rung: rung.rmse_nm)
    runner_up = others[0] if others else None
    words = [_why(chosen, best, len(near))]
    if runner_up:
        words.append(f"Runner-up: {_figures(runner_up)}.")
    words.append(_formulas(usable, limit))
    return Choice(tuple(rungs), chosen, runner_up, " ".join(word for word in words if word))


def _why(chosen: Rung, best: Rung, near: int) -> str:
    if near == 1:
        return f"Chosen: {_figures(chosen)}, the smallest held-out error by more than one standard error."
    if chosen is best:
        return f"Chosen: {_figures(chosen)}, the smallest held-out error and the fewest numbers."
    return (
        f"Chosen: {_figures(chosen)}, the fewest numbers of {near} within one standard error "
        f"of the smallest held-out error ({best.family}, {1e3 * best.rmse_nm:.3g} mN m)."
    )


def _figures(rung: Rung) -> str:
    what = "parameters" if rung.is_formula else "support vectors"
    count = " + ".join(f"{score.n_terms:.0f}" for score in rung.scores)
    return f"{rung.family} ({1e3 * rung.rmse_nm:.3g} +- {1e3 * rung.se_nm:.2g} mN m held out, {count} {what})"


def _formulas(usable: Sequence[Rung], limit: float) -> str:
    """Say whether a formula is as good as the best learned curve."""
    formulas = [rung for rung in usable if rung.is_formula]
    learned = [rung for rung in usable if not rung.is_formula]
    if not formulas or not learned:
        return ""
    formula = min(formulas, key=lambda rung: rung.rmse_nm)
    machine = min(learned, key=lambda rung: rung.rmse_nm)
    if formula.rmse_nm <= max(limit, machine.rmse_nm + machine.se_nm):
        return f"A parametric model is as good: {formula.family} does not err more than {machine.family}."
    times = formula.rmse_nm / machine.rmse_nm
    return f"No parametric model is as good: the best, {formula.family}, errs {times:.2g} times as much."
