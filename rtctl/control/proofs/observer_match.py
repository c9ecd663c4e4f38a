"""How the disturbance observer goes by a force sensor that is late: what it delays of its own, how much too high it takes the inertia, how quick it is.

Pure functions of numbers, over the undamped hands of `observer_loop.grid` on a joint that slides. A sensor may be anything from immediate to as late as
it is said to be, so torque and velocity are delayed by a part of that, and what is left over is damped by an inertia that is taken too high
(docs/theory.md 6.4). That the whole box passes with what is chosen here is for `observer_margin` to show.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from rtctl.control.disturbance_observer import LATE_MOST
from rtctl.control.proofs.drive_in_hand import ElasticJoint
from rtctl.control.proofs.observer_loop import Loop, grid
from rtctl.control.proofs.observer_margin import Finding, judge
from rtctl.control.proofs.quicker_sensors import quicker_sensors

KEPT_WANTED = 0.4
"""Share of its damping that every vibration is to keep: more than `observer_margin.KEPT_LEAST`, as some hands are tried only."""

EXCESSES = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3)
"""What the inertia may be taken too high by, the least that is enough."""


def late_ticks(loop: Loop) -> float:
    """Delay and low-pass of the force sensor together: a low-pass is as late as its time constant."""
    lag = 1 / (2 * math.pi * loop.sensor_hz * loop.period_s) if loop.sensor_hz > 0 else 0.0
    return loop.sensor_ticks + lag


def in_gears(loop: Loop, gears: tuple[ElasticJoint, ...]) -> Finding | None:
    """The worst of undamped hands on a joint that slides and has one of these gears, behind every sensor; None where there are none.

    A hand that holds the link leaves the motor to swing on its gear, J_m of the inertia J that the observer takes from its torque. It feeds
    gain LP (J - J_m) dv/dt to that swing, which drives it from where low-passes, delay and lag turn by half a turn (docs/theory.md 6.5).
    """
    if not gears:
        return None
    free = replace(loop, joints=gears, stiffness_nm_rad=0.0, damping_nms_rad=0.0, bristle_nm_rad=0.0)
    points = _sliding(free)
    least: Finding | None = None
    for one in (free, *quicker_sensors(free)):
        found = judge(one, points)
        if not found.ok:
            return found
        least = found if least is None or found.kept < least.kept else least
    return least


def bears(loop: Loop, gears: tuple[ElasticJoint, ...]) -> bool:
    """True where none of these gears rings by the observer."""
    found = in_gears(loop, gears)
    return found is None or found.ok


def largest_in_gears(loop: Loop, gears: tuple[ElasticJoint, ...], bandwidths_hz: Iterable[float]) -> float:
    """The first of the bandwidths with which none of these gears rings, Hz; 0 if there is none."""
    return next((hz for hz in bandwidths_hz if bears(replace(loop, bandwidth_hz=hz), gears)), 0.0)


def tuned(loop: Loop, bandwidths_hz: Iterable[float], gears: tuple[ElasticJoint, ...] = ()) -> Loop:
    """The loop with the first of the bandwidths, and with it the least excess, that damps every vibration enough behind every sensor, those of unknown gears, too; the last if none does."""
    points = _sliding(loop)
    owns = sorted({min(math.ceil(late_ticks(loop) * k / 8), LATE_MOST) for k in range(5)})
    for hz in bandwidths_hz:
        for excess in EXCESSES:
            tried = [replace(loop, bandwidth_hz=hz, own_ticks=own, excess=excess) for own in owns]
            ranked = sorted(((_kept(one, points), -one.own_ticks) for one in tried), reverse=True)
            for kept, own in ranked:
                found = replace(loop, bandwidth_hz=hz, own_ticks=-own, excess=excess)
                if kept >= KEPT_WANTED and bears(found, gears):
                    return found
            loop = replace(loop, bandwidth_hz=hz, own_ticks=-ranked[0][1], excess=excess)
    return loop


def _sliding(loop: Loop) -> np.ndarray:
    """Numbers of the points of the grid with undamped hands on a joint that slides."""
    points = grid(loop)
    return np.flatnonzero((points.b_h == 0.0) & (points.bristle == 0.0))


def _kept(loop: Loop, points: np.ndarray) -> float:
    """Least share that is kept with every sensor, or as soon as it is too little; less than 0 where something grows."""
    least = 1.0
    for one in (loop, *quicker_sensors(loop)):
        found = judge(one, points)
        least = min(least, found.kept if found.ok else -found.radius)
        if not least >= KEPT_WANTED:
            break
    return least
