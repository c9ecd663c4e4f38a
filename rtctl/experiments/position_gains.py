"""Gains of the position controllers of an experiment: those of the rig's inertia, as slow as its joint asks
for."""

from __future__ import annotations

import math

import numpy as np

from hw.motion import own_size
from rtctl.check.speed_servo import UNSOUND, slowed_until_quiet
from rtctl.control.velocity import lowpass_alpha
from rtctl.errors import ConfigError
from rtctl.experiments.order import Order
from rtctl.experiments.position_loop import GAINS
from rtctl.rig_file.axis_tables import AxisTable
from rtctl.rig_file.config import LoadedConfig

KP_PER_INERTIA, ZETA = 830.0, 1.0
"""Position gain k_p = 830 J (29 rad/s), damping ratio of the closed loop."""

# 17 times the 4.6 Hz of the loop: the low-pass takes atan(4.6/80) = 3.3 degrees of its phase
VELOCITY_HZ = 80.0
ERROR_RAD = 1e-3
"""Error at which a standing reference gets the friction in full, where the rig file gives no
`friction.stop_rad`."""
# a model may say 5 % more than there is (1/.95) before its help drives the joint
FRICTION_GAIN = 0.95
# what is left of an error dies away at this rate, to e^-2.4 in the 1.5 s of a step; Routh allows k_d/J = 58
INTEGRAL_PER_S = 1.6
"""Integral gain over position gain, 1/s."""


def _proportional(axis: AxisTable, slower: float, T: float) -> tuple[float, float, float]:
    """k_d, k_p and the low-pass of the velocity per tick, of a loop that is so many times as slow."""
    kp = KP_PER_INERTIA * axis.inertia_kgm2 / slower**2
    # the joint's own damping is there already
    # never below 0: a joint that damps more than that needs no derivative
    kd = max(2 * ZETA * math.sqrt(kp * axis.inertia_kgm2) - axis.viscous_nms_rad, 0.0)
    return kd, kp, lowpass_alpha(VELOCITY_HZ / slower, T)


def slower_of(loaded: LoadedConfig) -> float:
    """How many times as slow the controllers must be not to ring on the joint of axis 0, elastic and late as
    it is (docs/theory.md 9.1). Raises ConfigError where none is slow enough."""
    axis, T = loaded.config.axis[0], loaded.config.period_s

    def gains(slower: float) -> tuple[float, float, float]:
        kd, kp, alpha = _proportional(axis, slower, T)
        return kd, kp, T / alpha - T

    slower = slowed_until_quiet(loaded, 0, gains)
    if slower is None:
        raise ConfigError(f"{loaded.path}: axis {axis.name}: no position controller {UNSOUND}")
    return slower


def gains_of(order: Order, controller: str) -> np.ndarray:
    """Gains of PD or PID for the rig's inertia, joint and encoder."""
    # one set for all models: what differs between two runs is the model alone
    axis, g = order.loaded.config.axis[0], np.zeros(1, GAINS)
    inertia, T = axis.inertia_kgm2, order.loaded.config.period_s
    slower = slower_of(order.loaded)
    kd, kp, alpha = _proportional(axis, slower, T)
    g["kp_nm_rad"], g["kd_nms_rad"], g["alpha"] = kp, kd, alpha
    g["ki_nm_rad_s"] = INTEGRAL_PER_S / slower * kp if controller == "PID" else 0.0
    # above the break-away of the shipped rig, .35 of 2 N m: less could not end a stick
    g["integral_max_nm"] = 0.2 * axis.torque_limit_nm
    g["inertia_kgm2"], g["friction_gain"] = inertia, FRICTION_GAIN
    g["error_rad"] = axis.friction.stop_rad or own_size("error_rad", ERROR_RAD, axis.motion)
    return g
