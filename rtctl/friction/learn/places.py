"""Rungs of place: how many waves a turn friction has, cross-validated over places, and that model.

Rows are measurements at one place and speed each. The machine is least squares with the product kernel of
`rtctl.friction.kind_place` (a ridge in its space): with so many rows at the same speeds an epsilon-SVR took
a hundred times as long, and no better. Without a wave it is the spline of speed alone, which is the rung to
beat."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.band import Band
from rtctl.friction.kind_curve import Curve
from rtctl.friction.kind_harmonics import Harmonics
from rtctl.friction.kind_place import SPEEDS_MOST, WAVES_MOST, PlaceKernel, compile_place
from rtctl.friction.kind_spline import UNIT
from rtctl.friction.learn.bands import of_errors, with_band
from rtctl.friction.learn.fit import describe_branch
from rtctl.friction.learn.grids import unit_of
from rtctl.friction.learn.hold_out import FOLDS, TRAINS, folds_by_speed
from rtctl.friction.model import Branch, FrictionModel, self_test_vectors
from rtctl.friction.points import POINTS_MAX, FrictionPoints, level_starts

SHARES = (0.03, 0.3)
"""lambda tried: how far friction may differ from place to place."""

DECAY = 0.7
"""rho: a higher wave is as much less likely."""

RIDGES = (1e-4, 1e-3, 1e-2)
"""Tried: how much smoothness counts against the squares of the errors."""

_SECTORS = 20
"""Sectors of a turn; every fifth that has rows is held out together, at every speed and in every turn."""

_PLACES_LEAST = 8
"""Fewest places per turn from which waves can be told."""

_SPEEDS_LEAST = 4
"""Fewest speeds of which some can be held out."""

_ROWS_OF_SEARCH = 400
"""Rows of one direction that the search looks at."""

_ROWS_OF_MODEL = 1000
"""Rows that the model is learned from: each becomes a support vector."""


@dataclass(frozen=True)
class PlaceRung:
    """One number of waves: its kernel and ridge, held-out RMSE and its standard error over places, N m."""

    kernel: PlaceKernel
    ridge: float
    rmse_nm: float
    se_nm: float


@dataclass(frozen=True)
class PlaceFit:
    """The rungs, fewest waves first, and the chosen; `model` is with it, as it was where no wave helps."""

    rungs: tuple[PlaceRung, ...]
    chosen: PlaceRung
    model: FrictionModel

    @property
    def sentence(self) -> str:
        """What was chosen and what for."""
        alone, best = self.rungs[0], self.chosen
        if best.kernel.orders == 0:
            return (
                f"No waves over the turn: they do not better the {1e3 * alone.rmse_nm:.3g} mN m at held-out "
                "places."
            )
        return (
            f"{best.kernel.orders} waves over a turn of {best.kernel.period_rad:.4g} rad: "
            f"{1e3 * best.rmse_nm:.3g} mN m at held-out places, {1e3 * alone.rmse_nm:.3g} by speed alone."
        )


@dataclass(frozen=True)
class _Side:
    """Rows of one direction: speed, position, friction without the conservative part; fold of each."""

    direction: int
    v: np.ndarray
    x: np.ndarray
    f: np.ndarray
    fold: np.ndarray


def fit_places(
    model: FrictionModel, points: FrictionPoints, period_rad: float, conservative: Harmonics | None = None
) -> PlaceFit:
    """Add what place does to friction to a model.

    Parameters
    ----------
    points
        Rows with a `position_rad`, each of one place and speed (`rtctl identify` writes points_places.csv);
        `travel_rad` is the way a row is the mean over.
    period_rad
        One turn of whatever friction follows: 2 pi for the joint, 2 pi over the gear ratio for its motor.
    conservative
        Taken off the rows first, and kept in the model.

    Raises
    ------
    DataError
        No positions, too few places or too many rows, or a curve that is not positive."""
    if points.columns.get("position_rad") is None:
        raise DataError(f"{points.source}: no column position_rad; give points_places.csv of rtctl identify")
    sides = [_side(points, way, period_rad, conservative) for way in (1, -1)]
    unit = unit_of(points.motion, float(np.abs(points.velocity_rad_s).max()))
    rungs = tuple(_rungs(sides, period_rad, unit))
    best = min(rungs, key=lambda rung: rung.rmse_nm)
    chosen = next(rung for rung in rungs if rung.rmse_nm <= best.rmse_nm + best.se_nm)
    kept = conservative if conservative is not None and len(conservative.orders) else None
    if chosen.kernel.orders == 0:
        return PlaceFit(rungs, chosen, replace(model, conservative=kept))
    forward, backward = (
        _branch(before, side, chosen) for before, side in zip(model.branches, sides, strict=True)
    )
    both = _with_bands(model.branches, (forward, backward), sides, chosen)
    made = replace(
        model,
        kind="spline",
        branches=both,
        place=chosen.kernel,
        conservative=kept,
        self_test=self_test_vectors(both),
    )
    return PlaceFit(rungs, chosen, made)


def _side(points: FrictionPoints, way: int, period_rad: float, conservative: Harmonics | None) -> _Side:
    rows = points.rows_of(way)
    x = points.columns["position_rad"][rows]
    known = np.isfinite(x)
    rows, x = rows[known], x[known]
    places = len(np.unique(np.floor((x / period_rad) % 1.0 * 2 * _SECTORS)))
    if places < _PLACES_LEAST or not 2 * _PLACES_LEAST <= len(rows) <= POINTS_MAX:
        raise DataError(
            f"{points.source}: direction {way:+d}: {len(rows)} rows at {places} places of a turn of "
            f"{period_rad:.4g} rad; {_PLACES_LEAST} places and {2 * _PLACES_LEAST} to {POINTS_MAX} rows are "
            "needed: measure more places, or another period"
        )
    v = np.abs(points.velocity_rad_s[rows])
    friction = points.friction_nm[rows]
    if conservative is not None and len(conservative.orders):
        travel = np.nan_to_num(points.columns.get("travel_rad", np.zeros(len(points.direction)))[rows])
        friction = friction + way * conservative.mean_over(x, travel)
    # sectors with rows are counted: of 8 even places only sectors 0 and 2 of every five have one
    fold = np.unique(np.floor((x / period_rad) % 1.0 * _SECTORS), return_inverse=True)[1] % FOLDS
    return _Side(way, _levels(v), x, friction, fold)


def _levels(v: np.ndarray) -> np.ndarray:
    """Speeds rounded to as many levels as the law has segments: rows of one level differ by noise alone."""
    share = 1e-3
    while len(np.unique(v)) >= SPEEDS_MOST:
        grid = np.power(1 + share, np.round(np.log(np.maximum(v, 1e-9)) / math.log1p(share)))
        v = np.where(v > 0, grid, 0.0)
        share *= 2
    return v


def _rungs(sides: list[_Side], period_rad: float, unit_rad_s: float) -> Iterator[PlaceRung]:
    """Every number of waves with the best of its shares and ridges."""
    for orders in range(WAVES_MOST + 1):
        tried = []
        for share in SHARES if orders else SHARES[:1]:
            for ridge in RIDGES:
                kernel = PlaceKernel(period_rad, orders, share, DECAY, unit_rad_s)
                errors = [_held_out(kernel, ridge, side) for side in sides]
                folds = [np.concatenate(fold) for fold in zip(*errors, strict=True)]
                # a fold without a row errs by nothing, and knows nothing
                blocks = np.array([np.mean(fold**2) for fold in folds if len(fold)])
                rmse = float(np.sqrt(blocks.mean()))
                se = float(blocks.std(ddof=1) / math.sqrt(len(blocks))) / (2 * rmse) if rmse > 0 else 0.0
                tried.append(PlaceRung(kernel, ridge, rmse, se))
        yield min(tried, key=lambda rung: rung.rmse_nm)


def _thinned(side: _Side, most: int) -> _Side:
    """So many rows, drawn without a pattern, always the same, and the slowest and the fastest."""
    rows = np.sort(np.random.default_rng(0).permutation(len(side.v))[:most])
    ends = [int(np.argmin(side.v)), int(np.argmax(side.v))]  # the range does not shrink
    rows = np.unique(np.append(rows, ends))
    return _Side(side.direction, side.v[rows], side.x[rows], side.f[rows], side.fold[rows])


def _held_out(kernel: PlaceKernel, ridge: float, side: _Side) -> list[np.ndarray]:
    """Errors at the held-out places of each fold, N m."""
    few = _thinned(side, _ROWS_OF_SEARCH)
    errors = _errors_of(kernel, ridge, few, few.fold)
    return [errors[few.fold == k] for k in range(FOLDS)]


def _errors_of(kernel: PlaceKernel, ridge: float, side: _Side, fold: np.ndarray) -> np.ndarray:
    """Error of each row by what was learned without its fold, N m; 0 where that trains always."""
    errors = np.zeros(len(fold))
    for k in range(FOLDS):
        held = fold == k
        if not held.any() or held.all():
            continue
        v, x = side.v[~held], side.x[~held]
        beta, intercept = _solve(kernel, ridge, v, x, side.f[~held])
        errors[held] = kernel.product(side.v[held], side.x[held], v, x) @ beta + intercept - side.f[held]
    return errors


def _solve(
    kernel: PlaceKernel, ridge: float, v: np.ndarray, x: np.ndarray, f: np.ndarray
) -> tuple[np.ndarray, float]:
    """Duals and intercept of min sum (f(v, x) - f)^2 + ridge |f|^2, the intercept free."""
    n = len(v)
    system = np.zeros((n + 1, n + 1))
    system[:n, :n] = kernel.product(v, x, v, x) + ridge * np.eye(n)
    system[n, :n] = system[:n, n] = 1.0
    found = np.linalg.solve(system, np.append(f, 0.0))
    return found[:n], float(found[n])


def _branch(before: Branch, side: _Side, rung: PlaceRung) -> Branch:
    rows = _thinned(side, _ROWS_OF_MODEL)
    beta, intercept = _solve(rung.kernel, rung.ridge, rows.v, rows.x, rows.f)
    parameters = {UNIT: rung.kernel.unit_rad_s} if rung.kernel.unit_rad_s != 1.0 else {}
    curve = Curve("spline", parameters, rows.v, beta, intercept)
    held = np.concatenate(_held_out(rung.kernel, rung.ridge, side))
    branch = describe_branch(curve, side.v, side.f, held, {"ridge": rung.ridge})
    tables = compile_place(rung.kernel, rows.v, rows.x, beta)
    residual = np.abs(branch.curve(side.v) + tables(side.v, side.x) - side.f)
    speeds = branch.curve.extreme_speeds(branch.speed_max_rad_s)
    lowest = branch.magnitude(speeds) + tables.over_turn(speeds).min(axis=1)
    if not (lowest > 0).all():
        raise DataError("friction over place is not positive everywhere; measure more places")
    shortfall = float(np.max(branch.magnitude(side.v) - side.f, initial=0.0))
    spread = max(shortfall, float(-tables.over_turn(speeds).min()), before.place_spread_nm or 0.0)
    return replace(
        branch,
        support_places=rows.x,
        place_spread_nm=spread,
        train_mean_error_nm=float(residual.mean()),
        train_rmse_nm=float(np.sqrt(np.mean(residual**2))),
        train_max_error_nm=float(residual.max()),
    )


def _with_bands(
    before: tuple[Branch, Branch], after: tuple[Branch, Branch], sides: list[_Side], rung: PlaceRung
) -> tuple[Branch, Branch]:
    """Both directions with their bands about the curve of speed and place.

    What sessions differ by is in the band of the curve of speed, which is then wider by as much as the two
    curves are apart. Else the band is of what the curve of speed and place errs by itself, at places or at
    speeds that were held out, whichever is more: the curve of speed is learned from means over places that
    are never quite even, and what it is off by is no error of this one."""
    if any(branch.band is None for branch in before):
        return after
    if before[0].band is not None and before[0].band.way == "log":
        about = [_band_about(*pair) for pair in zip(before, after, strict=True)]
        return replace(after[0], band=about[0]), replace(after[1], band=about[1])
    few = [_thinned(side, _ROWS_OF_SEARCH) for side in sides]
    found = {"place": _errors(rung, few, [one.fold for one in few])}
    # by levels: each place has a mean speed of its own, which differs by noise
    if all(len(level_starts(one.v)) >= _SPEEDS_LEAST for one in few):
        found["speed"] = _errors(rung, few, [folds_by_speed(one.v, FOLDS) for one in few])
    way = max(found, key=lambda way: float(np.mean(found[way][1] ** 2)))
    return with_band(after, of_errors(*found[way], way))


def _errors(
    rung: PlaceRung, sides: list[_Side], folds: list[np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Speed, held-out error (N m) and block of every held-out row, one direction after the other."""
    speed, errors, block = [], [], []
    for at, (side, fold) in enumerate(zip(sides, folds, strict=True)):
        held = fold != TRAINS
        speed.append(side.v[held])
        errors.append(_errors_of(rung.kernel, rung.ridge, side, fold)[held])
        block.append(FOLDS * at + fold[held])
    return np.concatenate(speed), np.concatenate(errors), np.concatenate(block)


def _band_about(before: Branch, after: Branch) -> Band | None:
    """The band of the curve of speed about that of speed and place: wider by what the two are apart."""
    if before.band is None:
        return None
    end = min(before.speed_max_rad_s, after.speed_max_rad_s)
    v = np.union1d(before.curve.extreme_speeds(end), after.curve.extreme_speeds(end))
    return before.band.widened(float(np.abs(after.magnitude(v) - before.magnitude(v)).max()))
