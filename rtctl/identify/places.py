"""Places to measure at: which they are, and the way there."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rtctl.identify.measurement_order import Task
from rtctl.identify.motion import Motion, Steps
from rtctl.identify.windows import per_place, steady_s, window_s


@dataclass(frozen=True)
class Spot:
    """Where to measure next.

    `place_rad` is a place, whole turns to and fro being the same; None: wherever the joint is. `step_rad` is
    the travel to move on by instead where the joint cannot turn far enough for places. From there the joint
    moves on to the phase `phase_share` of the gear's ripple, None: any."""

    step_rad: float = 0.0
    place_rad: float | None = None
    phase_share: float | None = None


HERE = Spot()


def gap_to(motion: Motion, direction: int, place_rad: float, passed_rad: float) -> float:
    """Travel in `direction` to the next place that is whole turns from `place_rad`; 0 when just passed it.

    Just passed: by no more than `passed_rad`."""
    gap = (place_rad - motion.position_rad) * direction % motion.rig.turn_rad
    return 0.0 if gap > motion.rig.turn_rad - passed_rad else gap  # else a whole turn for a hair's breadth


def make_room(motion: Motion, direction: int, run_rad: float) -> Steps[None]:
    """Go back so that a run of `run_rad` in `direction` fits, unless it fits already."""
    if motion.room_rad(direction) >= run_rad:
        return
    travel = motion.high_rad - motion.low_rad
    # a turn at once where there is room: going back for each run would double the way
    goal_room = min(max(run_rad, motion.rig.turn_rad), travel)
    yield from motion.rest()
    jog = motion.jog_speed_rad_s()
    yield from motion.advance(-direction * (goal_room - motion.room_rad(direction)), jog)
    yield from motion.rest()


def go_on(motion: Motion, direction: int, spot: Spot, run_rad: float, speed_rad_s: float) -> Steps[None]:
    """Move on to a spot, with room for a run of `run_rad` at a speed from there."""
    pace = max(motion.jog_speed_rad_s(), speed_rad_s)
    travel = motion.high_rad - motion.low_rad
    if spot.place_rad is not None and motion.rig.turn_rad + run_rad <= travel:
        passed_rad = spot.step_rad
        if motion.room_rad(direction) < gap_to(motion, direction, spot.place_rad, passed_rad) + run_rad:
            yield from make_room(motion, direction, motion.rig.turn_rad + run_rad)
        step = gap_to(motion, direction, spot.place_rad, passed_rad)
    else:
        # a run at the jog speed or faster goes on far enough by itself
        step = min(spot.step_rad, max(0.0, travel - run_rad)) if speed_rad_s < pace else 0.0
        yield from make_room(motion, direction, step + run_rad)
        step = min(step, motion.room_rad(direction) - run_rad)
    if spot.phase_share is not None:
        there = motion.position_rad + direction * max(step, 0.0)
        more = motion.ripple.travel_to(there, spot.phase_share, direction)
        step = max(step, 0.0) + more if step + more + run_rad <= motion.room_rad(direction) else step
    if step > 0.0:
        yield from motion.advance(direction * step, pace)


def spots(motion: Motion, task: Task) -> Iterator[Spot]:
    """Places of a point, without end: even over whole turns, each moved within its share.

    Notes
    -----
    Friction that varies over a turn cancels in the mean of even places. Uneven within their share, so that
    they do not meet a gear's ripple always at the same phase. So many turns that a run ends before the next
    place begins; otherwise the places would bunch. Where the ripple's period is shorter than the distance of
    two places, each of them is moved on to a phase of its own, the phases being as even as the places: then
    the ripple cancels in the mean as well, however little of a period one measurement sees."""
    settings, speed = motion.settings, task.speed_rad_s
    # by point: one that is measured again meets the same places, whatever was measured before it
    random = np.random.default_rng([settings.seed, task.number])
    # a break-away is one measurement, and each has a place of its own; a run takes several
    places = settings.measurements if speed == 0 else settings.spots
    run = 0.0
    if speed > 0:
        run = (2 * steady_s(motion, speed) + per_place(motion) * window_s(motion, speed)) * speed
    # half as much again: runs are never quite as long as planned
    turns = max(1, math.ceil(1.5 * run * places / motion.rig.turn_rad))
    # of a short travel all there is: places there follow each other at random distances
    span = min(motion.rig.turn_rad, motion.high_rad - motion.low_rad)
    start = motion.position_rad
    phased = 0.0 < motion.ripple.period_rad <= span / places
    order = random.permutation(places)  # phases in another order than places: neither follows the other
    for number in itertools.count():
        moved = float(random.uniform(-0.25, 0.25))
        place = start + task.direction * (number + 0.5 + moved) * turns * motion.rig.turn_rad / places
        phase = float((order[number % places] + random.uniform()) / places) if phased else None
        yield Spot(span / places * (1.0 + 2.0 * moved), place, phase)
