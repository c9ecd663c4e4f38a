"""Friction of the simulated joint: LuGre or elasto-plastic, one step coupled with the mass.

| symbol | meaning | unit |
|---|---|---|
| v, x | joint velocity and position | rad/s, rad |
| z | bristle deflection | rad |
| g | dry friction in steady sliding at this speed, place and direction | N m |
| s0, s1, b | bristle stiffness, bristle damping, viscous friction | N m/rad, N m s/rad |
| J, h | inertia, step | kg m^2, s |
| w | velocity of a step, between those at its ends | rad/s |

References
----------
Canudas de Wit et al.: A new model for control of systems with friction, 1995.
Dupont et al.: Single state elasto-plastic friction models, 2002."""

from __future__ import annotations

import math

import numpy as np

from hw.simulators.jit import compiled, inlined

_FAR = 40.0
"""Multiple of the Stribeck speed beyond which the Stribeck peak is nil (and powers would overflow)."""

_SERIES_BELOW = 0.125
"""Share of its length that a bristle turns over in one step, below which `bristle_gains` takes a series:
right to 3e-14."""


@compiled
def direction_scale(v: float, p: np.record, axis: int) -> float:
    """Scale of the whole static curve in the direction of `v`."""
    # rest counts as forwards: a joint that stands needs one scale, not the mean of two
    return float(p.friction_scale_positive[axis] if v >= 0.0 else p.friction_scale_negative[axis])


@compiled
def waves(x: float, table: np.ndarray, count: int) -> float:
    """Sum of the first `count` rows (amplitude, waves per turn, phase rad) of `table` at the angle `x`."""
    total = 0.0
    for k in range(count):
        total += table[k, 0] * math.sin(table[k, 1] * x + table[k, 2])
    return total


@compiled
def modulation(x: float, p: np.record, axis: int) -> float:
    """Factor of the dry friction at position `x` (eccentric gears, bearings), 1 without."""
    share, factor = p.modulation_share[axis], 1.0
    if share != 0.0:
        factor += share * math.sin(p.modulation_per_rad[axis] * x)
    if p.friction_wave_count[axis] != 0:
        factor += waves(x, p.friction_wave[axis], p.friction_wave_count[axis])
    return float(factor)


@compiled
def peak_share(v: float, p: np.record, axis: int) -> float:
    """Share of the Stribeck peak that is left at velocity `v`: of two speeds where there is a second one."""
    r = min(abs(v) * (1.0 / p.stribeck_rad_s[axis]), _FAR)
    exponent = p.stribeck_exponent[axis]
    # every plant of the family is Gaussian: a product takes less than a power
    power = r * r if exponent == 2.0 else r**exponent
    left = math.exp(-power)
    share = p.second_share[axis]
    if share == 0.0:
        return left
    r = min(abs(v) * (1.0 / p.second_rad_s[axis]), _FAR)
    return float((1.0 - share) * left + share * math.exp(-(r * r if exponent == 2.0 else r**exponent)))


@compiled
def viscous(v: float, p: np.record, axis: int) -> float:
    """Viscous friction per speed at velocity `v`, N m s/rad: b, and what thins out with speed."""
    if p.thinning_nms_rad[axis] == 0.0:
        return float(p.viscous_nms_rad[axis])
    r = v / p.thinning_rad_s[axis]
    return float(p.viscous_nms_rad[axis] + p.thinning_nms_rad[axis] / (1.0 + r * r))


@compiled
def sliding_level(v: float, x: float, more_nm: float, more_peak_nm: float, p: np.record, axis: int) -> float:
    """Dry friction in steady sliding before the scale of its direction, N m, with what a load adds to it."""
    peak = p.breakaway_nm[axis] - p.coulomb_nm[axis] + more_peak_nm
    level = p.coulomb_nm[axis] + more_nm + peak * peak_share(v, p, axis)
    return float(level * modulation(x, p, axis))


@inlined
def dry_friction(v: float, x: float, p: np.record, axis: int) -> float:
    """Dry friction g(v, x) > 0 in steady sliding, N m.

    Notes
    -----
    g = [F_c + (F_s - F_c) exp(-(|v|/v_s)^delta)] * scale(direction) * modulation(x); docs/theory.md 12.1.
    With a second speed the peak is (1 - m) exp(-(|v|/v_s)^delta) + m exp(-(|v|/v_2)^delta), m its share."""
    peak = (p.breakaway_nm[axis] - p.coulomb_nm[axis]) * peak_share(v, p, axis)
    return float((p.coulomb_nm[axis] + peak) * (direction_scale(v, p, axis) * modulation(x, p, axis)))


@compiled
def static_friction(v: float, x: float, p: np.record, axis: int) -> float:
    """Friction torque in steady sliding, signed like `v`, viscous part included, N m."""
    total = dry_friction(v, x, p, axis) + viscous(v, p, axis) * direction_scale(v, p, axis) * abs(v)
    return float(math.copysign(total, v))


@compiled
def plastic_share(z: float, v: float, z_ss: float, elastic_share: float) -> float:
    """Dupont's alpha: 0 where the bristle only stretches, 1 where it only slides.

    A negative `elastic_share` is LuGre: 1 everywhere, hence its drift under sub-break-away vibration."""
    if elastic_share < 0.0:
        return 1.0
    z_ba = elastic_share * z_ss
    # on its way back, and below break-away, it is a spring and nothing else: vibration does not make it creep
    if z * v <= 0.0 or abs(z) <= z_ba:
        return 0.0
    if abs(z) >= z_ss:
        return 1.0
    # half a sine, whose slope is 0 at both ends: a kink in alpha would be one in the friction (Dupont et al.)
    return 0.5 * math.sin(math.pi * (abs(z) - 0.5 * (z_ss + z_ba)) / (z_ss - z_ba)) + 0.5


