"""What an identification is to do, and what it must know of the rig."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from hw.motion import words
from rtctl.check import lateness
from rtctl.check.speed_servo import UNSOUND, slowed_until_quiet
from rtctl.errors import ConfigError
from rtctl.rig_file.axis_tables import AxisTable
from rtctl.rig_file.config import LoadedConfig

TURN_RAD = 2 * math.pi
CHATTER_SHARE = 0.01
"""One encoder count may move the servo's torque by this share of the torque limit."""

SERVO_SHARE = 0.9
"""Share of the torque limit that motions may use."""

VELOCITY_SHARE = 0.8
"""Share of the velocity limit that an identification may drive at."""

SPEED_RANGE = 400.0
"""Highest over lowest speed, unless told otherwise."""

TRAVEL_S = 2.0
"""Time in which the highest speed of a linear axis crosses its travel, unless told otherwise: a rotary one of
4 rad at 2 rad/s."""

RAMP_S = 40.0
"""Time in which the break-away ramp comes to the torque limit, unless told otherwise: .05 N m/s where that is
2 N m."""

MARGIN = 0.05
"""Kept free at both ends of the travel unless told otherwise, in what stands for a radian."""

TOP_RAD_S = 2.0
"""Highest speed of a rotary axis, unless told otherwise or its velocity limit is lower; of a linear axis its
highest speed stands for this one."""

SERVOS = ((1.0, 1.0), (4.0, 1.0), (4.0, 3.0))
"""What is tried in turn where no try becomes steady: the servo's stiffness, and its filter's time, each so
many times.

Where friction falls with speed by g' (below 0), a bristle of stiffness s0 acts on a servo like a spring s0 v
g'/g, which its own must exceed or the joint stick-slips: 48 N m/rad at .01 rad/s on the mock with the
Stribeck speed .01, against 43. But one count of a coarse encoder may be worth half the friction of a light
joint, which then jumps from count to count."""


@dataclass(frozen=True)
class Settings:
    """Options of an identification; every one changes the data, so a resumed one must have the same."""

    axis: int = 0
    speed_min_rad_s: float = 0.005
    speed_max_rad_s: float = TOP_RAD_S
    train_levels: int = 54
    test_levels: int = 28
    measurements: int = 100
    spots: int = 20
    """Places along the travel over which the measurements of a point are spread."""
    window_s: float = 0.1
    """Time one measurement averages over; longer where the joint moves too few counts in it."""
    warm_up_s: float = 30.0
    bias_s: float = 5.0
    ramp_nm_s: float = 0.05
    hand_limit_nm: float = 0.0
    """Torque on the force sensor that means a hand; 0: 2 % of the torque limit."""
    margin_rad: float = MARGIN
    """Kept free at both ends of the travel."""
    seed: int = 1
    lower_levels: int = 4
    """How often the lowest speed may be halved to follow a Stribeck peak below it."""
    ripple_per_turn: float = 0.0
    """Periods of the gear's ripple in one turn of the joint (of the screw, or in a metre without a lead); 0:
    its gear ratio, once per turn of the motor; of a linear motor none."""
    sweep_rad_s: float = 0.0
    """Speed of a slow turn each way at the end, for the conservative part; 0: none."""


