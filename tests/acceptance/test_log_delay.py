"""The default torque delay of half a period, on a motor-driven mock whose delay is known.

The rig is moved by its motor alone, through the backend, at 200 Hz: there half a period is 2.5 ms, and a
wrong delay would shift the viscous friction by J d w^2, several per cent. No noise: what is left is the
delay.
"""

import numpy as np
import pytest

from hw.interface import Rig
from hw.simulators.jit import records
from hw.simulators.mock_backend import MockBackend
from hw.simulators.mock_options import MockOptions
from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.regression import joint_fit
from rtctl.friction.logs.regressors import regressors
from rtctl.friction.logs.signal_shift import advanced
from rtctl.tick import new_ticks

RATE_HZ = 200.0
PER_AMPERE = 80 * 0.72 * 0.0134
TRUTH = {"inertia_kgm2": 0.012, "viscous_nms_rad": 0.05, "coulomb_nm": 0.25}


def rig():
    one = np.ones(1)
    return Rig(1, 1 / RATE_HZ, 80 * one, 0.72 * one, 0.0134 * one, 1e7 * one, np.array([[0.0, 0.1, 0.0]]))


def driven(delay_ticks, seconds=25.0):
    """Position, measured current and commanded current of a joint that a servo swings by its motor."""
    axis = {
        "torque_delay_ticks": delay_ticks,
        "friction": {"breakaway_nm": 0.25, "coulomb_nm": 0.25, "bristle_stiffness_nm_rad": 2500.0},
    }
    table = {"axis": [axis], "hand": [{"kind": "none"}]}
    backend = MockBackend(MockOptions.model_validate(table).model_dump(mode="json"), rig())
    tick = records(new_ticks())
    tick["enabled"] = 1
    rows = []
    for k in range(round(seconds * RATE_HZ)):
        t = k / RATE_HZ
        wanted = sum(a * np.sin(2 * np.pi * f * t) for a, f in ((0.4, 0.4), (0.15, 1.1), (0.06, 2.3)))
        tick["tick"] = k
        backend.read(tick)
        x = float(tick["position_rad"][0, 0])
        current = (4.0 * (wanted - x) - 0.1 * (x - rows[-1][0]) * RATE_HZ) / PER_AMPERE if rows else 0.0
        rows.append((x, float(tick["current_a"][0, 0]), current))
        tick["current_command_a"] = current
        backend.write(tick)
    position, measured, command = np.array(rows).T
    return position, PER_AMPERE * measured, PER_AMPERE * command


def in_time(position, torque, periods):
    """The log with its torque put back by so many periods, as a log that is read."""
    put_back, ends = advanced(torque, RATE_HZ, periods / RATE_HZ), 4
    return AxisLog(RATE_HZ, position[ends:-ends], put_back[ends:-ends], "mock", "0")


def errors(position, torque, periods):
    """Relative error of each parameter, the torque taken as late by so many periods."""
    found = joint_fit(regressors(in_time(position, torque, periods))).symmetric.parameters
    return {name: found[name].value / truth - 1 for name, truth in TRUTH.items()}


@pytest.mark.parametrize("delay_ticks", [0, 3])
def test_a_measured_current_is_half_a_period_late_whatever_the_drive_delays(delay_ticks):
    """Measured: viscous friction -.04 % off with half a period, +11 % with none, -11 % with a whole one."""
    position, measured, _ = driven(delay_ticks)
    right = errors(position, measured, 0.5)
    assert max(abs(error) for error in right.values()) < 1e-3
    assert errors(position, measured, 0.0)["viscous_nms_rad"] > 0.08
    assert errors(position, measured, 1.0)["viscous_nms_rad"] < -0.08


@pytest.mark.parametrize("periods", [0.0, 0.5, 1.0])
def test_the_delay_left_in_a_log_is_found_and_said(periods):
    """Measured: 2.52, .013 and -2.48 ms of 2.5, 0 and -2.5."""
    position, measured, _ = driven(0)
    fit = joint_fit(regressors(in_time(position, measured, periods)))
    left_s = (0.5 - periods) / RATE_HZ
    assert fit.remaining_delay_s.value == pytest.approx(left_s, abs=5e-5)
    assert any("the torque looks 2." in text for text in fit.warnings) is (periods != 0.5)


@pytest.mark.parametrize("delay_ticks", [0, 3])
def test_a_recorded_command_is_early_by_half_a_period_and_by_the_delay_of_the_drive(delay_ticks):
    position, _, command = driven(delay_ticks)
    right = errors(position, command, -0.5 - delay_ticks)
    assert max(abs(error) for error in right.values()) < 1e-3
    assert errors(position, command, 0.5)["viscous_nms_rad"] < -0.15
