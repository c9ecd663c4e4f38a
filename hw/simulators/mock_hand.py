"""The scripted hand: a spring and damper (and some mass) between the joint and where the hand wants it.

The hand rests at its centre until `hand_start_s`, then follows its trajectory; it holds the tip only
inside its grip intervals. Letting go while moving is the kick of the hands-off test."""

from __future__ import annotations

import math

import numpy as np

from hw.simulators.jit import compiled
from hw.simulators.mock_records import SINES, Hand

_NONE, _SINES, _TRIANGLE, _PUSH = int(Hand.NONE), int(Hand.SINES), int(Hand.TRIANGLE), int(Hand.PUSH)


@compiled
def grips(time_s: float, p: np.record, axis: int) -> bool:
    """Whether the hand holds the tip at `time_s` after the first tick."""
    if p.hand_kind[axis] == _NONE:
        return False
    # no interval is always, not never: most hands hold on
    if p.grip_count[axis] == 0:
        return True
    held = False
    for k in range(p.grip_count[axis]):
        # all are asked, in any order: grips may overlap, and a rig file need not sort them
        held |= p.grip_from_s[axis, k] <= time_s < p.grip_to_s[axis, k]
    return held


@compiled
def hold(time_s: float, p: np.record, axis: int) -> tuple[float, float, float]:
    """Stiffness, damping and inertia that the hand has on the tip at `time_s`: zeros where it does not hold
    it."""
    if not grips(time_s, p, axis):
        return 0.0, 0.0, 0.0
    inertia = p.hand_inertia_kgm2[axis]
    return float(p.hand_stiffness_nm_rad[axis]), float(p.hand_damping_nms_rad[axis]), float(inertia)


@compiled
def _sines(t: float, p: np.record, axis: int) -> tuple[float, float]:
    x, v = 0.0, 0.0
    for k in range(SINES):
        w = p.hand_sine_rad_s[axis, k]
        if w > 0.0:
            x += p.hand_sine_rad[axis, k] * math.sin(w * t)
            v += p.hand_sine_rad[axis, k] * w * math.cos(w * t)
    return x, v


@compiled
def _triangle(t: float, amplitude: float, speed: float) -> tuple[float, float]:
    # a quarter of the period on: a hand begins where it rests, not at the end of its way
    phase = (t * speed + amplitude) % (4.0 * amplitude)  # begins in the middle, going up
    if phase < 2.0 * amplitude:
        return phase - amplitude, speed
    return 3.0 * amplitude - phase, -speed


@compiled
def _push(t: float, amplitude: float, speed: float, hold_s: float, rest_s: float) -> tuple[float, float]:
    ramp_s = amplitude / speed
    t = t % (2.0 * ramp_s + hold_s + rest_s)
    if t < ramp_s:
        return speed * t, speed
    t -= ramp_s + hold_s
    if t < 0.0:
        return amplitude, 0.0
    if t < ramp_s:
        return amplitude - speed * t, -speed
    return 0.0, 0.0


@compiled
def wanted(time_s: float, p: np.record, axis: int) -> tuple[float, float]:
    """Position (rad) and velocity (rad/s) the hand wants at `time_s` after the first tick."""
    t = time_s - p.hand_start_s[axis]
    kind = p.hand_kind[axis]
    x, v = 0.0, 0.0
    if t >= 0.0:
        if kind == _SINES:
            x, v = _sines(t, p, axis)
        elif kind == _TRIANGLE:
            x, v = _triangle(t, p.hand_amplitude_rad[axis], p.hand_speed_rad_s[axis])
        elif kind == _PUSH:
            # the depth has a sign, and the way there has the same
            speed = math.copysign(p.hand_speed_rad_s[axis], p.hand_amplitude_rad[axis])
            x, v = _push(t, p.hand_amplitude_rad[axis], speed, p.hand_hold_s[axis], p.hand_rest_s[axis])
    return p.hand_center_rad[axis] + x, v
