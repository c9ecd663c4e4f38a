"""What can be said about the simulated rig in a rig file: `[device.options]`. Host side only.

The defaults are the nominal joint of docs/theory.md 1.3, with perfect sensors but for their
resolution; noise, bias and unevenness are switched on in the rig file."""

from __future__ import annotations

from typing import Annotated, Literal, TypeVar

from pydantic import Field, field_validator, model_validator

from hw.channels import READING
from hw.fault_options import Faults
from hw.option_tables import Table, number
from hw.simulators.mock_effect_options import (
    CurrentLoopOptions,
    DriftOptions,
    ElasticOptions,
    LoadOptions,
    Seconds,
    TimingOptions,
    WavesOptions,
)
from hw.simulators.mock_effects import ELEMENTS
from hw.simulators.mock_force_filter import FORCE_LINE
from hw.simulators.mock_records import DELAY_LINE, GRIPS, SINES
from hw.simulators.mock_sensors import SENSORS, measured

T = TypeVar("T")

MODULATION_MAX = 0.9
"""Most that all waves of the dry friction over position may add up to: some friction is left everywhere."""

Force = Annotated[float, Field(ge=-1e3, le=1e3)]
Share = Annotated[float, Field(ge=-2, le=2)]
Angle = Annotated[float, Field(ge=-100, le=100)]
Frequency = Annotated[float, Field(gt=0, le=100)]
Vector = Annotated[tuple[Force, Force, Force], Field(strict=False)]
Row = Annotated[tuple[Share, Share, Share], Field(strict=False)]
Matrix = Annotated[tuple[Row, Row, Row], Field(strict=False)]
Interval = Annotated[tuple[Seconds, Seconds], Field(strict=False)]
Sine = Annotated[tuple[Angle, Frequency], Field(strict=False)]


class FrictionOptions(Table):
    """[device.options.axis.friction]: the true friction of one joint, link side."""

    model: Literal["lugre", "elasto_plastic", "gms"] = Field(
        default="lugre",
        description="elasto_plastic does not creep under vibration below break-away; "
        "gms: Maxwell-slip elements",
    )
    elements: int = number(2, ELEMENTS, "gms: how many", 8)
    coulomb_nm: float = number(1e-6, 1e3, "F_c: Coulomb friction", 0.25)
    breakaway_nm: float = number(1e-6, 1e3, "F_s: break-away torque", 0.35)
    stribeck_rad_s: float = number(1e-6, 1e2, "v_s: Stribeck speed", 0.1)
    stribeck_exponent: float = number(0.5, 4, "delta: 2 is Gaussian", 2.0)
    second_share: float = number(0, 1, "share of the peak that is gone at second_rad_s instead", 0.0)
    second_rad_s: float = number(1e-6, 1e2, "the second speed", 0.4)
    viscous_nms_rad: float = number(0, 1e3, "b_v: viscous friction", 0.05)
    thinning_nms_rad: float = number(0, 1e3, "viscous friction besides, that thins out with speed", 0.0)
    thinning_rad_s: float = number(1e-6, 1e2, "speed at which half of that is left", 0.5)
    bristle_stiffness_nm_rad: float = number(1e-3, 1e7, "sigma0: stiffness of the bristles", 250.0)
    bristle_damping_nms_rad: float = number(0, 1e4, "sigma1: their damping", 1.0)
    elastic_share: float = number(0, 0.99, "elasto_plastic: z_ba / z_ss, purely elastic share", 0.7)
    scale_positive: float = number(0.1, 10, "scale of the whole curve for v >= 0", 1.0)
    scale_negative: float = number(0.1, 10, "scale of the whole curve for v < 0", 1.0)
    modulation_share: float = number(-0.9, 0.9, "amplitude of the dry friction over position", 0.0)
    modulation_period_rad: float = number(1e-3, 100, "its period", 6.283185307179586)

    @model_validator(mode="after")
    def _peak(self) -> FrictionOptions:
        # the peak above Coulomb friction would be negative: a joint that slips away from rest
        if self.breakaway_nm < self.coulomb_nm:
            msg = f"breakaway_nm {self.breakaway_nm} must not be below coulomb_nm {self.coulomb_nm}"
            raise ValueError(msg)
        return self


