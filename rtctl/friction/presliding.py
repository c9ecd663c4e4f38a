"""Presliding length of a joint, from the beginnings of break-away ramps.

Before a joint breaks away its friction is a spring: the torque is balanced by bristles that bend. The
presliding length is the travel over which they would take up the whole break-away torque if they stayed as
stiff as they begin,

    length = break-away torque / initial slope of torque over position          (rad)

so F_s / sigma0 of LuGre, and (sum of the elements' yield torques) / (sum of their stiffnesses) of
Maxwell-slip. It is *not* the travel after which the joint slides: LuGre's bristles soften from the first
moment on (90 % of the torque only after 2.3 lengths), and a Maxwell-slip joint slides when its last element
has yielded.

What is fitted, over the torque tau of one ramp as a share u = tau / break-away torque:

    x = x_0 + length (u + bend (-ln(1 - u) - u))

bend 0 is a spring that yields at once (elasto-plastic), 1 is LuGre's x = -length ln(1 - u). It is linear in
x_0, length and length * bend. Points of a ramp are the instants at which the encoder's count changes: there
the position is known without the quantum's error, up to the x_0 that is fitted anyway. Where the joint bends
by less than some counts, the mean of the counts over many ramps is fitted instead: ramps begin anywhere
within a count, so that their mean has no error either."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

SHARE_LOW, SHARE_HIGH = 0.05, 0.6
"""Shares of the break-away torque between which the slope is taken: after the ramp's own start, before it
yields."""
SMOOTH_S = 0.02
"""The motor torque is averaged over so much of the ramp: it rises evenly, so that the mean has no bias."""
CHANGES_MIN = 2
"""Count changes that tell the slope of one ramp."""
GRID = np.linspace(SHARE_LOW, 0.8, 16)
"""Shares at which the counts of a coarse encoder are averaged over ramps; further, because little else is
seen."""
RAMPS_MIN = 2
AVERAGED_MIN = 8
COUNTS_MIN = 1.0
"""The averages need so many ramps, and so many counts over the grid: of less, slope and bend cannot be told
apart."""
SURE = 3.0
"""A length found from averaged counts must be so many of its standard errors; else it is not known."""
BEND_MAX = 1.5
SHORTEST_SHARE = 1 / 16
"""Least share of the assumed length that is told as a bound: shorter ones were not tried with hands (decision
0156)."""
LENGTH_MAX_RAD = 1.0


@dataclass(frozen=True)
class Presliding:
    """Presliding length over some ramps.

    Attributes
    ----------
    length_rad
        Break-away torque over initial slope, mean over the ramps.
    spread_rad
        Standard deviation of one ramp's length: places, directions and noise. None: not known (given by
        hand). 0: the length is not told apart from shorter ones (`at_most`).
    ramps
        Ramps behind it, or turns of the motion in a log; 0 when it was given by hand."""

    length_rad: float
    spread_rad: float | None
    ramps: int

    @property
    def at_most(self) -> bool:
        """True when nothing but an upper bound of the length is known."""
        return self.spread_rad == 0.0

    def __str__(self) -> str:
        """The figures in words."""
        length = f"{1e3 * self.length_rad:.4g} mrad"
        if self.spread_rad is None:
            return f"{length}, given by hand"
        if self.at_most:
            return f"at most {length}, over {self.ramps} ramps or turns"
        return f"{length}, spread {1e3 * self.spread_rad:.2g} mrad over {self.ramps} ramps or turns"


@dataclass(frozen=True)
class Ramp:
    """One ramp as a share of its break-away torque.

    `position_rad` where the encoder counted (up to a constant), and the `share` then; `grid_rad` what it
    showed at `GRID` and `count_rad` its quantum."""

    position_rad: np.ndarray
    share: np.ndarray
    grid_rad: np.ndarray
    count_rad: float


def ramp_of(
    position_rad: np.ndarray, torque_nm: np.ndarray, break_away_nm: float, count_rad: float, period_s: float
) -> Ramp | None:
    """Reduce one ramp from rest to its count changes.

    Parameters
    ----------
    position_rad, torque_nm : array, shape (n,)
        Tick by tick from the ramp's first tick to the slip; the torque without the sensor's bias.
    break_away_nm : float
        Torque at the slip, signed as the ramp.

    Returns
    -------
    Ramp or None
        None when the ramp is too short, does not reach the end of `GRID`, or anything is NaN."""
    width = max(1, round(SMOOTH_S / period_s))
    counts = np.sign(break_away_nm) * position_rad / count_rad
    if len(counts) < 3 * width or not (np.isfinite(counts).all() and np.isfinite(torque_nm).all()):
        return None
    level = np.round(counts)
    # the furthest so far and the nearest from here on: between them a count chatters
    reached = np.maximum.accumulate(level)
    kept = np.minimum.accumulate(level[::-1])[::-1]
    share = np.convolve(torque_nm, np.full(width, 1.0 / width), mode="same") / break_away_nm
    # a chattering count: half way between the first time it is reached and the last time it is lost
    first, last = _passed(reached), _passed(kept)
    each = np.intersect1d(reached[first], kept[last])
    rows = 0.5 * (
        first[np.searchsorted(reached[first], each)] + last[np.searchsorted(kept[last], each)]
    ).astype(float)
    at = np.interp(rows, np.arange(len(share)), share)
    # the moving mean is short of ticks at both ends
    usable = (at >= SHARE_LOW) & (at <= SHARE_HIGH) & (rows >= width) & (rows < len(share) - width)
    risen = np.searchsorted(np.maximum.accumulate(share), GRID)
    if risen[-1] >= len(share):
        return None
    return Ramp(each[usable] * count_rad, at[usable], level[risen] * count_rad, count_rad)


def _passed(rising: np.ndarray) -> np.ndarray:
    """Rows at which a series that never falls has just risen."""
    return np.flatnonzero(np.diff(rising) > 0) + 1


def bend_of(ramps: Sequence[Ramp]) -> float:
    """How much the bristles soften on the way, over all ramps: 0 not at all, 1 as LuGre's (see the
    module)."""
    x = np.concatenate([ramp.position_rad - np.mean(ramp.position_rad) for ramp in ramps])
    linear = np.concatenate([ramp.share - np.mean(ramp.share) for ramp in ramps])
    softened = np.concatenate([_softening(ramp.share) - np.mean(_softening(ramp.share)) for ramp in ramps])
    (length, by_bend), *_ = np.linalg.lstsq(np.column_stack([linear, softened]), x, rcond=None)
    # noise may bend it the other way, which bristles do not
    return float(np.clip(by_bend / length, 0.0, BEND_MAX)) if length > 0 else 0.0


def lengths_rad(ramps: Sequence[Ramp], bend: float) -> np.ndarray:
    """Length of each ramp with a common bend."""
    found = []
    for ramp in ramps:
        curve = ramp.share + bend * _softening(ramp.share)
        curve = curve - np.mean(curve)
        found.append(float(curve @ ramp.position_rad / (curve @ curve)))
    return np.array(found)


def _softening(share: np.ndarray) -> np.ndarray:
    return np.asarray(-np.log1p(-share) - share)


def presliding(ramps: Sequence[Ramp], assumed_rad: float = 0.0) -> Presliding | None:
    """Mean length over ramps and its spread; where they do not tell it, how long it is at most.

    Returns
    -------
    Presliding or None
        None from fewer than two ramps, when it is no length at all, or when the bound is not below
        `assumed_rad`, the length that is assumed where none is known."""
    found = _told(ramps)
    if found is not None or len(ramps) < RAMPS_MIN:
        return found
    most_rad = max(_most_rad(ramps), SHORTEST_SHARE * assumed_rad)
    return Presliding(most_rad, 0.0, len(ramps)) if most_rad < assumed_rad else None


def _most_rad(ramps: Sequence[Ramp]) -> float:
    """Longest length that any of the ramps may have, rad.

    Bristles soften on the way, so that none of that length moves less than its share of it; of a motion the
    encoder hides less than a count."""
    moved_rad = max(float(np.ptp(ramp.grid_rad)) + ramp.count_rad for ramp in ramps)
    return moved_rad / float(GRID[-1] - GRID[0])


def _told(ramps: Sequence[Ramp]) -> Presliding | None:
    # by different torques: two counts passed in one tick have no slope, and 0/0 of one ramp would be all's
    telling = [ramp for ramp in ramps if len(np.unique(ramp.share)) >= CHANGES_MIN]
    if len(ramps) < RAMPS_MIN:
        return None
    # ramps that show two counts by luck are those of soft places: their mean would be too long
    if 2 * len(telling) < len(ramps) or len(telling) < RAMPS_MIN:
        return _averaged(ramps)
    each = lengths_rad(telling, bend_of(telling))
    length, spread = float(np.mean(each)), float(np.std(each, ddof=1))
    return Presliding(length, spread, len(each)) if 0 < length <= LENGTH_MAX_RAD else None


def _averaged(ramps: Sequence[Ramp]) -> Presliding | None:
    """Length from the counts averaged over ramps; its spread is sqrt(n) jackknife errors, hence mostly the
    encoder's."""
    grids = np.array([ramp.grid_rad - ramp.grid_rad[0] for ramp in ramps])
    n, seen = len(grids), float(np.mean(grids[:, -1]))
    if n < AVERAGED_MIN or seen < COUNTS_MIN * ramps[0].count_rad:
        return None
    length = _length_of_mean(grids.mean(axis=0))
    # one ramp left out at a time: no single ramp of few counts tells a length by itself
    each = np.array([_length_of_mean((grids.sum(axis=0) - one) / (n - 1)) for one in grids])
    error = math.sqrt((n - 1) * float(np.var(each)))
    sure = SURE * error < length <= LENGTH_MAX_RAD
    return Presliding(length, error * math.sqrt(n), n) if sure else None


