"""The motions behind one friction point, and what is made of their ticks."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from rtctl.identify.collected import FORGIVEN, Collected, UnsteadyError
from rtctl.identify.late_ticks import LATE_SHARE, ran_late
from rtctl.identify.measurement_order import Task
from rtctl.identify.motion import LOOK_S, SLIP_RAD, HandSeen, Motion, Order, Steps
from rtctl.identify.places import HERE, Spot, go_on, spots
from rtctl.identify.ripple import Ripple, measured
from rtctl.identify.slip import slip
from rtctl.identify.tick_readings import is_even, is_steady, measure, stops_and_starts
from rtctl.identify.ticks import before_the_guard
from rtctl.identify.travel_guard import SPARE_S
from rtctl.identify.windows import Allowance, per_place, run_up_rad, window_s

SETTLE_S, SETTLE_RAD = 2.0, 0.03
"""Patience of the steady-state test: this time plus the time for this travel."""
UNSTEADY = (
    "the motion never becomes steady there: stick-slip where friction falls with speed, an encoder too "
    "coarse for so slow a motion, backlash or a hard spot"
)
NO_BREAK_AWAY = (
    "the joint does not break away from rest against the ramp: hardly any dry friction, or less than "
    "gravity, a spring, cogging or the zero of the current"
)
LATE = (
    "ticks of the loop, or the host, came late too often while it was measured: leave more of the machine to "
    "this program (rtctl doctor), or run it elsewhere"
)
RIPPLE_PERIODS = 6.0
RIPPLES_PER_TURN_MIN = 4.0


def look_for_ripple(motion: Motion, bias_nm: float) -> Steps[None]:
    """Measure the gear's ripple at the jog speed, over some periods; what cannot be seen counts as none."""
    per_turn = motion.rig.ripple_per_turn
    if per_turn < RIPPLES_PER_TURN_MIN:
        return  # long periods are averaged by the places
    period, jog = motion.rig.turn_rad / per_turn, motion.jog_speed_rad_s()
    # its period is known, its size not: what cannot be measured below counts as none
    motion.ripple = Ripple(period)
    direction = 1 if motion.room_rad(1) >= motion.room_rad(-1) else -1
    # some periods: a ripple differs from one to the next, and one alone would be taken for a line
    reach = min(RIPPLE_PERIODS * period, motion.room_rad(direction) - run_up_rad(motion, jog) - SPARE_S * jog)
    if reach < 2.0 * period:
        return
    yield from settle(motion, direction * jog)
    rows = yield from motion.watch(math.floor(reach / period) * period / jog)
    yield from motion.rest()
    if len(rows := before_the_guard(rows, motion.rig.axis)) * motion.rig.period_s * jog < 2.0 * period:
        return
    torque = rows["motor_torque_nm"][:, motion.rig.axis] - bias_nm
    motion.ripple = measured(rows["position_rad"][:, motion.rig.axis], torque, period)


def settle(motion: Motion, velocity_rad_s: float) -> Steps[bool]:
    """Turn at a speed until torque and speed are steady; False when patience or travel ends first."""
    rig, speed = motion.rig, abs(velocity_rad_s)
    direction = 1 if velocity_rad_s > 0 else -1
    allowed = Allowance.of(motion, speed)
    # 16: two ticks to each of the eight blocks of `is_steady`
    window = max(16, round(allowed.window_s / rig.period_s))
    # a time and a travel: a servo settles over the one, bristles over the other
    patience = round((SETTLE_S + SETTLE_RAD * rig.radian / speed) / rig.period_s) + window
    least = round(allowed.travel_rad / speed / rig.period_s)
    look_s = max(LOOK_S, 0.2 * window * rig.period_s)

    def read(rows: np.ndarray) -> np.ndarray:
        return np.stack([rows["position_rad"][:, rig.axis], rows["motor_torque_nm"][:, rig.axis]])

    seen = read((yield from motion.see(Order(motion.turn(velocity_rad_s).fields, look_s))))
    ticks = seen.shape[1]
    while True:
        seen = seen[:, -window:]
        position, torque = seen
        # a window that is not full yet has the acceleration in it
        full = len(position) == window and ticks >= least
        if full and is_steady(
            position,
            torque,
            rig.period_s,
            velocity_rad_s,
            rig.count_rad,
            change_nm=allowed.change_nm,
            speed_share=allowed.speed_share,
            pairs=allowed.pairs,
        ):
            return True
        if ticks > patience or motion.room_rad(direction) <= motion.stopping_rad(speed):
            return False
        rows = read((yield from motion.see(Order(look_s=look_s))))
        ticks += rows.shape[1]
        seen = np.hstack([seen, rows])


def _lateness(motion: Motion) -> Callable[[], bool]:
    """A function that tells whether host or loop was late since now."""
    late, ticks, began = motion.late, motion.late_ticks, int(motion.last["tick"])

    def told() -> bool:
        slots = int(motion.last["tick"]) - began
        return motion.late > late or motion.late_ticks - ticks > LATE_SHARE * slots

    return told


