"""Logs of a hand that swings a joint with bristles, simulated here from first principles: no code of the mock
is used.
"""

import numpy as np

from rtctl.friction.logs.dynamics import AxisLog

RATE_HZ, INERTIA, VISCOUS, COULOMB, BIAS = 1000.0, 0.012, 0.01, 0.05, 0.004


def stop(dx, level, length, bent):
    return min(max(bent + dx / length, -level), level)


def lugre(dx, level, length, bent):
    return bent + (dx - abs(dx) * bent / level) / length


YIELDS = np.linspace(0.2, 1.8, 8) / 8


def rigid(dx, level, _length, _bent):
    """No bristles at all: friction turns over where the motion does."""
    return level * np.sign(dx)


def maxwell_slip(dx, level, length, bent):
    """Eight elements of one stiffness, whose yield torques differ by a factor of nine."""
    most = level * YIELDS
    return np.minimum(np.maximum(bent + dx / length / 8, -most), most)


def log(
    bristles,
    length_rad,
    *,
    stribeck=0.0,
    count_rad=1e-4,
    seconds=12.0,
    seed=0,
    torque=True,
    lag_s=0.0,
    rising=0.0,
):
    """A hand swings a joint: sines of .4 to 1.6 Hz, up to .3 rad."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    x = sum(
        0.07 * rng.uniform(0.5, 1.0) * np.sin(2 * np.pi * rng.uniform(0.4, 1.6) * t + rng.uniform(0.0, 6.0))
        for _ in range(4)
    )
    v = np.gradient(x, 1 / RATE_HZ)
    late = np.roll(v, round(lag_s * RATE_HZ))  # frictional lag: the peak follows the speed later
    level = 1.0 + stribeck * np.exp(-((late / 0.05) ** 2))
    level = level + rising * np.sign(v) * np.gradient(v, 1 / RATE_HZ) * np.exp(-((v / 0.1) ** 2))
    bent, friction = np.zeros(8) if bristles is maxwell_slip else 0.0, np.zeros(len(t))
    # as Python's own numbers, which are the same and three times as quick
    steps = zip((np.diff(x) / 4).tolist(), level[1:].tolist(), strict=True)
    for row, (dx, most) in enumerate(steps, start=1):
        for _ in range(4):
            bent = bristles(dx, most, length_rad, bent)
        friction[row] = COULOMB * np.sum(bent)
    hand = INERTIA * np.gradient(v, 1 / RATE_HZ) + VISCOUS * v + friction + BIAS
    hand = hand + 0.002 * rng.standard_normal(len(t))
    shown = np.round(x / count_rad) * count_rad
    return AxisLog(RATE_HZ, shown, hand if torque else np.zeros(len(t)), "made", "0" * 64)
