"""The conservative part out of a slow two-way sweep, and where its places are after an index has moved.

A motor that turns a joint slowly gives tau = d F - tau_c(x): friction F has the sign d of the motion, the
conservative part has not. So one regression on both directions tells them apart: a level for each direction
(and speed), friction's own waves with d, and the conservative ones without."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.kind_harmonics import ORDER_MAX, ORDERS_MOST, Harmonics
from rtctl.friction.learn.hold_out import FOLDS
from rtctl.friction.learn.in_step import chance, peak

# doubled, then halved between two: seven fits and at most four more, where every number would be 33
COUNTS = (0, 1, 2, 4, 8, 16, ORDERS_MOST)
"""How many harmonics are tried first; then those between the fewest that will do and the next fewer."""

# 2.5 to the shortest wave (`ORDER_MAX`): with longer ones a whole wave would be held out at once, and nothing
# beside it would tell its phase
_BLOCKS = 320
"""Most stretches of a period, each shorter than the shortest wave; every fifth is held out together, in every
turn."""

_RIDGE = 1e-12
"""Keeps waves that the places cannot tell apart finite; share of the mean square."""

# where the noise of a sweep is larger than the waves not even the same joint is told (decision 0150)
FIT_SHARE = 0.5
"""A part that explains less than this share of what is seen does not fit, and nothing is compensated with
it."""

# with both bounds frozen, of 87 sweeps of another joint with as large waves 2 fitted by chance and 12 by
# `OFF_MOST` (decision 0150)
CHANCE_MOST = 0.01
"""Nor does one whose waves fall into step by a shift as well as they do by chance more often than this,"""

OFF_MOST = 0.02
"""unless its waves miss this share of their power or less, beside noise: a single wave falls into step
whatever its phase, and is right there. A drift of amplitude by 10 % is 1 %."""

_ONWARD = 0.8
"""Rows of either direction of which so many go on the same way are a sweep, in the order of its places."""

FRICTION_ORDERS = 4
"""Waves of friction a period that are told apart from the conservative part."""


@dataclass(frozen=True)
class Sweep:
    """Slow motion over places: arrays of one length. `torque_nm` the motor's, along +x; `direction` +1 or
    -1."""

    position_rad: np.ndarray
    torque_nm: np.ndarray
    direction: np.ndarray


@dataclass(frozen=True)
class CoggingFit:
    """What was found. `tried`: number of harmonics -> held-out RMSE, N m; `friction_nm` mean friction of both
    directions; of one direction alone its level and NaN, and `part` has friction's own waves in it."""

    part: Harmonics
    friction_nm: tuple[float, float]
    rmse_nm: float
    tried: dict[int, float]


@dataclass(frozen=True)
class Shift:
    """Where the places of a part are now: x_now = x_then + `shift_rad`, -period/2 to period/2.

    `explained` is the share of the variance that the shifted part explains, `rmse_nm` what it leaves;
    `chance` how often waves of another joint, of the same orders and sizes but any phases, fall into step as
    well; `off` the share of the waves' power that the shifted part misses, beside noise; `fits` whether it
    may be used."""

    shift_rad: float
    explained: float
    rmse_nm: float
    level_nm: tuple[float, ...]
    """Mean motor torque of each direction there is, forward first: friction, which no shift explains."""
    chance: float
    off: float

    @property
    def fits(self) -> bool:
        """True when the shifted part explains enough to be compensated, and not as another joint's might."""
        return self.explained >= FIT_SHARE and (self.chance <= CHANCE_MOST or self.off <= OFF_MOST)


