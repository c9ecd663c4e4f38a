"""The table of an axis in a rig file, and those inside it: keys with type, bounds, default and meaning.

Those of sensors and friction are in `sensor_tables` and `friction_tables`, of the rig in `rig_tables`.

Every number has both bounds here, where it is read; unknown keys, NaN, infinities and strings in place of
numbers are refused."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, create_model, model_validator

from hw.motion import of_coordinate
from hw.outside import whole
from rtctl.control.environments.kind import Parameter
from rtctl.control.environments.table import PARAMETERS, KindName, meaning
from rtctl.rig_file.admittance_table import REQUIRED, AdmittanceTable
from rtctl.rig_file.fields import Name, Table, Vector, number
from rtctl.rig_file.friction_tables import ForceFeedbackTable, FrictionTable
from rtctl.rig_file.sensor_tables import ForceTable, TemperatureTable, VelocityTable


class CouplingTable(Table):
    """[axis.coupling]"""

    stiffness_nm_rad: float = number(0, 1e6, "k_c: spring of the virtual coupling", default=0.0)
    damping_nms_rad: float = number(0, 1e4, "b_c: its damper", default=0.0)
    # 20: later torques the law does not remember (`control.take_back.LATE_MOST`)
    delay_ticks: float = number(
        0,
        20,
        "ticks from a sample to its torque at the motor, whole or not; `rtctl check` takes what the "
        "devices declare or what was measured where that is more",
        default=0.0,
    )


OVERSHOOT_UNTOLD = 0.05
"""What surely passes the test pulse, so a coupling is proved for it (decision 0176)."""


class DriveTable(Table):
    """[axis.drive]: what lies between the torque sent and the link; what a device declares counts where it is
    worse"""

    current_loop_hz: float = number(
        0, 1e5, "bandwidth of the current loop, a first-order lag; 0: ideal, else at least 10", default=0.0
    )
    current_overshoot: float = number(
        0,
        0.6,
        "by what share the current exceeds a step; 0: surely of first order (`rtctl probe --pulses` tells)",
        default=OVERSHOOT_UNTOLD,
    )
    current_gain_error: float = number(
        0.02, 0.9, "how far the measured current may be off what was sent, as a share of it", default=0.3
    )
    current_offset_share: float = number(
        0.005, 1, "and how far beside that, as torque, share of torque_limit_nm", default=0.1
    )
    motor_share: float = number(
        0,
        1,
        "share of the guaranteed damping and dry friction on the side of motor and encoder; below 1 the "
        "joint is elastic, and the rest, beyond its spring, is the hand's to cancel",
        default=1.0,
    )
    joint_damping_nms_rad: float = number(0, 1e3, "damping of an elastic joint, 0 with play", default=0.0)
    resonance_hz: float = number(
        0,
        1e4,
        "lowest resonance of gear and link, where it is known and no device declares it; 0: not known, 20 "
        "to 100 Hz are reckoned with (docs/theory.md 6.5)",
        default=0.0,
    )
    encoder: Literal["motor", "link"] = Field(
        "motor", description="side of an elastic joint that the encoder turns with; rigid: motor"
    )

    @model_validator(mode="after")
    def _bandwidth(self) -> DriveTable:
        # at 10 Hz the lag is 16 ms already
        if 0 < self.current_loop_hz < 10:
            raise ValueError(f"current_loop_hz {self.current_loop_hz}: 0 for an ideal one, else at least 10")
        return self


class MeasuredTable(Table):
    """[axis.measured]: what was measured on this rig; `rtctl check` takes it where it is worse than what is
    declared"""

    delay_ticks: float = number(0, 20, "delay from a sample to its torque", default=0.0)
    jitter_ticks: float = number(0, 20, "how much shorter it is at times", default=0.0)
    sample_ticks: int = number(1, 20, "ticks between two fresh samples, at worst", default=1)
    current_loop_hz: float = number(0, 1e5, "bandwidth of the current loop; 0: not measured", default=0.0)


def _of_environment(parameter: Parameter) -> tuple[object, Any]:
    """Type and field of a parameter, by the table of environments."""
    text = meaning(parameter)
    if parameter.sign:
        return Annotated[Literal[-1, 1], BeforeValidator(whole)], Field(parameter.default, description=text)
    return float, number(parameter.low, parameter.high, text, default=parameter.default)


if TYPE_CHECKING:  # a table made by a table of environments is nothing to a type checker

    class EnvironmentTable(Table):
        """What is read by name."""

        kind: str = "free"
        stiffness_nm_rad: float = 0.0
        center_rad: float = 0.0

else:
    EnvironmentTable = create_model(
        "EnvironmentTable",
        __base__=Table,
        __module__=__name__,
        __doc__="[axis.environment]: the environment at start; a client may change it later within these "
        "bounds.",
        kind=(KindName, Field("free", description="remote: a renderer moves the proxy (docs/theory.md 3.1)")),
        **{one.name: _of_environment(one) for one in PARAMETERS},
    )


class AxisTable(Table):
    """[[axis]]"""

    name: Name = Field(description="name of the axis in telemetry, tables and errors")
    motion: Literal["rotary", "linear"] = Field(
        "rotary",
        description="linear: the axis slides; its keys end with the units of m and N (docs/linear-axis.md)",
    )
    lead_m: float = number(
        0,
        10,
        "of a linear axis with a screw or pinion: travel per turn, which encoder_counts_per_rev and "
        "gear_ratio are then of; 0: none, counts are of a metre and torque_constant_nm_a is in N/A",
        default=0.0,
    )
    inertia_kgm2: float = number(1e-9, 1e3, "J: inertia at the link, motor and gear included")
    viscous_nms_rad: float = number(
        0, 1e4, "b: guaranteed viscous damping, amplifier as in use, of both sides of an elastic joint"
    )
    encoder_counts_per_rev: float = number(1, 1e9, "counts per turn of the link")
    gear_ratio: float = number(1e-3, 1e4, "motor turns per link turn", default=1.0)
    gear_efficiency: float = number(0.01, 1, "gearbox efficiency", default=1.0)
    torque_constant_nm_a: float = number(1e-6, 1e3, "k_t of the motor")
    lever_m: tuple[float, float, float] = Field(
        strict=False,
        description="joint torque = lever . tip force in sensor axes; each within -10 to 10, not all 0",
    )
    axis_direction: Vector = Field(
        (0.0, 0.0, 0.0),
        strict=False,
        description="unit vector of the joint's axis in sensor axes, at position 0; for moments and "
        "carried_by",
    )
    torque_limit_nm: float = number(1e-6, 1e4, "largest torque ever sent, at the link")
    torque_continuous_nm: float = number(
        0, 1e4, "largest mean |torque| over 250 ms; 0: as torque_limit_nm", default=0.0
    )
    arming_share: float = number(
        0, 0.05, "torque of the arming test, share of the limit; 0: no test", default=0.05
    )
    torque_rate_nm_s: float = number(1e-3, 1e7, "largest slope of the torque sent")
    velocity_limit_rad_s: float = number(1e-3, 1e4, "v_max: above it the torque may only brake")
    position_min_rad: float = number(-1e6, 1e6, "lower end of travel", default=-1e3)
    position_max_rad: float = number(-1e6, 1e6, "upper end of travel", default=1e3)
    current_limit_a: float = number(1e-3, 1e4, "range of the current sensor", default=100.0)
    dry_friction_nm: float = number(
        0,
        1e3,
        "dry friction the joint surely has where no model tells; against the encoder's steps",
        default=0.0,
    )
    display: Literal["impedance", "admittance"] = Field(
        "impedance",
        description="impedance: motion is measured, torque is sent; admittance: force is measured, motion "
        "follows it (a stiff gearbox with a good force sensor)",
    )
    display_change: bool = Field(
        False,
        description="true: a client may change the display while it runs; both are proved, and need "
        "their tables",
    )
    velocity: VelocityTable = VelocityTable()
    force: ForceTable = ForceTable()
    temperature: TemperatureTable = TemperatureTable()
    coupling: CouplingTable = CouplingTable()
    admittance: AdmittanceTable = AdmittanceTable()
    drive: DriveTable = DriveTable()
    measured: MeasuredTable = MeasuredTable()
    environment: EnvironmentTable = EnvironmentTable()
    friction: FrictionTable = FrictionTable()
    force_feedback: ForceFeedbackTable = ForceFeedbackTable()

    @property
    def displays(self) -> tuple[str, ...]:
        """The display that the axis begins with, and the one that it may be changed to."""
        other = "admittance" if self.display == "impedance" else "impedance"
        return (self.display, other) if self.display_change else (self.display,)

    def may_show(self, display: str) -> bool:
        """True for a display that the axis begins with or may be changed to."""
        return display in self.displays

    @property
    def motor_ratio(self) -> float:
        """Turns of the motor per turn of the link; of a linear axis with a screw rad of the motor per m."""
        return self.gear_ratio * of_coordinate(self.motion, self.lead_m)[0]

    @property
    def counts_of_turn(self) -> float:
        """Encoder counts of 2 pi rad; of a linear axis of 2 pi m."""
        return self.encoder_counts_per_rev * of_coordinate(self.motion, self.lead_m)[1]

    @model_validator(mode="after")
    def _slides(self) -> AxisTable:
        if self.lead_m and self.motion != "linear":
            why = 'only an axis with motion = "linear" has a lead; set it, or leave lead_m out'
            raise ValueError(f"lead_m {self.lead_m}: {why}")
        return self

    @model_validator(mode="after")
    def _pairs(self) -> AxisTable:
        # equal ends, too: every place would be beyond one of them
        if self.position_min_rad >= self.position_max_rad:
            raise ValueError(
                f"position_min_rad {self.position_min_rad} must be below position_max_rad "
                f"{self.position_max_rad}"
            )
        if self.torque_continuous_nm > self.torque_limit_nm:
            raise ValueError(
                f"torque_continuous_nm {self.torque_continuous_nm} must not exceed torque_limit_nm "
                f"{self.torque_limit_nm}"
            )
        if self.velocity.device_tolerance_rad_s >= self.velocity_limit_rad_s:
            raise ValueError(
                f"velocity.device_tolerance_rad_s {self.velocity.device_tolerance_rad_s} must be below "
                f"velocity_limit_rad_s {self.velocity_limit_rad_s}: a joint that moves would pass for one "
                "at rest"
            )
        if self.velocity.device == "use" and self.friction.policy == "sign":
            raise ValueError(
                'friction.policy "sign" has no width around rest, where velocity.device = "use" would '
                'follow the noise of the device: take another policy, or device = "check"'
            )
        if any(abs(x) > 10 for x in self.lever_m) or not any((*self.lever_m, *self.axis_direction)):
            raise ValueError(f"lever_m {self.lever_m}: needs a component other than 0, each within -10..10 m")
        return self

    @model_validator(mode="after")
    def _admittance(self) -> AxisTable:
        if not self.may_show("admittance"):
            return self
        asked = "display_change = true" if self.display == "impedance" else 'display = "admittance"'
        for key in REQUIRED:
            value = getattr(self.admittance, key)
            if not value > 0:
                msg = f"admittance.{key} {value}: {asked} needs it above 0; give it in [axis.admittance]"
                raise ValueError(msg)
        for least, most in (("mass_kgm2", "mass_max_kgm2"), ("damping_nms_rad", "damping_max_nms_rad")):
            low, high = getattr(self.admittance, least), getattr(self.admittance, most)
            if 0 < high < low:  # 0: not to be changed
                msg = f"admittance.{most} {high} is below {least} {low}: raise it, or 0 for no change"
                raise ValueError(msg)
        if self.display_change and not self.coupling.stiffness_nm_rad > 0:
            raise ValueError(
                "display_change = true needs coupling.stiffness_nm_rad above 0: an impedance is felt "
                "through it"
            )
        if self.force_feedback.gain > 0:
            raise ValueError(
                f'force_feedback.gain {self.force_feedback.gain}: display = "admittance" is force feedback '
                "already; "
                "set gain = 0"
            )
        return self

    @model_validator(mode="after")
    def _direction(self) -> AxisTable:
        if not any(self.axis_direction):
            return self
        length = math.hypot(*self.axis_direction)
        if not 0.99 <= length <= 1.01:  # as it is typed from a drawing; the law makes it one of length 1
            raise ValueError(
                f"axis_direction {self.axis_direction} is {length:.3g} long: give a unit vector, such as "
                "[0, 0, 1]"
            )
        along = sum(u * x for u, x in zip(self.axis_direction, self.lever_m, strict=True))
        if abs(along) > 0.02 * math.hypot(*self.lever_m):  # a percent of angle is a measured one's error
            raise ValueError(
                f"axis_direction {self.axis_direction}, lever_m {self.lever_m}: a lever is axis x arm, so "
                "it is perpendicular to the axis; one of the two is wrong"
            )
        return self
