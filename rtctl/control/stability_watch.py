"""A contact stiffer than was promised rings: the watch sees it in the force and damps the virtual mass before
the account is short.

    low  <- low + a (tau_h - low)                   hands move, at most, some times a second
    fast <- fast + b ((tau_h - low)^2 - fast)       power in the band where they do not
    slow <- slow + b (low^2 - slow)
    rings:  fast > FLOOR^2  and  fast > SHARE (fast + slow),  for longer than STEP_S: a tap or a push is over
    by then
    w   rises to 1 within RISE_S while it rings, falls to 0 within FALL_S after

The damping that is added is w K_v: the mass is then as hard to move as the joint is held to it. The stiffest
hand that a mass bears grows with its damping (docs/theory.md 2.13). The index is that of Dimeas and
Aspragathos (2016), with two filters in place of a spectrum (docs/theory.md 14.5)."""

from __future__ import annotations

import math

from rtctl.control.jit import compiled
from rtctl.control.records import Record

CORNER_HZ = 9.0
"""Between what a hand does and what rings."""

POWER_S = 0.03
"""Over which powers are averaged."""

FLOOR_SHARE = 0.01
"""Least force that counts, as a share of the torque limit: what is less is noise and ripple."""

SHARE = 0.7
"""Share of the force power that must lie in the band: a sine of more than 14 Hz. Of one of f the low-pass of
f_c leaves f^2/(f^2 + f_c^2) there, which is .7 at 1.53 f_c."""

STEP_S = 0.05
"""Two thirds of a swing at 14 Hz, the slowest that counts: a tap is over sooner."""

RISE_S = 0.03
FALL_S = 2.0


@compiled
def watch_force(s: Record, p: Record, axis: int, hand_nm: float) -> float:
    """Damping to be added to the virtual mass, N m s/rad, >= 0; once a fresh sample."""
    dt = p.period_s
    s.watch_low_nm[axis] += -math.expm1(-2.0 * math.pi * CORNER_HZ * dt) * (hand_nm - s.watch_low_nm[axis])
    low = s.watch_low_nm[axis]
    share = -math.expm1(-dt / POWER_S)
    s.watch_fast_nm2[axis] += share * ((hand_nm - low) ** 2 - s.watch_fast_nm2[axis])
    s.watch_slow_nm2[axis] += share * (low * low - s.watch_slow_nm2[axis])
    fast, slow = s.watch_fast_nm2[axis], s.watch_slow_nm2[axis]
    # alone the ratio would call noise a ring
    rings = fast > p.watch_floor_nm[axis] ** 2 and fast > SHARE * (fast + slow)
    s.watch_s[axis] = s.watch_s[axis] + dt if rings else 0.0
    # up in 30 ms: a contact throws the joint within tenths of a second (14.5)
    step = dt / RISE_S if s.watch_s[axis] > STEP_S else -dt / FALL_S
    s.watch_share[axis] = min(max(s.watch_share[axis] + step, 0.0), 1.0)
    return s.watch_share[axis] * p.servo_velocity_gain_nms_rad[axis]


@compiled
def forget_force(s: Record, axis: int) -> None:
    """Begin anew: what came was no number."""
    s.watch_s[axis] = 0.0
    s.watch_low_nm[axis] = s.watch_fast_nm2[axis] = s.watch_slow_nm2[axis] = s.watch_share[axis] = 0.0
