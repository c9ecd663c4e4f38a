"""Whether friction depends on load and temperature, judged by what was held out. Judged, not deployed: the
law goes by speed and place alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.learn import certainty, load_terms
from rtctl.friction.learn.bands import way_of
from rtctl.friction.learn.hold_out import TRAINS, folds_of, several_logs, shared_out, units_of
from rtctl.friction.learn.load_terms import RUNGS, Rows, Terms
from rtctl.friction.model import FrictionModel
from rtctl.friction.points import FrictionPoints

LOAD_SPAN = 0.5
"""Least span of the load, share of the friction's RMS: less changes friction by less than its noise."""

ROWS_MIN = 30
"""Fewest points by which load is judged: the largest form has fourteen numbers."""

TEMPERATURE_SPAN_K = 5.0
"""Least span of temperature: as far as a running rig may go from it without a warning."""

TEMPERATURES_MIN = 8
"""Fewest points on either side of the middle temperature."""

ALIKE = 0.5
"""Largest correlation of temperature with speed up to which the two can be told apart."""


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
    rungs = tuple(_rung(rung, rows, fold, block) for rung in RUNGS)
    best = min(rungs, key=lambda one: one.rmse_nm)
    # the first: `RUNGS` begins with the plainest
    chosen = next(one for one in rungs if one.rmse_nm <= best.rmse_nm + best.doubt_nm)
    return LoadVerdict(span_nm, rungs, chosen)


def _folds(points: FrictionPoints, kept: np.ndarray, way: str) -> tuple[np.ndarray, np.ndarray]:
    """Fold and block of each row that is kept."""
    unit = units_of(points, way)[kept]
    if way != "speed":
        return shared_out(unit), unit
    fold = np.full(len(points.direction), TRAINS)
    for direction in (1, -1):
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
    return LoadRung(load_terms.fit_terms(rung, rows), rmse, doubt)


@dataclass(frozen=True)
class Warmth:
    """How friction scales per kelvin, dry and viscous part, each with its standard error; `reason` where
    nothing can be said.

    `middle_c` is where the scales are 1, `span_k` the range of temperature."""

    span_k: float = 0.0
    middle_c: float = 0.0
    dry_per_k: tuple[float, float] = (0.0, 0.0)
    viscous_per_k: tuple[float, float] | None = None
    reason: str = ""


def judge_temperature(model: FrictionModel, points: FrictionPoints) -> Warmth:
    """Scale of dry and viscous friction over temperature, by least squares about the learned curve.

    Notes
    -----
    f = F(v) + (T - T0) (d D(v) + b V v), D the curve's dry part and V its viscous slope: d and b are shares
    per kelvin. The curve was learned over all temperatures, so that it is right at about T0, their mean.
    What sessions differ by looks like temperature where each has its own: errors by sessions, where there are
    enough of them (`certainty.BLOCKS_MIN`)."""
    if points.temperature_range_c is None:
        return Warmth(reason="no column temperature_c: nothing is known of temperature")
    column = points.columns["temperature_c"]
    kept = np.concatenate([points.rows_of(direction) for direction in (1, -1)])
    kept = kept[np.isfinite(column[kept])]
    celsius, speed = column[kept], np.abs(points.velocity_rad_s[kept])
    span, middle = float(np.ptp(celsius)), float(celsius.mean())
    if (
        span < TEMPERATURE_SPAN_K
        or min((celsius < middle).sum(), (celsius > middle).sum()) < TEMPERATURES_MIN
    ):
        reason = (
            f"temperature spans {span:.1f} K: the data do not span it (at least {TEMPERATURE_SPAN_K:g} K, "
            f"{TEMPERATURES_MIN} points on either side)"
        )
        return Warmth(span, middle, reason=reason)
    if abs(float(np.corrcoef(celsius, speed)[0, 1])) > ALIKE:
        reason = (
            "temperature rises and falls with speed in these points: the two cannot be told apart; measure "
            "the same speeds cold and warm"
        )
        return Warmth(span, middle, reason=reason)
    backward = (points.direction[kept] < 0).astype(int)
    curve = np.where(backward, model.branches[1].magnitude(speed), model.branches[0].magnitude(speed))
    slope = np.array([branch.viscous_nms_rad for branch in model.branches])[backward]
    warmer = celsius - middle
    columns = [warmer * (curve - slope * speed), warmer * slope * speed]
    if not float(np.mean(slope * speed)) > 0.1 * float(np.mean(curve)):
        columns = columns[:1]  # hardly any viscous friction, whose scale nobody could tell
    # sessions count as one each: row by row, eight that differ by 2 % had a sixth of their scatter for error
    block = units_of(points, "log")[kept] if several_logs(points) else np.arange(len(kept))
    found, errors = _regress(np.column_stack(columns), points.friction_nm[kept] - curve, block)
    viscous = (found[1], errors[1]) if len(found) > 1 else None
    return Warmth(span, middle, (found[0], errors[0]), viscous)


def _regress(columns: np.ndarray, wanted: np.ndarray, block: np.ndarray) -> tuple[list[float], list[float]]:
    """Least squares and standard errors that allow for unlike spreads, and for errors that a block shares."""
    inverse = np.linalg.pinv(columns.T @ columns)
    found = inverse @ columns.T @ wanted
    names, at = np.unique(block, return_inverse=True)
    if len(names) < certainty.BLOCKS_MIN:  # too few to know their own spread: row by row
        names = at = np.arange(len(wanted))
    scored = np.zeros((len(names), len(found)))
    np.add.at(scored, at, columns * (wanted - columns @ found)[:, None])
    few = len(names) / max(len(names) - len(found), 1)
    variance = few * inverse @ (scored.T @ scored) @ inverse
    return [float(one) for one in found], [float(one) for one in np.sqrt(np.diag(variance))]


def judge(model: FrictionModel, points: FrictionPoints, folds: str) -> tuple[LoadVerdict, Warmth]:
    """Both; what cannot be held out says so instead of failing a fit."""
    try:
        load = judge_load(points, folds)
    except DataError as error:
        load = LoadVerdict(0.0, reason=str(error))
    return load, judge_temperature(model, points)
