"""Whether friction depends on load, judged by what was held out. What the law is given of it, where that is
asked for, is made in `unloaded`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.learn import certainty, load_terms
from rtctl.friction.learn.bands import way_of
from rtctl.friction.learn.hold_out import TRAINS, folds_of, shared_out, units_of
from rtctl.friction.learn.load_terms import RUNGS, Rows, Terms
from rtctl.friction.learn.warmth import Warmth, judge_temperature
from rtctl.friction.model import FrictionModel
from rtctl.friction.points import FrictionPoints

LOAD_SPAN = 0.5
"""Least span of the load, share of the friction's RMS: less changes friction by less than its noise."""

ROWS_MIN = 30
"""Fewest points by which load is judged: the largest form has fourteen numbers."""


@dataclass(frozen=True)
class LoadRung:
    """One form: `terms` fitted to all points, its held-out RMSE and what it may differ by by chance
    (`certainty.doubt`), N m."""

    terms: Terms
    rmse_nm: float
    doubt_nm: float


@dataclass(frozen=True)
class LoadVerdict:
    """What load is worth. `chosen` None: `reason` says why nothing can be said. `span_nm` is the span of the
    load."""

    span_nm: float
    rungs: tuple[LoadRung, ...] = ()
    chosen: LoadRung | None = None
    reason: str = ""

    def of(self, rung: str) -> LoadRung:
        """One of `RUNGS`."""
        return next(one for one in self.rungs if one.terms.rung == rung)

    @property
    def less_share(self) -> float:
        """Held-out error of the chosen form below that of Coulomb + viscous, share of it: 0 none, 1 all."""
        assert self.chosen is not None
        return 1 - self.chosen.rmse_nm / self.of("coulomb_viscous").rmse_nm


def rows_of(points: FrictionPoints) -> tuple[Rows, np.ndarray]:
    """Points of both directions along their motion, and their index.

    The motor's torque is the column motor_nm where it is known, else what a steady speed needs: friction less
    load."""
    kept = np.concatenate([points.rows_of(direction) for direction in (1, -1)])
    load = points.columns["load_nm"]
    sign = points.direction
    motor = points.columns.get("motor_nm", np.full(len(load), np.nan))
    # at a steady speed the three are in balance
    motor = np.where(np.isfinite(motor), motor, sign * points.friction_nm - load)
    kept = kept[np.isfinite(load[kept])]
    columns = (np.abs(points.velocity_rad_s), points.friction_nm, sign * load, sign * motor, sign < 0)
    return Rows(*(column[kept] for column in columns)), kept


def judge_load(points: FrictionPoints, folds: str) -> LoadVerdict:
    """Fit every form of `RUNGS` with load and without, and choose as everywhere: the plainest as good as the
    best on what was held out.

    `folds` is what is held out together, of `hold_out.WAYS`; sessions where there are some."""
    if "load_nm" not in points.columns:
        return LoadVerdict(0.0, reason="no column load_nm: nothing is known of load")
    rows, kept = rows_of(points)
    if len(kept) < ROWS_MIN:
        return LoadVerdict(0.0, reason=f"{len(kept)} points with a load, at least {ROWS_MIN} are needed")
    # along the motion: a weight that hangs on the joint helps one way and hinders the other, and so spans
    # twice its torque
    span_nm = float(np.ptp(rows.outside_nm))
    size_nm = float(np.sqrt(np.mean(rows.friction_nm**2)))
    # coefficients of a load that hardly changed are noise over noise, however many points there are
    if span_nm < LOAD_SPAN * size_nm:
        return LoadVerdict(
            span_nm,
            reason=f"the load spans {span_nm:.3g} N m, friction is {size_nm:.3g} N m: the data do not span "
            "it; hang weights on the joint",
        )
    fold, block = _folds(points, kept, way_of(points, folds))
    # a fold of all of them would be learned from nothing
    if len(np.unique(fold)) < 2:
        raise DataError(
            f"{points.source}: points with a load are of one {way_of(points, folds)} alone, and none is left "
            "to judge by; measure the load in every session"
        )
    rungs = tuple(_rung(rung, rows, fold, block) for rung in RUNGS)
    best = min(rungs, key=lambda one: one.rmse_nm)
    # the first: `RUNGS` begins with the plainest
    chosen = next(one for one in rungs if one.rmse_nm <= best.rmse_nm + best.doubt_nm)
    return LoadVerdict(span_nm, rungs, chosen)


def _folds(points: FrictionPoints, kept: np.ndarray, way: str) -> tuple[np.ndarray, np.ndarray]:
    """Fold and block of each row that is kept."""
    # units of all points, and only then those with a load: numbers of speeds must not change with what has
    # one
    unit = units_of(points, way)[kept]
    if way != "speed":
        return shared_out(unit), unit
    fold = np.full(len(points.direction), TRAINS)
    for direction in (1, -1):
        # direction by direction: each has a slowest and a fastest speed of its own, which train always
        fold[points.rows_of(direction)] = folds_of(points, (direction,), way)
    return fold[kept], unit


def _rung(rung: str, rows: Rows, fold: np.ndarray, block: np.ndarray) -> LoadRung:
    errors = np.zeros(len(fold))
    for k in np.unique(fold[fold != TRAINS]):
        held = fold == k
        fitted = load_terms.fit_terms(rung, rows.of(~held))
        errors[held] = fitted(rows.of(held)) - rows.friction_nm[held]
    judged = fold != TRAINS
    rmse = float(np.sqrt(np.mean(errors[judged] ** 2)))
    doubt = certainty.doubt(errors[judged], block[judged])
    # told are the numbers of all points: the folds only said how well a form does on what it has not seen
    return LoadRung(load_terms.fit_terms(rung, rows), rmse, doubt)


def judge(model: FrictionModel, points: FrictionPoints, folds: str) -> tuple[LoadVerdict, Warmth]:
    """Both; what cannot be held out says so instead of failing a fit."""
    try:
        load = judge_load(points, folds)
    except DataError as error:
        load = LoadVerdict(0.0, reason=str(error))
    return load, judge_temperature(model, points)
