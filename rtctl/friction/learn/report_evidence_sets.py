"""What is known of a set of data: every rung of the ladder, judged by what it never saw."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtctl.friction.learn import hold_out, ladder, nested
from rtctl.friction.learn.grids import noise_nm
from rtctl.friction.learn.over_best import OverBest, over_best
from rtctl.friction.learn.report_evidence import interval_nm
from rtctl.friction.learn.selection import Rung
from rtctl.friction.points import FrictionPoints


@dataclass(frozen=True)
class Line:
    """One rung: held-out RMSE with its 95 % interval, and the nested one, N m; None where there is none.
    `refused` says why.

    `covered` is the share of what was held out that lies in the band of the fit without it, 0 to 1; None: no
    band."""

    family: str
    held_out_nm: float | None
    low_nm: float
    high_nm: float
    terms: str
    nested_nm: float | None
    nested_se_nm: float
    refused: str
    covered: float | None = None


@dataclass(frozen=True)
class Found:
    """One set. Errors in N m; `friction_nm` is the RMS of what was measured, `floor_nm` the scatter of points
    about a smooth curve of their own.

    `chosen_nm` is the nested error of whatever the ladder chose each time, `chosen_held_out_nm` what it then
    held out, `chosen_covered` the share of it that lay in the band; `over_best` holds the choice against the
    rungs that are not refused. `sessions`: each that was held out, where whole logs are."""

    name: str
    source: str
    points: int
    way: str
    units: int
    friction_nm: float
    floor_nm: float
    chosen: str
    chosen_nm: float
    chosen_held_out_nm: float
    lines: tuple[Line, ...]
    notes: tuple[str, ...]
    over_best: OverBest
    chosen_covered: float | None = None
    sessions: tuple[nested.NextSession, ...] = ()

    @property
    def judged(self) -> list[Line]:
        """Rungs that are not refused and could be learned without each fold."""
        return [line for line in self.lines if line.nested_nm is not None and not line.refused]

    @property
    def least_nm(self) -> float:
        """Least nested error of a rung."""
        return min(line.nested_nm for line in self.judged if line.nested_nm is not None)


def judge_set(
    name: str, source: str, points: FrictionPoints, notes: Sequence[str], options: ladder.Options
) -> Found:
    """Climb the ladder on all points, and once more without each fold (`nested`).

    Raises
    ------
    DataError
        Nothing can be learned."""
    whole = ladder.ascend(points, options)
    without = nested.generalisation(points, options, every_rung=True)
    # each direction by itself: where they differ, neighbours of both would scatter by it
    noise = [noise_nm(*points.branch(direction)) for direction in (1, -1)]
    told = [rung.family for rung in whole.choice.rungs if not rung.refused]
    rivals = {name: without.errors_nm[name] for name in told if name in without.of_rungs}
    return Found(
        name=name,
        source=source,
        points=sum(len(points.rows_of(direction)) for direction in (1, -1)),
        way=options.folds,
        units=len(np.unique(hold_out.units_of(points, options.folds))),
        friction_nm=float(np.sqrt(np.mean(points.friction_nm**2))),
        floor_nm=float(np.sqrt(np.mean(np.square(noise)))),
        chosen=whole.choice.chosen.family,
        chosen_nm=without.rmse_nm,
        chosen_held_out_nm=without.held_out_nm,
        chosen_covered=without.covered.get(nested.CHOSEN),
        lines=tuple(_line(rung, without) for rung in whole.choice.rungs),
        notes=tuple(dict.fromkeys(_without_files(note) for note in notes)),
        over_best=over_best(without.errors_nm[nested.CHOSEN], rivals, without.unit),
        sessions=without.sessions,
    )


def _without_files(note: str) -> str:
    """A warning without the names of the files it is about, which several share."""
    return re.sub(r"^(\S+\.\w+,? )*\S+\.\w+: ", "", note)


def _line(rung: Rung, without: nested.Generalisation) -> Line:
    low, high = (0.0, 0.0) if rung.refused else interval_nm(rung)
    nested_nm, se_nm = without.of_rungs.get(rung.family) or (None, 0.0)
    terms = " + ".join(f"{score.n_terms:.0f}" for score in rung.scores)
    held_out = None if rung.refused else rung.rmse_nm
    return Line(
        rung.family,
        held_out,
        low,
        high,
        terms,
        nested_nm,
        se_nm,
        rung.refused or "",
        without.covered.get(rung.family),
    )
