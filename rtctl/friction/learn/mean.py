"""The mean of the rungs: what is deployed where errors that cannot be told apart would make the choice a
matter of luck (decision 0049).

Rungs err in different ways, and the mean of what they say errs less than most of them, often less than the
best. Nothing is learned for it: its held-out errors are the means of theirs, point by point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from rtctl.friction.kind_table import MEAN
from rtctl.friction.learn.machines import Candidate
from rtctl.friction.learn.score import Score
from rtctl.friction.learn.selection import Choice, Rung

# chosen on made joints; from 3 to 10 all sets but one were within a tenth of their best rung (decision 0049)
POWER = 4.0
"""A rung weighs as the inverse of its expected mean square error to this power: one that errs 1.2 times the
least has a quarter of its weight."""

LEAST = 0.01
"""Shares of the heaviest below this are left out: such a rung errs 1.8 times as much, and its numbers would
be in the file for nothing."""


def shares(rungs: Sequence[Rung]) -> dict[str, float]:
    """Share of each rung in the mean, by its family, together 1; without those that say next to nothing.
    `rungs` are usable ones."""
    expected = np.array([rung.compared_nm for rung in rungs])
    least = float(expected.min())
    # twice: these are roots of what `POWER` is of
    heavy = np.where(expected > 0, least / np.where(expected > 0, expected, 1.0), 1.0) ** (2 * POWER)
    # before they are made 1 together, so that what is left out leaves no gap
    heavy[heavy < LEAST] = 0.0
    heavy /= heavy.sum()
    return {rung.family: float(share) for rung, share in zip(rungs, heavy, strict=True) if share > 0}


def mean_of(rungs: Sequence[Rung], wanted: Mapping[str, float]) -> Rung | None:
    """The mean of those of `rungs` that `wanted` gives a share, as a rung; None where fewer than two of them
    can be used.

    A rung that has no part in it (refused here) leaves its share to the others."""
    parts = [rung for rung in rungs if rung.family in wanted and not rung.refused]
    # errors of other folds or sides are of other points: their mean would be no error of anything
    if len(parts) < 2 or len({tuple(len(score.errors) for score in rung.scores) for rung in parts}) > 1:
        return None
    whole = sum(wanted[rung.family] for rung in parts)
    share = [wanted[rung.family] / whole for rung in parts]
    scores = tuple(
        _mean_score(list(zip(share, scores, strict=True)))
        for scores in zip(*(rung.scores for rung in parts), strict=True)
    )
    # nothing was chosen for the mean itself: it has the luck of its parts, by their shares
    luck_nm2 = sum(a * rung.luck_nm2 for a, rung in zip(share, parts, strict=True))
    return Rung(MEAN.name, scores, tried=len(parts), luck_nm2=luck_nm2)


def _mean_score(parts: Sequence[tuple[float, Score]]) -> Score:
    """Score of one side: the errors are means of the parts', since they are of the same points without the
    same folds."""
    first = parts[0][1]
    return Score(
        Candidate.mean([(share, score.candidate) for share, score in parts]),
        first.direction,
        _together(parts, "errors"),
        # all of them are in the file and in the curve
        float(sum(score.n_terms for _, score in parts)),
        blocks=first.blocks,
        between=None if first.between is None else _together(parts, "between"),
        between_blocks=first.between_blocks,
    )


def _together(parts: Sequence[tuple[float, Score]], errors: str) -> np.ndarray:
    """Weighted sum of the errors of that name, N m."""
    total: np.ndarray = np.sum([share * getattr(score, errors) for share, score in parts], axis=0)
    return total


def explained(mean: Rung, chosen: Rung) -> str:
    """Say what was taken, of what, and what the plainest rung alone would err."""
    of = mean.scores[0].candidate.parts
    heaviest = sorted(of, key=lambda part: -part[0])
    names = ", ".join(f"{candidate.family} {100 * share:.0f} %" for share, candidate in heaviest[:3])
    more = f" and {len(of) - 3} more" if len(of) > 3 else ""
    return (
        f"Chosen: the mean of {len(of)} rungs ({1e3 * mean.rmse_nm:.3g} +- {1e3 * mean.se_nm:.2g} mN m held "
        f"out, {1e3 * mean.expected_nm:.3g} expected), those that err least weighing most: {names}{more}. "
        f"One rung alone would be {chosen.family}, {1e3 * chosen.expected_nm:.3g} mN m expected (--no-mean)."
    )


def alone(curve: Rung, choice: Choice) -> Choice:
    """The choice with a curve that errs so much less than all others that they have no share, though its
    numbers are not told."""
    told = choice.chosen
    said = (
        f"Chosen: {curve.family} ({1e3 * curve.rmse_nm:.3g} +- {1e3 * curve.se_nm:.2g} mN m held out) as a "
        f"curve, for its numbers are not told. The rung that is told would be {told.family}, "
        f"{1e3 * told.expected_nm:.3g} mN m expected (--no-mean)."
    )
    rungs = tuple(curve if rung.family == curve.family else rung for rung in choice.rungs)
    return replace(choice, rungs=rungs, chosen=curve, runner_up=told, explanation=said)
