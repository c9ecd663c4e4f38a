"""Two sessions of one joint differ by no more than what is in them: the offset's drift is not what a curve of
friction is beside Coulomb + viscous.
"""

import numpy as np
import pytest

from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.log_input import samples
from rtctl.friction.logs.regression import joint_fit
from rtctl.friction.logs.regressors import regressors

RATE_HZ, INERTIA = 500.0, 0.02

LEFT = 5e-4
"""Share of the friction that stretches of a session may differ by; beside Coulomb + viscous friction, whose
offset then follows what friction is beside them, it was 5e-3.
"""


def stribeck(v, size_nm):
    return size_nm * (1 + 0.4 * np.exp(-np.abs(v) / 0.15) + 0.1 * np.abs(v)) * np.sign(v)


def session(seed, size_nm, drift_nm=0.0):
    """A motion of three sines that begins and ends slowly, as a hand that tries a joint makes it."""
    random, t = np.random.default_rng(seed), np.arange(0, 60, 1 / RATE_HZ)
    w = 2 * np.pi * 0.25 * np.array([1, 1.618, 2.7]) * random.uniform(0.9, 1.1, 3)
    size, phase = np.array([1, 0.5, 0.2]) * random.uniform(0.8, 1.2, 3), random.uniform(0, 6.28, 3)
    x = (size * np.sin(np.outer(t, w) + phase)).sum(axis=1) * (1 - 0.6 * np.cos(2 * np.pi * t / 60) ** 2)
    v = np.gradient(x, t)
    torque = INERTIA * size_nm * np.gradient(v, t) + stribeck(v, size_nm)
    torque += size_nm * 0.01 * random.standard_normal(len(t)) + drift_nm * t / 60
    return AxisLog(RATE_HZ, x, torque, f"{seed}.csv", "0" * 64)


@pytest.mark.parametrize("size_nm", [0.02, 6.0])
@pytest.mark.parametrize("drift_share", [0.0, 0.05])
def test_what_is_left_of_each_session_is_the_joints_friction(size_nm, drift_share):
    for seed in (1, 2, 3):
        signals = regressors(session(seed, size_nm, drift_share * size_nm))
        found = samples(signals, joint_fit(signals), "0" * 64, remove_offset=True)
        v, off = found.velocity_rad_s, (found.friction_nm - stribeck(found.velocity_rad_s, size_nm)) / size_nm
        fast = np.abs(v) > 0.25
        of_stretches = [part.mean() for part in np.array_split(off[fast], 6)]
        assert np.std(of_stretches) < LEFT
