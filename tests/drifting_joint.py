"""Joints with friction, moved along given paths, many at once: ticks with a known factor of the dry friction.

Independent of the mock: bristles of LuGre (its closed solution over one step) or Maxwell-slip elements,
driven by the path.
"""

from dataclasses import dataclass

import numpy as np

from rtctl.control.jit import compiled
from rtctl.control.vocabulary import State
from rtctl.tick import new_ticks
from tests.shipped_friction import BACKWARD, law_nm

INERTIA = 0.012
PEOPLE = (
    ((0.3, 0.5),),
    ((0.2, 0.23), (0.1, 0.61), (0.05, 1.37), (0.01, 2.9)),
    ((0.03, 1.7), (0.012, 2.9), (0.05, 0.13)),
    ((0.25, 1.1), (0.02, 6.0)),
    ((0.6, 0.15), (0.03, 0.9)),
    ((0.08, 0.8), (0.08, 0.9)),
)
"""How hands move: amplitudes (rad) and frequencies (Hz) that are added up."""

SHORT = ((0.003, 1.1), (0.001, 2.3))
"""Strokes hardly longer than bristles bend."""


@dataclass
class Joint:
    sines: tuple = PEOPLE[1]
    factor: float = 1.0
    """Of the dry friction; `backward`: of that backwards, beside it."""
    backward: float = 1.0
    later: float | None = None
    """Factor from `later_s` on."""
    later_s: float = 0.0
    elements: int = 0
    """0: LuGre; else Maxwell-slip."""
    sigma0: float = 250.0
    offset: float = 0.008
    noise: float = 0.003
    counts: float = 160_000.0


def paths(joints, rate_hz, seconds):
    """Time (n,), position, velocity, acceleration (n, joints)."""
    t = np.arange(round(rate_hz * seconds)) / rate_hz
    out = np.zeros((3, len(t), len(joints)))
    for j, joint in enumerate(joints):
        for k, (amplitude, hz) in enumerate(joint.sines):
            w, phase = 2 * np.pi * hz, 0.7 * j + 1.9 * k
            out[0, :, j] += amplitude * np.sin(w * t + phase)
            out[1, :, j] += amplitude * w * np.cos(w * t + phase)
            out[2, :, j] -= amplitude * w**2 * np.sin(w * t + phase)
    return t, *out


def dry_nm(v):
    """Dry friction of the shipped joint at velocities v, a magnitude: law less .05 |v|, which the model has
    as viscous.
    """
    speed = np.abs(v)
    return (
        np.where(v >= 0, law_nm(speed), law_nm(speed, -1)) - np.where(v >= 0, 0.05, 0.05 * BACKWARD) * speed
    )


def friction_nm(joints, t, x, v, rate_hz):
    """Torque that friction takes, signed as the velocity, (n, joints)."""
    factor = np.array([j.factor for j in joints])[None] * np.ones_like(v)
    for k, j in enumerate(joints):
        if j.later is not None:
            factor[t >= j.later_s, k] = j.later
    factor = factor * np.where(v >= 0, 1.0, np.array([j.backward for j in joints])[None])
    g, sigma = factor * dry_nm(v), np.array([j.sigma0 for j in joints])
    dx = np.diff(x, axis=0, prepend=x[:1])
    out = bent_nm(np.sign(v) * g, np.exp(-np.abs(v) / rate_hz * sigma / g))
    slipping = [k for k, j in enumerate(joints) if j.elements]
    if slipping:
        count = np.array([joints[k].elements for k in slipping])
        out[:, slipping] = slipped_nm(count, sigma[slipping], g[:, slipping], dx[:, slipping])
    return out + 0.05 * np.where(v >= 0, 1.0, BACKWARD) * v


@compiled
def bent_nm(end, fade):
    """Of LuGre's bristles, which come closer to `end` by a share 1 - `fade` in each step, (n, joints)."""
    out = np.zeros_like(end)
    for j in range(end.shape[1]):
        f = 0.0
        for i in range(len(end)):
            out[i, j] = f = end[i, j] + (f - end[i, j]) * fade[i, j]
    return out


@compiled
def slipped_nm(count, sigma, g, dx):
    """Of so many Maxwell-slip elements each, whose yield torques are as 1 to n."""
    out = np.zeros_like(g)
    for j in range(len(count)):
        n = count[j]
        parts = np.zeros(n)
        for i in range(len(g)):
            for k in range(n):
                bound = (k + 1) / (n * (n + 1) / 2) * g[i, j]
                parts[k] = min(max(parts[k] + sigma[j] / n * dx[i, j], -bound), bound)
                out[i, j] += parts[k]
    return out


def ticks_of(joints, seconds, rate_hz=400.0, seed=1):
    """ACTIVE ticks of each joint, one after the other, each those of a one-axis rig."""
    draw = np.random.default_rng(seed)
    t, x, v, a = paths(joints, rate_hz, seconds)
    torque = INERTIA * a + friction_nm(joints, t, x, v, rate_hz)
    for j, joint in enumerate(joints):
        rows, count = new_ticks(len(t), 1), 2 * np.pi / joint.counts
        rows["tick"] = np.arange(len(t))
        rows["time_ns"] = np.rint(t * 1e9).astype(np.int64)
        rows["state"], rows["fault_first"], rows["compensation"] = State.ACTIVE, -1, 1.0
        rows["position_rad"][:, 0] = np.rint(x[:, j] / count) * count
        rows["velocity_rad_s"][:, 0] = v[:, j]
        noise = joint.noise * draw.standard_normal((2, len(t)))
        rows["motor_torque_nm"][:, 0] = 0.6 * torque[:, j] + joint.offset + noise[0]
        rows["hand_torque_nm"][:, 0] = 0.4 * torque[:, j] + noise[1]
        yield rows
