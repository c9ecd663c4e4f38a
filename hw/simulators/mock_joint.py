"""The simulated joint in detail: one or two masses, several friction models, a motor current that lags.

`advance_detailed` takes the place of the plain joint's loop (`mock_plant`) wherever one of the effects in
`mock_effects` is on. Torques within a step as in `mock_sides`; with k and c stiffness and damping of the
joint and x, v the motor side's angle and velocity over the link's, the joint drives the link with k x + c v.
"""

from __future__ import annotations

import math

import numpy as np

from hw.simulators import mock_hand
from hw.simulators.jit import compiled
from hw.simulators.mock_bristles import implicit_share, waves
from hw.simulators.mock_drift import drifted
from hw.simulators.mock_load import load_levels
from hw.simulators.mock_sides import (
    COLUMNS,
    DRAG,
    LINK,
    MOTOR,
    SIZE,
    A,
    B,
    J,
    V,
    W,
    X,
    Z,
    hold,
    prepare,
    settle,
    solve,
)


@compiled
def is_detailed(p: np.record, axis: int) -> bool:
    """Whether the axis has an effect that the plain joint has not."""
    return bool(
        p.element_count[axis] > 0
        or p.joint_stiffness_nm_rad[axis] > 0.0
        or p.current_lag_s[axis] > 0.0
        or p.ripple_wave_count[axis] > 0
        or p.load_kind[axis] > 0
        or p.drift_count[axis] > 0
        or p.warm_count[axis] > 0
    )


@compiled
def _load_sides(
    s: np.record, p: np.record, axis: int, k_h: float, b_h: float, m_h: float, h: float
) -> tuple[np.ndarray, float]:
    """The sides as they stand now, and where in a step their torques are taken."""
    sides = np.zeros((2, COLUMNS))
    stiffness, damping = p.joint_stiffness_nm_rad[axis], p.joint_damping_nms_rad[axis]
    # the trapezoidal rule where that is stable: of second order, and it does not damp by itself
    share = 0.5
    for i in range(2):
        row = sides[i]
        inertia, viscous, size = 1.0, 1.0, 1.0
        if stiffness > 0.0:
            inertia, viscous, size = (
                p.link_inertia_share[axis],
                p.link_viscous_share[axis],
                p.link_dry_share[axis],
            )
            if i == MOTOR:
                inertia, viscous, size = 1.0 - inertia, 1.0 - viscous, 1.0 - size
        elif i == LINK:
            # a side that is not there: its equation must have a solution all the same
            row[J], row[SIZE] = 1.0, 0.0
            continue
        on_hand = i == LINK or stiffness <= 0.0
        row[J] = inertia * p.inertia_kgm2[axis] + (m_h if on_hand else 0.0)
        row[B], row[SIZE] = viscous, size
        row[X], row[V] = s.position_rad[axis], s.velocity_rad_s[axis]
        row[Z] = s.bristle_rad[axis] if i == MOTOR else s.link_bristle_rad[axis]
        wet = viscous * (p.viscous_nms_rad[axis] + p.thinning_nms_rad[axis])
        total_d = wet + size * p.bristle_damping_nms_rad[axis] + damping
        total_k = size * p.bristle_stiffness_nm_rad[axis] + stiffness
        if on_hand:
            total_d, total_k = total_d + b_h, total_k + k_h
        # the more implicit of both: their equations are solved as one
        share = max(share, implicit_share(row[J], total_d, total_k, h))
    if stiffness > 0.0:
        sides[MOTOR, X] += s.joint_twist_rad[axis]
        sides[MOTOR, V] += s.joint_twist_rate_rad_s[axis]
    return sides, share