@compiled
def bristle_gains(slope: float, v: float, h: float, rate: float) -> tuple[float, float, float, float]:
    """Exponential step of the bristle: z' = E z + gain v, on average over it m z + n v. Returns (E, gain, m,
    n).

    `slope` is alpha s0 / g in 1/rad, `rate` 1 / h.

    Notes
    -----
    a = slope |v|,  E = exp(-a h),  gain = (1 - E) / a,  m = gain / h,  n = (1 - m) / a (1, h, 1 and h / 2
    where a vanishes); docs/theory.md 12.3. gain and n in s. With q = a h, n / h is the sum of (-q)^k / (k +
    2)! over k = 0, 1, ...; where q is small, that loses no digits and takes half as long as the exponential.
    """
    q = slope * (abs(v) * h)
    if q < _SERIES_BELOW:
        q_2 = q * q
        low = (1 / 2 - q * (1 / 6)) + q_2 * (1 / 24 - q * (1 / 120))
        high = (1 / 720 - q * (1 / 5040)) + q_2 * (1 / 40320 - q * (1 / 362880))
        rest = low + (q_2 * q_2) * high
        mean = 1.0 - q * rest
        return 1.0 - q * mean, h * mean, mean, h * rest
    keep = math.exp(-q)
    length = h / q
    gain = (1.0 - keep) * length
    mean = gain * rate
    return keep, gain, mean, (1.0 - mean) * length


@compiled
def implicit_share(inertia: float, damping: float, stiffness: float, h: float) -> float:
    """Where in a step of `h` its torques are taken: 1/2 (the middle) for a fine step, 1 (the end) for a
    coarse one.

    Notes
    -----
    theta = (3 + r) / (6 + r) with r = h damping / J + h^2 stiffness / J. The step is then of second order,
    and for a damped mass its amplification is the Pade approximant (6 - 2r) / (6 + 4r + r^2) of exp(-r):
    bounded for every r, and nil where the middle alone would ring."""
    r = h * (damping + h * stiffness) / inertia
    return (3.0 + r) / (6.0 + r)


@inlined
def coupled_step(
    v: float,
    z: float,
    x: float,
    acceleration: float,
    torque: float,
    drag: float,
    inertia: float,
    h: float,
    share: float,
    p: np.record,
    axis: int,
) -> tuple[float, float, float, float]:
    """Advance velocity and bristle by `h` under `torque` - `drag` w. Returns (v', z', w, friction at the
    end).

    w is the velocity of the step, v + theta (v' - v) with theta = `share`: the position moves by h w.
    `torque` is that at theta h into the step; `acceleration` (rad/s^2, as of the start) only foresees the
    velocity at which friction is read.

    Notes
    -----
    Linear in w, so it needs no iteration and is stable for every stiffness; of second order (theta = 1 is
    of first order; docs/theory.md 12.3). With mu = 2 theta - 1, the bristle under constant w is
    z' = E z + gain w, on average m z + (1 - m) w / a where m = gain / h, and
    J (v' - v) / h = torque - drag w - s0 [(1 - mu) average + mu z'] - s1 (z' - z) / h - b w.
    The bristle cannot stretch beyond break-away; where a step would, it is held there and w solved anew."""
    rate, per_share = 1.0 / h, 1.0 / share  # a division less for the next step to wait for
    ahead = (1.0 - share) * h
    v_mid = v + ahead * acceleration
    # read once, where the step is foreseen to be: at its end it would depend on what is solved for
    g = dry_friction(v_mid, x + ahead * v, p, axis)
    s0, s1 = p.bristle_stiffness_nm_rad[axis], p.bristle_damping_nms_rad[axis]
    b = viscous(v_mid, p, axis) * direction_scale(v_mid, p, axis)
    # g is above 0 everywhere: the options bound coulomb_nm from below and all waves by .9 of it
    slope = plastic_share(z, v_mid, g / s0, p.elastic_share[axis]) * s0 / g
    keep, gain, mean_keep, mean_gain = bristle_gains(slope, v_mid, h, rate)
    # 0 for the middle, 1 for the end: how much of the spring is that of the end of the step
    end = 2.0 * share - 1.0
    s_keep = s0 * ((1.0 - end) * mean_keep + end * keep)
    s_gain = s0 * ((1.0 - end) * mean_gain + end * gain)
    push = inertia * rate * per_share
    load = push + b + drag
    w = (push * v + torque + (s1 * rate * (1.0 - keep) - s_keep) * z) / (load + s_gain + s1 * rate * gain)
    z_new = keep * z + gain * w
    if s0 * abs(z_new) > p.bristle_max_nm[axis]:
        z_new = math.copysign(p.bristle_max_nm[axis] / s0, z_new)
        spring = s0 * (0.5 * (1.0 - end) * (z + z_new) + end * z_new)
        w = (push * v + torque - spring - s1 * rate * (z_new - z)) / load
        v_new = v + (w - v) * per_share
        return v_new, z_new, w, s0 * z_new + s1 * rate * (z_new - z) + b * v_new
    v_new = v + (w - v) * per_share
    # at the end of the step: dz/dt under constant w, and the change to v' as far as the bristle still
    # stretches
    slip = slope * abs(v_mid) * z
    # by how much the bristle follows a change of the velocity: 1 unbent, 0 where it slides
    stretch = 1.0 - math.copysign(slope, v_mid) * z
    z_rate = keep * (w - slip + (v_new - w) * stretch)
    return v_new, z_new, w, s0 * z_new + s1 * z_rate + b * v_new
