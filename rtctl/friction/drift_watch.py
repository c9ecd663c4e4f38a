"""Follows the friction of every axis of a rig over its ticks: one at a time or a recording at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rtctl.control.compensation_limit import FACTOR_LEAST
from rtctl.control.vocabulary import State
from rtctl.friction import adaptation
from rtctl.friction import drift_verdict as verdict
from rtctl.friction.drift_bins import RATE_HZ, Binning
from rtctl.friction.drift_change import forget_before_change
from rtctl.friction.drift_deployed import Deployed, deployed
from rtctl.friction.drift_estimate import Estimate, estimate
from rtctl.friction.drift_here import Places, beside_viscous, stayed
from rtctl.friction.drift_sliding import PRESLIDING_LENGTHS, Sliding
from rtctl.friction.drift_strokes import Strokes
from rtctl.rig_file.friction_tables import DriftTable
from rtctl.tick import joined

FRESH_TICKS = 3
"""A sample older than that says nothing of this moment."""

LOOK_S = 0.5
"""Ticks are looked at in blocks of so long: a block costs as much whether it is long or short."""


@dataclass
class AxisWatch:
    """One axis: what it is relative to, what is remembered, and what was last made of it."""

    by: Deployed
    table: DriftTable
    strokes: Strokes
    sliding: Sliding
    rate_hz: float
    found: Estimate | None = None
    warning: str = ""
    stopped: str = ""
    bounds: adaptation.Bounds | None = None
    """Bounds of the factor that the feed-forward goes by; None where it follows nothing."""
    factor: float = 1.0
    """The factor that the law is to be asked for."""
    following: bool = True
    """Whether it follows what is found, within its bounds; else it stays where it is."""
    _judged: int = field(default=0, repr=False)
    _places: Places = field(default_factory=Places, repr=False)

    def begin_session(self) -> None:
        """The motor is switched on: sensors may have been zeroed since."""
        self.strokes.begin_session()
        self.stopped = ""

    def take_up(self, table: np.ndarray, *, warned: bool, factor: float = 1.0) -> None:
        """Go on from strokes of an earlier run (`Strokes.table`) and from its factor, within the bounds of
        this one; `warned`: there was a warning then. Nothing is stopped for them."""
        if self.bounds is not None:
            self.factor = min(max(factor, self.bounds.least), self.bounds.most)
        if not len(table):
            return
        self.strokes.take_up(table)
        found = estimate(self.strokes, self.by, self.rate_hz)
        # sums from a file may pass each test and still have no solution together
        if found is None or not np.isfinite(list(vars(found).values())).all():
            self.strokes.forget()
            return
        self.found = found
        self.warning = verdict.warning(found, self.by, self.table.warn_share, warned=warned)

    def judge(self, share: float) -> None:
        """Make of what is remembered what there is to say; `share` of the feed-forward is in force."""
        # nothing new, but that all was forgotten: then what was found is of no present motion
        if self.strokes.taken == self._judged and (self.found is None or len(self.strokes.table)):
            return
        self._judged = self.strokes.taken
        forget_before_change(self.strokes, self.rate_hz)
        found = self.found = estimate(self.strokes, self.by, self.rate_hz)
        # what was told is of motion that is forgotten; what was warned of is not known to be gone
        if found is None:
            return
        warned, share_of_news = bool(self.warning), self.table.warn_share
        # nothing is remembered beside a warning: what has changed is no reference
        before, as_quick = self._places.before(found, self.strokes, keep=not warned)
        found = self.found = beside_viscous(found, as_quick)
        # a change is not gone because the hand works elsewhere, or is on its way
        known = before is not None and stayed(found, self.strokes)
        if known or not warned or not verdict.of_a_place(found, self.by, share_of_news):
            self.warning = verdict.warning(found, self.by, share_of_news, warned=warned, before=before)
        # once: the words of a STOP are those of the moment it came for
        if self.table.stop and not self.stopped:
            self.stopped = verdict.overcompensated(found, self.by, share)

    def still_too_much(self, share: float) -> bool:
        """Whether `share` of the feed-forward would stop the rig again for what it was stopped for."""
        return bool(self.stopped and self.found and verdict.overcompensated(self.found, self.by, share))

    def adapt(self, moved_s: float, *, faulty: bool) -> None:
        """Have the feed-forward follow what was found, by `moved_s` more seconds of motion; not after a STOP
        or beside a fault."""
        if self.bounds is not None:
            # beside a fault torques are not those of the joint
            frozen = faulty or bool(self.stopped) or not self.following
            self.factor = adaptation.followed(self.factor, self.found, self.bounds, moved_s, frozen=frozen)


class RigWatch:
    """All axes of one rig.

    Parameters
    ----------
    params, model
        The law's arrays: shape (1,), and one friction model for each axis.
    tables
        `[axis.friction.drift]` of each axis.

    Attributes
    ----------
    axes : list of AxisWatch or None
        None for an axis that cannot be watched, or is not to be."""

    def __init__(self, params: np.ndarray, model: np.ndarray, tables: Sequence[DriftTable]) -> None:
        period_s = float(params[0]["period_s"])
        # whole ticks to a bin; a loop below 200 Hz has bins of one
        stride = max(1, round(1.0 / (RATE_HZ * period_s)))
        self._binning = Binning(stride)
        # a whole bin at least, where the loop is slower than two ticks a second
        self._block = max(stride, round(LOOK_S / period_s))
        self._batches: list[np.ndarray] = []
        self._ticks = 0
        self._powered = False
        rate_hz = 1.0 / (period_s * stride)
        self.axes = [
            _axis(deployed(params, model, a), table, rate_hz, _bounds(params[0], a))
            for a, table in enumerate(tables)
        ]
        # the law's gains are at the largest factor: in force is a share of them (docs/theory.md 5.10)
        self._largest = 1.0 + params[0]["friction_raise"]
        self._idle = all(axis is None for axis in self.axes)

    def follow(self, rows: np.ndarray) -> bool:
        """Take the next ticks, in order; True when that made something new of them."""
        if self._idle or len(rows) == 0:
            return False
        self._batches.append(rows)
        self._ticks += len(rows)
        if self._ticks < self._block:
            return False
        return self.look()

    def look(self) -> bool:
        """Look at what has come; True when there was something."""
        if not self._batches:
            return False
        rows = joined(self._batches)
        self._batches, self._ticks = [], 0
        moving = (rows["state"] == State.ACTIVE) | (rows["state"] == State.HOLD)
        if not moving.any():
            self._powered = False
            self._binning.forget()
            return False
        self._sessions(moving)
        # beside a fault a torque may not be what was sent, and a held sample is of another place
        usable = moving & (rows["faults"] == 0) & (rows["sample_age_ticks"] < FRESH_TICKS)
        torque = self._torque(rows)
        # by the number of the tick: the host may have lost some on their way
        bins = self._binning(
            rows["tick"], usable, np.stack([rows["position_rad"], torque, rows["place_trust"]])
        )
        # by the whole block: torques of half a second beside a fault are worth no following
        faulty = bool((rows["faults"] != 0).any()) or not moving[-1]
        for a, axis in enumerate(self.axes):
            if axis is not None:
                before = axis.sliding.moved
                found = axis.sliding(bins, a)
                axis.strokes.add(found, axis.by, axis.sliding.moved - before)
                axis.judge(self._share(rows[-1], a))
                # by sliding alone: what a joint did not use while it stood is not saved
                axis.adapt(len(found.velocity) / axis.rate_hz, faulty=faulty)
        return True

    def _torque(self, rows: np.ndarray) -> np.ndarray:
        """Torque on each joint with that of its place, less what its load adds to the friction, as far as the
        model knows these, N m, shape (n, axes)."""
        hand, motor, velocity = rows["hand_torque_nm"], rows["motor_torque_nm"], rows["velocity_rad_s"]
        torque: np.ndarray = motor + hand
        for a, axis in enumerate(self.axes):
            if axis is not None:
                # load first: it goes by the torques as they are, and a place's push is none of a hand
                torque[:, a] = axis.by.unloaded_nm(velocity[:, a], hand[:, a], motor[:, a])
                torque[:, a] += axis.by.pushed_nm(rows["position_rad"][:, a], rows["place_trust"][:, a])
        return torque

    def _share(self, row: np.void, a: int) -> float:
        """Share of the feed-forward of `deployed` that is in force, 0 to 1."""
        axis = self.axes[a]
        factor = row["friction_factor"][a] if axis is not None and axis.bounds is not None else 1.0
        return self.share(a, float(row["compensation"][a]), float(factor))

    def share(self, a: int, compensation: float, factor: float) -> float:
        """Share of the feed-forward of `deployed` that these two make, 0 to 1."""
        return compensation * factor / float(self._largest[a])

    def _sessions(self, moving: np.ndarray) -> None:
        """Where the motor is switched on, a session begins; what stands before that in the same block is
        taken as its own."""
        before = np.concatenate([[self._powered], moving[:-1]])
        self._powered = bool(moving[-1])
        # two starts within a block of half a second are one session
        if not (moving & ~before).any():
            return
        for axis in self.axes:
            if axis is not None:
                axis.begin_session()


def _bounds(params: np.void, a: int) -> adaptation.Bounds | None:
    """Bounds of what the feed-forward of axis `a` follows, as the law has them; None where it follows
    nothing."""
    step, largest = float(params["friction_change_step"][a]), 1.0 + float(params["friction_raise"][a])
    return adaptation.Bounds(FACTOR_LEAST, largest, step / float(params["period_s"])) if step > 0 else None


def _axis(
    by: Deployed | None, table: DriftTable, rate_hz: float, bounds: adaptation.Bounds | None
) -> AxisWatch | None:
    if by is None or not table.watch:
        return None
    settle = PRESLIDING_LENGTHS * by.presliding_rad
    return AxisWatch(
        by=by,
        table=table,
        strokes=Strokes(round(table.window_s * rate_hz)),
        sliding=Sliding(rate_hz, settle, by.speed_min_rad_s, by.speed_max_rad_s),
        rate_hz=rate_hz,
        bounds=bounds,
    )