@dataclass(frozen=True)
class Rig:
    """Facts of the axis to identify, link side."""

    name: str
    axis: int
    period_s: float
    count_rad: float
    inertia_kgm2: float
    torque_limit_nm: float
    velocity_limit_rad_s: float
    position_min_rad: float
    position_max_rad: float
    hand_limit_nm: float
    ripple_per_turn: float = 1.0
    """Periods of the gear's ripple in `turn_rad`."""
    radian: float = 1.0
    """What stands for a radian in every length, speed and acceleration that is chosen in rad; of a rotary
    axis 1."""
    motion: str = "rotary"
    torque_rate_nm_s: float = math.inf
    """Slope of the gate."""
    late_s: float = 0.0
    """Longest time from a place that is passed to the torque that answers it, as declared."""
    stiffer: float = 1.0
    """The servo's stiffness is so many times what its damping asks for."""
    calmer: float = 1.0
    """The servo's filter is so many times as slow, its damping as small."""

    servos: tuple[tuple[float, float], ...] = SERVOS
    """Those of `SERVOS` that are stable on this joint, each with its filter as slow as that takes."""

    def with_servo(self, number: int) -> Rig:
        """The same rig with another of its servos."""
        stiffer, calmer = self.servos[number]
        return replace(self, stiffer=stiffer, calmer=calmer)

    @property
    def turn_rad(self) -> float:
        """Travel over which places are spread: a turn, or 2 pi of what stands for a radian."""
        return TURN_RAD * self.radian

    @property
    def filter_s(self) -> float:
        """Time constant of the servo's velocity: as short as the encoder's quantum allows.

        Notes
        -----
        With d = J / (4 tau) one count moves the torque by d count / tau = J count / (4 tau^2), which is
        to stay below CHATTER_SHARE of the limit."""
        # a count that moves the torque by more is chatter in what is measured
        quiet = math.sqrt(self.inertia_kgm2 * self.count_rad / (4 * CHATTER_SHARE * self.torque_limit_nm))
        return self.calmer * max(2 * self.period_s, quiet)  # two ticks: quicker it would be no filter

    @property
    def damping_nms_rad(self) -> float:
        """Gain d of the servo: a quarter of what the filter's lag would make oscillate."""
        return self.inertia_kgm2 / (4 * self.filter_s)

    @property
    def stiffness_nm_rad(self) -> float:
        """Gain k of the servo: damping ratio sqrt(3)/2 with d, where it is not made stiffer."""
        # zeta = d/(2 sqrt(k J)) = sqrt(3)/2
        return self.stiffer * self.damping_nms_rad**2 / (3 * self.inertia_kgm2)

    @property
    def servo_max_nm(self) -> float:
        """Most torque of the servo and of a ramp."""
        return SERVO_SHARE * self.torque_limit_nm

    @property
    def wind_up_rad(self) -> float:
        """How far the servo's reference is ahead of a joint that stands still when all its torque is there.

        At a slow loop rate the servo is soft and this is long: .5 rad at 250 Hz on the mock, .04 at 1 kHz."""
        return self.servo_max_nm / self.stiffness_nm_rad


def settings_of(loaded: LoadedConfig, given: Mapping[str, Any]) -> Settings:
    """Settings from the options that were given; what is None takes a default that suits the motion of the
    axis.

    Notes
    -----
    A linear axis has no usual speed: a carriage of a metre and a stage of 10 mm differ by a hundred. Its
    highest speed crosses the travel in `TRAVEL_S`, within the velocity limit, and the other defaults keep the
    proportions that they have to 2 rad/s. A rotary one turns at 2 rad/s as far as its velocity limit lets it.
    The ramp goes by the torque limit: friction of .01 and of 10 N m is met in seconds.

    Raises
    ------
    ConfigError
        No such axis."""
    # None is an option that was not given; 0 was, and stays
    options = {name: value for name, value in given.items() if value is not None}
    axis = _axis(loaded, options.get("axis", 0))
    most = VELOCITY_SHARE * axis.velocity_limit_rad_s
    scaled = {"ramp_nm_s": axis.torque_limit_nm / RAMP_S}
    if axis.motion == "linear":
        travel = axis.position_max_rad - axis.position_min_rad
        # what was given first: margins and slowest speed keep their proportion to it
        top = options.get("speed_max_rad_s") or min(most, travel / TRAVEL_S)
        scaled |= {"margin_rad": (MARGIN / TOP_RAD_S) * top}
    else:
        top = min(TOP_RAD_S, most)
    # before what was given, which goes over it below
    scaled |= {"speed_max_rad_s": top, "speed_min_rad_s": top / SPEED_RANGE}
    return Settings(**{**scaled, **options})


def _axis(loaded: LoadedConfig, number: int) -> AxisTable:
    if not 0 <= number < loaded.config.n_axes:
        raise ConfigError(f"{loaded.path}: axis {number}: the rig has axes 0 to {loaded.config.n_axes - 1}")
    return loaded.config.axis[number]


