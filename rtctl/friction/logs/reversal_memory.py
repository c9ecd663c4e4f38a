"""How well memory of the turn explains friction near reversals: rungs from none to Maxwell-slip, on parts
held out.

A curve of speed says that friction turns over at once where the motion turns back; bristles say over a
travel. Each rung is one linear balance

    tau = J a + b v + friction + (offset of the stretch)

with another friction (docs/theory.md 9.4):

============  ==========================================================================================
speed         F_+ H(v) + F_- H(-v), and the same times a Stribeck peak: what a curve of speed can say
lag           the same, its peaks a time tau late behind the speed (frictional lag, HS90)
acceleration  that of speed, and the acceleration times each peak: other when the speed rises than when it
falls
stop          the stop operator s <- clip(s + dx/L, -1, 1) over the recorded path in place of the sign
lugre         LuGre's bristle, ds/dx = (1 - s sgn dx)/L, in place of the sign
maxwell       a sum of stop operators of several lengths, each of weight >= 0 (Maxwell-slip, Iwa66)
============  ==========================================================================================

Both sides pass one zero-phase low-pass, so a turn that the filter blurs is blurred alike. The stretches are
cut into blocks of time; what is told is the error in each half of the blocks of what was fitted to the other,
length and lag too."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from rtctl.friction.logs.bristle_columns import (
    Columns,
    by_acceleration,
    by_late_speed,
    by_lugre,
    by_speed,
    by_stop,
)
from rtctl.friction.logs.dynamics import CUTOFF_HZ, SPEED_MIN_RAD_S, AxisLog
from rtctl.friction.logs.turns import TurningPart, longest_length, parts_of, shortest_length

NEAR_S = 0.1
"""Rows this close to a turn are near it, s."""

TURNS_MIN = 12
"""Fewest turns that are told of: six to fit, six to judge."""

BLOCK_S = 1.0
"""Length of a block of time that is fitted or judged as one, s; longer where turns are rare."""

BLOCKS_MIN = 4
"""Fewest blocks, so that their errors differ from each other visibly."""

TURNS_PER_BLOCK = 3
"""Turns of a block, at least on average: a block without one judges nothing."""

SURE = 2.0
"""Standard errors by which a rung must be worse than the best before it is passed over."""

WORTH = 0.25
"""Share of the error that a richer rung must take off beside: less is a filter's blur as well as bristles."""

LENGTHS_PER_DECADE = 4
"""Lengths tried per decade: the error is flat about its least."""

TOLD = 1e-3
"""Share of the columns' size below which what sets two of them apart is taken for nothing: an offset and a
difference between the directions differ in the turns alone, and not at all where nothing bends."""

LAGS_S = (0.0, 0.002, 0.005, 0.01, 0.02, 0.04, 0.08)
"""Frictional lags tried, s: a few milliseconds in lubricated contacts."""


@dataclass(frozen=True)
class Rung:
    """One description of friction and what it left on held-out blocks.

    Attributes
    ----------
    name
        `speed`, `lag`, `acceleration`, `stop`, `lugre` or `maxwell`.
    near_nm, rms_nm
        Error (RMS, N m) within `NEAR_S` of a turn, and everywhere.
    gain, gain_standard_error
        How much smaller `near_nm` is than that of `speed`, as a share, and the standard error of it over
        blocks.
    parameter
        Length (rad; of `maxwell` the mean by weight) or lag (s) fitted to all rows; 0 for `speed` and
        `acceleration`."""

    name: str
    near_nm: float
    rms_nm: float
    gain: float
    gain_standard_error: float
    parameter: float


@dataclass(frozen=True)
class Reversals:
    """The rungs, simplest first, the number of turns, and the simplest rung that none beats by `WORTH` and
    beyond chance."""

    rungs: tuple[Rung, ...]
    turns: int
    chosen: str


def reversals_of_logs(
    logs: Sequence[AxisLog], cutoff_hz: float = CUTOFF_HZ, speed_min_rad_s: float = SPEED_MIN_RAD_S
) -> Reversals | None:
    """What memory of the turn is worth over all turns of some logs, or of stretches of them.

    Returns
    -------
    Reversals or None
        None: fewer than `TURNS_MIN` turns, turns in too few blocks of time to fit to some and judge by
        others, or strokes too short to bend anything."""
    parts = parts_of(logs, cutoff_hz, speed_min_rad_s)
    lengths, turns = tried_lengths(parts), sum(part.turns for part in parts)
    if not len(lengths) or not (rows := TurnRows.of(parts, turns)).turn_in_both_halves():
        return None
    speed = rows.judged(by_speed, (0.0, 1.0))
    found = {
        "speed": replace(speed, parameter=0.0),
        "lag": rows.judged(partial(by_late_speed, speed.parameter), LAGS_S),
        "acceleration": rows.judged(partial(by_acceleration, speed.parameter), (0.0,)),
        "stop": rows.judged(by_stop, lengths),
        "lugre": rows.judged(by_lugre, lengths),
    }
    found["maxwell"] = rows.judged_sum(lengths, found["stop"].parameter)
    return _compared(found, rows, turns)


