"""The offset of the torque in the joint regression: one level for each log, and its slow drift.

A force sensor's zero wanders while a log is taken. A constant would push that into the other parameters and
leave an interval around a number the offset never had. So the offset of a log is its mean over the rows that
are regressed on plus the first cosines of a period of the log, which are the principal components of a random
walk about its mean. Only what is slower than the motion is modelled: a term that turned as fast as the joint
does could not be told from friction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtctl.friction.logs.intervals import blocks_in, recorded_s
from rtctl.friction.logs.regressors import Regressors

DRIFT_PERIOD_S = 10.0
"""Shortest period of a drift term: warming up and creep of a strain gauge are slower."""

REVERSALS_PER_TERM = 4
"""Reversals of the motion for each drift term, so that drift is slower than friction changes its sign."""

TERMS_MAX = 6

BLOCKS_PER_TERM = 3
"""Blocks of the intervals for each term, since a term takes the freedom of one."""

# beside a line alone the drift took up to .5 % of the friction, beside these .02 (decision 0098)
BENDS = 12
"""Speeds of each direction between which friction is a line while its drift is found."""


@dataclass(frozen=True)
class Offset:
    """Offset of one log: its row in the symmetric parameters, and the drift about it.

    `terms` is the number of cosines, 0 where the log is too short or turns too seldom: the offset is then
    taken as constant. `drift_range_nm` is that of the drift found (and removed)."""

    source: str
    parameter: str
    terms: int
    drift_range_nm: float


@dataclass(frozen=True)
class OffsetColumns:
    """Columns of the regression: `logs` (n, logs) are 1 on the rows of each log, `drift` (n, terms) its
    cosines."""

    names: tuple[str, ...]
    logs: np.ndarray
    drift: np.ndarray
    owner: np.ndarray
    """Log of each drift column."""

    def relative(self, sliding: np.ndarray) -> np.ndarray:
        """Offsets of the logs against their mean: (n, logs - 1), for a fit whose levels hold the mean."""
        # without the first: the columns of all logs add up to a constant, which the levels have already
        return np.asarray(self.logs[:, 1:] - self.logs[sliding, 1:].mean(axis=0))

    def freedom(self, name: str, log: np.ndarray, block: np.ndarray) -> int:
        """Degrees of freedom of a parameter: for the offset of a log, those of its own blocks.

        `log` and `block` are those of the rows regressed on."""
        if name not in self.names:
            return int(block[-1]) - len(self.owner)
        k = self.names.index(name)
        return len(np.unique(block[log == k])) - 1 - int((self.owner == k).sum())

    def describe(self, drift_nm: np.ndarray, sources: tuple[str, ...], sliding: np.ndarray) -> list[Offset]:
        """The offset of each log; `drift_nm` has one coefficient for each drift column."""
        found = []
        for k, name in enumerate(self.names):
            mine = self.owner == k
            drift = (self.drift[:, mine] @ drift_nm[mine])[sliding & (self.logs[:, k] > 0)]
            found.append(Offset(sources[k], name, int(mine.sum()), float(np.ptp(drift))))
        return found


def offset_columns(signals: Regressors) -> OffsetColumns:
    """Columns of the offset: its mean over the sliding rows of each log, and its drift about that mean."""
    logs = len(signals.sources)
    names = ("offset_nm",) if logs == 1 else tuple(f"offset_{k + 1}_nm" for k in range(logs))
    level = (signals.log[:, None] == np.arange(logs)).astype(float)
    # from the mean of the rows regressed on: a log's offset then is one number, however it drifts
    drift, owner = [], []
    for k in range(logs):
        rows = np.flatnonzero(signals.log == k)
        time_s = recorded_s(signals.time_s[rows])  # on both sides of a long gap a cosine is constant
        share = time_s / max(time_s[-1], 1e-9)
        sliding = signals.sliding[rows]
        for term in range(1, _terms(signals, rows) + 1):
            column = np.zeros(len(level))
            # half waves: those of a random walk about its mean, whose ends are free
            wave = np.cos(np.pi * term * share)
            column[rows] = wave - wave[sliding].mean()
            drift.append(column)
            owner.append(k)
    return OffsetColumns(
        names, level, np.column_stack(drift) if drift else np.zeros((len(level), 0)), np.array(owner, int)
    )


def drift_beside_friction(signals: Regressors, offset: OffsetColumns, inertia_kgm2: float) -> np.ndarray:
    """Coefficients of the drift columns, N m, beside a friction of any shape over speed in each direction.

    Beside Coulomb + viscous friction the drift takes what these miss, by as much as slow and quick, or
    forward and backward motion are uneven in time: the points of two sessions of one joint then differ by
    it."""
    rows = signals.sliding
    v = signals.velocity_rad_s[rows]
    # drift first, since its coefficients alone are kept; offsets beside it, or their differences would be
    # drift
    columns = [offset.drift[rows], offset.relative(rows)[rows]]
    for mine in (v > 0, v < 0):
        speed = np.abs(v[mine])
        # quantiles, so that each piece has rows; of strokes at one speed many are the same
        at = np.unique(np.quantile(speed, np.linspace(0, 1, BENDS + 1)))
        friction = np.zeros((len(v), len(at)))
        friction[mine] = np.column_stack([np.interp(speed, at, one) for one in np.eye(len(at))])
        columns.append(friction)
    matrix = np.hstack([*columns, signals.besides[rows]])
    scale = np.sqrt((matrix**2).mean(axis=0))
    scale[scale == 0] = 1.0
    left = signals.torque_nm[rows] - inertia_kgm2 * signals.acceleration_rad_s2[rows]
    found = np.linalg.lstsq(matrix / scale, left, rcond=None)[0] / scale
    return np.asarray(found[: offset.drift.shape[1]])


def _terms(signals: Regressors, rows: np.ndarray) -> int:
    sliding = rows[signals.sliding[rows]]
    if len(sliding) == 0:
        return 0
    reversals = int((np.diff(np.sign(signals.velocity_rad_s[sliding])) != 0).sum())
    duration_s = float(recorded_s(signals.time_s[rows])[-1])
    return min(
        # half waves: term n has a period of 2 T/n
        int(2 * duration_s / DRIFT_PERIOD_S),
        reversals // REVERSALS_PER_TERM,
        blocks_in(duration_s, signals.cutoff_hz) // BLOCKS_PER_TERM,
        TERMS_MAX,
    )
