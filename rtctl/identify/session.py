"""The whole identification as one procedure: bias, arming, warm-up, points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Protocol

import numpy as np

from rtctl.control.vocabulary import State, state_and_cause
from rtctl.errors import DataError, FaultError, HandOnRigError
from rtctl.friction.guarantee import assumed_rad
from rtctl.friction.presliding import presliding
from rtctl.identify.bias import Bias, read_bias
from rtctl.identify.collected import Collected, UnsteadyError
from rtctl.identify.ended import first_fault, what_ended
from rtctl.identify.measurement_order import Known, Task, remaining
from rtctl.identify.motion import HandSeen, Motion, Order, Steps
from rtctl.identify.place_rows import Row
from rtctl.identify.points import collect, look_for_ripple
from rtctl.identify.settings import Rig, Settings
from rtctl.identify.slip import FAST_SHARE, RISE_S
from rtctl.identify.sweep import look_for_cogging, sweep
from rtctl.identify.tick_readings import Measurement
from rtctl.identify.ticks import mean_c
from rtctl.identify.windows import fastest_rad_s, run_up_rad, steady_s, window_s
from rtctl.rounded import down

ARM_PATIENCE_S = 30.0
HOPELESS = 8
"""After so many points were given up and no speed was measured at all, the highest speed is tried, and
without it the identification ends."""
ZERO_LIMITS = 5.0
"""The force sensor may drift by this many hand limits; then it is no drift any more."""

Progress = Callable[[float, float, str], None]
"""Receives expected seconds done and in all, and what is being done."""


@dataclass(frozen=True)
class Point:
    """One friction point: mean over `count` measurements. Torque has the sign of the motion it opposes."""

    name: str
    use: str
    direction: int
    target_rad_s: float
    velocity_rad_s: float
    friction_torque_nm: float
    std_nm: float
    count: int
    discarded: int
    late: int
    """Tries and measurements thrown away, and repeated, because host or loop was late."""
    acceleration_rms_rad_s2: float
    hand_torque_nm: float
    force_n: tuple[float, float, float]
    temperature_c: float | None
    position_rad: float
    """Mean over the measurements."""
    time_s: float
    """Middle between the first and the last measurement, s since the session began."""
    weakest_place_nm: float
    """Mean at the place where the friction was least, signed like `friction_torque_nm`."""
    presliding_rad: float | None = None
    """Break-away: presliding length, see `rtctl.friction.presliding`; None elsewhere, or when it cannot be
    told."""
    presliding_spread_rad: float | None = None
    presliding_ramps: int | None = None


class Store(Protocol):
    """Where points go as soon as they are complete."""

    def has(self, task: Task) -> bool:
        """True when the point is there already (a resumed identification)."""

    def begin(self, bias: Bias) -> None:
        """A session on the rig has begun; the ticks so far are those of its bias."""

    def warmed_up(self) -> None:
        """The warm-up is over: the ticks since the bias are its own."""

    def add(self, point: Point, measurements: Sequence[Measurement]) -> None:
        """Keep a point and what it is the mean of."""

    def skip(self, task: Task, why: str) -> None:
        """A point could not be measured; the others go on."""

    def known(self) -> Sequence[Known]:
        """Points there already."""

    def lacks_sweep(self) -> bool:
        """True until a slow two-way sweep is kept."""

    def swept(self, rows: Sequence[Row]) -> None:
        """Keep a slow two-way sweep."""


def expected_s(motion: Motion, task: Task) -> float:
    """Rough time one point takes on the rig, s; for the progress bar only."""
    settings = motion.settings
    turn_s = motion.rig.turn_rad / motion.jog_speed_rad_s()
    if task.speed_rad_s == 0:
        return turn_s + settings.measurements * (0.5 + (1.0 - FAST_SHARE) * RISE_S)
    settle_s = 1.5 * steady_s(motion, task.speed_rad_s) + 0.3
    return turn_s + settings.spots * settle_s + settings.measurements * window_s(motion, task.speed_rad_s)


def identify(
    rig: Rig, settings: Settings, store: Store, progress: Progress, notice: Callable[[str], None]
) -> Steps[None]:
    """Run a whole identification.

    Raises
    ------
    DataError, FaultError, HandOnRigError
        As the motions; what was complete is in the store."""
    # of this session: what was given up is tried again by the next one
    motion, tried = Motion(rig, settings, notice), set[str]()

    def is_over(task: Task) -> bool:
        return store.has(task) or task.name in tried

    todo = remaining(settings, is_over, store.known())
    sweeps = settings.sweep_rad_s > 0 and store.lacks_sweep()
    if not (todo or sweeps):
        return
    progress(0.0, 1.0, "sensor bias")
    bias = yield from read_bias(motion)
    store.begin(bias)
    progress(0.0, 1.0, "arming")
    yield from arm(motion)
    # only now: before it is armed the joint may be moved by hand
    motion.choose_travel()
    _require_room(motion)
    total_s = settings.warm_up_s + sum(expected_s(motion, task) for task in todo)
    progress(0.0, total_s, "warm-up")
    yield from warm_up(motion)
    yield from look_for_cogging(motion)
    yield from look_for_ripple(motion, bias.motor_torque_nm)
    store.warmed_up()
    done_s = settings.warm_up_s
    while todo:
        task = todo.pop(0)
        progress(done_s, total_s, task.name)
        # measured or given up: `remaining` is not to ask for it again
        tried.add(task.name)
        # the longest known: dry friction settles over some of it
        motion.presliding_rad = max((one.presliding_rad or 0.0 for one in store.known()), default=0.0)
        try:
            got = yield from collect(motion, task, bias.motor_torque_nm)
            point = summarise(task, got, bias.time_s, motion.rig.motion)
            store.add(point, got.measurements)
            _follow_zero(motion, point)
        except UnsteadyError as why:
            store.skip(task, str(why))
            notice(f"left out: {why}")
            todo = _quick_ones_first(todo, store, len(tried), settings.speed_max_rad_s)
        done_s += expected_s(motion, task)
        # what was measured may ask for slower speeds: a peak goes on below the lowest
        if not todo:
            todo = remaining(settings, is_over, store.known())
            total_s = done_s + sum(expected_s(motion, task) for task in todo)
    if sweeps:
        progress(done_s, total_s, f"slow turn each way at {settings.sweep_rad_s:g} rad/s")
        store.swept((yield from sweep(motion, settings.sweep_rad_s, bias.motor_torque_nm)))
    progress(done_s, total_s, "done")
    yield from motion.rest()


def _quick_ones_first(todo: list[Task], store: Store, tried: int, top_rad_s: float) -> list[Task]:
    """What is left to do, after many points in vain the quickest first: a coarse encoder spoils the slow ones
    alone, and chance may put many of these first.

    Raises
    ------
    DataError
        Many points were tried, those at the highest speed too, and not one speed became steady."""
    if tried < HOPELESS or any(one.speed_rad_s > 0 for one in store.known()):
        return todo
    if not any(task.speed_rad_s >= top_rad_s for task in todo):
        raise DataError(
            f"none of {tried} points became steady: check the gearbox for backlash, the encoder's "
            "resolution and the unit of its counts, the inertia in the rig file, which the speed servo is "
            "made from, and whether cogging or a ripple is as strong as the friction (--ripple-per-turn: "
            "its periods in a turn, of a motor without a gear its pole pairs or slots)"
        )
    return sorted(todo, key=lambda task: -task.speed_rad_s)


def summarise(task: Task, got: Collected, began_s: float, motion: str) -> Point:
    """Mean, standard deviation and count of a point's measurements; `began_s` is when its session began,
    `motion` the axis' ("rotary", "linear")."""
    rows = [asdict(measurement) for measurement in got.measurements]
    column = {name: np.array([row[name] for row in rows], dtype=float) for name in rows[0]}
    torque, acceleration = column["torque_nm"], column["acceleration_rad_s2"]
    force = column["force_n"].mean(axis=0)
    bent = presliding(got.ramps, assumed_rad(motion))
    return Point(
        name=task.name,
        use=task.use,
        direction=task.direction,
        target_rad_s=task.direction * task.speed_rad_s,
        velocity_rad_s=float(column["velocity_rad_s"].mean()),
        friction_torque_nm=float(torque.mean()),
        # 0 and not NaN: JSON has none; the count says that it is of one
        std_nm=float(torque.std(ddof=1)) if len(torque) > 1 else 0.0,
        count=len(torque),
        discarded=got.discarded,
        late=got.late,
        acceleration_rms_rad_s2=float(np.sqrt(np.mean(acceleration**2))),
        hand_torque_nm=float(column["hand_torque_nm"].mean()),
        force_n=(float(force[0]), float(force[1]), float(force[2])),
        temperature_c=mean_c(column["temperature_c"]),
        position_rad=float(column["position_rad"].mean()),
        # the middle: drift over the time of a point is then in its mean
        time_s=0.5 * float(column["time_s"].min() + column["time_s"].max()) - began_s,
        weakest_place_nm=got.weakest_nm,
        presliding_rad=bent.length_rad if bent else None,
        presliding_spread_rad=bent.spread_rad if bent else None,
        presliding_ramps=bent.ramps if bent else None,
    )