def tried_lengths(parts: Sequence[TurningPart]) -> np.ndarray:
    """Lengths of bristles that are tried, rad; none where there are fewer than `TURNS_MIN` turns, or strokes
    too short to bend anything."""
    shortest, longest = shortest_length(parts), longest_length(parts)
    if sum(part.turns for part in parts) < TURNS_MIN or longest <= 2 * shortest:
        return np.zeros(0)
    return np.geomspace(shortest, longest, 1 + round(LENGTHS_PER_DECADE * np.log10(longest / shortest)))


@dataclass(frozen=True)
class TurnRows:
    """Kept rows of all parts: torque (n,), columns of the motion and of the offset of each part, which are
    near a turn, their blocks and halves."""

    parts: tuple[TurningPart, ...]
    torque_nm: np.ndarray
    motion: np.ndarray
    offsets: np.ndarray
    near: np.ndarray
    block: np.ndarray

    @classmethod
    def of(cls, parts: Sequence[TurningPart], turns: int) -> TurnRows:
        """Rows of the parts, which turn so many times in all."""
        total_s = sum(len(part.torque_nm) / part.rate_hz for part in parts)
        # long enough for some turns, and short enough for some blocks; where both cannot be, for the blocks
        block_s = min(max(BLOCK_S, TURNS_PER_BLOCK * total_s / turns), total_s / BLOCKS_MIN)
        near, block, first = [], [], 0
        for part in parts:
            close = np.zeros(len(part.torque_nm), bool)
            reach = round(NEAR_S * part.rate_hz)
            for turn in part.turned:
                close[max(turn - reach, 0) : turn + reach + 1] = True
            near.append(close[part.rows])
            # An even number of blocks: both halves see each stretch, hence its offset.
            count = 2 * max(1, round(len(close) / part.rate_hz / block_s / 2))
            block.append(first + part.rows * count // len(close))
            first += count
        # a gap in the log may be hours: each stretch has its own zero
        offsets = np.repeat(np.eye(len(parts)), [len(part.rows) for part in parts], axis=0)
        return cls(
            parts=tuple(parts),
            torque_nm=np.concatenate([part.torque_nm[part.rows] for part in parts]),
            motion=np.concatenate([part.motion[part.rows] for part in parts]),
            offsets=offsets,
            near=np.concatenate(near),
            block=np.concatenate(block),
        )

    def halves(self) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
        """Rows to fit to and rows to judge, each way about."""
        odd = self.block % 2 == 1
        # every second block and not the first half: what warms up is in both
        return (odd, ~odd), (~odd, odd)

    def turn_in_both_halves(self) -> bool:
        """Whether each half has turns in half of `BLOCKS_MIN` blocks: columns that were fitted where nothing
        turns are without bounds where something does."""
        turning = (np.unique(self.block[self.near & half]) for half, _ in self.halves())
        return all(len(blocks) >= BLOCKS_MIN // 2 for blocks in turning)

    def judged(self, columns: Columns, values: Sequence[float] | np.ndarray) -> _Found:
        """Held-out residuals, the parameter chosen in the rows fitted to; and the parameter that fits all
        rows best."""
        designs = [
            np.hstack([self.motion, np.concatenate([columns(part, value) for part in self.parts])])
            for value in values
        ]
        residual = np.empty(len(self.torque_nm))
        for fitted, rest in self.halves():
            left = [self._solved(design, fitted) for design in designs]
            best = int(np.argmin([squares for _, squares in left]))
            whole = np.hstack([designs[best][rest], self.offsets[rest]])
            residual[rest] = self.torque_nm[rest] - whole @ left[best][0]
        every = np.ones(len(residual), bool)
        best = int(np.argmin([self._solved(design, every)[1] for design in designs]))
        return _Found(residual, float(values[best]))

    def _solved(self, design: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, float]:
        """Coefficients of the columns and of the offsets, fitted to some rows, and the squares left there."""
        part = self.offsets[rows]
        count = np.maximum(part.sum(axis=0), 1.0)

        def zero(values: np.ndarray) -> np.ndarray:
            return np.asarray(part.T @ values / count[:, None])

        # about the zeros, so that none of them, however large, has a say in what the columns do not tell
        columns, torque = design[rows], self.torque_nm[rows, None]
        columns, torque = columns - part @ zero(columns), torque - part @ zero(torque)
        scale = np.sqrt((columns**2).mean(axis=0)) + np.finfo(float).tiny
        solution = np.linalg.lstsq(columns / scale, torque[:, 0], rcond=TOLD)[0] / scale
        left = torque[:, 0] - columns @ solution
        rest = self.torque_nm[rows] - design[rows] @ solution
        return np.concatenate([solution, zero(rest[:, None])[:, 0]]), float(left @ left)

    def judged_sum(self, lengths_rad: np.ndarray, peaks_at_rad: float) -> _Found:
        """Held-out residuals of a sum of stop operators: weights >= 0 by direction, the peaks on the operator
        of one length."""
        every = [np.concatenate([by_stop(part, length) for part in self.parts]) for length in lengths_rad]
        # of one length: peaks of every length beside the operators themselves would be twice as many columns,
        # nearly alike
        peaks = every[int(np.argmin(np.abs(lengths_rad - peaks_at_rad)))][:, 2:]
        free = np.hstack([self.motion, self.offsets, peaks])
        bound = np.hstack([each[:, :2] for each in every])
        residual = np.empty(len(self.torque_nm))
        for fitted, rest in self.halves():
            weights, others = _bounded(bound[fitted], free[fitted], self.torque_nm[fitted])
            residual[rest] = self.torque_nm[rest] - bound[rest] @ weights - free[rest] @ others
        weights, _ = _bounded(bound, free, self.torque_nm)
        by_length = weights.reshape(-1, 2).sum(axis=1)
        return _Found(residual, float(by_length @ lengths_rad / max(by_length.sum(), np.finfo(float).tiny)))


@dataclass(frozen=True)
class _Found:
    residual_nm: np.ndarray
    parameter: float


def _bounded(bound: np.ndarray, free: np.ndarray, torque: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least squares of torque = bound w + free u with w >= 0: the free columns are projected out first."""
    from scipy.optimize import nnls

    scale = np.sqrt((free**2).mean(axis=0)) + np.finfo(float).tiny
    # an orthonormal basis: normal equations would square the condition of peaks that are nearly alike
    base, _ = np.linalg.qr(free / scale)
    weights = nnls(bound - base @ (base.T @ bound), torque - base @ (base.T @ torque))[0]
    rest = np.linalg.lstsq(free / scale, torque - bound @ weights, rcond=1e-9)[0] / scale
    return weights, rest


def _compared(found: Mapping[str, _Found], rows: TurnRows, turns: int) -> Reversals:
    """The rungs told, and the simplest that the best does not beat by `WORTH` and `SURE` standard errors over
    the blocks."""
    squares = {
        name: np.bincount(rows.block[rows.near], one.residual_nm[rows.near] ** 2, rows.block.max() + 1)
        for name, one in found.items()
    }
    n, speed = int(rows.near.sum()), squares["speed"]
    rungs = []
    for name, one in found.items():
        share, doubt = _ratio(squares[name], speed)
        root = float(np.sqrt(share))
        # the error of a root is half that of its square, over the root
        error = 0.5 * doubt / root if share > 0 else 0.0
        near, rms = (float(np.sqrt(mean)) for mean in (squares[name].sum() / n, np.mean(one.residual_nm**2)))
        rungs.append(Rung(name, near, rms, 1.0 - root, error, one.parameter))
    best = min(squares, key=lambda name: float(squares[name].sum()))
    chosen = next(name for name in squares if _as_good(squares[name], squares[best]))
    return Reversals(tuple(rungs), turns, chosen)


def _as_good(one: np.ndarray, best: np.ndarray) -> bool:
    share, doubt = _ratio(best, one)
    return 1.0 - share <= SURE * doubt or share >= (1.0 - WORTH) ** 2


def _ratio(one: np.ndarray, other: np.ndarray) -> tuple[float, float]:
    """Ratio of two sums over blocks and its standard error, each block left out in turn (jackknife)."""
    # a ratio of sums: blocks of few turns weigh as little as they hold
    told = (one.sum() - one) / (other.sum() - other)
    n = len(one)
    return float(one.sum() / other.sum()), float(np.sqrt((n - 1) / n * ((told - told.mean()) ** 2).sum()))