class AxisOptions(Table):
    """[[device.options.axis]]: motor, gear and sensors of one joint; gearing comes from the rig."""

    inertia_kgm2: float = number(1e-9, 1e3, "true inertia at the link", 0.012)
    # not 1: the rig file believes in a torque constant that the motor does not have
    torque_scale: float = number(0.1, 10, "true torque per ampere over the rig file's", 1.0)
    torque_delay_ticks: int = number(0, 16, "whole periods until a current acts", 0)
    current_max_a: float = number(1e-3, 1e4, "saturation of the amplifier", 20.0)
    current_noise_a: float = number(0, 100, "Hall sensor: standard deviation", 0.0)
    current_bias_a: float = number(-100, 100, "Hall sensor: bias", 0.0)
    current_resolution_a: float = number(0, 100, "Hall sensor: quantum; 0 none", 0.0)
    encoder_rounds: bool = Field(
        default=False, description="false: counts truncate downward, as real ones do"
    )
    encoder_bits: int = number(0, 32, "width of its counter; 0: endless", 0)
    ripple_nm: float = number(0, 1e3, "gearbox vibration: torque ripple at the link", 0.0)
    ripple_order: float = number(0.01, 1e3, "gear-mesh periods per motor turn", 1.0)
    start_position_rad: float = number(-1e3, 1e3, "joint angle at the first tick", 0.0)
    friction: FrictionOptions = FrictionOptions()
    elastic: ElasticOptions | None = Field(default=None, description="none: a rigid joint, one mass")
    current_loop: CurrentLoopOptions | None = Field(
        default=None, description="none: the current follows at once"
    )
    waves: WavesOptions | None = Field(default=None, description="besides ripple_nm and modulation_share")
    load: LoadOptions | None = Field(default=None, description="none: friction knows no load")
    drift: DriftOptions | None = Field(default=None, description="none: friction stays as it is")

    @model_validator(mode="after")
    def _positive_everywhere(self) -> AxisOptions:
        waves = self.waves.friction if self.waves else ()
        # the sum of sizes: at some place waves of unlike orders are all at their least together, or nearly
        total = abs(self.friction.modulation_share) + sum(abs(share) for share, _, _ in waves)
        if total > MODULATION_MAX:
            raise ValueError(
                f"waves.friction with friction.modulation_share adds up to {total:g}; at most "
                f"{MODULATION_MAX}"
            )
        return self

    @field_validator("encoder_bits")
    @classmethod
    def _wide_enough(cls, bits: int) -> int:
        # half a range is what may pass between two reads: with 7 bits 64 counts, 2.5 rad/s of 160,000 a turn
        # at 1 kHz
        if 0 < bits < 8:
            raise ValueError(f"encoder_bits {bits}: must be 0 (endless) or 8 to 32")
        return bits


class HandOptions(Table):
    """[[device.options.hand]]: one joint's hand."""

    kind: Literal["none", "rest", "sine", "sines", "triangle", "push"] = Field(
        default="rest", description="how the hand wants to move; none: nobody holds the joint"
    )
    stiffness_nm_rad: float = number(0, 1e4, "k_h: of the hand, to where it wants to be", 5.0)
    damping_nms_rad: float = number(0, 1e3, "b_h: of the hand", 0.1)
    inertia_kgm2: float = number(0, 1e2, "of the hand, on its side of the force sensor", 0.0)
    # a pull in the first second would be tared away, or taken for a fault of the test pulse
    start_s: float = number(0, 1e9, "rest until then (tare, arming)", 1.0)
    center_rad: float = number(-1e3, 1e3, "middle of the motion; push: start", 0.0)
    amplitude_rad: float = number(-100, 100, "sine, triangle: amplitude; push: depth, signed", 0.3)
    frequency_hz: float = Field(default=0.5, gt=0, le=100, description="sine: frequency")
    speed_rad_s: float = number(1e-4, 1e3, "triangle, push: speed", 0.1)
    hold_s: float = number(0, 1e6, "push: pause at depth", 1.0)
    rest_s: float = number(0, 1e6, "push: pause at the start", 1.0)
    sines: tuple[Sine, ...] = Field(
        default=(), max_length=SINES, strict=False, description="[amplitude rad, Hz] each"
    )
    grips_s: tuple[Interval, ...] = Field(
        default=(),
        max_length=GRIPS,
        strict=False,
        description="[from, to) intervals of holding; none: always",
    )

    @model_validator(mode="after")
    def _consistent(self) -> HandOptions:
        # their period is made of it: of no way there is none
        if self.kind in ("triangle", "push") and abs(self.amplitude_rad) < 1e-4:
            raise ValueError(f"amplitude_rad {self.amplitude_rad}: {self.kind} needs at least 1e-4")
        # it goes to both sides: a sign says nothing, and its phase runs backwards; a push has a side
        if self.kind == "triangle" and self.amplitude_rad < 0:
            raise ValueError(f"amplitude_rad {self.amplitude_rad}: triangle needs a positive one")
        if self.kind == "sines" and not self.sines:
            raise ValueError("sines: kind 'sines' needs at least one [amplitude_rad, frequency_hz]")
        for from_s, to_s in self.grips_s:
            if to_s <= from_s:
                raise ValueError(f"grips_s [{from_s}, {to_s}] ends before it begins")
        return self


class MomentOptions(Table):
    """[device.options.force.moment]: the sensor shows moments about its origin, too."""

    resolution_nm: float = number(0, 10, "quantum; 0 none", 0.0)
    range_nm: float = number(1e-4, 1e4, "saturation", 5.0)
    noise_nm: float = number(0, 10, "standard deviation", 0.0)
    bias_nm: Vector = Field(default=(0.0, 0.0, 0.0), description="bias of each sensor axis")
    contact_m: Vector = Field(
        default=(0.0, 0.0, 0.0),
        description="where the hand holds the tip, from the sensor's origin, sensor axes",
    )