def _length_of_mean(grid_rad: np.ndarray) -> float:
    mean = [Ramp(grid_rad, GRID, grid_rad, 0.0)]
    return float(lengths_rad(mean, bend_of(mean))[0])


def together(parts: Sequence[Presliding]) -> Presliding | None:
    """Presliding of all ramps of several groups (the two directions); None without any.

    Notes
    -----
    A bound tells nothing beside a length that is known, and of bounds alone the longest holds. The spread is
    that of all ramps in one: sum (n_i - 1) s_i^2 + n_i (l_i - l)^2 = (n - 1) s^2."""
    told = [part for part in parts if not part.at_most]
    if parts and not told:
        longest_rad = max(part.length_rad for part in parts)
        return Presliding(longest_rad, 0.0, sum(part.ramps for part in parts))
    parts = told
    if not parts:
        return None
    # 1: a length that was given by hand is as good as one ramp
    n = np.array([max(part.ramps, 1) for part in parts], dtype=float)
    each = np.array([part.length_rad for part in parts])
    length = float(n @ each / n.sum())
    spreads = [part.spread_rad for part in parts]
    ramps = sum(part.ramps for part in parts)
    if any(spread is None for spread in spreads) or n.sum() < RAMPS_MIN:
        return Presliding(length, None, ramps)
    within = (n - 1) @ np.square(np.array(spreads, dtype=float))
    return Presliding(length, math.sqrt((within + n @ np.square(each - length)) / (n.sum() - 1)), ramps)
