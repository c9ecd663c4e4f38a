"""Tables of a rig file: what lies between the torque sent and the link, as declared and as measured."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from rtctl.rig_file.fields import Table, number


class DriveTable(Table):
    """[axis.drive]: what lies between the torque sent and the link; what a device declares counts where it is
    worse"""

    current_loop_hz: float = number(
        0, 1e5, "bandwidth of the current loop, a first-order lag; 0: ideal, else at least 10", default=0.0
    )
    # .35: more was compared with no first-order loop (`control.proofs.overshoot`)
    current_loop_overshoot: float = number(
        0,
        0.35,
        "of a loop of second order: how far it overshoots a step, as a share of it; 0: none, as of first "
        "order. It is judged as a loop that is later and stronger (docs/theory.md 2.19)",
        default=0.0,
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
    joint_damping_nms_rad: float = number(0, 1e3, "damping of an elastic joint itself", default=0.0)
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
            msg = f"current_loop_hz {self.current_loop_hz}: 0 for an ideal one, else at least 10"
            raise ValueError(msg)
        if self.current_loop_overshoot > 0 and not self.current_loop_hz > 0:
            msg = (
                f"current_loop_overshoot {self.current_loop_overshoot}: of a loop of which bandwidth? give "
                "current_loop_hz"
            )
            raise ValueError(msg)
        return self


class MeasuredTable(Table):
    """[axis.measured]: what was measured on this rig; `rtctl check` takes it where it is worse than what is
    declared"""

    delay_ticks: float = number(0, 20, "delay from a sample to its torque", default=0.0)
    jitter_ticks: float = number(0, 20, "how much shorter it is at times", default=0.0)
    sample_ticks: int = number(1, 20, "ticks between two fresh samples, at worst", default=1)
    current_loop_hz: float = number(0, 1e5, "bandwidth of the current loop; 0: not measured", default=0.0)
