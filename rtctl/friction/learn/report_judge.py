"""An existing model judged by points: per direction, beside Coulomb + viscous fitted to the same points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtctl.friction.learn.grids import RESOLUTION_SHARE
from rtctl.friction.model import Branch, FrictionModel
from rtctl.friction.points import FrictionPoints


@dataclass(frozen=True)
class Judgement:
    """One direction. Errors are model minus measurement, N m.

    `error_share` is the RMSE over the RMS of the measured friction. `outside` counts points faster than the
    trained range, `slower` those below the slowest trained speed: they count in no error. `over_bound` counts
    points within the range that the model misses by more than its file states (`bound_nm`). `floor_rmse_nm`
    is the RMSE of Coulomb + viscous fitted to these very points, `allowed_rmse_nm` what the model may err
    beside it: those two numbers have seen the points, and the model has not. `outside_band_share` is the
    share of points outside the model's band, 0 to 1 (None also without a band). None where no point lies
    within the range."""

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
    allowed_rmse_nm: float | None = None
    outside_band_share: float | None = None
    slower: int = 0

    def beyond(self) -> tuple[tuple[int, str], ...]:
        """Points beyond either end of the trained range, and how they are."""
        return (self.outside, "faster"), (self.slower, "slower")


BAND_SIGMAS = 1.96
"""Half width of a band of 95 %, standard deviations."""

OUTSIDE_MOST = 0.1
"""Share of a session beyond a band that is for 95 % of it, from which the band does not hold: twice what it
allows; of few points more, by chance."""

# at a tenth alone 40 % of right sessions of 5 points each way were refused, 22 % of 24 (decision 0155)
RIGHT_REFUSED = 0.05
"""Largest share of right sessions, both directions together, of which more points are outside by chance."""

FAR_OVER = 2.0
"""Times the stated bound, the largest error of the points learned from, that no single point may err: a
little beyond the largest of so many is chance."""

MOSTLY = 0.5
"""Share of the points beyond the trained range from which it is another motion than the model's, or another
unit."""

# a session is hardly ever just as slow as another (decision 0101)
SAME_SPEED = 0.02
"""Share by which a point may be slower than the slowest of those learned from, and is as slow."""

UNEVEN_SURE = 2.0
"""Standard errors by which a mean over places may be off the mean over all places."""


def judge(model: FrictionModel, points: FrictionPoints) -> tuple[Judgement, Judgement]:
    """Judge both directions, +1 first.

    Of a model by place a point is a mean over places that are never quite even: it may be off by what its
    measurements scatter by, over the root of their number, before it speaks against the curve of speed."""
    # a curve of speed alone was learned from such means itself, and its bound has them in it
    slack_nm = np.zeros(len(points.direction))
    if model.place is not None:
        slack_nm = np.nan_to_num(UNEVEN_SURE * points.std_nm / np.sqrt(np.maximum(points.count, 1)))
    forward, backward = (
        _of(branch, *points.branch(way), way, slack_nm[points.rows_of(way)])
        for branch, way in zip(model.branches, (1, -1), strict=True)
    )
    return forward, backward


def by_chance(points: int) -> float:
    """Most of so many points, independent of each other, that may be beyond what holds 95 % of them."""
    from scipy.special import bdtr

    few = np.arange(points + 1.0)
    # of two directions: each has the root of what both are to hold
    likely = few[bdtr(few, points, 0.05) >= np.sqrt(1 - RIGHT_REFUSED)]
    return max(OUTSIDE_MOST * points, float(likely.min(initial=points)))


def faults(found: tuple[Judgement, ...]) -> list[str]:
    """What speaks against the model, in words; empty when nothing does."""
    said = []
    for one in found:
        at = f"direction {one.direction:+d}:"
        if one.rmse_nm is None or one.floor_rmse_nm is None:
            within = " within the trained range" if one.points else ""
            said.append(f"{at} no point{within}, nothing can be said")
            continue
        said += elsewhere((one,))
        judged = one.points - one.outside - one.slower
        far = abs(one.worst_nm or 0.0) > FAR_OVER * one.bound_nm
        # a few beyond the largest error of the points learned from are chance, unless one is far beyond
        if one.over_bound > by_chance(judged) or (one.over_bound and far):
            said.append(
                f"{at} {one.over_bound} points break the stated bound of {one.bound_nm:.4g} N m, with errors "
                f"of up to {abs(one.worst_nm or 0.0):.4g} N m, at {one.worst_at_rad_s:.3g} rad/s"
            )
        share = one.outside_band_share
        if share is not None and share * judged > by_chance(judged) + 1e-9:
            said.append(f"{at} {100 * share:.0f} % of the points lie outside the 95 % band")
        if one.rmse_nm > (one.allowed_rmse_nm or 0.0):
            said.append(f"{at} Coulomb + viscous fitted to these points is nearer to them")
    return said


def elsewhere(found: tuple[Judgement, ...]) -> list[str]:
    """Which directions have most of their points beyond the trained range, in words."""
    return [
        f"direction {one.direction:+d}: most points, {beyond} of {one.points}, are {how} than the trained "
        "range"
        for one in found
        for beyond, how in one.beyond()
        if beyond > MOSTLY * one.points
    ]


def headed(found: tuple[Judgement, ...]) -> str:
    """What a model with faults does: points that are missing speak against none."""
    judged = tuple(one for one in found if one.rmse_nm is not None)
    return "does not hold" if faults(judged) else "cannot be judged in full"


def not_judged(found: tuple[Judgement, ...]) -> list[str]:
    """Which points nothing is said of: another session of the same joint is hardly ever just as quick and as
    slow. Help fades above the trained range; below it the curve is what quicker motion extrapolates to."""
    return [
        f"direction {one.direction:+d}: {beyond} of {one.points} points are {how} than the trained range: "
        "not judged"
        for one in found
        for beyond, how in one.beyond()
        if 0 < beyond <= MOSTLY * one.points
    ]


def _of(
    branch: Branch, speed: np.ndarray, friction_nm: np.ndarray, direction: int, slack_nm: np.ndarray
) -> Judgement:
    slowest = 0.0 if branch.band is None else branch.band.slowest_rad_s
    slow = speed < slowest * (1 - SAME_SPEED)
    inside = (speed <= branch.speed_max_rad_s) & ~slow
    v, f, bound = speed[inside], friction_nm[inside], branch.error_max_nm
    n, outside, slower = len(speed), int((speed > branch.speed_max_rad_s).sum()), int(slow.sum())
    if not len(v):
        return Judgement(direction, n, outside, bound, 0, slower=slower)
    error = branch.magnitude(v) - f
    # what uneven places may have made of it is no error of the model
    sure = np.sign(error) * np.maximum(np.abs(error) - slack_nm[inside], 0.0)
    line = np.column_stack([np.ones_like(v), v])
    floor = line @ np.linalg.lstsq(line, f, rcond=None)[0] - f
    # less than that counts as equal (decision 0012), however narrow the band
    told = np.where(np.abs(sure) > RESOLUTION_SHARE * np.abs(f).max(), sure, 0.0)
    # among those that count against the model: a larger one may be what uneven places make
    size, worst = float(np.sqrt(np.mean(f**2))), int(np.argmax(np.abs(sure)))
    rmse = float(np.sqrt(np.mean(error**2)))
    return Judgement(
        direction,
        n,
        outside,
        bound,
        int((np.abs(sure) > bound * (1 + 1e-9)).sum()),
        rmse,
        rmse / size if size else None,
        float(error.mean()),
        float(error[worst]),
        float(v[worst]),
        float(np.sqrt(np.mean(floor**2))),
        _allowed(branch, v, f, floor),
        None if branch.band is None else 1 - float(np.mean(branch.band.holds(v, told))),
        slower,
    )


def _allowed(branch: Branch, v: np.ndarray, f: np.ndarray, floor: np.ndarray) -> float:
    """RMSE up to which a model is as near to points as Coulomb + viscous fitted to them, N m.

    Two numbers fitted to n points err by 2/n of the power less than those that are not, and of right sessions
    all but `RIGHT_REFUSED` have no more than Fisher's F times it (decision 0162); and between two
    sessions the model may be off by a standard deviation of its band, or by what counts as equal where it is
    more (decision 0012)."""
    from scipy.special import fdtri

    session = RESOLUTION_SHARE * float(np.abs(f).max())
    if branch.band is not None:
        session = max(session, float(np.sqrt(np.mean(branch.band.at(v) ** 2))) / BAND_SIGMAS)
    # two numbers were fitted to the very points that the model has not seen
    free = max(len(v) - 2, 1)
    chance = fdtri(len(v), free, np.sqrt(1 - RIGHT_REFUSED))
    fitted = float(np.mean(floor**2)) * len(v) / free * chance
    return float(np.hypot(np.sqrt(fitted), session))
