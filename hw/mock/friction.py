"""Friction of the simulated joint: LuGre or elasto-plastic, one step coupled with the mass.

| symbol | meaning | unit |
|---|---|---|
| v, x | joint velocity and position | rad/s, rad |
| z | bristle deflection | rad |
| g | dry friction in steady sliding at this speed, place and direction | N m |
| s0, s1, b | bristle stiffness, bristle damping, viscous friction | N m/rad, N m s/rad |
| J, h | inertia, step | kg m^2, s |

References
----------
Canudas de Wit et al.: A new model for control of systems with friction, 1995.
Dupont et al.: Single state elasto-plastic friction models, 2002.
"""

from __future__ import annotations

import math

import numpy as np

from hw.mock.jit import compiled

_FAR = 40.0
"""Multiple of the Stribeck speed beyond which the Stribeck peak is nil (and powers would overflow)."""


@compiled
def direction_scale(v: float, p: np.record, axis: int) -> float:
    """Scale of the whole static curve in the direction of `v`."""
    return float(p.friction_scale_positive[axis] if v >= 0.0 else p.friction_scale_negative[axis])


@compiled
def modulation(x: float, p: np.record, axis: int) -> float:
    """Factor of the dry friction at position `x` (eccentric gears, bearings), 1 without."""
    share = p.modulation_share[axis]
    return float(1.0 + share * math.sin(p.modulation_per_rad[axis] * x)) if share != 0.0 else 1.0


@compiled
def dry_friction(v: float, x: float, p: np.record, axis: int) -> float:
    """Dry friction g(v, x) > 0 in steady sliding, N m.

    Notes
    -----
    g = [F_c + (F_s - F_c) exp(-(|v|/v_s)^delta)] * scale(direction) * modulation(x); theory section 4.
    """
    r = min(abs(v) / p.stribeck_rad_s[axis], _FAR)
    exponent = p.stribeck_exponent[axis]
    power = r * r if exponent == 2.0 else r**exponent
    peak = (p.breakaway_nm[axis] - p.coulomb_nm[axis]) * math.exp(-power)
    return float((p.coulomb_nm[axis] + peak) * direction_scale(v, p, axis) * modulation(x, p, axis))


@compiled
def static_friction(v: float, x: float, p: np.record, axis: int) -> float:
    """Friction torque in steady sliding, signed like `v`, viscous part included, N m."""
    total = dry_friction(v, x, p, axis) + p.viscous_nms_rad[axis] * direction_scale(v, p, axis) * abs(v)
    return float(math.copysign(total, v))


@compiled
def plastic_share(z: float, v: float, z_ss: float, elastic_share: float) -> float:
    """Dupont's alpha: 0 where the bristle only stretches, 1 where it only slides.

    A negative `elastic_share` is LuGre: 1 everywhere, hence its drift under sub-break-away vibration.
    """
    if elastic_share < 0.0:
        return 1.0
    z_ba = elastic_share * z_ss
    if z * v <= 0.0 or abs(z) <= z_ba:
        return 0.0
    if abs(z) >= z_ss:
        return 1.0
    return 0.5 * math.sin(math.pi * (abs(z) - 0.5 * (z_ss + z_ba)) / (z_ss - z_ba)) + 0.5


@compiled
def bristle_gains(z: float, v: float, g: float, h: float, p: np.record, axis: int) -> tuple[float, float]:
    """Exponential step of the bristle: z' = E z + gain v'. Returns (E, gain), gain in s.

    Notes
    -----
    a = alpha s0 |v| / g,  E = exp(-a h),  gain = (1 - E) / a  (h where a vanishes); theory section 4.
    """
    s0 = p.bristle_stiffness_nm_rad[axis]
    a = plastic_share(z, v, g / s0, p.elastic_share[axis]) * s0 * abs(v) / g
    if a * h < 1e-5:
        return 1.0 - a * h, h * (1.0 - 0.5 * a * h)
    keep = math.exp(-a * h)  # quicker than expm1, and 1 - keep is still good to 1e-11 here
    return keep, (1.0 - keep) / a


@compiled
def coupled_step(
    v: float,
    z: float,
    x: float,
    torque: float,
    drag: float,
    inertia: float,
    h: float,
    p: np.record,
    axis: int,
) -> tuple[float, float, float]:
    """Advance velocity and bristle by `h` under `torque` - `drag` v'. Returns (v', z', friction torque).

    Notes
    -----
    Linear in v', so it needs no iteration and is stable for every stiffness; theory section 4, with
    c = s0 + s1/h:  v' = [J v/h + torque - c E z + s1 z/h] / [J/h + c gain + b + drag].
    The bristle cannot stretch beyond break-away; where a step would, it is held there and v' solved anew.
    """
    rate = 1.0 / h
    g = dry_friction(v, x, p, axis)
    s0, s1 = p.bristle_stiffness_nm_rad[axis], p.bristle_damping_nms_rad[axis]
    b = p.viscous_nms_rad[axis] * direction_scale(v, p, axis)
    keep, gain = bristle_gains(z, v, g, h, p, axis)
    c = s0 + s1 * rate
    push = inertia * rate * v + torque + s1 * rate * z
    v_new = (push - c * keep * z) / (inertia * rate + c * gain + b + drag)
    z_new = keep * z + gain * v_new
    if s0 * abs(z_new) > p.bristle_max_nm[axis]:
        z_new = math.copysign(p.bristle_max_nm[axis] / s0, z_new)
        v_new = (push - c * z_new) / (inertia * rate + b + drag)
    friction = s0 * z_new + s1 * rate * (z_new - z) + b * v_new
    return v_new, z_new, friction
