"""Tables of a rig file: what an axis measures, and what the force sensor is."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field, model_validator

from rtctl.rig_file.fields import Name, Table, Vector, number


class VelocityTable(Table):
    """[axis.velocity]"""

    method: Literal["foaw", "difference", "lowpass", "kalman"] = Field(
        "foaw", description="estimator of the velocity (docs/theory.md 10.1)"
    )
    window: int = number(2, 64, "FOAW: longest window, samples", default=16)
    band_counts: float = number(0.1, 100, "FOAW: tolerated deviation, encoder counts", default=1.0)
    cutoff_hz: float = number(0.1, 5000, "low-pass cut-off or Kalman bandwidth", default=30.0)
    device: Literal["record", "check", "use"] = Field(
        "record",
        description="velocity that a device measures: only recorded; also held against the encoder, a "
        "fault when implausible; also used for the friction feed-forward",
    )
    device_tolerance_rad_s: float = number(
        0, 1e4, "how far it may be off the encoder's; 0: a tenth of velocity_limit_rad_s", default=0.0
    )


class ForceTable(Table):
    """[axis.force]"""

    lowpass_hz: float = number(0, 5000, "low-pass of the hand torque, by the law; 0 is off", default=0.0)
    sensor_lowpass_hz: float = number(
        0,
        1e5,
        "the sensor's own low-pass, in hardware or firmware, as one of first order; 0: not known",
        default=0.0,
    )
    sensor_delay_s: float = number(
        0,
        0.1,
        "how late its force is besides: age of a sample, half the window of a moving average",
        default=0.0,
    )
    tare_s: float = number(0, 10, "time at rest over which the bias is averaged before arming", default=0.3)
    limit_n: float = number(
        0.01, 1e4, "range of the sensor, as its data sheet has it: at this value it is clipped", default=50.0
    )
    resolution_n: float = number(
        0, 1e3, "coarsest step of the sensor, against a frozen one; 0: a hundredth of limit_n", default=0.0
    )
    offset_nm: float = number(
        0,
        1e4,
        "how far the force may be off in power, as torque at the joint; 0: a tenth of torque_limit_nm",
        default=0.0,
    )


class ForceSensorTable(Table):
    """[force_sensor]: what the sensor of the rig, wherever its joints, feels besides three forces"""

    moments: bool = Field(
        False, description="use its moments: joint torque = lever_m . force + axis_direction . moment"
    )
    limit_nm: float = number(1e-4, 1e4, "range of its moments", default=5.0)
    resolution_nm: float = number(
        0, 1e3, "coarsest step of its moments; 0: a hundredth of limit_nm", default=0.0
    )
    carried_by: tuple[Name, ...] = Field(
        (),
        strict=False,
        max_length=32,
        description="joints that turn the sensor, from the base on: levers and weight follow their "
        "positions; empty: they are the same at every position",
    )
    tip_kg: float = number(
        0, 100, "mass of what is mounted on the sensor; 0: its weight is not followed", default=0.0
    )
    tip_center_m: Vector = Field(
        (0.0, 0.0, 0.0), strict=False, description="its centre of mass from the sensor's origin, sensor axes"
    )
    gravity_m_s2: Vector = Field(
        (0.0, 0.0, 0.0), strict=False, description="at position 0 of all joints, sensor axes: down, 9.81 long"
    )
    off_axis_n: float = number(
        0, 1e4, "most tared force across the joints, beside all levers; 0: not watched", default=0.0
    )
    off_axis_nm: float = number(
        0, 1e4, "most tared moment across the joints, beside all axes; 0: not watched", default=0.0
    )

    @model_validator(mode="after")
    def _fits(self) -> ForceSensorTable:
        # twice would turn the sensor by its angle twice
        if len(set(self.carried_by)) != len(self.carried_by):
            raise ValueError(f"carried_by {list(self.carried_by)} names a joint twice")
        length = math.hypot(*self.gravity_m_s2)
        # 9810 would be mm/s2
        if self.tip_kg > 0 and not 1 <= length <= 30:
            raise ValueError(
                f"tip_kg {self.tip_kg}: gravity_m_s2 {self.gravity_m_s2} must say where down is, 1 to 30 "
                "m/s2 long (9.81 on earth)"
            )
        # refused, not ignored: a mass that was given, and then does nothing, would be taken for compensated
        if self.tip_kg > 0 and not self.carried_by:
            raise ValueError(
                f"tip_kg {self.tip_kg}: name the joints that turn the sensor in carried_by; a weight that "
                "does not turn is in the tare"
            )
        if self.off_axis_nm > 0 and not self.moments:
            raise ValueError(f"off_axis_nm {self.off_axis_nm}: the moments are not used; set moments = true")
        return self


class TemperatureTable(Table):
    """[axis.temperature]"""

    sensor: bool = Field(False, description="the motor has one; if it falls silent the torque is ramped down")
    warn_c: float = number(-40, 300, "from here on the torque limit falls", default=70.0)
    trip_c: float = number(-40, 300, "here it is zero, and the rig stops", default=90.0)

    @model_validator(mode="after")
    def _order(self) -> TemperatureTable:
        # the limit falls from one to the other: over nothing it would be a switch
        if self.trip_c < self.warn_c + 1:
            raise ValueError(f"trip_c {self.trip_c} must be at least 1 above warn_c {self.warn_c}")
        return self
