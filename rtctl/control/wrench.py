"""From the six components of a force-torque sensor to the torque on each joint, at every pose.

    tau = lever . (F - F_w - F_0) + direction . (M - M_w - M_0)

F, M: force and moment about the sensor's origin, in its axes. `direction` is the unit vector of the joint's
axis and `lever` = direction x r, with r from that axis to the sensor's origin: together direction . (r x F +
M). F_0, M_0 are the tare, F_w = m g and M_w = c x m g the weight of what is mounted on the sensor. A rig
without moments has M = 0.

The rig file gives lever, direction and g at position 0 of all joints. Joints that turn the sensor (`chain`,
from the base on) turn g, and each of them turns the axes of those before it: (direction, lever) is the
velocity with which the joint moves the sensor's origin, so in the sensor's own axes

    (u, v)_a <- Ad(exp(-(u, v)_n q_n)) ... Ad(exp(-(u, v)_(a+1) q_(a+1))) (u, v)_a        g <- R_n' ... R_1' g

with every (u, v) on the right at position 0. Without a chain lever, direction and weight are what they are; a
weight that does not turn is in the tare."""

from __future__ import annotations

import math

import numpy as np

from rtctl.control.jit import compiled, inlined
from rtctl.control.records import Record

TINY = 1e-9
"""Levers shorter than this (m), and what is left of a lever beside the others, have no direction."""


@compiled
def turn(vector: np.ndarray, at: int, axis: np.ndarray, angle: float) -> None:
    """Turn `vector[at:at + 3]` about the unit vector `axis` by `angle`, rad, in place."""
    x, y, z = vector[at], vector[at + 1], vector[at + 2]
    u, v, w = axis[0], axis[1], axis[2]
    # Rodrigues: no matrix, which compiled code would have to allocate in a tick
    c, s = math.cos(angle), math.sin(angle)
    along = (1.0 - c) * (u * x + v * y + w * z)
    vector[at] = c * x + s * (v * z - w * y) + along * u
    vector[at + 1] = c * y + s * (w * x - u * z) + along * v
    vector[at + 2] = c * z + s * (u * y - v * x) + along * w


@compiled
def _carry(screw: np.ndarray, direction: np.ndarray, lever: np.ndarray, angle: float) -> None:
    """Show (lever, direction) of a joint in axes that the joint (`direction`, `lever`) has turned by
    `angle`."""
    # minus: the sensor turns by +angle, so what stands still turns back in its axes
    turn(screw, 0, direction, -angle)
    turn(screw, 3, direction, -angle)
    u, v, w = direction[0], direction[1], direction[2]
    x = v * lever[2] - w * lever[1]  # a point of the turning joint's axis: direction x lever
    y = w * lever[0] - u * lever[2]
    z = u * lever[1] - v * lever[0]
    c, s = math.cos(angle), -math.sin(angle)
    # shift p = (1 - R) point; the point is perpendicular to the axis
    p_x = x - (c * x + s * (v * z - w * y))
    p_y = y - (c * y + s * (w * x - u * z))
    p_z = z - (c * z + s * (u * y - v * x))
    # the turned axis no longer passes where it did: its lever changes by p x direction
    screw[0] += p_y * screw[5] - p_z * screw[4]
    screw[1] += p_z * screw[3] - p_x * screw[5]
    screw[2] += p_x * screw[4] - p_y * screw[3]


@inlined
def _pose(s: Record, p: Record) -> None:
    """Write `screw` (lever, then direction of each joint) and `weight` (force, then moment) at the present
    positions."""
    for axis in range(len(s.position_rad)):
        for i in range(3):
            s.screw[axis, i] = p.lever_m[axis, i]
            s.screw[axis, 3 + i] = p.axis_direction[axis, i]
    for i in range(3):
        s.weight[i] = p.tip_weight_n[i]  # at position 0; turned below
    for k in range(p.chain_count):
        joint = p.chain_axis[k]
        direction, lever, angle = p.axis_direction[joint], p.lever_m[joint], s.position_rad[joint]
        turn(s.weight, 0, direction, -angle)
        for before in range(k):  # from the base on: each joint turns the axes of those before it
            _carry(s.screw[p.chain_axis[before]], direction, lever, angle)
    f, c = s.weight, p.tip_center_m
    # moments that are not measured have no weight in them
    moments = 1.0 if p.moment_used != 0 else 0.0
    f[3] = moments * (c[1] * f[2] - c[2] * f[1])
    f[4] = moments * (c[2] * f[0] - c[0] * f[2])
    f[5] = moments * (c[0] * f[1] - c[1] * f[0])


@compiled
def torque_on(s: Record, axis: int, wrench: np.ndarray) -> float:
    """Torque on one joint of a force and moment, shape (6,), at the pose of the last sample, N m."""
    torque = 0.0
    for i in range(6):
        torque += s.screw[axis, i] * wrench[i]
    return torque


@inlined
def take_wrench(t: Record, s: Record, p: Record) -> None:
    """Take over force and moment of a fresh, valid sample whose positions are taken over already."""
    for i in range(3):
        s.wrench[i] = t.force_n[i]
        s.wrench[3 + i] = t.moment_nm[i] if p.moment_used != 0 else 0.0  # what is not used may be NaN
    _pose(s, p)
    for axis in range(len(s.position_rad)):
        s.force_raw_nm[axis] = torque_on(s, axis, s.wrench)


@compiled
def report_wrench(t: Record, s: Record) -> None:
    """Tared force and moment into the tick: less the weight and the tare that is averaged over most
    samples."""
    for i in range(3):
        t.force_tared_n[i], t.moment_tared_nm[i] = s.tared[i], s.tared[3 + i]


@compiled
def beside(s: Record, part: int) -> float:
    """What of the tared force (`part` 0) or moment (3) lies beside every joint's lever or direction; N or
    N m.

    The part that turns no joint: what is left when its projections on the levers (directions), made
    perpendicular to each other, are taken away. 0 on a rig whose levers have all three directions."""
    found = 0
    for axis in range(len(s.position_rad)):
        # Gram and Schmidt: each lever less what those before it have of it
        basis = s.beside_basis[min(found, 2)]  # room in the state: compiled code must not allocate in a tick
        for i in range(3):
            basis[i] = s.screw[axis, part + i]
        for k in range(found):
            _remove(basis, s.beside_basis[k])
        length = math.sqrt(basis[0] ** 2 + basis[1] ** 2 + basis[2] ** 2)
        if length > TINY:  # a lever along another adds no direction
            for i in range(3):
                basis[i] /= length
            found += 1
            if found == 3:
                return 0.0
    rest = s.beside_rest
    for i in range(3):
        rest[i] = s.tared[part + i]
    for k in range(found):
        _remove(rest, s.beside_basis[k])
    return math.sqrt(rest[0] ** 2 + rest[1] ** 2 + rest[2] ** 2)


@compiled
def _remove(vector: np.ndarray, unit: np.ndarray) -> None:
    """Take the projection on `unit` out of `vector`; both of shape (3,)."""
    along = vector[0] * unit[0] + vector[1] * unit[1] + vector[2] * unit[2]
    for i in range(3):
        vector[i] -= along * unit[i]