@compiled
def _store_sides(s: np.record, p: np.record, axis: int, sides: np.ndarray) -> None:
    """Write the sides back; with elements, one bristle's deflection that gives the same torque stands for
    them."""
    elastic = p.joint_stiffness_nm_rad[axis] > 0.0
    outer = sides[LINK] if elastic else sides[MOTOR]
    s.position_rad[axis], s.velocity_rad_s[axis] = outer[X], outer[V]
    if elastic:
        s.joint_twist_rad[axis] = sides[MOTOR, X] - sides[LINK, X]
        s.joint_twist_rate_rad_s[axis] = sides[MOTOR, V] - sides[LINK, V]
    if p.element_count[axis] > 0:
        for i in range(2):
            total = 0.0
            for k in range(p.element_count[axis]):
                total += s.element_nm[axis, i, k]
            # a side without friction has no bristle: 0 over 0 would be NaN for good
            size = max(sides[i, SIZE], 1e-9)
            sides[i, Z] = total / (p.bristle_stiffness_nm_rad[axis] * size)
    s.bristle_rad[axis], s.link_bristle_rad[axis] = sides[MOTOR, Z], sides[LINK, Z]


@compiled
def _substep(
    sides: np.ndarray,
    torques: np.ndarray,
    drive: tuple[float, float, float],
    level: tuple[float, float],
    factor: tuple[float, float],
    h: float,
    share: float,
    p: np.record,
    axis: int,
) -> tuple[float, float]:
    """Advance both sides by `h` under `drive` = (motor torque, hand torque, hand drag); returns friction of
    each."""
    for i in range(2):
        prepare(sides[i], h, share, level, factor, p, axis)
        sides[i, W] = sides[i, V]
    motor, link = sides[MOTOR], sides[LINK]
    push = 1.0 / (share * h)
    k, c = p.joint_stiffness_nm_rad[axis], p.joint_damping_nms_rad[axis]
    if k > 0.0:
        coupling, spring = c + share * h * k, k * (motor[X] - link[X])
        a0, a1 = (
            motor[J] * push + motor[DRAG] + coupling,
            link[J] * push + link[DRAG] + drive[2] + coupling,
        )
        a = (a0, -coupling, a1)
        b = (motor[J] * push * motor[V] + drive[0] - spring, link[J] * push * link[V] + drive[1] + spring)
    else:
        a = (motor[J] * push + motor[DRAG] + drive[2], 0.0, 1.0)
        b = (motor[J] * push * motor[V] + drive[0] + drive[1], 0.0)
    solve(sides, torques, a, b, h, 2.0 * share - 1.0, p, axis)
    highest = p.bristle_max_nm[axis] * (1.0 + (level[0] + level[1]) / p.breakaway_nm[axis]) * factor[0]
    for _ in range(2):  # twice: with one bristle held, the other may reach its end
        held = hold(motor, h, share, highest, p, axis)
        if not (hold(link, h, share, highest, p, axis) or held):
            break
        solve(sides, torques, a, b, h, 2.0 * share - 1.0, p, axis)
    return settle(motor, torques[MOTOR], h, share, p, axis), settle(link, torques[LINK], h, share, p, axis)


@compiled
def _ripple(x: float, p: np.record, axis: int) -> float:
    """Torque ripple at the motor side's angle `x`, N m."""
    torque = p.ripple_nm[axis] * math.sin(p.ripple_per_rad[axis] * x)
    return float(torque + waves(x, p.ripple_wave[axis], p.ripple_wave_count[axis]))


@compiled
def _joint_torque(sides: np.ndarray, p: np.record, axis: int) -> float:
    """Torque of the elastic joint on the link, N m; nil where it is rigid."""
    motor, link = sides[MOTOR], sides[LINK]
    spring = p.joint_stiffness_nm_rad[axis] * (motor[X] - link[X])
    return float(spring + p.joint_damping_nms_rad[axis] * (motor[V] - link[V]))


@compiled
def _foresee(sides: np.ndarray, s: np.record, p: np.record, axis: int) -> None:
    """Accelerations at the start of a period, from the torques as they stand."""
    motor, link = sides[MOTOR], sides[LINK]
    if p.joint_stiffness_nm_rad[axis] > 0.0:
        through = _joint_torque(sides, p, axis)
        own = s.friction_torque_nm[axis] - s.link_friction_nm[axis]
        motor[A] = (s.motor_torque_nm[axis] - own - through) / motor[J]
        inertia = p.link_inertia_share[axis] * p.inertia_kgm2[axis]
        link[A] = (s.hand_torque_nm[axis] + through - s.link_friction_nm[axis]) / inertia
    else:
        pull = s.motor_torque_nm[axis] + s.hand_torque_nm[axis] - s.friction_torque_nm[axis]
        motor[A] = pull / p.inertia_kgm2[axis]


