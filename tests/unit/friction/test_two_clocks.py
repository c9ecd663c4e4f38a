"""A torque that is stamped by another clock than the position, by so little that friction is nearly right."""

import re
from dataclasses import replace

import numpy as np
import pytest
from moved_joint import CLEAN, simulate

from rtctl.friction.logs.log_input import Gearing, options_of, read_log
from rtctl.friction.logs.regression import joint_fit
from rtctl.friction.logs.regressors import of_stretches

MAPPED = {"position": {"column": "x"}, "hand_torque": {"column": "hand"}}


def told(log, torque, folder):
    path = folder / "log.csv"
    rows = np.column_stack([log.time, log.position, torque])
    np.savetxt(path, rows, delimiter=",", header="time_s,x,hand", comments="", fmt="%.9g")
    fit = joint_fit(of_stretches(read_log(options_of(path, MAPPED, None), Gearing())))
    said = [text for text in fit.warnings if "two clocks" in text or "torque looks" in text]
    return said, fit.symmetric.parameters["viscous_nms_rad"].value


@pytest.mark.parametrize("rate", [3e-4, -3e-4])
def test_a_clock_that_gains_little_is_named_and_its_remedy_puts_the_column_right(rate, tmp_path):
    log = simulate(replace(CLEAN["hand"], seconds=60.0))
    off = np.interp(log.time, log.time * (1 + rate), log.hand)
    (said,), wrong = told(log, off, tmp_path)
    assert "two clocks" in said
    line = re.search(r"torque = (np\.interp\(.*\))", said)[1]
    put_right = eval(line, {"np": np, "t": log.time, "torque": off})
    found, right = told(log, put_right, tmp_path)
    assert not [text for text in found if "two clocks" in text]
    assert abs(right / log.truth["viscous_nms_rad"] - 1) < 0.05
    assert abs(right - log.truth["viscous_nms_rad"]) < 0.5 * abs(wrong - log.truth["viscous_nms_rad"])


def test_one_clock_and_one_delay_are_no_two_clocks(tmp_path):
    log = simulate(replace(CLEAN["hand"], seconds=60.0))
    assert not told(log, log.hand, tmp_path)[0]
    (said,), _ = told(log, np.interp(log.time - 0.006, log.time, log.hand), tmp_path)
    assert "ms late" in said
    assert "two clocks" not in said


def test_a_clock_that_gains_what_friction_explains_as_well_is_not_named(tmp_path):
    log = simulate(replace(CLEAN["hand"], seconds=60.0, hand_noise=0.03))
    off = np.interp(log.time, log.time * (1 + 4e-5), log.hand)
    said, viscous = told(log, off, tmp_path)
    assert not [text for text in said if "two clocks" in text]
    assert viscous == pytest.approx(log.truth["viscous_nms_rad"], rel=0.06)