class ForceOptions(Table):
    """[device.options.force]: the three-axis sensor at the tip."""

    resolution_n: float = number(0, 10, "quantum; 0 none", 0.005)
    range_n: float = number(1e-3, 1e5, "saturation", 50.0)
    noise_n: float = number(0, 100, "standard deviation", 0.0)
    bias_n: Vector = Field(default=(0.0, 0.0, 0.0), description="bias of each sensor axis")
    drift_n_sqrt_s: float = number(0, 10, "random walk: standard deviation after one second", 0.0)
    # one matrix for what leaks between the axes and for a sensor that is mounted turned
    crosstalk: Matrix = Field(
        default=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
        description="measured = crosstalk . true force",
    )
    lowpass_hz: float = number(0, 1e5, "its own low-pass, first order; 0: none", 0.0)
    delay_ticks: int = number(0, FORCE_LINE - 1, "whole periods that its samples are old", 0)
    moment: MomentOptions | None = Field(default=None, description="none: a sensor of forces only")
    tip_kg: float = number(0, 100, "mass mounted on the sensor, which every joint turns", 0.0)
    tip_center_m: Vector = Field(
        default=(0.0, 0.0, 0.0), description="its centre of mass from the sensor's origin"
    )
    gravity_m_s2: Vector = Field(default=(0.0, 0.0, 0.0), description="at position 0, sensor axes")


class VelocityOptions(Table):
    """[device.options.velocity]: a velocity sensor at every joint, beside the encoder."""

    lag_s: float = number(0, 1, "time constant of its filter", 0.0)
    noise_rad_s: float = number(0, 100, "standard deviation", 0.0)
    bias_rad_s: float = number(-100, 100, "bias", 0.0)
    scale: float = number(-10, 10, "measured over true velocity", 1.0)
    resolution_rad_s: float = number(0, 100, "quantum; 0 none", 0.0)


class MockOptions(Table):
    """[device.options] of kind mock. `axis` and `hand`: one table for all axes, or one per axis."""

    seed: int = number(0, 2**63 - 1, "of all noise; same seed, same run, bit for bit", 1)
    substeps: int = number(0, 1000, "plant steps per period; 0: as many as 100 us need", 0)
    # as boards have it: a host that dies leaves no torque behind (docs/safety.md)
    time_to_live_ticks: int = number(1, 50, "a current is held this long without a new one", 10)
    temperature_c: float = number(-40, 200, "shown by the motor's sensor", 25.0)
    estop_from_s: float = number(0, 1e9, "emergency stop pressed from here", 0.0)
    estop_to_s: float = number(0, 1e9, "to here, not before; equal: never", 0.0)
    force: ForceOptions = ForceOptions()
    velocity: VelocityOptions | None = Field(default=None, description="none: no velocity sensor")
    timing: TimingOptions = TimingOptions()
    axis: tuple[AxisOptions, ...] = Field(default=(AxisOptions(),), strict=False)
    hand: tuple[HandOptions, ...] = Field(default=(HandOptions(),), strict=False)
    faults: Faults = ()

    @field_validator("axis", "hand")
    @classmethod
    def _some(cls, tables: tuple[T, ...]) -> tuple[T, ...]:
        # as Field(min_length=1) one bad table would be reported as "too short" besides
        if not 1 <= len(tables) <= 8:
            raise ValueError(f"needs 1 to 8 tables, not {len(tables)}")
        return tables

    @model_validator(mode="after")
    def _stop_lasts(self) -> MockOptions:
        # refused: a stop that is scripted and never pressed would prove what it was scripted for
        if self.estop_to_s < self.estop_from_s:
            raise ValueError(
                f"estop_to_s {self.estop_to_s:g} lies before estop_from_s {self.estop_from_s:g}: never "
                "pressed; give a later estop_to_s, or leave both out"
            )
        return self

    @model_validator(mode="after")
    def _delay_fits(self) -> MockOptions:
        for k, axis in enumerate(self.axis):
            # both are places in the one line of currents
            total = axis.torque_delay_ticks + self.timing.transport_delay_ticks
            if total > DELAY_LINE - 1:
                raise ValueError(
                    f"axis[{k}].torque_delay_ticks with timing.transport_delay_ticks is {total:g}; at most "
                    f"{DELAY_LINE - 1}"
                )
        return self

    @model_validator(mode="after")
    def _sensor_for_faults(self) -> MockOptions:
        # refused: the fault of a sensor that is not there would be played, and nothing would happen
        here = measured(self.model_dump())
        for k, fault in enumerate(self.faults):
            if fault.channel not in READING or fault.channel in here:
                continue
            keys = SENSORS.get(fault.channel, ())
            if not keys:
                raise ValueError(f"faults[{k}].channel: the mock rig has no sensor of {fault.channel!r}")
            raise ValueError(
                f"faults[{k}].channel: {fault.channel!r} needs a sensor: add "
                f"[device.options.{'.'.join(keys)}]"
            )
        return self
