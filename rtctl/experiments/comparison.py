"""Tables and pictures of a comparison of friction models: what point-to-point and tracking show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rtctl.experiments import figures, positioning
from rtctl.experiments.models import Compared
from rtctl.experiments.order import Order
from rtctl.experiments.positioning import Found, over_cases
from rtctl.experiments.report import Outcome, Part, Target
from rtctl.experiments.statistics import Estimate, estimate
from rtctl.friction.learn.report_page import Picture
from rtctl.friction.learn.report_tables import Table

Figures = Mapping[str, tuple[str, float]]
"""Key of a figure -> its words with unit, and the scale to that unit."""


@dataclass(frozen=True)
class Words:
    """What one experiment calls itself, the figure it is judged by (`key`, in mrad), and what its runs
    are."""

    name: str
    title: str
    key: str
    target: str
    figure: str
    runs: str


def outcome(
    words: Words, shown: Figures, order: Order, compared: list[Compared], found: Found, pictures: Part
) -> Outcome:
    """The page of an experiment: is the best support-vector model better than none, and than each formula."""
    # the best by the very figure that it is judged by: of three machines that is a little luck, and the page
    # names which
    best = positioning.best_svr(found, "PD", words.key, compared)
    target = Target(
        f"{words.name}: {words.target} with the best SVR ({best}) less than with none (PD)",
        # paired by seed: seeds differ by far more than models do
        positioning.less(found, "PD", words.key, best),
        0.60,
    )
    verdicts = tuple(
        positioning.verdict(found, controller, words.key, compared, words.figure)
        for controller in positioning.CONTROLLERS
    )
    told = (
        pictures,
        Part("Where SVR wins and where it does not", verdicts, (learned(compared),)),
        *parts(order, found, shown),
    )
    # by PD: an integral hides what a model of friction does not know
    winner = positioning.best_of_all(found, "PD", words.key, 1e3, "mrad")
    said = (
        f"PD with friction feed-forward: {target.measured.text(100, '.1f')} % less {words.figure} with "
        f"{best} than without, over all {words.runs}. {winner}"
    )
    return Outcome(words.name, words.title, said, told, (target,), numbers(found))


def learned(compared: Sequence[Compared]) -> Table:
    """How well each model describes friction, before any control."""
    # `none` has learned nothing
    rows = tuple((one.name, f"{1e3 * one.rmse_nm:.2f}", one.terms) for one in compared if one.name != "none")
    caption = (
        "The friction models, all learned from the same points: held-out RMSE, and support vectors or "
        "parameters."
    )
    return Table(caption, ("model", "held-out RMSE, mN m", "numbers per direction"), rows)


def parts(order: Order, found: Found, shown: Figures) -> list[Part]:
    """Per controller: one picture of the first error figure over all cases, and a table per case."""
    made = []
    for controller, cases in found.items():
        tables = [_table(case, of, shown, order.repetitions) for case, of in cases.items()]
        made.append(
            Part(f"{controller}: every case", shown=(_bars(order, found, controller, shown), *tables))
        )
    return made


def finite(values: np.ndarray) -> Estimate | None:
    """Mean over the seeds in which the figure exists; None when it exists in none."""
    there = values[np.isfinite(values)]  # a time that was never reached is no number
    return estimate(there) if len(there) else None


def _table(case: str, of: Mapping[str, Mapping[str, np.ndarray]], shown: Figures, seeds: int) -> Table:
    rows = []
    for model, one in of.items():
        cells = []
        for name, (_, scale) in shown.items():
            # by figure: a run that never settled has a steady-state error all the same
            found = finite(one[name])
            cells.append("never" if found is None else _cell(found, scale, seeds))
        rows.append((model, *cells))
    several = (
        f"mean over {seeds} seeds ± half of the 95 % confidence interval; (n) where only n seeds got there."
    )
    caption = f"{case}: {several if seeds > 1 else 'one run.'}"
    return Table(caption, ("friction model", *(words for words, _ in shown.values())), tuple(rows))


def _cell(found: Estimate, scale: float, seeds: int) -> str:
    # how many got there is half of the figure: two of ten that are quick are no quick model
    return found.text(scale) + (f" ({found.count})" if found.count < seeds else "")


def _bars(order: Order, found: Found, controller: str, shown: Figures) -> Picture:
    # the first figure that is an error: what both experiments are judged by comes first in their lists
    error = next(name for name in shown if "error" in name)
    # its words end with the unit, which the axis has in brackets
    words, scale = shown[error]
    models = next(iter(found[controller].values()))
    groups = {
        "mean over all cases": {name: estimate(over_cases(found, controller, name, error)) for name in models}
    }
    name = f"{error}_{controller}".lower()
    caption = (
        f"{controller}: {words}, mean over all cases, with 95 % confidence intervals over seeds where there "
        "are several."
    )
    return Picture(name, caption, figures.bars(groups, f"{words.replace(', ', ' [')}]", order.motion, scale))


def numbers(found: Found) -> dict[str, Any]:
    """Every figure for scripts."""
    return {
        "controllers": {
            controller: {
                case: {
                    model: {name: finite(values) for name, values in one.items()} for model, one in of.items()
                }
                for case, of in cases.items()
            }
            for controller, cases in found.items()
        }
    }
