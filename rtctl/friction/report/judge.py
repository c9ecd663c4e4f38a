"""An existing model judged by points: per direction, beside Coulomb + viscous fitted to the same points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtctl.friction.model import Branch, FrictionModel
from rtctl.friction.points.measured import FrictionPoints


@dataclass(frozen=True)
class Judgement:
    """One direction. Errors are model minus measurement, N m.

    `error_share` is the RMSE over the RMS of the measured friction. `outside` counts points faster than the
    trained range, which count in no error. `over_bound` counts points within the range that the model misses by more
    than its file states (`bound_nm`). `floor_rmse_nm` is the RMSE of Coulomb + viscous fitted to these very
    points. `outside_band_share` is the share of points outside the model's band, 0 to 1 (None also without a band). None where
    no point lies within the range.
    """

    direction: int
    points: int
    outside: int
    bound_nm: float
    over_bound: int
    rmse_nm: float | None = None
    error_share: float | None = None
    bias_nm: float | None = None
    worst_nm: float | None = None
    worst_at_rad_s: float | None = None
    floor_rmse_nm: float | None = None
    outside_band_share: float | None = None


OUTSIDE_MOST = 0.1
"""Share of a session beyond a band that is for 95 % of it, from which the band does not hold: twice what it allows."""


def judge(model: FrictionModel, points: FrictionPoints) -> tuple[Judgement, Judgement]:
    """Judge both directions, +1 first."""
    forward, backward = model.branches
    return _of(forward, *points.branch(1), 1), _of(backward, *points.branch(-1), -1)


def faults(found: tuple[Judgement, ...]) -> list[str]:
    """What speaks against the model, in words; empty when nothing does."""
    said = []
    for one in found:
        at = f"direction {one.direction:+d}:"
        if one.rmse_nm is None or one.floor_rmse_nm is None:
            said.append(f"{at} no point within the trained range, nothing can be said")
            continue
        if one.outside:
            said.append(f"{at} {one.outside} of {one.points} points are faster than the trained range")
        if one.over_bound:
            said.append(f"{at} {one.over_bound} points break the stated bound of {one.bound_nm:.4g} N m")
        if one.outside_band_share is not None and one.outside_band_share > OUTSIDE_MOST:
            said.append(f"{at} {100 * one.outside_band_share:.0f} % of the points lie outside the 95 % band")
        if one.rmse_nm > one.floor_rmse_nm * (1 + 1e-9) + 1e-12:
            said.append(f"{at} Coulomb + viscous fitted to these points is nearer to them")
    return said


def _of(branch: Branch, speed: np.ndarray, friction_nm: np.ndarray, direction: int) -> Judgement:
    inside = speed <= branch.speed_max_rad_s
    v, f, bound = speed[inside], friction_nm[inside], branch.error_max_nm
    n, outside = len(speed), int((~inside).sum())
    if not len(v):
        return Judgement(direction, n, outside, bound, 0)
    error = branch.magnitude(v) - f
    line = np.column_stack([np.ones_like(v), v])
    floor = line @ np.linalg.lstsq(line, f, rcond=None)[0] - f
    size, worst = float(np.sqrt(np.mean(f**2))), int(np.argmax(np.abs(error)))
    rmse = float(np.sqrt(np.mean(error**2)))
    return Judgement(
        direction,
        n,
        outside,
        bound,
        int((np.abs(error) > bound * (1 + 1e-9)).sum()),
        rmse,
        rmse / size if size else None,
        float(error.mean()),
        float(error[worst]),
        float(v[worst]),
        float(np.sqrt(np.mean(floor**2))),
        None if branch.band is None else 1 - float(np.mean(branch.band.holds(v, error))),
    )
