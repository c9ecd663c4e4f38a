"""What can be said in a rig file about a simulated joint beyond the plain one: a table per effect. Host side
only."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from hw.option_tables import Table, number
from hw.simulators.mock_effects import POINTS, WAVES

Seconds = Annotated[float, Field(ge=0, le=1e9)]
Celsius = Annotated[float, Field(ge=-40, le=200)]
Factor = Annotated[float, Field(ge=0.05, le=20)]
Order = Annotated[float, Field(ge=0.01, le=1e5)]
Phase = Annotated[float, Field(ge=-100, le=100)]
WaveShare = Annotated[float, Field(ge=-0.9, le=0.9)]
Torque = Annotated[float, Field(ge=-1e3, le=1e3)]
FrictionWave = Annotated[tuple[WaveShare, Order, Phase], Field(strict=False)]
RippleWave = Annotated[tuple[Torque, Order, Phase], Field(strict=False)]
DriftPoint = Annotated[tuple[Seconds, Factor, Factor], Field(strict=False)]
WarmPoint = Annotated[tuple[Seconds, Celsius], Field(strict=False)]


class ElasticOptions(Table):
    """[device.options.axis.elastic]: two masses. The hand and the force sensor are on the link's."""

    stiffness_nm_rad: float = number(0.1, 1e7, "of the joint, at the link", 200.0)
    damping_nms_rad: float = number(0, 1e3, "of the joint", 0.005)
    link_inertia_share: float = number(0.001, 0.999, "of inertia_kgm2; the rest is the motor's", 0.5)
    link_viscous_share: float = number(0, 1, "of friction.viscous_nms_rad; the rest damps the motor", 0.0)
    link_dry_share: float = number(0, 1, "of the dry friction; the rest is in motor and gear", 0.0)
    encoder: Literal["motor", "link"] = Field("motor", description="side that the encoder turns with")


class CurrentLoopOptions(Table):
    """[device.options.axis.current_loop]: the real current follows the wanted one as a first-order
    low-pass."""

    bandwidth_hz: float = number(0, 1e5, "where it falls by 3 dB; 0: see time_constant_s", 0.0)
    time_constant_s: float = number(0, 0.1, "instead of the bandwidth", 0.0)

    @model_validator(mode="after")
    def _one(self) -> CurrentLoopOptions:
        # they are one number, 1 / (2 pi f): two of them would contradict each other
        if (self.bandwidth_hz > 0) == (self.time_constant_s > 0):
            raise ValueError("current_loop: give bandwidth_hz or time_constant_s, one of them, above 0")
        # slower by .16 s and more than what is asked of it: no current loop, but a number in kHz
        if 0 < self.bandwidth_hz < 1:
            raise ValueError(f"bandwidth_hz {self.bandwidth_hz}: must be at least 1")
        return self


class WavesOptions(Table):
    """[device.options.axis.waves]: dry friction and torque over position, several orders of each."""

    friction: tuple[FrictionWave, ...] = Field(
        (),
        max_length=WAVES,
        strict=False,
        description="[share of the dry friction, per turn, phase rad] each",
    )
    ripple: tuple[RippleWave, ...] = Field(
        (),
        max_length=WAVES,
        strict=False,
        description="[N m at the link, per turn of the link, phase rad] each",
    )


class LoadOptions(Table):
    """[device.options.axis.load]: what the torque through the gear adds to the friction (`mock_load`)."""

    outside: float = number(0, 0.95, "load_friction_external: share added to F_c", 0.0)
    motor: float = number(0, 0.95, "load_friction_motor", 0.0)
    outside_peak: float = number(0, 0.95, "load_friction_external_stribeck: share added to the peak", 0.0)
    motor_peak: float = number(0, 0.95, "load_friction_motor_stribeck", 0.0)
    outside_square_nm: float = number(0, 10, "load_friction_external_quad, 1 / (N m)", 0.0)
    motor_square_nm: float = number(0, 10, "load_friction_motor_quad, 1 / (N m)", 0.0)


class DriftOptions(Table):
    """[device.options.axis.drift]: friction that changes in time and with the motor's temperature."""

    points: tuple[DriftPoint, ...] = Field(
        (),
        max_length=POINTS,
        strict=False,
        description="[s, factor of dry, of viscous friction]; linear between",
    )
    temperature: tuple[WarmPoint, ...] = Field(
        (), max_length=POINTS, strict=False, description="[s, C] of the motor, as its sensor shows it"
    )
    dry_per_c: float = number(-0.1, 0.1, "change of the dry friction's factor per C", 0.0)
    viscous_per_c: float = number(-0.1, 0.1, "change of the viscous friction's factor per C", 0.0)
    reference_c: float = number(-40, 200, "temperature at which both are 1", 25.0)

    @model_validator(mode="after")
    def _in_order(self) -> DriftOptions:
        for name, table in (("points", self.points), ("temperature", self.temperature)):
            times = [row[0] for row in table]
            # `mock_drift.between` divides by the time between two points
            if any(after <= before for before, after in pairwise(times)):
                raise ValueError(f"{name}: times must rise, not {times}")
        return self


class TimingOptions(Table):
    """[device.options.timing]: a slow device."""

    sample_every_ticks: int = number(1, 16, "a fresh sample only so often; else the last one", 1)
    transport_delay_ticks: float = number(0, 16, "until a current acts, any fraction", 0.0)
