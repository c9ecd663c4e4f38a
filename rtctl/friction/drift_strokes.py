"""What is remembered of the motion: sums over each of the last strokes, in fixed memory.

A row says  tau - J a - b v = m s F + d F + e J a + c b v + k (x - x_0) + o + noise,  s = sgn v, F the model's
dry friction, at its place as far as that is trusted: m is the factor of the dry friction, d half of what the
factors of the two directions differ by, e and c the shares that inertia and viscous friction are off by, k a
spring that nobody told of (x_0 where the session began to slide), o the offset of the session (of the force
sensor's tare and the current's zero). A stroke is kept as its sums, which is all that least squares and
standard errors clustered by stroke ask for."""

from __future__ import annotations

import math

import numpy as np

from rtctl.friction.drift_deployed import Deployed
from rtctl.friction.drift_sliding import Rows

COLUMNS = 6
"""s F, F, J a, b v, x - x_0, 1."""

SUMS = 3 + COLUMNS * COLUMNS + COLUMNS + 1
"""Numbers kept of a stroke: session, rows, trust in their places, Z'Z, Z'y, y'y."""

STROKES = 256
"""Strokes remembered at most."""

PIECE_ROWS = 200
"""A longer stroke counts as several: a joint that turns for minutes shows more than one place."""

# by strokes alone a hand that wiggles was told .996 minutes after a change (decision 0095)
MOTION_FACTOR = 2.0
"""Strokes that ended so many windows of motion ago are forgotten, too: a joint that sticks and slips, or
hardly leaves the presliding, shows little sliding, and a window of sliding alone would reach minutes back, to
before a change. Where none ended for so long, nothing is known of the present."""

KEPT_STROKES = 6
"""So many of the newest of each direction are not forgotten for that while strokes still end: fewer tell
nothing."""

# bristles that follow a steep curve late read 2 to 10 % too much (decision 0075)
LATE_SHARE = 0.03
"""Rows whose friction by the curve was another by this share one presliding length ago are left out: bristles
follow the curve so far behind, by some percent where a joint gets faster out of a high peak."""

ROWS_MIN = 4
"""A shorter stroke says nothing."""


