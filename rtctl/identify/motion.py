"""Motions of one axis as generators: they yield orders, receive ticks, and return what they saw.

A motion never trusts the time between its orders: every program carries its own limits (travel, hand,
slip, duration), which the law guards at its own rate."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from rtctl.control.vocabulary import Program, ProgramFlag, State
from rtctl.errors import DataError, FaultError, HandOnRigError
from rtctl.identify.cogging import Cogging
from rtctl.identify.ended import what_ended
from rtctl.identify.late_ticks import late_ticks
from rtctl.identify.ripple import Ripple
from rtctl.identify.settings import Rig, Settings
from rtctl.identify.travel_guard import SPARE_S, guards_rad
from rtctl.tick import joined

T = TypeVar("T")

# hand, travel and slip are guarded by the law at its own rate: this is only how often the procedure plans
LOOK_S = 0.05
ACCELERATION_RAD_S2 = 10.0
REST_S, REST_PATIENCE_S = 0.3, 5.0
CREEP_RAD_S, CREEP_PATIENCE_S = 0.01, 30.0
"""On the flank of a detent that pulls about as much as friction holds a joint creeps no faster, for
minutes."""
HAND_PATIENCE_S, PAUSES = 60.0, 10
FOLLOW_S, JOG_CROSSING_S = 1.0, 1.2
SLIP_RAD = 0.02
"""Displacement that ends a ramp: well above what a joint creeps (6 mrad on the mock) before it breaks away.

