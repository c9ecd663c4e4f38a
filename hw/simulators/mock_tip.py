"""The weight of what is mounted on the simulated force sensor, as the joints turn it.

Written apart from the law's own (`rtctl.control.wrench`): by the matrix of the whole rotation."""

from __future__ import annotations

import math

import numpy as np

from hw.simulators.jit import compiled


@compiled
def weigh(s: np.record, p: np.record) -> None:
    """Write `tip_weight_n`, N in sensor axes: every joint, in the rig's order from the base on, turns the
    sensor."""
    x, y, z = p.gravity_m_s2[0], p.gravity_m_s2[1], p.gravity_m_s2[2]
    for axis in range(len(s.position_rad)):
        a, b, c = p.axis_direction[axis, 0], p.axis_direction[axis, 1], p.axis_direction[axis, 2]
        # the other way: what the sensor sees of the world turns against it
        half = -0.5 * s.position_rad[axis]
        # by a quaternion, apart from the law's formula: a common mistake would agree with itself
        w, n = math.cos(half), math.sin(half)  # quaternion of the turn
        i, j, k = n * a, n * b, n * c
        r11, r12, r13 = 1 - 2 * (j * j + k * k), 2 * (i * j - w * k), 2 * (i * k + w * j)
        r21, r22, r23 = 2 * (i * j + w * k), 1 - 2 * (i * i + k * k), 2 * (j * k - w * i)
        r31, r32, r33 = 2 * (i * k - w * j), 2 * (j * k + w * i), 1 - 2 * (i * i + j * j)
        x, y, z = (
            r11 * x + r12 * y + r13 * z,
            r21 * x + r22 * y + r23 * z,
            r31 * x + r32 * y + r33 * z,
        )
    s.tip_weight_n[0], s.tip_weight_n[1], s.tip_weight_n[2] = p.tip_kg * x, p.tip_kg * y, p.tip_kg * z
