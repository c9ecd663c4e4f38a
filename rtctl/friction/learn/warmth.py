"""What a kelvin changes of dry and viscous friction, and how sure that is. Judged, not deployed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rtctl.friction.learn.hold_out import several_logs, units_of
from rtctl.friction.model import FrictionModel
from rtctl.friction.points import FrictionPoints

TEMPERATURE_SPAN_K = 5.0
"""Least span of temperature: as far as a running rig may go from it without a warning."""

TEMPERATURES_MIN = 8
"""Fewest points on either side of the middle temperature."""

ALIKE = 0.5
"""Largest correlation of temperature with speed up to which the two can be told apart."""

VISCOUS_LEAST = 0.1
"""Least viscous share of the friction, mean, whose scale is told: of less nobody could tell it."""

SESSIONS_MIN = 3
"""Fewest sessions that tell an error: what two differ by is their temperature or anything else."""

BENDS = (0.1, 0.4, 0.7)
"""Speeds at which a curve bends, on the logarithmic way from the lowest to the highest of the points."""

TOLD_BY = 1e-10
"""Least share of its columns by which a session may be left out: with less the rest say nothing alone."""


@dataclass(frozen=True)
class Warmth:
    """How friction scales per kelvin, dry and viscous part, each with its standard error; `reason` where
    nothing can be said.

    Twice a standard error holds the truth in 95 % of all cases, however few the sessions; NaN where their
    number tells no error. `middle_c` is where the scales are 1, `span_k` the range of temperature. `caution`
    says what of few sessions no error tells."""

    span_k: float = 0.0
    middle_c: float = 0.0
    dry_per_k: tuple[float, float] = (0.0, 0.0)
    viscous_per_k: tuple[float, float] | None = None
    reason: str = ""
    caution: str = ""


def judge_temperature(model: FrictionModel, points: FrictionPoints) -> Warmth:
    """Scale of dry and viscous friction over temperature, by least squares beside a curve of each direction.

    Notes
    -----
    f = C(v) + (T - T0) (d D(v) + b V v), D the learned curve's dry part and V its viscous slope: d and b are
    shares per kelvin, T0 the mean temperature. C is fitted with them: the learned curve runs through points
    as they are, the warmth of each with them (decision 0146). What is shared by a session, of one session by
    a stretch of its time, counts as one."""
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
        # a log that warms by 25 K makes points of its middle temperature
        if "log" in points.columns and not several_logs(points):
            reason += "; a point of a log is its mean over all of it: of one that warms give the parts"
        return Warmth(span, middle, reason=reason)
    if abs(float(np.corrcoef(celsius, speed)[0, 1])) > ALIKE:
        reason = (
            "temperature rises and falls with speed in these points: the two cannot be told apart; measure "
            "the same speeds cold and warm"
        )
        return Warmth(span, middle, reason=reason)
    backward = points.direction[kept] < 0
    # the learned curve says only what is dry and what viscous; the level is fitted anew beside the
    # temperature (decision 0146)
    dry, viscous = _parts(model, speed, backward)
    # both, also where hardly any is viscous: oil that thins is else told as dry friction that falls
    columns = np.column_stack(
        [(celsius - middle) * part for part in (dry, viscous)] + _curve(speed, backward)
    )
    told = 2 if float(np.mean(viscous)) > VISCOUS_LEAST * float(np.mean(dry + viscous)) else 1
    found = _regress(columns, points.friction_nm[kept], _blocks(points)[kept], told)
    sessions = len(set(points.columns["log"])) if several_logs(points) else 1
    return Warmth(span, middle, found[0], found[1] if told > 1 else None, caution=_CAUTION.get(sessions, ""))


def at_middle(model: FrictionModel, points: FrictionPoints, warmth: Warmth) -> FrictionPoints:
    """Points as their friction would be at `warmth.middle_c`, where the model is at home; those of unknown
    temperature as they are."""
    over_k = np.nan_to_num(points.columns["temperature_c"] - warmth.middle_c)
    dry, viscous = _parts(model, np.abs(points.velocity_rad_s), points.direction < 0)
    by_k = warmth.dry_per_k[0] * dry + (warmth.viscous_per_k or (0.0,))[0] * viscous
    return replace(points, friction_nm=points.friction_nm - over_k * by_k)


def _parts(model: FrictionModel, speed: np.ndarray, backward: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Dry and viscous friction of the learned curve, N m, at each speed of its direction."""
    curve = np.where(backward, model.branches[1].magnitude(speed), model.branches[0].magnitude(speed))
    slope = np.array([branch.viscous_nms_rad for branch in model.branches])[backward.astype(int)]
    return curve - slope * speed, slope * speed


