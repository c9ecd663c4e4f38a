"""The tables of a rig file: every key with its type, bounds, default and meaning.

Every number has both bounds here, where it is read; unknown keys, NaN, infinities and strings in place of
numbers are refused.
"""

from __future__ import annotations

import ipaddress
import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from hw.outside import whole
from hw.plain_words import NAME_PATTERN


class Table(BaseModel):
    """Base of all tables: strict types, no unknown keys, finite numbers, immutable."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)


def _number(low: float, high: float, text: str, **more: Any) -> Any:  # noqa: ANN401
    return Field(ge=low, le=high, description=text, **more)


Name = Annotated[str, Field(pattern=NAME_PATTERN)]
Component = Annotated[float, Field(ge=-1e3, le=1e3)]
Vector = tuple[Component, Component, Component]


class RigTable(Table):
    """[rig]"""

    name: Name = Field(
        description="rig name: lock file, telemetry, model files and service instance carry it"
    )
    description: str = Field("", max_length=200, description="what the rig is, in words")
    absent: tuple[Literal["current", "force"], ...] = Field(
        (),
        strict=False,
        description="sensors this rig does not have; their channels read 0 and what needs them does nothing",
    )


class LoopTable(Table):
    """[loop]"""

    rate_hz: float = _number(100, 20_000, "control rate", default=1000.0)
    clock: Literal["wall", "virtual"] = Field(
        "wall", description="virtual: as fast as it can, simulated rigs only"
    )
    realtime: Literal["require", "prefer", "waive", "off"] = Field(
        "prefer",
        description="require: refuse to start without real-time rights; prefer: start, but a real rig does not "
        "arm without them; waive: a real rig arms with a quarter of its torque; off: do not even ask, else as waive",
    )
    priority: int = _number(1, 98, "SCHED_FIFO priority", default=80)
    cpu: int = _number(-1, 1023, "core of the loop; -1: the last core of the machine", default=-1)
    ring_s: float = _number(8, 120, "seconds of ticks kept in shared memory", default=8.0)


class VelocityTable(Table):
    """[axis.velocity]"""

    method: Literal["foaw", "difference", "lowpass", "kalman"] = Field(
        "foaw", description="estimator of the velocity (docs/theory.md 10.1)"
    )
    window: int = _number(2, 64, "FOAW: longest window, samples", default=16)
    band_counts: float = _number(0.1, 100, "FOAW: tolerated deviation, encoder counts", default=1.0)
    cutoff_hz: float = _number(0.1, 5000, "low-pass cut-off or Kalman bandwidth", default=30.0)
    device: Literal["record", "check", "use"] = Field(
        "record",
        description="velocity that a device measures: only recorded; also held against the encoder, a fault when "
        "implausible; also used for the friction feed-forward",
    )
    device_tolerance_rad_s: float = _number(
        0, 1e4, "how far it may be off the encoder's; 0: a tenth of velocity_limit_rad_s", default=0.0
    )


class ForceTable(Table):
    """[axis.force]"""

    lowpass_hz: float = _number(0, 5000, "low-pass of the hand torque; 0 is off", default=0.0)
    tare_s: float = _number(0, 10, "time at rest over which the bias is averaged before arming", default=0.3)
    limit_n: float = _number(
        0.01, 1e4, "range of the sensor, as its data sheet has it: at this value it is clipped", default=50.0
    )
    resolution_n: float = _number(
        0, 1e3, "coarsest step of the sensor, against a frozen one; 0: a hundredth of limit_n", default=0.0
    )
    offset_nm: float = _number(
        0,
        1e4,
        "how far the force may be off in power, as torque at the joint; 0: a quarter of torque_limit_nm",
        default=0.0,
    )


class ForceSensorTable(Table):
    """[force_sensor]: what the sensor of the rig, wherever its joints, feels besides three forces"""

    moments: bool = Field(
        False,
        description="use its moments: joint torque = lever_m . force + axis_direction . moment",
    )
    limit_nm: float = _number(1e-4, 1e4, "range of its moments", default=5.0)
    resolution_nm: float = _number(
        0, 1e3, "coarsest step of its moments; 0: a hundredth of limit_nm", default=0.0
    )
    carried_by: tuple[Name, ...] = Field(
        (),
        strict=False,
        max_length=32,
        description="joints that turn the sensor, from the base on: levers and weight follow their positions; "
        "empty: they are the same at every position",
    )
    tip_kg: float = _number(
        0, 100, "mass of what is mounted on the sensor; 0: its weight is not followed", default=0.0
    )
    tip_center_m: Vector = Field(
        (0.0, 0.0, 0.0), strict=False, description="its centre of mass from the sensor's origin, sensor axes"
    )
    gravity_m_s2: Vector = Field(
        (0.0, 0.0, 0.0), strict=False, description="at position 0 of all joints, sensor axes: down, 9.81 long"
    )
    off_axis_n: float = _number(
        0, 1e4, "most tared force across the joints, beside all levers; 0: not watched", default=0.0
    )
    off_axis_nm: float = _number(
        0, 1e4, "most tared moment across the joints, beside all axes; 0: not watched", default=0.0
    )

    @model_validator(mode="after")
    def _fits(self) -> ForceSensorTable:
        if len(set(self.carried_by)) != len(self.carried_by):
            msg = f"carried_by {list(self.carried_by)} names a joint twice"
            raise ValueError(msg)
        length = math.hypot(*self.gravity_m_s2)
        if self.tip_kg > 0 and not 1 <= length <= 30:
            msg = f"tip_kg {self.tip_kg}: gravity_m_s2 {self.gravity_m_s2} must say where down is, 1 to 30 m/s2 long (9.81 on earth)"
            raise ValueError(msg)
        if self.tip_kg > 0 and not self.carried_by:
            msg = f"tip_kg {self.tip_kg}: name the joints that turn the sensor in carried_by; a weight that does not turn is in the tare"
            raise ValueError(msg)
        if self.off_axis_nm > 0 and not self.moments:
            msg = f"off_axis_nm {self.off_axis_nm}: the moments are not used; set moments = true"
            raise ValueError(msg)
        return self


class TemperatureTable(Table):
    """[axis.temperature]"""

    sensor: bool = Field(False, description="the motor has one; if it falls silent the torque is ramped down")
    warn_c: float = _number(-40, 300, "from here on the torque limit falls", default=70.0)
    trip_c: float = _number(-40, 300, "here it is zero, and the rig stops", default=90.0)

    @model_validator(mode="after")
    def _order(self) -> TemperatureTable:
        if self.trip_c < self.warn_c + 1:
            msg = f"trip_c {self.trip_c} must be at least 1 above warn_c {self.warn_c}"
            raise ValueError(msg)
        return self


class CouplingTable(Table):
    """[axis.coupling]"""

    stiffness_nm_rad: float = _number(0, 1e6, "k_c: spring of the virtual coupling", default=0.0)
    damping_nms_rad: float = _number(0, 1e4, "b_c: its damper", default=0.0)
    delay_ticks: float = _number(
        0,
        20,
        "ticks from a sample to its torque at the motor, whole or not; `rtctl check` takes what the devices declare "
        "or what was measured where that is more",
        default=0.0,
    )


class DriveTable(Table):
    """[axis.drive]: what lies between the torque sent and the link; what a device declares counts where it is worse"""

    current_loop_hz: float = _number(
        0, 1e5, "bandwidth of the current loop, a first-order lag; 0: ideal, else at least 10", default=0.0
    )
    current_gain_error: float = _number(
        0.02, 0.9, "how far the measured current may be off what was sent, as a share of it", default=0.3
    )
    current_offset_share: float = _number(
        0.005, 1, "and how far beside that, as torque, share of torque_limit_nm", default=0.1
    )
    motor_share: float = _number(
        0,
        1,
        "share of the guaranteed damping and dry friction on the side of motor and encoder; below 1 the joint is "
        "elastic, and the rest, beyond its spring, is the hand's to cancel",
        default=1.0,
    )
    joint_damping_nms_rad: float = _number(0, 1e3, "damping of an elastic joint itself", default=0.0)
    encoder: Literal["motor", "link"] = Field(
        "motor", description="side of an elastic joint that the encoder turns with; rigid: motor"
    )

    @model_validator(mode="after")
    def _bandwidth(self) -> DriveTable:
        if 0 < self.current_loop_hz < 10:
            msg = f"current_loop_hz {self.current_loop_hz}: 0 for an ideal one, else at least 10"
            raise ValueError(msg)
        return self


class MeasuredTable(Table):
    """[axis.measured]: what was measured on this rig; `rtctl check` takes it where it is worse than what is declared"""

    delay_ticks: float = _number(0, 20, "delay from a sample to its torque", default=0.0)
    jitter_ticks: float = _number(0, 20, "how much shorter it is at times", default=0.0)
    sample_ticks: int = _number(1, 20, "ticks between two fresh samples, at worst", default=1)
    current_loop_hz: float = _number(0, 1e5, "bandwidth of the current loop; 0: not measured", default=0.0)


class EnvironmentTable(Table):
    """[axis.environment]: the environment at start; a client may change it later within these bounds."""

    kind: Literal["free", "spring", "wall", "damper", "detents", "remote"] = Field(
        "free", description="remote: a renderer moves the proxy (docs/theory.md 3.1)"
    )
    stiffness_nm_rad: float = _number(0, 1e6, "spring, wall: k; detents: greatest slope", default=0.0)
    damping_nms_rad: float = _number(0, 1e4, "damper, wall: b", default=0.0)
    center_rad: float = _number(-1e3, 1e3, "rest angle, wall face, or centre of a detent", default=0.0)
    side: Annotated[Literal[-1, 1], BeforeValidator(whole)] = Field(
        1, description="wall: +1 resists motion to larger angles"
    )
    pitch_rad: float = _number(1e-3, 100, "detents: distance", default=0.2)


CAP_SHARE_MAX = 0.3
"""Most of the torque limit that the feed-forward may take."""


class ObserverTable(Table):
    """[axis.friction.observer]: disturbance observer from the force sensor; off while gain is 0, or without a sensor"""

    gain: float = _number(0, 0.98, "share of what the feed-forward leaves that it compensates", default=0.9)
    bandwidth_hz: float = _number(
        0, 200, "of its low-pass; too much rings on a stiff hand; 0: rate_hz/20, at most 20", default=0.0
    )
    deadband_nm: float = _number(
        0, 1e3, "friction left alone: more than the force sensor may be off after its tare", default=0.003
    )

    def bandwidth_at(self, rate_hz: float) -> float:
        """Bandwidth in Hz of a loop of this rate."""
        return self.bandwidth_hz or min(20.0, rate_hz / 20)


class FrictionTable(Table):
    """[axis.friction]"""

    model: str = Field("", max_length=500, description="model file, relative to the rig file; empty: none")
    policy: Literal[
        "off",
        "hybrid",
        "sign",
        "deadband",
        "tanh",
        "dither",
        "intent",
        "stop",
        "stop_gated",
        "observer",
        "lugre",
    ] = Field(
        "hybrid",
        description="what decides the direction of the feed-forward near rest (docs/theory.md 5.6)",
    )
    gain: float = _number(0, 1, "kappa: share of Coulomb and Stribeck friction compensated", default=0.9)
    viscous_gain: float = _number(0, 1, "kappa_v: share of the viscous part compensated", default=0.0)
    cap_share: float = _number(
        0, CAP_SHARE_MAX, "cap of the feed-forward, share of the torque limit", default=CAP_SHARE_MAX
    )
    tanh_rad_s: float = _number(1e-4, 10, "speed scale of tanh", default=0.02)
    blend_rad_s: float = _number(
        1e-4, 10, "hybrid: speed above which motion decides, not intent", default=0.05
    )
    deadband_rad_s: float = _number(0, 10, "deadband policy: slower motion has no direction", default=0.01)
    dither_hz: float = _number(1, 1000, "dither policy: frequency", default=80.0)
    intent_nm: float = _number(
        1e-5, 1e3, "hand torque at which intent saturates; 0.2 F_c is usual", default=0.05
    )
    intent_lowpass_hz: float = _number(
        0,
        5000,
        "low-pass of the hand's torque for the intent: the mass of a hand buzzes without; 0: rate_hz/20, at most 50",
        default=0.0,
    )
    gate_deadband_nm: float = _number(0, 1e3, "hand torque below which the gate stays shut", default=0.002)
    gate_nm: float = _number(
        1e-5, 1e3, "hand torque that opens the gate fully; 0.1 F_c is usual", default=0.03
    )
    gate_lowpass_s: float = _number(0, 1, "time constant of the gate", default=0.01)
    presliding_rad: float = _number(
        0, 1, "F_s / sigma0: motion over which friction is a spring; 0: as the model says", default=0.0
    )
    stop_rad: float = _number(
        0,
        1,
        "hybrid, stop and lugre policies: length over which their direction turns; 0: the presliding length",
        default=0.0,
    )
    drift_nm: float = _number(0, 1e3, "how far friction may have drifted below the model", default=0.0)
    observer: ObserverTable = ObserverTable()

    def intent_lowpass_at(self, rate_hz: float) -> float:
        """Low-pass of the intent in Hz of a loop of this rate."""
        return self.intent_lowpass_hz or min(50.0, rate_hz / 20)


class ForceFeedbackTable(Table):
    """[axis.force_feedback]: off while gain is 0"""

    gain: float = _number(0, 20, "torque per torque the hand feels beyond the virtual force", default=0.0)
    lowpass_hz: float = _number(
        0.1, 5000, "filter of that torque: its lag is negative damping in a stiff grip", default=200.0
    )
    deadband_nm: float = _number(0, 1e3, "hand torque that is not fed back", default=0.002)
    cap_share: float = _number(0, CAP_SHARE_MAX, "its cap, share of the torque limit", default=CAP_SHARE_MAX)
    share: float = _number(
        0,
        0.98,
        "most of what friction and spare damping surely take out, with the feed-forward",
        default=0.95,
    )


class AxisTable(Table):
    """[[axis]]"""

    name: Name = Field(description="name of the axis in telemetry, tables and errors")
    inertia_kgm2: float = _number(1e-9, 1e3, "J: inertia at the link, motor and gear included")
    viscous_nms_rad: float = _number(0, 1e4, "b: guaranteed viscous damping at the link, amplifier as in use")
    encoder_counts_per_rev: float = _number(1, 1e9, "counts per turn of the link")
    gear_ratio: float = _number(1e-3, 1e4, "motor turns per link turn", default=1.0)
    gear_efficiency: float = _number(0.01, 1, "gearbox efficiency", default=1.0)
    torque_constant_nm_a: float = _number(1e-6, 1e3, "k_t of the motor")
    lever_m: tuple[float, float, float] = Field(
        strict=False,
        description="joint torque = lever . tip force in sensor axes; each within -10 to 10, not all 0",
    )
    axis_direction: Vector = Field(
        (0.0, 0.0, 0.0),
        strict=False,
        description="unit vector of the joint's axis in sensor axes, at position 0; for moments and carried_by",
    )
    torque_limit_nm: float = _number(1e-6, 1e4, "largest torque ever sent, at the link")
    torque_continuous_nm: float = _number(
        0, 1e4, "largest mean |torque| over 250 ms; 0: as torque_limit_nm", default=0.0
    )
    arming_share: float = _number(
        0, 0.05, "torque of the arming test, share of the limit; 0: no test", default=0.05
    )
    torque_rate_nm_s: float = _number(1e-3, 1e7, "largest slope of the torque sent")
    velocity_limit_rad_s: float = _number(1e-3, 1e4, "v_max: above it the torque may only brake")
    position_min_rad: float = _number(-1e6, 1e6, "lower end of travel", default=-1e3)
    position_max_rad: float = _number(-1e6, 1e6, "upper end of travel", default=1e3)
    current_limit_a: float = _number(1e-3, 1e4, "range of the current sensor", default=100.0)
    dry_friction_nm: float = _number(
        0,
        1e3,
        "dry friction the joint surely has where no model tells; against the encoder's steps",
        default=0.0,
    )
    velocity: VelocityTable = VelocityTable()
    force: ForceTable = ForceTable()
    temperature: TemperatureTable = TemperatureTable()
    coupling: CouplingTable = CouplingTable()
    drive: DriveTable = DriveTable()
    measured: MeasuredTable = MeasuredTable()
    environment: EnvironmentTable = EnvironmentTable()
    friction: FrictionTable = FrictionTable()
    force_feedback: ForceFeedbackTable = ForceFeedbackTable()

    @model_validator(mode="after")
    def _pairs(self) -> AxisTable:
        if self.position_min_rad >= self.position_max_rad:
            msg = f"position_min_rad {self.position_min_rad} must be below position_max_rad {self.position_max_rad}"
            raise ValueError(msg)
        if self.torque_continuous_nm > self.torque_limit_nm:
            msg = f"torque_continuous_nm {self.torque_continuous_nm} must not exceed torque_limit_nm {self.torque_limit_nm}"
            raise ValueError(msg)
        if self.velocity.device_tolerance_rad_s >= self.velocity_limit_rad_s:
            msg = (
                f"velocity.device_tolerance_rad_s {self.velocity.device_tolerance_rad_s} must be below "
                f"velocity_limit_rad_s {self.velocity_limit_rad_s}: a joint that moves would pass for one at rest"
            )
            raise ValueError(msg)
        if self.velocity.device == "use" and self.friction.policy == "sign":
            msg = (
                'friction.policy "sign" has no width around rest, where velocity.device = "use" would follow the '
                'noise of the device: take another policy, or device = "check"'
            )
            raise ValueError(msg)
        if any(abs(x) > 10 for x in self.lever_m) or not any((*self.lever_m, *self.axis_direction)):
            msg = f"lever_m {self.lever_m}: needs a component other than 0, each within -10..10 m"
            raise ValueError(msg)
        return self

    @model_validator(mode="after")
    def _direction(self) -> AxisTable:
        if not any(self.axis_direction):
            return self
        length = math.hypot(*self.axis_direction)
        if not 0.99 <= length <= 1.01:
            msg = f"axis_direction {self.axis_direction} is {length:.3g} long: give a unit vector, such as [0, 0, 1]"
            raise ValueError(msg)
        along = sum(u * x for u, x in zip(self.axis_direction, self.lever_m, strict=True))
        if abs(along) > 0.02 * math.hypot(*self.lever_m):
            msg = (
                f"axis_direction {self.axis_direction}, lever_m {self.lever_m}: a lever is axis x arm, so it is perpendicular to "
                "the axis; one of the two is wrong"
            )
            raise ValueError(msg)
        return self


class PassivityTable(Table):
    """[passivity]"""

    budget_j: float = _number(1e-6, 100, "deficit of a port before damping is injected", default=0.02)
    bank_j: float = _number(0, 100, "most energy a port may save up", default=0.02)
    renderer_store_j: float = _number(
        0, 10, "most energy a renderer or a change of environment may put in at once", default=0.1
    )
    renderer_power_w: float = _number(
        0, 20, "most power a renderer or changes of environment may put in", default=1.0
    )


class DeviceTable(Table):
    """[[device]]: together the devices provide every channel once and take the command of every axis once."""

    kind: Name = Field(description="backend: mock, playback, or an installed one")
    name: Name | None = Field(None, description="names the device in errors; default: its kind")
    axes: tuple[Name, ...] = Field(
        (), strict=False, description="axes it serves, in its own order; empty: all"
    )
    channels: tuple[str, ...] = Field(
        (), strict=False, description="channels the rig uses of those it has; empty: all"
    )
    rate_hz: float | None = Field(
        None, ge=1, le=100_000, description="rate of a free-running sensor; default: a sample in every cycle"
    )
    max_age_ticks: int | None = Field(
        None,
        ge=0,
        le=10_000,
        description="oldest sample that counts as fresh; default: 0, or loop rate over rate_hz, rounded up",
    )
    budget_us: float | None = Field(
        None, ge=5, le=5000, description="time its reading may take; default: its share of 40 % of the period"
    )
    options: dict[str, Any] = Field(default_factory=dict, description="the backend's own options")


class RecordTable(Table):
    """[record]: every tick of every run into MCAP files; `record = true` for the defaults"""

    folder: str = Field(
        "",
        max_length=500,
        description="relative to the rig file; empty: `recordings` in the rig's state folder",
    )
    file_mb: float = _number(1, 1e6, "a new file begins at this size", default=1000.0)
    file_minutes: float = _number(0.01, 1e5, "and at this age", default=60.0)
    free_mb: float = _number(0, 1e7, "room left on the disk: below it recording pauses", default=200.0)


class ViewTable(Table):
    """[view]: the daemon shows its own page on 127.0.0.1; `view = true` for the defaults"""

    port: int = _number(
        1024, 65_535, "TCP port of the page; each rig of a machine needs its own", default=8650
    )


class TelemetryTable(Table):
    """[telemetry]"""

    state_hz: float | None = _number(
        1,
        1000,
        "rate of the decimated state samples; left out: 100, or one a message if that is more",
        default=None,
    )
    batch_ms: float | None = _number(
        1,
        1000,
        "ticks per message, as time; left out: 8 ticks, at least 2 ms and at most 20 ms",
        default=None,
    )
    plotjuggler: bool = Field(
        False, description="also publish the state samples on 127.0.0.1 without keys, read-only, for viewers"
    )
    plotjuggler_port: int = _number(1024, 65_000, "TCP port of that publication", default=9872)


class GatewayTable(Table):
    """[gateway]: clients on other machines, and of other users. The daemon's own user always reaches it by ipc."""

    bind: str = Field(
        "", max_length=15, description="IPv4 address to listen on, 127.0.0.1 for tunnels; empty: no TCP"
    )
    port: int = _number(
        1024, 65_000, "TCP port of requests; targets and telemetry take the next two", default=9860
    )
    curve_dir: str = Field(
        "", max_length=500, description="folder of keys, relative to the rig file; made by `rtctl keys new`"
    )
    group: str = Field(
        "",
        pattern=r"^([A-Za-z_][A-Za-z0-9_.-]{0,31})?$",
        description="unix group whose members reach the daemon by ipc, as operators; empty: its own user and root only",
    )

    @model_validator(mode="after")
    def _keys_for_tcp(self) -> GatewayTable:
        if self.bind:
            _check_address(self.bind)
        if self.bind and not self.curve_dir:
            msg = f"bind {self.bind}: TCP needs keys; make them with `rtctl keys new` and name their folder as curve_dir"
            raise ValueError(msg)
        if self.curve_dir and not self.bind:
            msg = f"curve_dir {self.curve_dir!r} has no effect without bind; give an address or remove it"
            raise ValueError(msg)
        return self


def _check_address(text: str) -> None:
    try:
        address = ipaddress.IPv4Address(text)
    except ValueError:
        msg = f"bind {text!r}: an IPv4 address of this machine, such as 127.0.0.1, not a name or a wildcard"
        raise ValueError(msg) from None
    if address.is_multicast or address.is_reserved:
        msg = f"bind {text}: no address a machine can have"
        raise ValueError(msg)
