"""What the force sensor shows when nothing is touched, measured before anything moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtctl.errors import FaultError, HandOnRigError
from rtctl.identify.motion import Motion, Order, Steps
from rtctl.identify.ticks import mean_c
from rtctl.tick import joined


@dataclass(frozen=True)
class Bias:
    """What the sensors show with the motor off and nobody there. `time_s`: when it began, loop's clock."""

    motor_torque_nm: float
    motor_torque_std_nm: float
    current_a: float
    force_n: tuple[float, float, float]
    force_std_n: tuple[float, float, float]
    temperature_c: float | None
    time_s: float


def read_bias(motion: Motion) -> Steps[Bias]:
    """Sensor means with the motor off. Raises HandOnRigError when the force is not at rest meanwhile."""
    # with the motor off: a current that holds a joint would be in the zero of its torque
    rig, parts, seconds = motion.rig, list[np.ndarray](), 0.0
    while seconds < motion.settings.bias_s:
        rows = yield from motion.see_any(Order())
        # a sample that is held counts one draw of the noise several times
        rows = rows[(rows["enabled"] == 0) & (rows["sample_age_ticks"] == 0)]
        parts.append(rows)
        seconds += max(len(rows), 1) * rig.period_s  # an end even where nothing comes
    rows = joined(parts)
    # one for each block below
    if len(rows) < 8:
        raise FaultError("no fresh samples while the motor was off; check the device (rtctl monitor)")
    torque = rows["hand_torque_raw_nm"][:, rig.axis]
    # means: the sensor's noise is no hand
    blocks = torque[: len(torque) // 8 * 8].reshape(8, -1).mean(axis=1)
    if float(np.ptp(blocks)) > rig.hand_limit_nm:
        raise HandOnRigError(
            f"the hand torque moves by {float(np.ptp(blocks)):.3f} N m with the motor off, more than "
            f"{rig.hand_limit_nm:g}: take the hand off the rig and start again"
        )
    motor, force = rows["motor_torque_nm"][:, rig.axis], rows["force_n"]
    mean, std = force.mean(axis=0), force.std(axis=0)
    return Bias(
        motor_torque_nm=float(motor.mean()),
        motor_torque_std_nm=float(motor.std()),
        current_a=float(rows["current_a"][:, rig.axis].mean()),
        force_n=(float(mean[0]), float(mean[1]), float(mean[2])),
        force_std_n=(float(std[0]), float(std[1]), float(std[2])),
        temperature_c=mean_c(rows["temperature_c"][:, rig.axis]),
        time_s=1e-9 * int(rows["time_ns"][0]),
    )