def _ripple_per_turn(axis: AxisTable, given: float, turn_rad: float) -> float:
    """Periods of the ripple in `turn_rad`; `given` is of a turn of the joint or the screw, without a lead of
    a metre."""
    if axis.motion != "linear":
        return given or axis.motor_ratio
    if axis.lead_m:
        return (given or axis.gear_ratio) * turn_rad / axis.lead_m
    return given * turn_rad


def rig_of(loaded: LoadedConfig, settings: Settings) -> Rig:
    """Facts of the axis `settings.axis` of a rig file.

    Raises
    ------
    ConfigError
        No such axis, a speed above the rig's limit, a travel shorter than its margins, or a joint on which no
        speed servo is stable."""
    config = loaded.config
    axis, low, top = _axis(loaded, settings.axis), settings.speed_min_rad_s, settings.speed_max_rad_s
    if not 0 < low < top <= VELOCITY_SHARE * axis.velocity_limit_rad_s:
        raise ConfigError(
            words(
                f"{loaded.path}: speeds {low:g} to {top:g} rad/s: they must rise from above 0 to at most "
                f"80 % of velocity_limit_rad_s = {axis.velocity_limit_rad_s:g}",
                axis.motion,
            )
        )
    # two margins are kept free, and as much is left to move in at least
    if axis.position_max_rad - axis.position_min_rad <= 4 * settings.margin_rad:
        raise ConfigError(
            words(
                f"{loaded.path}: travel {axis.position_min_rad:g} to {axis.position_max_rad:g} rad is too "
                f"short for a margin of {settings.margin_rad:g} rad at both ends; give --margin a smaller "
                "one",
                axis.motion,
            )
        )
    # as the logs have it: a carriage at its top speed stands for a joint at 2 rad/s
    radian = top / TOP_RAD_S if axis.motion == "linear" else 1.0
    rig = Rig(
        name=config.rig.name,
        axis=settings.axis,
        period_s=config.period_s,
        count_rad=TURN_RAD / axis.counts_of_turn,
        inertia_kgm2=axis.inertia_kgm2,
        torque_limit_nm=axis.torque_limit_nm,
        velocity_limit_rad_s=axis.velocity_limit_rad_s,
        position_min_rad=axis.position_min_rad,
        position_max_rad=axis.position_max_rad,
        ripple_per_turn=_ripple_per_turn(axis, settings.ripple_per_turn, TURN_RAD * radian),
        hand_limit_nm=settings.hand_limit_nm or 0.02 * axis.torque_limit_nm,
        radian=radian,
        motion=axis.motion,
        torque_rate_nm_s=axis.torque_rate_nm_s,
        late_s=lateness.of_axis(loaded, settings.axis).answer_s(config.period_s),
    )
    rig = replace(rig, servos=_stable_servos(loaded, rig))
    return rig.with_servo(0)


def _stable_servos(loaded: LoadedConfig, rig: Rig) -> tuple[tuple[float, float], ...]:
    """`SERVOS` as slow as the joint asks for, where any is stable; ConfigError where the first is none."""

    def slowed(stiffer: float, calmer: float) -> tuple[float, float] | None:
        def gains(factor: float) -> tuple[float, float, float]:
            one = replace(rig, stiffer=stiffer, calmer=calmer * factor)
            return one.damping_nms_rad, one.stiffness_nm_rad, one.filter_s

        factor = slowed_until_quiet(loaded, rig.axis, gains)
        return None if factor is None else (stiffer, calmer * factor)

    found = [slowed(*one) for one in SERVOS]
    if found[0] is None:
        raise ConfigError(f"{loaded.path}: axis {rig.axis}: no speed servo {UNSOUND}, or use identify --log")
    return tuple(one for one in found if one is not None)


def without_feedforward(loaded: LoadedConfig) -> LoadedConfig:
    """The same rig with friction feed-forward off and a free environment: what is measured is friction
    alone."""
    axes = tuple(
        axis.model_copy(
            update={
                # help would be measured as friction that is not there
                "friction": axis.friction.model_copy(update={"policy": "off"}),
                "environment": axis.environment.model_copy(update={"kind": "free"}),
            }
        )
        for axis in loaded.config.axis
    )
    config = loaded.config.model_copy(update={"axis": axes})
    free: LoadedConfig = loaded.model_copy(update={"config": config})
    return free
