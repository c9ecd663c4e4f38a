"""What the simulated rig's sensors make of the truth: quantised, biased, drifting, noisy; and which sensors
it has."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from hw.encoder import unwrap, wrap
from hw.interface import Options
from hw.kept_readings import copy_readings
from hw.simulators.jit import compiled
from hw.simulators.mock_drift import temperature
from hw.simulators.mock_force_filter import shown_torque
from hw.simulators.mock_noise import normal
from hw.simulators.mock_tip import weigh

SENSORS: dict[str, tuple[str, ...]] = {
    "position": (),
    "current": (),
    "force": (),
    "temperature": (),
    "estop": (),
    "moment": ("force", "moment"),
    "velocity": ("velocity",),
}
"""Channels that the mock rig can measure -> keys of the option that gives it the sensor; none: it always has
it."""


def measured(options: Options) -> frozenset[str]:
    """Channels that the rig of these options (dumped `MockOptions`) measures."""
    return frozenset(name for name, keys in SENSORS.items() if _has(options, keys))


def _has(options: Options, keys: tuple[str, ...]) -> bool:
    value: object = options
    for key in keys:
        value = value[key] if isinstance(value, Mapping) else None
    return value is not None


@compiled
def quantised(value: float, quantum: float, offset: float) -> float:
    """`value` on the grid of `quantum` (0: no grid); `offset` .5 rounds, 0 truncates downward."""
    if quantum <= 0.0:
        return value
    # floor, not a cut toward 0: a cut would have one step of double width at 0
    return math.floor(value / quantum + offset) * quantum


@compiled
def encoder_angle(s: np.record, p: np.record, axis: int) -> float:
    """Angle a driver makes of the encoder: counts, through a counter of finite width where there is one."""
    quantum, bits = p.count_rad[axis], p.encoder_bits[axis]
    angle = s.position_rad[axis] + (1.0 - p.encoder_at_link[axis]) * s.joint_twist_rad[axis]
    if bits == 0:
        return quantised(angle, quantum, p.encoder_offset[axis])
    # through the counter that a driver follows: what does not fit half a range is seen as it would be there
    count = math.floor(angle / quantum + p.encoder_offset[axis])
    return float(unwrap(wrap(count, bits), bits, s.encoder[axis]) * quantum)


@compiled
def sensed_velocity(s: np.record, p: np.record, axis: int, periods: int) -> float:
    """Velocity sensor of one axis, rad/s at the joint, so many periods after its last reading: filter, scale,
    bias, noise, resolution."""
    true = s.velocity_rad_s[axis] + (1.0 - p.encoder_at_link[axis]) * s.joint_twist_rate_rad_s[axis]
    # a first-order low-pass; a share of 1 is none, and shows what is so now
    share = p.velocity_share
    if periods != 1 and share < 1.0:
        share = 1.0 - (1.0 - share) ** periods
    s.velocity_filtered_rad_s[axis] += share * (true - s.velocity_filtered_rad_s[axis])
    velocity = p.velocity_scale * s.velocity_filtered_rad_s[axis] + p.velocity_bias_rad_s
    if p.velocity_noise_rad_s > 0.0:
        velocity += p.velocity_noise_rad_s * normal(s)
    return quantised(velocity, p.velocity_resolution_rad_s, 0.5)


@compiled
def sense_axes(t: np.record, s: np.record, p: np.record, periods: int) -> None:
    """Encoder, Hall current, temperature and, where there is a sensor, velocity of every axis, so many
    periods after the last reading."""
    for axis in range(len(t.position_rad)):
        t.position_rad[axis] = encoder_angle(s, p, axis)
        current = s.current_a[axis] + p.current_bias_a[axis]
        if p.current_noise_a[axis] > 0.0:
            current += p.current_noise_a[axis] * normal(s)
        t.current_a[axis] = quantised(current, p.current_resolution_a[axis], 0.5)
        t.temperature_c[axis] = temperature((s.tick - s.first_tick) * p.period_s, p, axis)
        if p.velocity_sensor == 1:
            t.device_velocity_rad_s[axis] = sensed_velocity(s, p, axis, periods)


@compiled
def tip_force(k: int, s: np.record, p: np.record) -> float:
    """Force of the hand at the tip along axis `k` of the sensor, N."""
    force = 0.0
    for axis in range(len(s.hand_torque_nm)):
        force += p.tip_per_joint[k, axis] * shown_torque(s, p, axis)
    return force


@compiled
def _sense_moment(t: np.record, s: np.record, p: np.record, x: float, y: float, z: float) -> None:
    """Moments about the sensor's origin: of the hand's force at its point of contact, and of the tip's
    weight."""
    if p.moment_sensor == 0:
        return
    c, g, f = p.force_contact_m, p.tip_center_m, s.tip_weight_n
    m_x = c[1] * z - c[2] * y + g[1] * f[2] - g[2] * f[1]
    m_y = c[2] * x - c[0] * z + g[2] * f[0] - g[0] * f[2]
    m_z = c[0] * y - c[1] * x + g[0] * f[1] - g[1] * f[0]
    for k in range(3):
        moment = (m_x, m_y, m_z)[k] + p.moment_bias_nm[k]
        if p.moment_noise_nm > 0.0:
            moment += p.moment_noise_nm * normal(s)
        moment = min(max(moment, -p.moment_range_nm), p.moment_range_nm)
        t.moment_nm[k] = quantised(moment, p.moment_resolution_nm, 0.5)


@compiled
def sense_force(t: np.record, s: np.record, p: np.record, periods: int) -> None:
    """Three-axis force sensor at the tip, so many periods after its last reading: weight, cross-talk, bias,
    drift, noise, range, resolution; its moments, too."""
    x, y, z = tip_force(0, s, p), tip_force(1, s, p), tip_force(2, s, p)
    if p.moment_sensor != 0 or p.tip_kg > 0.0:
        weigh(s, p)
        _sense_moment(t, s, p, x, y, z)
        x, y, z = x + s.tip_weight_n[0], y + s.tip_weight_n[1], z + s.tip_weight_n[2]
    for k in range(3):
        if p.force_drift_n > 0.0 and periods > 0:
            s.force_drift_n[k] += p.force_drift_n * math.sqrt(periods) * normal(s)
        force = p.force_crosstalk[k, 0] * x + p.force_crosstalk[k, 1] * y + p.force_crosstalk[k, 2] * z
        force += p.force_bias_n[k] + s.force_drift_n[k]
        if p.force_noise_n > 0.0:
            force += p.force_noise_n * normal(s)
        # the range behind bias and noise: an amplifier saturates by what it sees
        force = min(max(force, -p.force_range_n), p.force_range_n)
        t.force_n[k] = quantised(force, p.force_resolution_n, 0.5)


@compiled
def hold_sample(t: np.record, s: np.record, p: np.record) -> None:
    """A slow device: only every `sample_every_ticks` slots what it shows is new, count and all; else the last
    sample."""
    # by slots and not by reads: a loop that misses some finds the sample that is due
    slot = 1 + (s.tick - s.first_tick) // p.sample_every_ticks  # from 1 on: 0 is before the first sample
    due = slot != s.sampled_slot
    if due:
        s.sampled_slot = slot
        s.sample_count += 1
        s.sampled_estop = t.estop
    t.sample_count, t.estop = s.sample_count, s.sampled_estop
    # kept before it is shown: what is not due is the very sample of before, noise and all
    if due:
        copy_readings(t, s.sampled)
    copy_readings(s.sampled, t)