def arm(motion: Motion) -> Steps[None]:
    """Bring the rig to ACTIVE with full authority. Raises FaultError when it does not get there."""
    waited_s = 0.0
    while True:
        # asked for until it begins: while it tares and ramps up it is on its way already
        idle = int(motion.last["state"]) in (State.INIT, State.IDLE)
        rows = yield from motion.see_any(Order(look_s=0.2, arm_in=motion.epoch if idle else None))
        if int(motion.last["state"]) in (State.FAULT, State.ESTOP, State.LOCKOUT):
            raise FaultError(
                f"the rig went to {state_and_cause(motion.last)} while it armed: "
                f"{first_fault(int(motion.last['fault_first']))[1]}; remove the cause "
                "(rtctl events, rtctl doctor) and start again"
            )
        if int(motion.last["epoch"]) != motion.epoch:
            raise FaultError(f"the rig was stopped while it armed by {what_ended(rows, motion.rig)}")
        if int(motion.last["state"]) == State.ACTIVE and float(motion.last["authority"]) >= 1.0:
            return
        waited_s += len(rows) * motion.rig.period_s
        if waited_s > ARM_PATIENCE_S:
            raise FaultError(
                f"not armed after {ARM_PATIENCE_S:g} s: state {state_and_cause(motion.last)}; "
                f"the rig must stand still, untouched"
            )


