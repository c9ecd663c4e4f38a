"""Choose from the scores: the smallest error within one standard error, then the fewest numbers.

A rung is one family of the ladder; a score is one candidate's held-out errors. Among the candidates of a
rung, side by side, errors are compared as they are; among the rungs by what each is expected to err: a rung
of a hundred candidates shows the luckiest, one of a formula has nothing to choose (decision 0037). Errors
below the tolerance are not told apart either, however small their standard errors (decision 0012)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rtctl.errors import DataError, UnidentifiableError
from rtctl.friction.kind_table import FORMULAS
from rtctl.friction.learn.certainty import doubt, excess, standard_error
from rtctl.friction.learn.formulas import fit_formula, is_bend, require_told, says_little_of_rest
from rtctl.friction.learn.score import Score
from rtctl.friction.learn.search import Side


@dataclass(frozen=True)
class Rung:
    """One family: its chosen candidate per side, or why there is none.

    `failures` counts the candidates lost, by reason, all sides together. `luck_nm2` is how much the mean
    square of the held-out errors is too small for being the least of many (`luck`), N^2 m^2. `bends`: a
    formula whose v_s is beyond the range on some side, no Stribeck peak. `untold`: a formula that is refused
    for its numbers alone."""

    family: str
    scores: tuple[Score, ...]
    refused: str | None = None
    failures: dict[str, int] = field(default_factory=dict)
    tried: int = 0
    luck_nm2: float = 0.0
    bends: bool = False
    untold: bool = False

    @property
    def errors(self) -> np.ndarray:
        """Held-out errors of all sides, N m."""
        return np.concatenate([score.errors for score in self.scores])

    @property
    def curve(self) -> Rung:
        """The rung as a curve, whatever its numbers mean: no longer refused where it was for them alone."""
        return replace(self, refused=None) if self.untold else self

    @property
    def blocks(self) -> np.ndarray | None:
        """Block of each of `errors`; None where a side does not say."""
        told = [score.blocks for score in self.scores if score.blocks is not None]
        return np.concatenate(told) if len(told) == len(self.scores) else None

    @property
    def compared(self) -> np.ndarray:
        """What rungs are compared by, N m: see `Score.compared`."""
        return np.concatenate([score.compared for score in self.scores])

    @property
    def compared_blocks(self) -> np.ndarray | None:
        """Block of each of `compared`; None where a side does not say."""
        told = [score.compared_blocks for score in self.scores if score.compared_blocks is not None]
        return np.concatenate(told) if len(told) == len(self.scores) else None

    @property
    def rmse_nm(self) -> float:
        """Held-out RMSE over all sides, N m; infinite for a refused rung."""
        return float("inf") if self.refused else float(np.sqrt(np.mean(self.errors**2)))

    @property
    def expected_nm(self) -> float:
        """What the rung is expected to err, RMS: its held-out error without the luck of the choice, N m;
        infinite for a refused rung."""
        return float("inf") if self.refused else float(np.sqrt(self.rmse_nm**2 + self.luck_nm2))

    @property
    def compared_nm(self) -> float:
        """RMS of `compared`, without the luck of the choice: `expected_nm`, but for what sessions at the same
        speeds differ by; N m."""
        return float("inf") if self.refused else float(np.sqrt(np.mean(self.compared**2) + self.luck_nm2))

    @property
    def se_nm(self) -> float:
        """Standard error of `rmse_nm`, N m."""
        return 0.0 if self.refused else standard_error(self.errors, self.blocks)

    @property
    def doubt_nm(self) -> float:
        """See `certainty.doubt`, N m."""
        return 0.0 if self.refused else doubt(self.compared, self.compared_blocks)

    @property
    def n_terms(self) -> float:
        """Support vectors, or parameters, of all sides together, trained on all points."""
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
    of_formulas: str = ""
    """The sentence of the explanation that says whether a formula is as good as a machine; "" where one of
    them is missing."""


def as_good(scores: Iterable[Score], tolerance_nm: float = 0.0) -> list[Score]:
    """Scores not worse than the best one's error plus its standard error, or the tolerance; chosen one first.

    The chosen one has the fewest numbers; among equals the smallest error.

    Parameters
    ----------
    tolerance_nm : float
        Held-out errors (RMSE, N m, >= 0) up to this one are as good as any smaller one."""
    usable = [score for score in scores if not score.failed]
    if not usable:
        return []
    best = min(usable, key=lambda score: score.compared_nm)
    limit = max(best.compared_nm + best.doubt_nm, tolerance_nm)  # decision 0012
    near = [score for score in usable if score.compared_nm <= limit]
    return sorted(near, key=lambda score: (score.n_terms, score.compared_nm))


def tolerance_nm(data: Side, share: float) -> float:
    """Tolerance on one side, N m: `share` (0 to 1) of the largest friction measured."""
    return share * float(data.friction_nm.max())


def climb(family: str, scores: Sequence[Score], sides: Sequence[Side], tolerance_share: float = 0.0) -> Rung:
    """Judge one family on all sides. A formula the points cannot tell is refused."""
    mine = [score for score in scores if score.candidate.family == family]
    failures = dict(Counter(score.failed for score in mine if score.failed))
    chosen: list[Score] = []
    lucks = []
    for data in sides:
        here = [score for score in mine if score.direction == data.direction]
        equal_nm = tolerance_nm(data, tolerance_share)
        near = as_good(here, equal_nm)
        if not near:
            return Rung(family, (), _lost(here), failures, len(mine))
        chosen.append(near[0])
        among_equals = near[0].compared_nm <= equal_nm
        lucks.append(
            luck(min(near, key=lambda one: one.compared_nm) if among_equals else near[0], here, data)
        )
    counts = [len(score.errors) for score in chosen]  # luck is of mean squares: they weigh by points
    luck_nm2 = float(np.average(lucks, weights=counts)) if sum(counts) else 0.0
    bends, fits = False, []
    try:
        if family in FORMULAS:
            fits = [fit_formula(family, data.speed, data.friction_nm, data.weight) for data in sides]
        for fit, data in zip(fits, sides, strict=bool(fits)):
            require_told(fit, data.speed)
            bends |= is_bend(fit, data.speed)
    except UnidentifiableError as error:
        untold = bool(fits) and all(map(says_little_of_rest, fits, (data.speed for data in sides)))
        return Rung(family, tuple(chosen), f"{error.reason}: {error}", failures, len(mine), untold=untold)
    return Rung(family, tuple(chosen), None, failures, len(mine), luck_nm2, bends)


def luck(chosen: Score, scores: Iterable[Score], data: Side) -> float:
    """By how much the mean square of the chosen candidate's held-out errors is too small, N^2 m^2, >= 0.

    Notes
    -----
    The bias of the least error of a cross-validation [TT09]: over the folds, the mean square of the chosen
    one less that of the candidate which is best there. Where folds agree on the best it is little; a
    candidate alone has none.

    One that was chosen for its few numbers among errors that count as equal (decision 0012) has the luck of
    the least of them: what it errs more is in its held-out error, and not counted again (decision 0046)."""
    fold = data.compared_folds
    same = [score for score in scores if not score.failed and len(score.compared) == len(fold)]
    if len(same) < 2 or len(chosen.compared) != len(fold):
        return 0.0
    squares = np.array([score.compared for score in same]) ** 2
    least = sum(float(squares[:, fold == k].sum(axis=1).min()) for k in np.unique(fold))
    return max(0.0, (float(np.sum(chosen.compared**2)) - least) / len(fold))


def _told_apart(rung: Rung, best: Rung) -> bool:
    """Whether a rung is expected to err more than the best by more than one standard error of the difference,
    point by point."""
    if len(rung.compared) != len(best.compared):  # a side of another size: not point by point
        return rung.compared_nm > best.compared_nm + best.doubt_nm
    more, se = excess(rung.compared, best.compared, best.compared_blocks)
    return more + rung.luck_nm2 - best.luck_nm2 > se  # luck is no error that was seen


def _lost(scores: Sequence[Score]) -> str:
    """Why a side has no candidate, and how far a bound on the support vectors is from one."""
    said = "; ".join(dict.fromkeys(score.failed for score in scores if score.failed))
    least = min((score.n_terms for score in scores), default=np.inf)
    return (said or "no candidate") + (f", the sparsest has {least:.0f}" if np.isfinite(least) else "")


def choose(rungs: Sequence[Rung], tolerance_nm: float = 0.0) -> Choice:
    """Choose a rung and say why. `tolerance_nm` as in `as_good`.

    Raises
    ------
    DataError
        When every rung failed or was refused."""
    usable = [rung for rung in rungs if not rung.refused]
    if not usable:
        said = "; ".join(f"{rung.family}: {rung.refused}" for rung in rungs)
        bounded = any("support vectors" in (rung.refused or "") for rung in rungs)
        remedy = "raise --max-support-vectors, or add points" if bounded else "add points"
        raise DataError(f"no model of the ladder could be learned: {said}; {remedy}")
    best = min(usable, key=lambda rung: rung.compared_nm)
    near = sorted(
        (rung for rung in usable if rung.compared_nm <= tolerance_nm or not _told_apart(rung, best)),
        key=lambda rung: (rung.n_terms, rung.compared_nm),
    )
    chosen = near[0]
    others = sorted((rung for rung in usable if rung is not chosen), key=lambda rung: rung.compared_nm)
    runner_up = others[0] if others else None
    equal = all(rung.compared_nm <= tolerance_nm for rung in near)
    among = f"below {1e3 * tolerance_nm:.3g} mN m" if equal else ""
    words = [_why(chosen, best, len(near), among)]
    if chosen.bends:
        words.append("It bends over all speeds: its numbers are no Stribeck peak.")
    if runner_up:
        words.append(f"Runner-up: {_figures(runner_up)}.")
    of_formulas = _formulas(usable, near, among)
    words.append(of_formulas)
    return Choice(tuple(rungs), chosen, runner_up, " ".join(word for word in words if word), of_formulas)


def _why(chosen: Rung, best: Rung, near: int, among: str) -> str:
    """Say why in a sentence; `among` says what the rungs it was chosen from have in common, "" one standard
    error."""
    said = f"Chosen: {_figures(chosen)}, "
    smallest = f"the smallest error {_BUT_SESSIONS}" if _is_shared(best) else "the smallest expected error"
    if near == 1:
        return said + (f"the only one {among}." if among else f"{smallest} by more than one standard error.")
    if chosen is best:
        return said + f"{smallest} and the fewest numbers."
    others = f"{smallest} has {best.family}, {1e3 * best.compared_nm:.3g} mN m"
    if among:
        return said + f"the fewest numbers of {near} {among} ({others})."
    return said + f"the fewest numbers of {near} within one standard error of the best ({others})."


_BUT_SESSIONS = "but for what sessions differ by"


def _is_shared(rung: Rung) -> bool:
    """Whether it was compared without what its sessions differ by."""
    return any(score.between is not None for score in rung.scores)


def _figures(rung: Rung) -> str:
    what = "parameters" if rung.is_formula else "support vectors"
    count = " + ".join(f"{score.n_terms:.0f}" for score in rung.scores)
    held_out = f"{1e3 * rung.rmse_nm:.3g} +- {1e3 * rung.se_nm:.2g} mN m held out"
    if _is_shared(rung):
        held_out += f", {1e3 * rung.compared_nm:.3g} {_BUT_SESSIONS}"
    elif rung.luck_nm2 > 0:
        held_out += f", {1e3 * rung.expected_nm:.3g} expected"
    return f"{rung.family} ({held_out}, {count} {what})"


def _formulas(usable: Sequence[Rung], near: Sequence[Rung], among: str) -> str:
    """Say whether a formula is as good as the best learned curve. `near` are the rungs to choose from,
    `among` as in `_why`."""
    formulas = [rung for rung in usable if rung.is_formula]
    learned = [rung for rung in usable if not rung.is_formula]
    if not formulas or not learned:
        return ""
    formula = min(formulas, key=lambda rung: rung.compared_nm)
    machine = min(learned, key=lambda rung: rung.compared_nm)
    if formula.compared_nm <= machine.compared_nm:
        return f"A parametric model is as good: {formula.family} does not err more than {machine.family}."
    if not _told_apart(formula, machine):
        return (
            f"A parametric model is as good: {formula.family} errs more by less than one standard error of "
            f"{machine.family}."
        )
    if formula in near and among:
        return (
            f"A parametric model is as good: {formula.family}, {1e3 * formula.compared_nm:.3g} mN m, is "
            f"{among}."
        )
    times = formula.compared_nm / machine.compared_nm
    return f"No parametric model is as good: the best, {formula.family}, errs {times:.2g} times as much."
