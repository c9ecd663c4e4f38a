"""What is said of a row is said of its own file, by the time of that file: of several logs, and of a log with
gaps.
"""

import tracemalloc
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.friction.logs.balance import Balance
from rtctl.friction.logs.balance_faults import diagnosed
from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.held_still import held_still
from rtctl.friction.logs.intervals import Estimate
from rtctl.friction.logs.plausibility import Limits, doubtful_offsets, plausible
from rtctl.friction.logs.regressors import of_stretches, pooled
from rtctl.friction.logs.rows_in_turn import hold

RATE_HZ = 200.0
T = np.arange(8000) / RATE_HZ


def made(name, *, coulomb=0.25, rests=None, push_nm=2.0):
    """A joint of .05 kg m^2 by two sines; `rests` (s, s): held there while so much pushes it."""
    waves = [(a, 2 * np.pi * f) for a, f in ((0.4, 0.4), (0.12, 1.3))]
    clock = T.copy()
    if rests is not None:
        clock = np.cumsum(np.where((rests[0] <= T) & (rests[1] > T), 0.0, 1 / RATE_HZ))
    x = sum(a * np.sin(w * clock) for a, w in waves)
    v = sum(a * w * np.cos(w * clock) for a, w in waves)
    acceleration = sum(-a * w**2 * np.sin(w * clock) for a, w in waves)
    torque = 0.05 * acceleration + 0.05 * v + coulomb * np.sign(v)
    if rests is not None:
        torque = np.where((rests[0] <= T) & (rests[1] > T), push_nm, torque)
    torque = torque + np.random.default_rng(1).normal(0, 0.005, len(T))
    return AxisLog(RATE_HZ, x, torque, name, name)


def balance_of(*logs):
    return Balance.of(pooled([of_stretches([one]) for one in logs]))


def test_a_stand_is_told_of_its_own_log_at_its_own_time():
    held = made("second.csv", rests=(20.0, 22.0))
    (text,) = held_still(balance_of(made("first.csv"), held))
    assert text.startswith("second.csv: the joint stands for")
    assert " from 20" in text
    assert held_still(balance_of(made("first.csv"), made("third.csv"))) == ()
    # the other zero of a second session pushes nothing: it was taken for 2 N m
    rests = made("third.csv", rests=(20.0, 22.0), push_nm=0.2)
    other = replace(made("first.csv"), torque_nm=made("first.csv").torque_nm + 2.0)
    for logs in ((other, rests), (rests, other), (rests, other, replace(rests, source="fourth.csv"))):
        assert held_still(balance_of(*logs)) == ()


def test_parts_of_a_second_log_are_told_by_the_time_of_that_log():
    warms = made("second.csv", coulomb=np.repeat([0.15, 0.25, 0.40], [2700, 2700, 2600]))
    told = [text for text in diagnosed(balance_of(made("first.csv"), warms)) if "changes within" in text]
    assert told
    assert all("second.csv" in text for text in told)
    (times,) = {text.split("parts from ")[1].split(" on ")[0] for text in told}
    assert [float(one.split()[0]) for one in times.split(", ")] == pytest.approx([0.0, 13.3, 26.6], abs=1.0)


def test_rows_of_a_stretch_behind_a_gap_are_not_told_as_rows_of_the_file():
    log = made("log.csv")
    torque = log.torque_nm.copy()
    torque[1000:1100] = torque[1000]
    recording = type("Recorded", (), {"hand_torque_nm": None})
    for start_s, said in ((0.0, "log.csv: motor torque: stands still"), (12.5, "(rows from 12.5 s on)")):
        part = replace(log, torque_nm=torque, start_s=start_s)
        (text,) = [one for one in plausible(recording, part, torque, Limits()) if "stands still" in one]
        assert said in text
        assert "from row 1001 on" in text


def test_a_held_log_with_a_gap_of_an_hour_needs_no_table_of_the_gap():
    moved = 0.5 * np.sin(2 * np.arange(20_000) / 1000)
    seen = moved[np.arange(20_000) // 5 * 5]
    at = np.arange(20_000.0) + 3.6e6 * (np.arange(20_000) >= 10_000)
    tracemalloc.start()
    found = hold(seen, at)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found.times == pytest.approx(5)
    assert most < 8e6  # bytes; a number for each row of the gap would be 29e6


@pytest.mark.parametrize("value", [-0.002, 0.0])
def test_an_offset_beside_no_coulomb_friction_is_no_negative_share_of_it(value):
    """It was "-2500 % of the Coulomb friction", and a division by 0."""
    found = {"coulomb_nm": Estimate(value, 0.01, -0.02, 0.02), "offset_nm": Estimate(0.05, 0.01, 0.03, 0.07)}
    fit = SimpleNamespace(
        symmetric=SimpleNamespace(parameters=found),
        offsets=(SimpleNamespace(parameter="offset_nm", source="log.csv"),),
    )
    (text,) = doubtful_offsets(fit)
    assert "an offset of 0.05 N m, beside no Coulomb friction, is taken out" in text