def warm_up(motion: Motion) -> Steps[None]:
    """Turn to and fro for `warm_up_s`: cold grease would read as friction."""
    rig, spent = motion.rig, 0.0
    direction = 1 if motion.room_rad(1) >= motion.room_rad(-1) else -1
    speed = motion.jog_speed_rad_s()
    began, pauses = int(motion.last["tick"]), 0
    while spent < motion.settings.warm_up_s:
        try:
            left_rad = speed * (motion.settings.warm_up_s - spent)
            # not less than a tenth of a radian: a shorter stroke only bends what it should warm
            reach = min(motion.room_rad(direction), rig.turn_rad, max(left_rad, 0.1 * rig.radian))
            yield from motion.advance(direction * reach, speed)
            yield from motion.rest()
        except HandSeen:
            pauses += 1
            yield from motion.wait_for_free_rig(pauses)
        direction = -direction
        spent = (int(motion.last["tick"]) - began) * rig.period_s


def _require_room(motion: Motion) -> None:
    settings, travel = motion.settings, motion.high_rad - motion.low_rad
    speed = settings.speed_max_rad_s
    if not (motion.room_rad(1) > 0 and motion.room_rad(-1) > 0):
        raise DataError(
            f"the joint stands at {motion.position_rad:.4g} rad, outside its travel less the margin "
            f"({motion.low_rad:.4g} to {motion.high_rad:.4g}); move it towards the middle"
        )
    if run_up_rad(motion, speed) + 0.04 * speed > travel:
        raise DataError(
            f"a travel of {travel:.4g} rad is too short for {speed:g} rad/s; "
            f"give --speed-max {down(0.98 * fastest_rad_s(motion))} or less"
        )


def _follow_zero(motion: Motion, point: Point) -> None:
    """Take the slow drift of the force sensor out of the hand guard. Raises HandOnRigError when it is too
    much."""
    motion.hand_zero_nm = point.hand_torque_nm
    # followed without a bound, a person who leans on the rig slowly would become its zero
    limit = ZERO_LIMITS * motion.rig.hand_limit_nm
    if not abs(motion.hand_zero_nm) <= limit:
        raise HandOnRigError(
            f"the force sensor has moved by {motion.hand_zero_nm:.3f} N m since it was tared, more than "
            f"{limit:g}: something leans on the rig, or the sensor drifts; remove it and continue with "
            "--resume"
        )