def _solve(design: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Least squares by the normal equations: its columns are waves, all of one size."""
    # squares of the design square its condition, too; waves at even places are orthogonal and have none to
    # speak of
    square = design.T @ design
    square[np.diag_indices_from(square)] += (
        _RIDGE * max(float(np.trace(square)), 1e-300) / max(len(square), 1)
    )
    found: np.ndarray = np.linalg.solve(square, design.T @ values)
    return found


def _waves(position_rad: np.ndarray, period_rad: float, orders: np.ndarray) -> np.ndarray:
    """Waves of each order: all cos, then all sin, shape (n, 2 m)."""
    angle = 2 * math.pi / period_rad * np.asarray(position_rad)[:, None] * orders
    return np.hstack([np.cos(angle), np.sin(angle)])


def _levels(sweep: Sweep, period_rad: float) -> np.ndarray:
    """Columns of friction: one level for each direction there is, and its waves with the sign of the
    motion."""
    ways = [(sweep.direction == way).astype(float) for way in (1, -1) if (sweep.direction == way).any()]
    columns = np.column_stack(ways)
    # in one direction friction's waves and the conservative ones are one and the same
    if len(ways) == 2:
        waves = _waves(sweep.position_rad, period_rad, np.arange(1, FRICTION_ORDERS + 1))
        columns = np.hstack([columns, sweep.direction[:, None] * waves])
    return columns


def fit_cogging(sweep: Sweep, period_rad: float, *, friction_period_rad: float | None = None) -> CoggingFit:
    """Learn the conservative part: as many of the strongest harmonics as held-out places ask for, the fewest
    within one standard error.

    Parameters
    ----------
    period_rad
        Period of the conservative part, of the joint's angle.
    friction_period_rad
        Period of friction's own waves, which are told apart when both directions are there; None: the same.

    Raises
    ------
    DataError
        Too few rows, or numbers that are not finite."""
    x, tau = np.asarray(sweep.position_rad, dtype=float), np.asarray(sweep.torque_nm, dtype=float)
    if not (np.isfinite(x).all() and np.isfinite(tau).all()) or len(x) < 32:
        raise DataError(
            f"a sweep of {len(x)} rows, at least 32 finite ones are needed; turn the joint slowly, both ways"
        )
    levels = _levels(sweep, friction_period_rad or period_rad)
    places = _places(sweep, period_rad)
    ranked = _ranked(x, tau, levels, period_rad, places)
    squares = _held_out(x, tau, levels, period_rad, places, [n for n in COUNTS if n <= len(ranked)])
    tried = {n: float(np.sqrt(one.mean())) for n, one in squares.items()}
    best = min(tried, key=lambda n: tried[n])
    # row by row: places are held out, and each row is a mean over its own way
    within = np.sqrt(squares[best].mean() + squares[best].std() / math.sqrt(len(x)))
    count = min(n for n in tried if tried[n] <= within)
    too_few = max((n for n in tried if n < count), default=0)
    # three waves are no four: the fourth would be of the noise, of any order, and as steep as that is high
    while count - too_few > 1:
        half = (count + too_few) // 2
        one = _held_out(x, tau, levels, period_rad, places, [half])[half]
        tried[half] = float(np.sqrt(one.mean()))
        count, too_few = (half, too_few) if tried[half] <= within else (count, half)
    orders = np.sort(ranked[:count])
    found, friction, rmse = _regress(x, tau, levels, period_rad, orders)
    return CoggingFit(found, friction, rmse, dict(sorted(tried.items())))


def _places(sweep: Sweep, period_rad: float) -> int:
    """Places of a period that the rows tell apart.

    A row of a sweep is a mean over the way to the next one. Its places scatter a little from lap to lap:
    counted one by one they would be many, and a wave would be found at 3 x 16 + 1 waves a period, where
    16 rows a period saw one."""
    found = len(np.unique(np.round((sweep.position_rad / period_rad) % 1.0, 4)))
    ways = [np.diff(sweep.position_rad[sweep.direction == way]) for way in (1, -1)]
    steps = np.concatenate([one * np.sign(np.median(one)) for one in ways if len(one)])
    onward = steps[steps > 0]
    if len(onward) < _ONWARD * len(steps):
        return found
    return min(found, max(1, round(period_rad / float(np.median(onward)))))


def _ranked(x: np.ndarray, tau: np.ndarray, levels: np.ndarray, period_rad: float, places: int) -> np.ndarray:
    """Orders by how much each takes off the residual, strongest first; as high as the rows can tell."""
    # four places to a wave tell its phase, and as many rows to each number its size
    highest = max(1, min(ORDER_MAX, places // 4, (len(x) - levels.shape[1]) // 4))
    orders = np.arange(1, highest + 1)
    base = _solve(levels, tau)
    # by correlation alone, not by fits: even places make waves orthogonal, and uneven ones nearly
    along = (tau - levels @ base) @ _waves(x, period_rad, orders)
    strength = along[:highest] ** 2 + along[highest:] ** 2
    chosen: np.ndarray = orders[np.argsort(strength)[::-1]][:ORDERS_MOST]
    return chosen


def _held_out(
    x: np.ndarray, tau: np.ndarray, levels: np.ndarray, period_rad: float, places: int, counts: list[int]
) -> dict[int, np.ndarray]:
    """Squared errors on held-out places by number of harmonics, N^2 m^2, each (n,); the strongest of what
    trains are chosen."""
    # as many as there are places, from one of them on: of 320 blocks 64 even places are in every fifth, and
    # so all were held out at once
    blocks = min(_BLOCKS, places)
    fold = np.round((x - x[0]) / period_rad % 1.0 * blocks).astype(int) % blocks % FOLDS
    squares = {n: np.zeros(len(x)) for n in counts}
    for k in np.unique(fold):
        held = fold == k
        # chosen anew by what trains: orders that held-out places had a vote in would look better than they
        # are
        ranked = _ranked(x[~held], tau[~held], levels[~held], period_rad, places)
        for n in counts:
            design = np.hstack([levels, _waves(x, period_rad, ranked[:n])])
            found = _solve(design[~held], tau[~held])
            squares[n][held] = (design[held] @ found - tau[held]) ** 2
    return squares


def _regress(
    x: np.ndarray, tau: np.ndarray, levels: np.ndarray, period_rad: float, orders: np.ndarray
) -> tuple[Harmonics, tuple[float, float], float]:
    design = np.hstack([levels, _waves(x, period_rad, orders)])
    found = _solve(design, tau)
    rmse = float(np.sqrt(np.mean((design @ found - tau) ** 2)))
    own = -found[levels.shape[1] :]  # the motor holds against it
    n = len(orders)
    friction = (float(found[0]), float(-found[1]) if levels.shape[1] > 1 else float("nan"))
    return Harmonics(period_rad, orders.astype(float), own[:n], own[n:]), friction, rmse


def find_shift(part: Harmonics, sweep: Sweep, friction_period_rad: float | None = None) -> Shift:
    """Find by circular correlation how far the places of `part` have moved, and whether it fits there.

    The level of each direction, and with both directions friction's own waves, are left out of it: see
    `fit_cogging`.

    Raises
    ------
    DataError
        A part without harmonics, or rows too few for them."""
    x, tau = np.asarray(sweep.position_rad, dtype=float), np.asarray(sweep.torque_nm, dtype=float)
    levels = _levels(sweep, friction_period_rad or part.period_rad)
    if not len(part.orders) or len(x) < 2 * len(part.orders) + 8:
        raise DataError(
            f"{len(x)} rows for {len(part.orders)} harmonics: too few to find a shift; sweep a whole turn"
        )
    seen, _, scatter = _regress(x, tau, levels, part.period_rad, part.orders)
    # as e^(-i n a): a shift then turns each harmonic by n times itself
    then, now = part.cos - 1j * part.sin, seen.cos - 1j * seen.sin
    # by waves and not row by row: a circular correlation of rows would ask for even places, which no sweep
    # has
    share = peak(then * np.conj(now), part.orders)
    moved = part.shifted(share * part.period_rad)
    rest = tau + moved(x)
    level = _solve(levels, rest)
    left = float(np.sqrt(np.mean((rest - levels @ level) ** 2)))
    before = _solve(levels, tau)
    whole = float(np.mean((tau - levels @ before) ** 2))
    explained = 1.0 - left**2 / whole if whole > 0 else 0.0
    ways = len(np.unique(sweep.direction))
    # both numbers of a wave have an error of scatter sqrt(2 / n)
    noise = 4.0 * len(part.orders) * scatter**2 / len(x)
    missed = float(np.sum((moved.cos - seen.cos) ** 2 + (moved.sin - seen.sin) ** 2))
    off = max(0.0, missed - noise) / max(float(np.sum(np.abs(now) ** 2)), 1e-300)
    by_chance = chance(then * np.conj(now), part.orders)
    return Shift(share * part.period_rad, explained, left, tuple(level[:ways].tolist()), by_chance, off)


def changed_since(
    part: Harmonics, sweep: Sweep, found: Shift, friction_period_rad: float | None = None
) -> CoggingFit:
    """What of the part is another than it was, beside its places: waves that held-out places of the new sweep
    ask for.

    The currents of a drive have waves of its own, of the motor's pole pairs and their multiples: offsets of
    its current sensors and of the electrical angle are measured anew at every start. No shift explains those,
    and one sweep tells them.

    Returns
    -------
    CoggingFit
        Of the difference: `part` is to be added to the shifted one; `tried[0]` is what the shift alone leaves
        at held-out places."""
    moved = part.shifted(found.shift_rad)
    rest = np.asarray(sweep.torque_nm, dtype=float) + moved(np.asarray(sweep.position_rad, dtype=float))
    told = Sweep(sweep.position_rad, rest, sweep.direction)
    return fit_cogging(told, part.period_rad, friction_period_rad=friction_period_rad)
