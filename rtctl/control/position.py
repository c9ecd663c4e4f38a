"""A position controller with friction and inertia feed-forward: references, and the torque that follows them.

    tau = k_p e + k_i int e + k_d (v_r - v) + J a_r + kappa s F(|v_f|)

e = x_r - x; v the measured velocity; F the friction model, kappa its share. While the reference moves, v_f is
its velocity and s its sign (docs/theory.md 11.4: noise free); while it stands, v_f is the measured velocity
and s = sat(e / e_0), so that the break-away torque is there before the joint moves. (The sign of the measured
velocity instead makes the joint hunt about its goal by a bristle deflection.)

| shape | x_r - start | |
|---|---|---|
| STEP | A | from the first tick on |
| SINE | A (1 - cos w t) | from rest; w = rate |
| TRIANGLE | 0, A, 0, -A, 0, ... | at the speed `rate` |"""

from __future__ import annotations

import math

from rtctl.control.feedforward import saturate, sign
from rtctl.control.friction_curve import BACKWARD, FORWARD, branch_magnitude
from rtctl.control.jit import compiled
from rtctl.control.records import Record
from rtctl.control.vocabulary import Shape

_STEP = int(Shape.STEP)
_SINE = int(Shape.SINE)
_TRIANGLE = int(Shape.TRIANGLE)

STANDING_RAD_S = 1e-6
"""Slower references count as standing."""


@compiled
def reference_at(shape: int, amplitude_rad: float, rate: float, t: float) -> tuple[float, float, float]:
    """Position (from the start), velocity and acceleration of a reference `t` seconds after it began; rad,
    s."""
    if shape == _SINE:
        phase = rate * t
        speed = amplitude_rad * rate * math.sin(phase)
        return (amplitude_rad * (1.0 - math.cos(phase)), speed, amplitude_rad * rate * rate * math.cos(phase))
    if shape == _TRIANGLE:
        quarters = rate * t / abs(amplitude_rad)  # one amplitude takes amplitude/rate
        phase = quarters - 4.0 * math.floor(quarters / 4.0)
        speed = rate if amplitude_rad > 0.0 else -rate
        if phase < 1.0:
            return amplitude_rad * phase, speed, 0.0
        if phase < 3.0:
            return amplitude_rad * (2.0 - phase), -speed, 0.0
        return amplitude_rad * (phase - 4.0), speed, 0.0
    return amplitude_rad, 0.0, 0.0


@compiled
def reference_fits(
    shape: int, amplitude_rad: float, rate: float, room_below: float, room_above: float, fastest: float
) -> bool:
    """Whether a reference stays within the room (rad, both >= 0) and the speed (rad/s). NaN fits nowhere."""
    if not abs(amplitude_rad) < math.inf:
        return False
    low, high, speed = min(amplitude_rad, 0.0), max(amplitude_rad, 0.0), 0.0
    if shape == _SINE:
        low, high, speed = 2.0 * low, 2.0 * high, abs(amplitude_rad) * rate  # A (1 - cos): from 0 to 2 A
    elif shape == _TRIANGLE:
        low, high, speed = -abs(amplitude_rad), abs(amplitude_rad), rate
    elif shape != _STEP:
        return False
    moving = shape == _STEP or (rate > 0.0 and abs(amplitude_rad) > 0.0)
    return moving and -low <= room_below and high <= room_above and speed <= fastest


@compiled
def friction_toward(
    model: Record, gain: float, v_r: float, v: float, error: float, error_rad: float
) -> float:
    """Friction feed-forward of a position controller, N m; 0 without a model."""
    if abs(v_r) > STANDING_RAD_S:
        side, speed = sign(v_r), abs(v_r)
    else:
        side, speed = saturate(error / error_rad), abs(v)  # break-away before it moves
    branch = FORWARD if side >= 0.0 else BACKWARD
    return float(gain * side * branch_magnitude(model, branch, speed))
