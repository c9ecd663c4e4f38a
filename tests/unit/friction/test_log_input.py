"""Logs that must not be used are refused with file, column and remedy."""

from dataclasses import replace

import numpy as np
import pytest

from rtctl.errors import DataError
from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.log_checks import diagnose
from rtctl.friction.logs.log_input import Gearing, options_of, read_log
from rtctl.friction.logs.log_points import HELD_ON, read_in_time
from rtctl.friction.logs.regressors import regressors

COLUMNS = {
    "time": {"column": "t"},
    "position": {"column": "x"},
    "motor_torque": {"column": "tau"},
}


def signals(n=5000, rate=500.0):
    t = np.arange(n) / rate
    return t, 0.4 * np.sin(2.5 * t), 0.25 * np.cos(2.5 * t) + 0.01 * np.sin(40 * t)


def read(tmp_path, t, x, tau, columns=COLUMNS, **options):
    path = tmp_path / "log.csv"
    rows = "\n".join(f"{a:.6f},{b:.9g},{c:.9g}" for a, b, c in zip(t, x, tau, strict=True))
    path.write_text(f"t,x,tau\n{rows}\n")
    (whole,) = read_log(options_of(path, columns, None), Gearing(), **options)
    return whole


def test_a_late_motor_torque_is_put_back_by_half_a_period_unless_told_otherwise(tmp_path):
    t, x, _ = signals()
    late = np.cos(2.5 * (t - 0.001))
    assert np.abs(read(tmp_path, t, x, late).torque_nm - np.cos(2.5 * t))[2:-2].max() < 1e-6
    assert np.abs(read(tmp_path, t, x, late, torque_delay_s=0.0).torque_nm - late).max() < 1e-6


def test_a_delay_of_many_samples_is_exact_and_what_it_leaves_open_is_cut_off(tmp_path):
    t, x, _ = signals()
    early = np.cos(2.5 * (t + 0.0207))
    found = read(tmp_path, t, x, early, torque_delay_s=-0.0207)
    assert len(found.torque_nm) == len(found.position_rad) == len(t) - 20
    assert np.abs(found.torque_nm - np.cos(2.5 * t[10:-10]))[2:-2].max() < 1e-6
    np.testing.assert_allclose(found.position_rad, x[10:-10], atol=1e-8)


@pytest.mark.parametrize("rates_hz", [(400.0, 100.0), (100.0, 400.0)])
def test_commands_of_two_rates_are_each_held_for_a_period_of_their_own(tmp_path, rates_hz):
    options, draw = [], np.random.default_rng(4)
    waves = ((0.6, 1.95), (0.25, 5.2), (0.1, 11.9))  # rad, rad/s
    for number, rate_hz in enumerate(rates_hz):
        t = np.arange(0.0, 20.0, 1 / rate_hz)
        later = t + 0.5 / rate_hz  # held from its row on: on the mean that much later
        v = sum(r * w * np.cos(w * later + number) for r, w in waves)
        a = -sum(r * w**2 * np.sin(w * later + number) for r, w in waves)
        x = sum(r * np.sin(w * t + number) for r, w in waves)
        tau = 0.01 * a + 0.05 * v + 0.25 * np.sign(v) + 0.002 * draw.normal(size=len(t))
        path = tmp_path / f"{number}.csv"
        np.savetxt(path, np.c_[t, x, tau], delimiter=",", header="t,x,tau", comments="", fmt="%.9g")
        options.append(options_of(path, COLUMNS, None))
    found = read_in_time(options, Gearing())
    assert found.torque_delays_s == pytest.approx([-0.5 / rate_hz for rate_hz in rates_hz])
    assert found.taken == (HELD_ON,)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t, x, tau: (t, x, 0 * tau), "constant"),
        (lambda t, x, tau: (t, np.degrees(x) * 10, tau), "position.*unit"),
        (lambda t, x, tau: (t, x, 1e5 * tau), "unit of the torque"),
        (lambda t, x, tau: (0 * t, x, tau), "time does not increase"),
        (lambda t, x, tau: (t[::-1], x, tau), "time does not increase"),
        (lambda t, x, tau: (t + 0.0015 * (np.arange(len(t)) % 3 == 1), x, tau), "uneven sampling: 67 % of"),
        (
            lambda t, x, tau: (np.where(np.arange(len(t)) == 70, t - 0.002, t), x, tau),
            "1 duplicated timestamps",
        ),
        (
            lambda t, x, tau: (np.where(np.arange(len(t)) == 70, t - 0.003, t), x, tau),
            "unsorted time: row 71",
        ),
        (lambda t, x, tau: (t, np.where(t == 1.0, np.nan, x), tau), "'x' row 501.*not a finite number"),
    ],
)
def test_a_log_that_cannot_be_used_is_refused(tmp_path, change, message):
    with pytest.raises(DataError, match=message):
        read(tmp_path, *change(*signals()))


def test_a_position_that_seems_to_rest_between_its_few_levels_is_told_so():
    t = np.arange(0, 40, 1 / 500)
    position = np.round(10 * np.sin(2 * np.pi * 0.05 * t)) / 20
    torque = 0.2 * np.sign(np.cos(2 * np.pi * 0.05 * t)) + 0.01 * np.sin(t)
    log = AxisLog(500.0, position, torque, "log", "0" * 64)
    with pytest.raises(DataError, match=r"column position: too coarse: 20 steps of 0\.05 rad"):
        diagnose([(log,)], regressors(log, speed_min_rad_s=50.0))
    # few rows slide, but not for the position: a velocity was recorded, and is not to be asked for again
    told = replace(log, velocity_rad_s=np.gradient(10 * np.sin(2 * np.pi * 0.05 * t), 1 / 500) / 20)
    assert diagnose([(told,)], regressors(told, speed_min_rad_s=50.0)) == ()
