"""How the disturbance observer goes by a force sensor that is late: what it delays of its own, how much too
high it takes the inertia, how quick it is.

Pure functions of numbers, over the undamped hands of `observer_loop.grid` on a joint that slides. A sensor
may be anything from immediate to as late as it is said to be, so torque and velocity are delayed by a part of
that, and what is left over is damped by an inertia that is taken too high (docs/theory.md 6.4). That the
whole box passes with what is chosen here is for `observer_margin` to show."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from rtctl.control.disturbance_observer import LATE_MOST
from rtctl.control.proofs.drive_in_hand import ElasticJoint
from rtctl.control.proofs.less_late import LATENESS, less_late
from rtctl.control.proofs.observer_loop import Loop, grid
from rtctl.control.proofs.observer_margin import KEPT_LEAST, Finding, judge

KEPT_WANTED = 0.4
"""Share of its damping that every vibration is to keep: more than `observer_margin.KEPT_LEAST`, as some hands
are tried only."""

EXCESSES = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3)
"""What the inertia may be taken too high by, the least that is enough: each costs gain times as much of the
joint's own inertia, which a hand feels in free motion (docs/theory.md 6.4)."""


def late_ticks(loop: Loop) -> float:
    """Delay and low-pass of the force sensor together: a low-pass is as late as its time constant."""
    lag = 1 / (2 * math.pi * loop.sensor_hz * loop.period_s) if loop.sensor_hz > 0 else 0.0
    return loop.sensor_ticks + lag


def in_gears(loop: Loop, gears: tuple[ElasticJoint, ...]) -> Finding | None:
    """The worst of undamped hands on a joint that slides and has one of these gears, behind every sensor;
    None where there are none.

    A hand that holds the link leaves the motor to swing on its gear, J_m of the inertia J that the observer
    takes from its torque. It feeds gain LP (J - J_m) dv/dt to that swing, which drives it from where
    low-passes, delay and lag turn by half a turn (docs/theory.md 6.5)."""
    return _in_gears(_on_gears(loop, gears), _Hard()) if gears else None


def _on_gears(loop: Loop, gears: tuple[ElasticJoint, ...]) -> Loop:
    return replace(loop, joints=gears, stiffness_nm_rad=0.0, damping_nms_rad=0.0, bristle_nm_rad=0.0)


def _in_gears(free: Loop, hard: _Hard) -> Finding:
    points, found = _sliding(free), list[Finding]()
    for one in (free, *less_late(free)):
        found.append(judge(one, points))
        if not found[-1].ok:
            hard.found(one, int(points[found[-1].worst]))
            return found[-1]
    return min(found, key=lambda each: each.kept)


def bears(loop: Loop, gears: tuple[ElasticJoint, ...], hard: _Hard | None = None) -> bool:
    """True where none of these gears rings by the observer. `hard`: where loops behind the same sensor were
    found to ring."""
    if not gears:
        return True
    free, hard = _on_gears(loop, gears), hard or _Hard()
    return not hard.fails(free, KEPT_LEAST) and _in_gears(free, hard).ok


def largest_in_gears(loop: Loop, gears: tuple[ElasticJoint, ...], bandwidths_hz: Iterable[float]) -> float:
    """The first of the bandwidths with which none of these gears rings, Hz; 0 if there is none."""
    hard = _Hard()
    return next((hz for hz in bandwidths_hz if bears(replace(loop, bandwidth_hz=hz), gears, hard)), 0.0)


def tuned(loop: Loop, bandwidths_hz: Iterable[float], gears: tuple[ElasticJoint, ...] = ()) -> Loop:
    """The loop with the first of the bandwidths, and with it the least excess, that damps every vibration
    enough however less late the rig is, those of unknown gears, too; the last if none does."""
    points, hard, hard_gears = _sliding(loop), _Hard(), _Hard()
    # 0 to D/2: later, an early sensor rings in stiff hands (6.4)
    owns = sorted({min(math.ceil(late_ticks(loop) * k / 8), LATE_MOST) for k in range(5)})
    tried: list[Loop] = []
    # bandwidth first: a slower observer helps less at every pace, an inertia is felt in quick motion alone
    # (7 Hz for 4 ticks left .17 to .26 of a hand's torque where .15 to .19 was had: decision 0061)
    for hz, excess in product(bandwidths_hz, EXCESSES):
        tried = [replace(loop, bandwidth_hz=hz, own_ticks=own, excess=excess) for own in owns]
        left, known = list(tried), dict[Loop, float]()
        while found := _best(left, points, hard, known):
            if bears(found, gears, hard_gears):
                return found
            left.remove(found)
    return max(tried, key=lambda one: (_kept(one, points, hard), -one.own_ticks), default=loop)


class _Hard:
    """How late the rig was with which a loop was damped too little, and points that were the worst with it:
    most that fail, fail there, too."""

    def __init__(self) -> None:
        self._late, self._points = dict[str, Any](), dict[int, None]()

    def found(self, loop: Loop, point: int) -> None:
        """Keep that this loop was the worst at this point of the grid."""
        late = {name: getattr(loop, name) for name in LATENESS}
        if self._late != late:
            self._late, self._points = late, {}
        self._points[point] = None

    def fails(self, loop: Loop, wanted: float) -> bool:
        """True if a loop keeps too little at these already; False: all must be looked at."""
        behind = replace(loop, **self._late)
        return bool(self._points) and not _share(judge(behind, np.array([*self._points]))) >= wanted


def _best(loops: list[Loop], points: np.ndarray, hard: _Hard, known: dict[Loop, float]) -> Loop | None:
    """The one that keeps the most, of equals the one that delays least; None if none keeps enough. What
    cannot be the best is not looked at to the end.

    `known`: what those keep that were looked at to the end."""
    best, most = None, (KEPT_WANTED, -math.inf)
    for one in sorted(loops, key=lambda one: one not in known):
        if one not in known and not hard.fails(one, most[0]):
            kept = _kept(one, points, hard, most[0])
            if kept >= most[0]:
                known[one] = kept
        if (rank := (known.get(one, -math.inf), -one.own_ticks)) > most:
            best, most = one, rank
    return best


def _sliding(loop: Loop) -> np.ndarray:
    """Numbers of the points of the grid with undamped hands on a joint that slides."""
    points = grid(loop)
    return np.flatnonzero((points.b_h == 0.0) & (points.bristle == 0.0))


def _share(found: Finding) -> float:
    """Share of its damping that the least damped vibration keeps; less than 0 where something grows."""
    return found.kept if found.ok else -found.radius  # below every share: even the least stable has a rank


def _kept(loop: Loop, points: np.ndarray, hard: _Hard, wanted: float = KEPT_WANTED) -> float:
    """Least share that is kept however less late the rig is, or as soon as it is too little."""
    least = 1.0
    for one in (loop, *less_late(loop)):
        found = judge(one, points)
        least = min(least, _share(found))
        if not least >= wanted:
            hard.found(one, int(points[found.worst]))
            break
    return least