This length and the other constants in rad are multiplied by `Rig.radian`, which is 1 of a rotary axis."""


@dataclass(frozen=True)
class Order:
    """What the procedure wants next: command fields (of its axis) or none, and how much to see before it goes
    on."""

    fields: dict[str, float] = field(default_factory=dict)
    look_s: float = LOOK_S
    arm_in: int | None = None  # the epoch to arm in


Steps = Generator[Order, np.ndarray, T]


class HandSeen(Exception):  # noqa: N818 - an event inside the procedure, not an error of the program
    """The law ended a program because of torque on the force sensor."""


class Motion:
    """Gives orders for one axis and keeps what it last saw.

    Attributes
    ----------
    last
        Newest tick seen.
    epoch
        That of the first tick seen: a stop since then voids what the procedure asks for.
    hand_zero_nm
        Hand torque that counts as none: follows the slow drift of the force sensor.
    hand_seen_nm
        Most that the force sensor had beyond that when it last ended a motion.
    low_rad, high_rad
        Travel to use; set by `choose_travel`.
    ripple, cogging, presliding_rad
        The gear's ripple, the cogging and the presliding length, as far as they were measured already.
        Cogging is taken off what is seen.
    late, late_ticks
        How often a host was later than the planned travel has room for; slots that the loop left out, or
        began late.
    creeps
        A joint that creeps counts as one at rest: there is cogging, or nothing is known of it yet.
    notice
        Receives what a person must know now; an empty text when it is over."""

    def __init__(
        self, rig: Rig, settings: Settings, notice: Callable[[str], None] = lambda _text: None
    ) -> None:
        self.rig, self.settings, self.notice = rig, settings, notice
        self.hand_zero_nm = self.hand_seen_nm = 0.0
        self.low_rad, self.high_rad = rig.position_min_rad, rig.position_max_rad
        self.ripple, self.cogging, self.presliding_rad = Ripple(), Cogging.none(), 0.0
        self.last: Any = None
        self.epoch: int | None = None
        self.creeps, self._count, self.late, self.late_ticks = True, 0, 0, 0

    # -- what is

    @property
    def position_rad(self) -> float:
        """Newest position."""
        return float(self.last["position_rad"][self.rig.axis])

    def choose_travel(self) -> None:
        """Use the travel around the present position: all of it, or one and a half turns either way."""
        here, margin = self.position_rad, self.settings.margin_rad
        self.low_rad = max(self.rig.position_min_rad + margin, here - 1.5 * self.rig.turn_rad)
        self.high_rad = min(self.rig.position_max_rad - margin, here + 1.5 * self.rig.turn_rad)

    def room_rad(self, direction: int) -> float:
        """Travel left in a direction."""
        end = self.high_rad if direction > 0 else self.low_rad
        return (end - self.position_rad) * direction

    @property
    def acceleration_rad_s2(self) -> float:
        """Acceleration of every program."""
        return ACCELERATION_RAD_S2 * self.rig.radian

    def stopping_rad(self, speed_rad_s: float) -> float:
        """Travel needed to stop from a speed, with the host late."""
        return speed_rad_s**2 / (2 * self.acceleration_rad_s2) + SPARE_S * speed_rad_s

    # -- orders

    def order(self, kind: Program, limit_s: float, **values: float) -> dict[str, float]:
        """Fields of a new program; `values` without the prefix `program_`."""
        rig, v = self.rig, values.get("velocity_rad_s", 0.0)
        travel = self.low_rad, self.high_rad
        low_rad, high_rad = guards_rad(rig, travel, self.position_rad, self.settings.margin_rad, v)
        self._count += 1
        fields = {
            "count": self._count,
            "kind": int(kind),
            "limit_ticks": round(limit_s / rig.period_s),
            "acceleration_rad_s2": self.acceleration_rad_s2,
            "stiffness_nm_rad": rig.stiffness_nm_rad,
            "damping_nms_rad": rig.damping_nms_rad,
            "alpha": rig.period_s / (rig.period_s + rig.filter_s),
            "torque_max_nm": rig.servo_max_nm,
            **dict.fromkeys(("velocity_rad_s", "ramp_nm_s", "fast_nm"), 0.0),
            "slip_rad": SLIP_RAD * rig.radian,
            "min_rad": low_rad,
            "max_rad": high_rad,
            "hand_nm": rig.hand_limit_nm,
            "hand_zero_nm": self.hand_zero_nm,
            **values,
        }
        return {f"program_{name}": float(value) for name, value in fields.items()}

    def see(self, order: Order) -> Steps[np.ndarray]:
        """Give an order and return the ticks that followed.

        Raises
        ------
        FaultError
            The rig is not ACTIVE any more.
        HandSeen
            The program was ended by the force sensor."""
        rows = yield from self.see_any(order)
        if int(self.last["state"]) != State.ACTIVE:
            raise FaultError(f"the motion was ended by {what_ended(rows, self.rig)}")
        if int(self.last["program_flags"][self.rig.axis]) & ProgramFlag.HAND:
            self.hand_seen_nm = float(self._hand_nm(rows).max())
            raise HandSeen
        return self.cogging.taken_off(rows, self.rig.axis)

    def _hand_nm(self, rows: np.ndarray) -> np.ndarray:
        """Torque of these ticks that the force sensor has not at rest, N m, without its sign."""
        torque: np.ndarray = np.abs(rows["hand_torque_nm"][:, self.rig.axis] - self.hand_zero_nm)
        return torque

    def see_any(self, order: Order) -> Steps[np.ndarray]:
        """As `see`, in any state and whatever the flags."""
        rows = yield order
        while len(rows) == 0:  # a host that was quicker than the loop
            rows = yield Order(look_s=order.look_s)
        self.late_ticks += late_ticks(rows, self.last, self.rig.period_s)
        self.last = rows[-1]
        self.late += len(rows) * self.rig.period_s > order.look_s + SPARE_S
        # the first: a stop since then voids all that is asked for
        self.epoch = int(rows["epoch"][0]) if self.epoch is None else self.epoch
        return rows

    def watch(self, seconds: float, order: Order | None = None) -> Steps[np.ndarray]:
        """Give an order (or none) and return all ticks of the next `seconds`."""
        parts = [(yield from self.see(order or Order(look_s=seconds)))]
        # by rows: a host that hands over few of them must not make a window short
        wanted = max(1, round(seconds / self.rig.period_s))
        while sum(map(len, parts)) < wanted:
            missing = wanted - sum(map(len, parts))
            parts.append((yield from self.see(Order(look_s=missing * self.rig.period_s))))
        return joined(parts)

    # -- motions

    def turn(self, velocity_rad_s: float, limit_s: float = 3600.0) -> Order:
        """Order to turn at a speed."""
        return Order(self.order(Program.SERVO, limit_s, velocity_rad_s=velocity_rad_s))

    def rest(self) -> Steps[None]:
        """Come to rest with the motor off: stop by the servo, then brake until nothing moves."""
        speed = abs(float(self.last["velocity_rad_s"][self.rig.axis]))
        stop_s = speed / self.acceleration_rad_s2
        if stop_s > self.rig.period_s:  # BRAKE alone would let a quick joint run out of its travel
            yield from self.watch(stop_s, Order(self.order(Program.SERVO, stop_s + 1.0), stop_s))
        rows = yield from self.watch(REST_S, Order(self.order(Program.BRAKE, 3600.0), REST_S))
        waited = REST_S
        # counts: an encoder flickers at rest
        still_rad = 4 * self.rig.count_rad + (CREEP_RAD_S * REST_S * self.rig.radian if self.creeps else 0.0)
        while np.ptp(rows["position_rad"][:, self.rig.axis]) > still_rad:
            if waited > (CREEP_PATIENCE_S if self.creeps else REST_PATIENCE_S):
                raise FaultError(
                    "the joint does not come to rest with the motor off: something else moves it "
                    "(gravity, a spring); friction cannot be identified on it"
                )
            rows = yield from self.watch(REST_S)
            waited += REST_S

    def wait_for_free_rig(self, pauses: int = 0) -> Steps[None]:
        """Brake until the force sensor has been quiet for a second.

        Parameters
        ----------
        pauses
            How often the rig was waited for before, and the hand came back: a hand that only drags is quiet
            while the joint rests.

        Raises
        ------
        HandOnRigError
            The force sensor is not quiet within `HAND_PATIENCE_S`, or after `PAUSES` pauses."""
        self.notice("hand on the rig: take it off")
        quiet_s = waited_s = 0.0
        most_nm = self.hand_seen_nm
        order = Order(self.order(Program.BRAKE, 3600.0))
        while quiet_s < 1.0:
            rows = yield from self.see(order)
            order = Order()
            seconds = len(rows) * self.rig.period_s
            torque = self._hand_nm(rows)
            most_nm = max(most_nm, float(torque.max()))
            # anew after each touch: a hand that pauses has not left
            quiet_s = quiet_s + seconds if np.all(torque <= self.rig.hand_limit_nm) else 0.0
            waited_s += seconds
            if (waited_s > HAND_PATIENCE_S and quiet_s == 0.0) or pauses >= PAUSES:
                raise HandOnRigError(
                    f"torque on the force sensor (up to {most_nm:.3g} N m, limit "
                    f"{self.rig.hand_limit_nm:g}) after {waited_s:.0f} s and {pauses} pauses: nobody may "
                    "touch the rig while its friction is identified. Take the hand off (or raise "
                    "--hand-limit) and continue with --resume"
                )
        self.notice("")

    def advance(self, distance_rad: float, speed_rad_s: float) -> Steps[None]:
        """Turn by about `distance_rad` (signed) at a speed, and stay in motion: what follows decides.

        Ends early at the end of the travel. Raises DataError when the joint does not follow though the servo
        had time to give all its torque."""
        direction = 1 if distance_rad > 0 else -1
        goal = self.position_rad + distance_rad
        # a soft servo pulls with all its torque only after its reference has run ahead by so much
        patience_s = FOLLOW_S + (2.0 * abs(distance_rad) + self.rig.wind_up_rad) / speed_rad_s
        order: Order | None = self.turn(direction * speed_rad_s)
        while (goal - self.position_rad) * direction > 0:
            if self.room_rad(direction) <= self.stopping_rad(speed_rad_s):
                break
            look_s = abs(goal - self.position_rad) / speed_rad_s
            look_s = min(max(look_s, self.rig.period_s), LOOK_S)  # so as not to see the goal too late
            rows = yield from self.see(Order(order.fields if order else {}, look_s))
            beyond = int(self.last["program_flags"][self.rig.axis]) & ProgramFlag.TRAVEL
            # a host that was late: the joint went out over the end still as this was asked, and was stopped
            # there; the way back is open
            order = self.turn(direction * speed_rad_s) if beyond else None
            # of a late host's ticks none counts in which the joint stood there, with no servo to pull it
            flags = rows["program_flags"][:, self.rig.axis].astype(np.int64)
            ran = int(np.count_nonzero((flags & int(ProgramFlag.TRAVEL)) == 0))
            patience_s -= max(ran, 1) * self.rig.period_s
            if patience_s < 0 and (goal - self.position_rad) * direction > 0:
                raise DataError(
                    f"the joint does not follow: at {self.position_rad:.4g} rad it should have passed "
                    f"{goal:.4g}, with up to {self.rig.servo_max_nm:g} N m (90 % of torque_limit_nm); "
                    "free the joint, or correct the torque constant, the sign or the limit in the rig file"
                )

    def jog_speed_rad_s(self) -> float:
        """Speed of moves between measurements: short travels are crossed slower."""
        travel = self.high_rad - self.low_rad
        most = min(0.5 * self.rig.radian, self.settings.speed_max_rad_s)
        return (
            min(most, max(0.05 * self.rig.radian, travel / JOG_CROSSING_S)) if math.isfinite(travel) else most
        )
