"""Warnings about logs name the cause that it is, and not one that looks alike."""

import re
from dataclasses import replace

import numpy as np
import pytest
from dirty_changes import column, quantised
from dirty_logs import identified, write
from moved_joint import CLEAN, simulate

from rtctl.friction.logs.log_checks import diagnose
from rtctl.friction.logs.log_input import Gearing, options_of
from rtctl.friction.logs.log_points import read_in_time
from rtctl.friction.logs.regression import joint_fit


def signals_of(log, folder):
    """Stretches of the log, and what is regressed on."""
    torque = (
        {"motor_torque": {"column": "motor"}} if log.hand is None else {"hand_torque": {"column": "hand"}}
    )
    columns = {"position": {"column": "x"}, **torque}
    found = read_in_time([options_of(write(log, folder / "log.csv"), columns, None)], Gearing())
    return found.logs, found.signals


def fine(name, **changed):
    return simulate(replace(CLEAN[name], counts=1e9, **changed))


def test_what_the_steps_of_a_position_leave_over_is_told_as_theirs(tmp_path):
    log = fine("hand")
    (said,) = identified(column("position", quantised(3e-3))(log), tmp_path).said.splitlines()
    assert "column position: too coarse: steps of 0.003 rad leave" in said
    # a hand that nobody mapped leaves more over than these steps
    held = replace(column("position", quantised(1e-3))(log), hand=log.hand + 0.03 * np.sin(7 * log.time))
    assert "is left over and is no noise" in identified(held, tmp_path).said


def test_a_fine_position_is_not_called_coarse_where_the_torque_is_not_proportional(tmp_path):
    log = fine("motor, even strokes")
    bent = replace(log, motor=np.sign(log.motor) * np.abs(log.motor) ** 1.3)
    said = identified(bent, tmp_path).said
    assert "too coarse" not in said
    assert "smaller than with a cut-off of 8 Hz, and not by the steps of the position" in said
    coarse = column("position", quantised(3e-4))(log)
    assert "too coarse: steps of 0.0003 rad make the inertia" in identified(coarse, tmp_path).said


@pytest.mark.parametrize("power", [0.75, 1.3])
def test_a_torque_that_is_a_power_is_told_where_friction_peaks_and_the_torque_is_noisy(power, tmp_path):
    """A cubic left .63 of what was left over, and too much to be told (the column leaves noise)."""
    peaked = {"inertia": 0.02, "coulomb": 0.3, "breakaway": 0.4, "stribeck": 0.3, "motor_noise": 0.02}
    log = fine("motor", **peaked, rate_hz=250.0, seed=33)
    bent = replace(log, motor=np.sign(log.motor) * np.abs(log.motor) ** power)
    said = identified(bent, tmp_path).said
    told = re.search(r"not proportional to what the motion wants: it grows about as the power ([\d.]+)", said)
    assert float(told[1]) == pytest.approx(power, abs=0.12)
    assert "not proportional" not in identified(log, tmp_path).said


def test_noise_of_a_position_widens_the_interval_of_the_inertia_and_has_its_name(tmp_path):
    """White noise of .5 mrad: 1.5 % too small, +- .6 %; where strokes are even 91 %, +- 22 %."""
    for name, level_rad, told in (("hand", 5e-4, False), ("motor, even strokes", 1e-4, True)):
        log = fine(name)
        noise = np.random.default_rng(5).normal(0, level_rad, len(log.position))
        found = signals_of(replace(log, position=log.position + noise), tmp_path)
        inertia = joint_fit(found[1]).symmetric.parameters["inertia_kgm2"]
        assert inertia.low <= 0.012 <= inertia.high
        assert inertia.high - inertia.low < (1.0 if not told else 20.0) * 0.012
        assert any("its noise makes the inertia" in one for one in diagnose(*found)) == told