_CAUTION = {
    1: "of one session: what else changed while the motor warmed is in it",
    2: "two sessions may differ by as much for another reason: record a third",
}


def _curve(speed: np.ndarray, backward: np.ndarray) -> list[np.ndarray]:
    """Columns of a curve of each direction: level, slope, and what fades from three speeds on."""
    # by ratio: nobody knows beforehand where in the range a peak falls, and mostly it is near its slow end
    low, high = float(speed[speed > 0].min()), float(speed.max())
    shapes = [np.ones(len(speed)), speed / high]
    shapes += [np.exp(-speed / (low * (high / low) ** bend)) for bend in BENDS]
    return [shape * side for side in (~backward, backward) for shape in shapes]


def _blocks(points: FrictionPoints) -> np.ndarray:
    """Number of what each point shares its errors with: sessions, stretches of time, or nothing."""
    if several_logs(points):
        return units_of(points, "log")
    time_s = points.time_s
    known = time_s is not None and bool(np.isfinite(time_s).all())
    return units_of(points, "time") if known else np.arange(len(points.direction))


def _regress(
    columns: np.ndarray, wanted: np.ndarray, block: np.ndarray, told: int
) -> list[tuple[float, float]]:
    """The first `told` coefficients, with standard errors that allow for errors that a block shares.

    Notes
    -----
    docs/theory.md 8.10: how far a coefficient moves as each block is left out, squared and summed, as a share
    of what that is of rows all alike; Student's of as many degrees of freedom as these squares then have, in
    place of the normal."""
    from scipy.stats import norm, t

    scale = np.sqrt((columns**2).mean(axis=0))
    scale[scale == 0] = 1.0
    columns = columns / scale
    inverse = np.linalg.pinv(columns.T @ columns)
    found = inverse @ columns.T @ wanted
    rest = wanted - columns @ found
    blocks = [block == one for one in np.unique(block)]
    squares = np.array([columns[rows].T @ columns[rows] for rows in blocks])
    scores = np.array([columns[rows].T @ rest[rows] for rows in blocks])
    without = np.eye(len(found)) - inverse @ squares
    # without a session that alone tells a column nothing is left of it: `without` is singular then
    alone = len(blocks) >= SESSIONS_MIN and np.linalg.cond(without).max() < 1 / TOLD_BY
    answer = []
    for k in range(told):
        error = np.nan
        if alone:
            left_out = np.linalg.solve(without, np.tile(inverse[:, k, None], (len(blocks), 1, 1)))[..., 0]
            moved = np.einsum("gp,gp->g", left_out, scores)
            shared = np.einsum("gpq,gq->gp", squares, left_out)
            alike = np.diag(np.einsum("gp,gp->g", left_out, shared)) - shared @ inverse @ shared.T
            freedom = np.trace(alike) ** 2 / np.sum(alike**2)
            # halved, so that twice the error told is 95 % however few the sessions are
            student = t.ppf(norm.cdf(2), max(freedom, 1.0)) / 2
            error = student * np.sqrt(moved @ moved * inverse[k, k] / np.trace(alike))
        answer.append((float(found[k] / scale[k]), float(error / scale[k])))
    return answer
