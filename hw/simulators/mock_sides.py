"""The two sides of a simulated joint within one step: their friction, their velocities, and what they are
after it.

The motor side has everything while the joint is rigid; an elastic one puts the link side behind a spring and
a damper, with its share of inertia and friction, and the hand on it. The motor side's angle and velocity are
those after the gear.

| symbol | meaning | unit |
|---|---|---|
| v, x | velocity and position of a side | rad/s, rad |
| w | velocity of a step, between those at its ends: x moves by h w | rad/s |
| theta, h | where in a step its torques are taken (`implicit_share`), its length | -, s |"""

from __future__ import annotations

import math

import numpy as np

from hw.simulators.jit import compiled
from hw.simulators.mock_bristles import bristle_gains, direction_scale, plastic_share, sliding_level, viscous
from hw.simulators.mock_elements import element_torque, settle_elements

MOTOR, LINK = 0, 1
"""Rows of `sides`; a rigid joint has the first only."""

# what each side is (B and SIZE: its shares of viscous and dry friction) and where it stands, columns of
# `sides`
X, V, A, J, B, SIZE, Z = 0, 1, 2, 3, 4, 5, 6
# its friction in this step: static curve of both directions, torque offset + slope w, bristle z' = keep z +
# gain w
UP, DOWN, DRAG, OFFSET, SLOPE, KEEP, GAIN, STEEP, SLIP, W = 7, 8, 9, 10, 11, 12, 13, 14, 15, 16
HELD, STOP = 17, 18  # 1 where a bristle is held at break-away, and its deflection there
COLUMNS = 19

_ROUNDS = 30
"""Most rounds of a step's solution; one or two are the rule."""


@compiled
def prepare(
    row: np.ndarray,
    h: float,
    share: float,
    level: tuple[float, float],
    factor: tuple[float, float],
    p: np.record,
    axis: int,
) -> None:
    """Read the static curve for this step, and bring one bristle into the form offset + slope w.

    `level` is what the load adds to Coulomb and peak, `factor` the drift of dry and viscous friction. The
    formulas are those of `hw.simulators.mock_bristles.coupled_step`, with the side's share of everything."""
    # the curve is read where the step takes its torques, by the velocity foreseen
    ahead, size = (1.0 - share) * h, row[SIZE]
    v_mid = row[V] + ahead * row[A]
    g = sliding_level(v_mid, row[X] + ahead * row[V], level[0], level[1], p, axis) * factor[0] * size
    row[UP], row[DOWN] = g * p.friction_scale_positive[axis], g * p.friction_scale_negative[axis]
    row[DRAG] = row[B] * viscous(v_mid, p, axis) * factor[1] * direction_scale(v_mid, p, axis)
    row[OFFSET], row[SLOPE], row[HELD] = 0.0, 0.0, 0.0
    # elements bring their own torque, a side without friction none
    if size <= 0.0 or p.element_count[axis] > 0:
        return
    g, z = row[UP] if v_mid >= 0.0 else row[DOWN], row[Z]
    s0, s1 = p.bristle_stiffness_nm_rad[axis] * size, p.bristle_damping_nms_rad[axis] * size
    steep = plastic_share(z, v_mid, g / s0, p.elastic_share[axis]) * s0 / g
    keep, gain, mean_keep, mean_gain = bristle_gains(steep, v_mid, h, 1.0 / h)
    end = 2.0 * share - 1.0
    row[OFFSET] = (s0 * ((1.0 - end) * mean_keep + end * keep) - s1 / h * (1.0 - keep)) * z
    row[SLOPE] = s0 * ((1.0 - end) * mean_gain + end * gain) + s1 / h * gain
    row[KEEP], row[GAIN], row[STEEP], row[SLIP] = (
        keep,
        gain,
        math.copysign(steep, v_mid),
        steep * abs(v_mid),
    )


@compiled
def _torque(
    row: np.ndarray, torques: np.ndarray, w: float, h: float, end: float, p: np.record, axis: int
) -> tuple[float, float]:
    """Dry friction of one side in a step at velocity `w`, N m, and its derivative by `w`."""
    if p.element_count[axis] > 0:
        return element_torque(w, torques, row[UP], row[DOWN], row[SIZE], h, end, p, axis)
    return row[OFFSET] + row[SLOPE] * w, row[SLOPE]