def _run(motion: Motion, task: Task, got: Collected, spot: Spot, bias_nm: float) -> Steps[None]:
    """One run at one place: move on, become steady, take some measurements while travel is left."""
    settings, rig, speed, direction = motion.settings, motion.rig, task.speed_rad_s, task.direction
    # what a late host or loop spoils from here on is not the joint's doing
    length_s, was_late, thrown = window_s(motion, speed), _lateness(motion), got.late
    left = settings.measurements - len(got.measurements)
    # so many at a place and then on: all of them at one place would be of that place
    wanted = min(left, per_place(motion))
    jog = motion.jog_speed_rad_s()
    travel = motion.high_rad - motion.low_rad
    run = min(run_up_rad(motion, speed) + wanted * length_s * speed + SPARE_S * jog, travel)
    yield from go_on(motion, direction, spot, run, speed)
    steady = yield from settle(motion, direction * speed)
    if was_late() and got.forgiven < FORGIVEN:
        steady = False  # it ran on beyond the place: even places, and phases of a ripple, are what cancels
    before, share = len(got.measurements), Allowance.of(motion, speed).speed_share
    while (
        steady and wanted > 0 and motion.room_rad(direction) > motion.stopping_rad(speed) + length_s * speed
    ):
        # whole periods of the ripple: no tick more
        rows = (yield from motion.watch(length_s))[: round(length_s / rig.period_s)]
        if np.any(rows["program_flags"][:, rig.axis]):
            break  # a guard ended the run while the host was late: the joint brakes
        # the servo's reference went on meanwhile: the next rows may be steady again
        if ran_late(rows, rig.period_s):
            got.late += 1
            continue
        measurement = measure(rows, rig.axis, rig.period_s, rig.inertia_kgm2, bias_nm)
        position, sent = rows["position_rad"][:, rig.axis], rows["torque_applied_nm"][:, rig.axis]
        if not is_even(position, rig.period_s, direction * speed, rig.count_rad, share) or stops_and_starts(
            sent, rig.period_s, speed, rig.inertia_kgm2
        ):
            del got.measurements[before:]  # it had become unsteady already: what grew into this was in them
            break
        got.add(motion.cogging.noted(measurement))
        wanted -= 1
    if len(got.measurements) == before:  # not steady, or only when the travel was over
        got.discard(late=was_late() or got.late > thrown)
        yield from motion.rest()


def collect(motion: Motion, task: Task, bias_nm: float) -> Steps[Collected]:
    """Measure one point: `settings.measurements` measurements spread over the travel.

    Raises
    ------
    UnsteadyError
        The joint never moves steadily at this speed, with no servo; it is at rest.
    DataError
        The joint does not move.
    HandOnRigError
        A hand stays on the rig."""
    settings, rig = motion.settings, motion.rig
    got, pauses, before = Collected(slip_rad=SLIP_RAD * rig.radian), 0, -1
    places, spot, forgiven = spots(motion, task), HERE, 0
    part = slip if task.speed_rad_s == 0 else _run
    try:
        while len(got.measurements) < settings.measurements:
            if got.forgiven == forgiven:  # else a late host spoilt the try: the same place again
                # nothing came of the last place: take all the travel there is
                spot = HERE if len(got.measurements) == before else next(places)
            before, forgiven = len(got.measurements), got.forgiven
            got.starts.append(before)
            try:
                yield from part(motion, task, got, spot, bias_nm)
                if got.hopeless(settings.measurements, last=_no_other_servo(motion, task, got)):
                    yield from _other_servo(motion, task, got)
            except HandSeen:
                # a hand that lets something be measured is not there to stay
                pauses = 0 if len(got.measurements) > before else pauses + 1
                yield from motion.wait_for_free_rig(pauses)
    finally:
        motion.rig = rig  # the servo of the next point is the usual one
    return got


def _no_other_servo(motion: Motion, task: Task, got: Collected) -> bool:
    return task.speed_rad_s == 0 or got.servo + 1 == len(motion.rig.servos)


def _other_servo(motion: Motion, task: Task, got: Collected) -> Steps[None]:
    """Give a speed that does not become steady another chance with the next of `Rig.servos`; then give it up.
    Raises UnsteadyError."""
    if _no_other_servo(motion, task, got):
        yield from motion.rest()
        raise UnsteadyError(
            f"{task.name}: {got.discarded_before + got.discarded} tries gave only {len(got.measurements)} "
            f"of {motion.settings.measurements} measurements; "
            + (LATE if got.late > FORGIVEN else UNSTEADY if task.speed_rad_s else NO_BREAK_AWAY)
        )
    got.begin_anew()
    motion.rig = motion.rig.with_servo(got.servo)
