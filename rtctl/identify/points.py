"""The motions behind one friction point, and what is made of their ticks."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from rtctl.control.vocabulary import Program, ProgramFlag
from rtctl.errors import DataError
from rtctl.friction.presliding import Ramp, ramp_of
from rtctl.identify.motion import (
    ACCELERATION_RAD_S2,
    LOOK_S,
    SLIP_RAD,
    SPARE_S,
    HandSeen,
    Motion,
    Order,
    Steps,
)
from rtctl.identify.plan import Task
from rtctl.identify.settings import TURN_RAD
from rtctl.identify.signals import Measurement, break_away, is_steady, measure, stood_still

COUNTS_PER_WINDOW = 12
WINDOW_MAX_S = 2.0
STEADY_RAD, STEADY_MIN_S, STEADY_MAX_S = 0.004, 0.1, 1.0
"""The steady-state test looks at the time for this travel (dry friction settles over a distance), within bounds."""
SETTLE_S, SETTLE_RAD = 2.0, 0.03
"""Patience of the steady-state test: this time plus the time for this travel."""
FAST_SHARE = 0.6
"""The ramp is quick up to this share of the smallest break-away torque seen."""
SLOW_EVERY = 5
"""One ramp in so many is slow from the beginning: its presliding is looked at. A quick one bends against damping too."""
DISCARDS_PER_MEASUREMENT = 3
SLIP_MAX_RAD = 0.2


@dataclass(frozen=True)
class Spot:
    """Where to measure next.

    `place_rad` is a place, whole turns to and fro being the same; None: wherever the joint is. `step_rad` is
    the travel to move on by instead where the joint cannot turn far enough for places.
    """

    step_rad: float = 0.0
    place_rad: float | None = None


HERE = Spot()


@dataclass
class Collected:
    """Measurements of one point, and how many tries were thrown away."""

    measurements: list[Measurement] = field(default_factory=list)
    discarded: int = 0
    ramps: list[Ramp] = field(default_factory=list)
    """Beginnings of the slow break-away ramps, for the presliding length."""
    slip_rad: float = SLIP_RAD
    """Displacement that ends a ramp."""
    starts: list[int] = field(default_factory=list)
    """How many measurements there were when each place was reached: those in between are of one place."""

    @property
    def weakest_nm(self) -> float:
        """Torque at the place where it was least in size against the motion's direction, N m, signed."""
        torque = np.array([one.torque_nm for one in self.measurements])
        inner = [start for start in sorted(set(self.starts)) if 0 < start < len(torque)]
        places = np.array([part.mean() for part in np.split(torque, inner)])
        return float(places[np.argmin(places * np.sign(torque.mean()))])

    def discard(self, wanted: int, what: str) -> None:
        """Count a try that gave nothing; too many are an error. Raises DataError."""
        self.discarded += 1
        if self.discarded > DISCARDS_PER_MEASUREMENT * wanted:
            raise DataError(
                f"{what}: {self.discarded} tries gave only {len(self.measurements)} of {wanted} measurements; "
                "the motion never becomes steady there: check the gearbox for backlash or a hard spot, "
                "leave out the speed (--speed-min, --speed-max) or raise --warm-up"
            )


def window_s(motion: Motion, speed_rad_s: float) -> float:
    """Length of one measurement: as set, but enough counts, and no more than half of the travel left."""
    wanted = max(motion.settings.window_s, COUNTS_PER_WINDOW * motion.rig.count_rad / speed_rad_s)
    room = motion.high_rad - motion.low_rad - run_up_rad(motion, speed_rad_s)
    return min(wanted, WINDOW_MAX_S, max(0.5 * room / speed_rad_s, 0.02))


def steady_s(speed_rad_s: float) -> float:
    """Length of the steady-state test's window."""
    return min(max(STEADY_RAD / speed_rad_s, STEADY_MIN_S), STEADY_MAX_S)


def run_up_rad(motion: Motion, speed_rad_s: float) -> float:
    """Travel of a run beside its measurements: speeding up, becoming steady, stopping."""
    up = speed_rad_s**2 / (2 * ACCELERATION_RAD_S2)
    return up + (steady_s(speed_rad_s) + 2 * LOOK_S) * speed_rad_s + motion.stopping_rad(speed_rad_s)


def fastest_rad_s(motion: Motion) -> float:
    """Highest speed at which the travel leaves room for a run with a window of 20 ms."""
    travel = motion.high_rad - motion.low_rad
    b = STEADY_MIN_S + 2 * LOOK_S + SPARE_S + 0.04
    root = math.sqrt(b * b + 4 * travel / ACCELERATION_RAD_S2)
    return 0.5 * ACCELERATION_RAD_S2 * (root - b)


