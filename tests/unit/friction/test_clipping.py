"""A torque that stays at its largest value is clipped where the balance wants more, and else an even
motion.
"""

import re
from dataclasses import replace

import numpy as np
import pytest
from dirty_changes import clean, moves, softly
from dirty_logs import identified, write

from rtctl.errors import DataError
from rtctl.friction.logs.balance import Balance
from rtctl.friction.logs.clipping import plateaus, require_unclipped
from rtctl.friction.logs.dynamics import AxisLog, Plateau
from rtctl.friction.logs.log_input import Gearing, options_of
from rtctl.friction.logs.log_points import checked
from rtctl.friction.logs.regressors import regressors


def test_runs_of_equal_extremes_are_seen_but_not_those_of_a_slow_bus():
    (found,) = plateaus(np.minimum(np.sin(np.arange(4000) / 70.0), 0.8), "log: torque")
    assert (found.level_nm, found.side) == (0.8, 1.0)
    assert found.rows > 20
    assert plateaus(np.repeat(np.sin(np.arange(400) / 7.0), 25), "log: torque") == ()
    assert plateaus(np.round(np.sin(np.arange(4000) / 70.0)), "log: torque") == ()


def stepped(signal, step):
    return np.round(signal / step) * step


@pytest.mark.parametrize("step", [0.0, 0.004, 0.008])
def test_moves_of_even_accelerations_are_no_clipped_torque(step, tmp_path):
    log = moves(clean("motor"))
    if step:
        log = replace(log, motor=stepped(log.motor, step))
    found = identified(log, tmp_path)
    assert found.code == 0, found.said
    assert "clipped" not in found.said
    assert all(abs(off) < 0.1 for name, off in found.off.items() if name != "viscous_nms_rad"), found.off


@pytest.mark.parametrize("limit", [0.35, 0.45])
def test_moves_that_are_clipped_are_refused(limit, tmp_path):
    log = moves(clean("motor"))
    found = identified(replace(log, motor=np.clip(log.motor, -limit, limit)), tmp_path)
    assert re.search("motor torque.*clipped", found.said), found


def test_a_run_of_equal_largest_torques_is_refused_only_where_the_balance_wants_more():
    log = moves(clean("motor"))

    def judge(motor):
        balance = Balance.of(regressors(AxisLog(500.0, log.position, motor, "log", "0" * 64)))
        level = float(np.quantile(balance.torque, 0.99))
        require_unclipped(balance, [(0, Plateau("log: motor torque", level, 1.0, 7, 40))], "log")

    judge(log.motor)
    with pytest.raises(DataError, match=r"clipped at .* for 40 samples from row 7 on: the motion wants"):
        judge(np.clip(log.motor, -0.45, 0.45))


def test_a_torque_that_the_motion_follows_is_not_clipped(tmp_path):
    """A drive at its limit that records what it gave: the joint moves by that."""
    log = clean("motor")
    for change in (softly(0.45), lambda s, _: np.clip(s, -0.4, 0.4)):
        assert "clipped" in identified(replace(log, motor=change(log.motor, log)), tmp_path).said
    assert "clipped" not in identified(log, tmp_path).said


def test_of_several_logs_the_one_that_is_clipped_is_named_and_left_out(tmp_path):
    """Beside one that is sound it was told as something that is left over, and counted."""
    log = clean("motor")
    sound = write(log, tmp_path / "a.csv")
    cut = write(replace(log, motor=np.clip(log.motor, -0.4, 0.4)), tmp_path / "b.csv")
    columns = {"position": {"column": "x"}, "motor_torque": {"column": "motor"}}
    options = [options_of(path, columns, None) for path in (sound, cut)]
    found = checked(options, Gearing())
    assert [stretches[0].source for stretches in found.logs] == [str(sound)]
    (told,) = [text for text in found.warnings if "clipped" in text]
    assert re.search(r"b\.csv: .*clipped at .*; it is left out, and the other logs are used", told)
    assert found.fit.symmetric.parameters["inertia_kgm2"].value == pytest.approx(0.012, rel=0.03)
