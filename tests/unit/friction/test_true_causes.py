"""Warnings about logs name the cause that it is, and not one that looks alike."""

from dataclasses import replace

import numpy as np
from dirty_changes import column, quantised
from dirty_logs import identified
from moved_joint import CLEAN, simulate


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