@compiled
def _lag(lag_s: float, h: float) -> tuple[float, float]:
    """Share of a current's distance to the wanted one left after `h`, and on average over it."""
    if lag_s <= 0.0:
        return 0.0, 0.0
    # expm1: 1 - exp loses its digits in a short step
    return math.exp(-h / lag_s), -math.expm1(-h / lag_s) * lag_s / h


@compiled
def _outside(sides: np.ndarray, pull: float, drag: float, m_h: float, p: np.record, axis: int) -> float:
    """Torque on the gear's output, N m: the elastic joint's, or the hand's less what moves the hand's own
    mass."""
    if p.joint_stiffness_nm_rad[axis] > 0.0:
        return -_joint_torque(sides, p, axis)
    return float(pull - drag * sides[MOTOR, V] - m_h * sides[MOTOR, A])


@compiled
def advance_detailed(
    s: np.record,
    p: np.record,
    axis: int,
    time_s: float,
    duration_s: float,
    steps: int,
    wanted_a: float,
    per_a: float,
) -> None:
    """Advance one axis by `duration_s` in equal `steps`; the amplifier makes `wanted_a`, `per_a` N m an
    ampere."""
    h = duration_s / steps
    k_h, b_h, m_h = mock_hand.hold(time_s, p, axis)
    x_d, v_d = s.hand_position_rad[axis], s.hand_velocity_rad_s[axis]
    x_end, v_end = mock_hand.wanted(time_s + duration_s, p, axis)
    dx, dv = (x_end - x_d) / steps, (v_end - v_d) / steps
    # once a period: in it neither a script nor the temperature changes by anything to be seen
    factor = drifted(s, p, axis, time_s)
    lag_keep, lag_mean = _lag(p.current_lag_s[axis], h)
    sides, share = _load_sides(s, p, axis, k_h, b_h, m_h, h)
    outer = LINK if p.joint_stiffness_nm_rad[axis] > 0.0 else MOTOR
    # without a lag the current is what is wanted, from the first step of the period on
    current = s.current_a[axis] if lag_keep > 0.0 else wanted_a
    s.motor_torque_nm[axis] = per_a * current
    _foresee(sides, s, p, axis)
    motor_side, link_side, level = 0.0, 0.0, (0.0, 0.0)
    drag = b_h + share * h * k_h
    for _ in range(steps):
        motor_nm = per_a * (wanted_a + (current - wanted_a) * lag_mean)
        current = wanted_a + (current - wanted_a) * lag_keep
        pull = k_h * (x_d + share * dx - sides[outer, X]) + b_h * (v_d + share * dv)
        # of this step: the load is the torque that passes now, not that of the period
        if p.load_kind[axis] > 0:
            level = load_levels(motor_nm, _outside(sides, pull, drag, m_h, p, axis), p, axis)
        ahead = sides[MOTOR, X] + (1.0 - share) * h * sides[MOTOR, V]
        drive = (motor_nm + _ripple(ahead, p, axis), pull, drag)
        motor_side, link_side = _substep(sides, s.element_nm[axis], drive, level, factor, h, share, p, axis)
        x_d += dx
        v_d += dv
    _store_sides(s, p, axis, sides)
    s.current_a[axis], s.motor_torque_nm[axis] = current, per_a * current
    s.friction_torque_nm[axis], s.link_friction_nm[axis] = motor_side + link_side, link_side
    s.hand_position_rad[axis], s.hand_velocity_rad_s[axis] = x_end, v_end
    through = per_a * current + _ripple(sides[MOTOR, X], p, axis) - motor_side
    if outer == LINK:
        through = _joint_torque(sides, p, axis) - link_side
    hand_nm = k_h * (x_end - s.position_rad[axis]) + b_h * (v_end - s.velocity_rad_s[axis])
    # between hand and handle: the hand's own mass is on the hand's side of the sensor
    s.hand_torque_nm[axis] = hand_nm - m_h * (hand_nm + through) / sides[outer, J]