def gap_to(motion: Motion, direction: int, place_rad: float, passed_rad: float) -> float:
    """Travel in `direction` to the next place that is whole turns from `place_rad`; 0 when just passed it.

    Just passed: by no more than `passed_rad`.
    """
    gap = (place_rad - motion.position_rad) * direction % TURN_RAD
    return 0.0 if gap > TURN_RAD - passed_rad else gap


def make_room(motion: Motion, direction: int, run_rad: float) -> Steps[None]:
    """Go back so that a run of `run_rad` in `direction` fits, unless it fits already."""
    if motion.room_rad(direction) >= run_rad:
        return
    travel = motion.high_rad - motion.low_rad
    goal_room = min(max(run_rad, TURN_RAD), travel)
    yield from motion.rest()
    jog = motion.jog_speed_rad_s()
    yield from motion.advance(-direction * (goal_room - motion.room_rad(direction)), jog)
    yield from motion.rest()


def settle(motion: Motion, velocity_rad_s: float) -> Steps[bool]:
    """Turn at a speed until torque and speed are steady; False when patience or travel ends first."""
    rig, speed = motion.rig, abs(velocity_rad_s)
    direction = 1 if velocity_rad_s > 0 else -1
    window = max(16, round(steady_s(speed) / rig.period_s))
    patience = round((SETTLE_S + SETTLE_RAD / speed) / rig.period_s)
    look_s = max(LOOK_S, 0.2 * window * rig.period_s)
    seen = yield from motion.see(Order(motion.turn(velocity_rad_s).fields, look_s))
    ticks = len(seen)
    while True:
        seen = seen[-window:]
        position, torque = seen["position_rad"][:, rig.axis], seen["motor_torque_nm"][:, rig.axis]
        full = len(seen) == window
        if full and is_steady(position, torque, rig.period_s, velocity_rad_s, rig.count_rad):
            return True
        if ticks > patience or motion.room_rad(direction) <= motion.stopping_rad(speed):
            return False
        rows = yield from motion.see(Order(look_s=look_s))
        ticks += len(rows)
        seen = np.concatenate([seen, rows])


def _go_on(motion: Motion, direction: int, spot: Spot, run_rad: float, speed_rad_s: float) -> Steps[None]:
    """Move on to a spot, with room for a run of `run_rad` at a speed from there."""
    pace = max(motion.jog_speed_rad_s(), speed_rad_s)
    travel = motion.high_rad - motion.low_rad
    if spot.place_rad is not None and TURN_RAD + run_rad <= travel:
        passed_rad = spot.step_rad
        if motion.room_rad(direction) < gap_to(motion, direction, spot.place_rad, passed_rad) + run_rad:
            yield from make_room(motion, direction, TURN_RAD + run_rad)
        step = gap_to(motion, direction, spot.place_rad, passed_rad)
    else:
        step = min(spot.step_rad, max(0.0, travel - run_rad)) if speed_rad_s < pace else 0.0
        yield from make_room(motion, direction, step + run_rad)
        step = min(step, motion.room_rad(direction) - run_rad)
    if step > 0.0:
        yield from motion.advance(direction * step, pace)


