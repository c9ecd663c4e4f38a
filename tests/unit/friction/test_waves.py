"""Waves of the torque over the position: magnets of a linear motor, a screw's lead, a belt's teeth."""

from dataclasses import replace

import numpy as np
import pytest

from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.log_points import SPEED_MIN_RAD_S
from rtctl.friction.logs.plausibility import doubtful_friction
from rtctl.friction.logs.regression import joint_fit
from rtctl.friction.logs.regressors import regressors
from rtctl.friction.logs.waves import without_waves

RATE_HZ, PITCH_M, MASS_KG, COULOMB_N, VISCOUS_NS_M = 500.0, 0.03, 8.0, 12.0, 20.0


def carriage(wave_n, way=0.0, weight_n=0.0):
    """Strokes of .3 m at levels of speed, ends rounded; waves of `wave_n`, larger forwards by `way`."""
    t = np.arange(int(20 * RATE_HZ)) / RATE_HZ
    wanted = np.sign(np.sin(2 * np.pi * t / 4)) * (0.05 + 0.2 * (1 + np.sin(2 * np.pi * t / 16)) / 2)
    window = np.hanning(101) / np.hanning(101).sum()
    v = np.convolve(wanted, window, mode="same")
    x = np.cumsum(v) / RATE_HZ
    wave = wave_n * np.sin(2 * np.pi * x / PITCH_M + 0.4) * (1 + way * np.sign(v))
    force = (
        MASS_KG * np.gradient(v, 1 / RATE_HZ) + VISCOUS_NS_M * v + COULOMB_N * np.sign(v) + wave + weight_n
    )
    force += np.random.default_rng(1).normal(0, 0.05, len(t))
    radian = np.abs(v).max() / 2
    return AxisLog(RATE_HZ, x, force, "log.csv", "0", radian=radian)


def signals(log):
    return regressors(log, 20.0, SPEED_MIN_RAD_S * log.radian)


def off(found):
    values = joint_fit(found).symmetric.parameters
    truth = {"inertia_kgm2": MASS_KG, "viscous_nms_rad": VISCOUS_NS_M, "coulomb_nm": COULOMB_N}
    return {name: values[name].value / each - 1 for name, each in truth.items()}


def test_waves_are_taken_out_and_told_with_their_pitch():
    plain = signals(carriage(16.0))
    found = without_waves(plain)
    assert max(abs(each) for each in off(found).values()) < 0.05
    assert max(abs(each) for each in off(plain).values()) > 0.25
    assert "waves over the position, every 0.03 rad, of 16" in found.warnings[-1]


@pytest.mark.parametrize("log", [carriage(0.0), carriage(8.0, way=0.4)])
def test_what_is_no_wave_of_both_directions_stays(log):
    plain = signals(log)
    assert without_waves(plain) is plain


def test_a_spring_is_no_wave():
    log = carriage(0.0)
    plain = signals(replace(log, torque_nm=log.torque_nm + 60.0 * log.position_rad))
    assert without_waves(plain) is plain


def test_a_weight_is_not_friction_that_was_taken_off():
    assert doubtful_friction(joint_fit(signals(carriage(0.0, weight_n=60.0)))) == ()