class Strokes:
    """The last strokes of one axis.

    Parameters
    ----------
    most_rows
        Rows remembered at most: older strokes go. Rows of motion, sliding or not, `MOTION_FACTOR` times that.

    Attributes
    ----------
    taken : int
        Strokes that ended so far.
    border : int
        So many of the oldest strokes may still be of before a change: the friction changed about there.
    from_rad : float
        Position that the places of this session are counted from; NaN before its first row."""

    def __init__(self, most_rows: int) -> None:
        self._most_rows = most_rows
        self.table = np.zeros((0, SUMS))
        self.session = self.taken = 0
        self._moved = 0
        self._ended = np.zeros(0)
        self._open = np.zeros(SUMS)
        self._stroke = -1
        self.border = 0
        self.from_rad = math.nan

    @property
    def rows(self) -> int:
        """Rows remembered."""
        return int(self.table[:, 1].sum())

    def take_up(self, table: np.ndarray) -> None:
        """Go on from the strokes of an earlier run; what comes is of a later session."""
        self.table, self.session = table[-STROKES:], int(table[-1, 0]) + 1
        # when they ended the file does not say: now
        self._ended = np.full(len(self.table), float(self._moved))

    def keep_newest(self, count: int) -> None:
        """Remember no more than so many strokes."""
        self.table, self._ended = self.table[-count:], self._ended[-count:]

    def forget(self) -> None:
        """Remember nothing."""
        self.table, self._ended, self.border = np.zeros((0, SUMS)), np.zeros(0), 0

    def begin_session(self) -> None:
        """Sensors were zeroed, or may have been: an offset of its own from here on."""
        self._close()  # first: the open stroke is of the session that ends
        self.session += 1
        self.from_rad = math.nan

    def add(self, rows: Rows, by: Deployed, moved: int = 0) -> None:
        """Take the next rows, in order of time; `moved` rows of motion went by meanwhile, these among
        them."""
        # before strokes are closed: they end at what has moved by now
        self._moved += moved
        if len(rows.velocity):
            self._take(settled(rows, by), by)
        # two windows of motion and no stroke of sliding: nothing is known of the present (decision 0095)
        if len(self._ended) and self._moved - self._ended[-1] > MOTION_FACTOR * self._most_rows:
            self.forget()

    def _take(self, rows: Rows, by: Deployed) -> None:
        if len(rows.velocity) == 0:
            return
        if math.isnan(self.from_rad):
            self.from_rad = float(rows.position[0])
        z, y = regression(rows, by, self.from_rad)
        for stroke in np.split(np.arange(len(y)), np.flatnonzero(np.diff(rows.stroke)) + 1):
            if rows.stroke[stroke[0]] != self._stroke:
                self._close()
                self._stroke = int(rows.stroke[stroke[0]])
            # rounded up, so that no piece is longer than the most
            # pieces alike: one of 200 rows and a rest of 5 would be two witnesses of very different worth
            for piece in np.array_split(stroke, -(-len(stroke) // PIECE_ROWS)):
                self._open += sums(z[piece], y[piece], rows.trust[piece])
                if self._open[1] >= PIECE_ROWS:
                    self._close()

    def _close(self) -> None:
        if self._open[1] >= ROWS_MIN:
            self.taken += 1
            self._open[0] = self.session
            self.table = np.vstack([self.table, self._open])[-STROKES:]
            self._ended = np.append(self._ended, float(self._moved))[-STROKES:]
            newest_first = np.cumsum(self.table[::-1, 1])[::-1]
            # by motion and not by time: a joint that rests overnight has not changed its friction by it
            kept = self._moved - self._ended < MOTION_FACTOR * self._most_rows
            forward = unpacked(self.table)[0][:, 0, 1] > 0.0
            for way in (forward, ~forward):
                kept[np.flatnonzero(way)[-KEPT_STROKES:]] = True
            # the stroke that crosses it stays whole
            kept &= newest_first - self.table[:, 1] < self._most_rows
            self.table, self._ended = self.table[kept], self._ended[kept]
        self._open = np.zeros(SUMS)


def settled(rows: Rows, by: Deployed) -> Rows:
    """The rows whose friction is that of their own speed, not of one that was a presliding length ago."""
    v, way = rows.velocity, np.sign(rows.velocity)
    square = v * v - 2.0 * by.presliding_rad * way * rows.acceleration  # at this acceleration, one length ago
    # below 0 the joint came from rest within that length: then it is the slowest speed of the curve
    before = np.sqrt(np.minimum(np.maximum(square, 1e-12), by.speed_max_rad_s**2))
    now_nm, before_nm = np.split(by.dry_nm(np.concatenate([v, way * before])), 2)
    kept = np.abs(before_nm - now_nm) <= LATE_SHARE * now_nm
    return Rows(*(column[kept] for column in vars(rows).values()))


def regression(rows: Rows, by: Deployed, from_rad: float) -> tuple[np.ndarray, np.ndarray]:
    """Columns (n, `COLUMNS`) and left side (n,) of the balance, N m; places are counted from `from_rad`."""
    v, inertia_nm = rows.velocity, by.inertia_kgm2 * rows.acceleration
    # inertia and viscous friction as known stand on the left: their columns are of what these are off by
    dry, viscous_nm = by.dry_nm(v, rows.position, rows.trust), by.viscous_nms_rad(v) * v
    place = rows.position - from_rad
    z = np.column_stack([np.sign(v) * dry, dry, inertia_nm, viscous_nm, place, np.ones_like(v)])
    return z, rows.torque - inertia_nm - viscous_nm


def unpacked(table: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Z'Z (n, c, c), Z'y (n, c), y'y (n,) of sums (n, `SUMS`)."""
    end = 3 + COLUMNS * COLUMNS
    return table[:, 3:end].reshape(-1, COLUMNS, COLUMNS), table[:, end : end + COLUMNS], table[:, -1]


def sums(z: np.ndarray, y: np.ndarray, trust: np.ndarray) -> np.ndarray:
    """The sums of rows, shape (`SUMS`,), of session 0."""
    return np.concatenate([[0.0, len(y), trust.sum()], (z.T @ z).ravel(), z.T @ y, [y @ y]])