def _run(motion: Motion, task: Task, got: Collected, spot: Spot, bias_nm: float) -> Steps[None]:
    """One run at one place: move on, become steady, take some measurements while travel is left."""
    settings, rig, speed, direction = motion.settings, motion.rig, task.speed_rad_s, task.direction
    length_s = window_s(motion, speed)
    left = settings.measurements - len(got.measurements)
    wanted = min(left, -(-settings.measurements // settings.spots))
    jog = motion.jog_speed_rad_s()
    travel = motion.high_rad - motion.low_rad
    run = min(run_up_rad(motion, speed) + wanted * length_s * speed + SPARE_S * jog, travel)
    yield from _go_on(motion, direction, spot, run, speed)
    steady = yield from settle(motion, direction * speed)
    before = len(got.measurements)
    while (
        steady and wanted > 0 and motion.room_rad(direction) > motion.stopping_rad(speed) + length_s * speed
    ):
        rows = (yield from motion.watch(length_s))[: round(length_s / rig.period_s)]
        if np.any(rows["program_flags"][:, rig.axis]):
            break  # a guard ended the run while the host was late: the joint brakes
        if stood_still(rows):
            continue
        got.measurements.append(measure(rows, rig.axis, rig.period_s, rig.inertia_kgm2, bias_nm))
        wanted -= 1
    if len(got.measurements) == before:  # not steady, or only when the travel was over
        got.discard(settings.measurements, task.name)
        yield from motion.rest()


def _slip(motion: Motion, task: Task, got: Collected, spot: Spot, bias_nm: float) -> Steps[None]:
    """One break-away: move on in the direction of the ramp, rest, ramp until the joint slips."""
    rig, settings, direction = motion.rig, motion.settings, task.direction
    jog = motion.jog_speed_rad_s()
    travel, stop = motion.high_rad - motion.low_rad, motion.stopping_rad(jog) + 0.5 * settings.margin_rad
    yield from _go_on(motion, direction, spot, min(stop, 0.5 * travel), 0.0)
    yield from motion.rest()
    slow = len(got.measurements) % SLOW_EVERY == 0
    least = 0.0 if slow else min(abs(m.torque_nm) for m in got.measurements)
    limit_s = 2.0 * rig.torque_limit_nm / settings.ramp_nm_s
    fields = motion.order(
        Program.RAMP,
        limit_s,
        ramp_nm_s=direction * settings.ramp_nm_s,
        fast_nm=FAST_SHARE * least,
        slip_rad=got.slip_rad,
    )
    parts = [(yield from motion.see(Order(fields, 4 * LOOK_S)))]
    while not int(parts[-1]["program_flags"][-1, rig.axis]):
        parts.append((yield from motion.see(Order(look_s=4 * LOOK_S))))
    rows = np.concatenate(parts)
    flags = ProgramFlag(int(rows["program_flags"][-1, rig.axis]))
    if ProgramFlag.LIMIT in flags:
        raise DataError(
            f"{task.name}: the joint did not move at {rig.servo_max_nm:g} N m, 90 % of "
            "torque_limit_nm; free the joint, or correct the torque constant or the limit in the rig file"
        )
    ended = int(np.argmax(rows["program_flags"][:, rig.axis] != 0))
    found = break_away(rows[:ended], rig.axis, rig.period_s, rig.count_rad, bias_nm)
    if found is None and ProgramFlag.SLIPPED in flags:  # it only bent so far: bristles as soft as that
        got.slip_rad = min(2.0 * got.slip_rad, SLIP_MAX_RAD)
    if found is None or ProgramFlag.SLIPPED not in flags or found.torque_nm * direction <= 0:
        got.discard(settings.measurements, task.name)
        return
    got.measurements.append(found)
    if slow and not stood_still(rows):
        torque = rows["motor_torque_nm"][:ended, rig.axis] - bias_nm
        position = rows["position_rad"][:ended, rig.axis]
        ramp = ramp_of(position, torque, found.torque_nm, rig.count_rad, rig.period_s)
        got.ramps += [ramp] if ramp else []


def _spots(motion: Motion, task: Task) -> Iterator[Spot]:
    """Places of a point, without end: even over whole turns, each moved within its share.

    Notes
    -----
    Friction that varies over a turn cancels in the mean of even places. Uneven within their share, so that
    they do not meet a gear's ripple always at the same phase. So many turns that a run ends before the next
    place begins; otherwise the places would bunch.
    """
    settings, speed = motion.settings, task.speed_rad_s
    random = np.random.default_rng([settings.seed, task.number])
    places = settings.measurements if speed == 0 else settings.spots
    run = 0.0
    if speed > 0:
        each = -(-settings.measurements // places)
        run = (2 * steady_s(speed) + each * window_s(motion, speed)) * speed
    turns = max(1, math.ceil(1.5 * run * places / TURN_RAD))
    span = min(TURN_RAD, motion.high_rad - motion.low_rad)
    start = motion.position_rad
    for number in itertools.count():
        moved = float(random.uniform(-0.25, 0.25))
        place = start + task.direction * (number + 0.5 + moved) * turns * TURN_RAD / places
        yield Spot(span / places * (1.0 + 2.0 * moved), place)


def collect(motion: Motion, task: Task, bias_nm: float) -> Steps[Collected]:
    """Measure one point: `settings.measurements` measurements spread over the travel.

    Raises
    ------
    DataError
        The joint does not move, or never moves steadily.
    HandOnRigError
        A hand stays on the rig.
    """
    settings = motion.settings
    got, pauses, before = Collected(), 0, -1
    spots = _spots(motion, task)
    while len(got.measurements) < settings.measurements:
        # nothing came of the last place: take all the travel there is
        spot = HERE if len(got.measurements) == before else next(spots)
        part = _slip if task.speed_rad_s == 0 else _run
        before = len(got.measurements)
        got.starts.append(before)
        try:
            yield from part(motion, task, got, spot, bias_nm)
        except HandSeen:
            pauses = 0 if len(got.measurements) > before else pauses + 1
            yield from motion.wait_for_free_rig(pauses)
    return got