@compiled
def solve(
    sides: np.ndarray,
    torques: np.ndarray,
    a: tuple[float, float, float],
    b: tuple[float, float],
    h: float,
    end: float,
    p: np.record,
    axis: int,
) -> None:
    """Find w of both sides (`W`): a w + dry friction(w) = b, with `a` = (motor, coupling, link) of a
    symmetric matrix.

    Notes
    -----
    The gradient of a convex function: Newton's step, shortened where it has gone too far along its own
    direction. With one bristle it is linear, and the first step is the solution."""
    w0, w1 = sides[MOTOR, W], sides[LINK, W]
    m0, d0 = _torque(sides[MOTOR], torques[MOTOR], w0, h, end, p, axis)
    m1, d1 = _torque(sides[LINK], torques[LINK], w1, h, end, p, axis)
    r0, r1 = a[0] * w0 + a[1] * w1 + m0 - b[0], a[1] * w0 + a[2] * w1 + m1 - b[1]
    for _ in range(_ROUNDS):
        h0, h1 = a[0] + d0, a[2] + d1
        scale = 1.0 / (h0 * h1 - a[1] * a[1])
        s0, s1 = (a[1] * r1 - h1 * r0) * scale, (a[1] * r0 - h0 * r1) * scale
        downhill, t = r0 * s0 + r1 * s1, 1.0
        for _ in range(_ROUNDS):
            m0, d0 = _torque(sides[MOTOR], torques[MOTOR], w0 + t * s0, h, end, p, axis)
            m1, d1 = _torque(sides[LINK], torques[LINK], w1 + t * s1, h, end, p, axis)
            r0 = a[0] * (w0 + t * s0) + a[1] * (w1 + t * s1) + m0 - b[0]
            r1 = a[1] * (w0 + t * s0) + a[2] * (w1 + t * s1) + m1 - b[1]
            uphill = r0 * s0 + r1 * s1
            if p.element_count[axis] == 0 or not uphill > -0.1 * downhill:
                break
            t *= max(0.1, downhill / (downhill - uphill))
        w0 += t * s0
        w1 += t * s1
        if p.element_count[axis] == 0 or abs(s0) + abs(s1) <= 1e-13 + 1e-11 * (abs(w0) + abs(w1)):
            break
    sides[MOTOR, W], sides[LINK, W] = w0, w1


@compiled
def hold(row: np.ndarray, h: float, share: float, highest: float, p: np.record, axis: int) -> bool:
    """Hold a bristle that the step would stretch beyond break-away (`highest` of the whole joint); True if it
    did."""
    if row[SIZE] <= 0.0 or row[HELD] != 0.0 or p.element_count[axis] > 0:
        return False
    s0, z, end = p.bristle_stiffness_nm_rad[axis], row[Z], 2.0 * share - 1.0
    z_new = row[KEEP] * z + row[GAIN] * row[W]
    if s0 * abs(z_new) <= highest:
        return False
    z_new = math.copysign(highest / s0, z_new)
    spring = s0 * (0.5 * (1.0 - end) * (z + z_new) + end * z_new)
    row[OFFSET] = row[SIZE] * (spring + p.bristle_damping_nms_rad[axis] * (z_new - z) / h)
    row[SLOPE], row[HELD], row[STOP] = 0.0, 1.0, z_new
    return True


@compiled
def settle(row: np.ndarray, torques: np.ndarray, h: float, share: float, p: np.record, axis: int) -> float:
    """Let the step pass on one side; returns its friction at the end, N m."""
    w = row[W]
    # w is the velocity at `share` of the step: the end lies as much further
    v_new = row[V] + (w - row[V]) / share
    row[A], row[V] = (v_new - row[V]) / h, v_new
    row[X] += h * w
    friction = row[DRAG] * v_new
    if row[SIZE] <= 0.0:
        return float(friction)
    if p.element_count[axis] > 0:
        return float(friction) + settle_elements(w, v_new, torques, row[UP], row[DOWN], row[SIZE], h, p, axis)
    s0, s1, z = p.bristle_stiffness_nm_rad[axis], p.bristle_damping_nms_rad[axis], row[Z]
    if row[HELD] != 0.0:
        z_new = row[STOP]
        z_rate = (z_new - z) / h
    else:
        z_new = row[KEEP] * z + row[GAIN] * w
        z_rate = row[KEEP] * (w - row[SLIP] * z + (v_new - w) * (1.0 - row[STEEP] * z))
    row[Z] = z_new
    return float(friction + row[SIZE] * (s0 * z_new + s1 * z_rate))
