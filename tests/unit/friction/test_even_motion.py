"""To and fro at even speeds: friction at these speeds is told, and of what is not in the log how large it may
be.
"""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from dirty_logs import said_by

from rtctl.errors import DataError
from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.regression import TooEvenError, joint_fit
from rtctl.friction.logs.regressors import regressors

J, B, F, RATE_HZ = 0.01, 0.08, 0.25, 500.0


def strokes(speeds, seconds=30.0, travel=0.6, noise=0.002):
    """A triangle of constant speeds, each for four strokes, whose corners take 20 ms; time, position,
    torque.
    """
    corners, at, side, t = [(0.0, 0.0)], 0.0, 1.0, 0.0
    k = 0
    while t < seconds:
        v = speeds[(k // 4) % len(speeds)]
        t, at = t + travel / v, at + side * travel
        corners.append((t, at))
        side, k = -side, k + 1
    time = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    sharp = np.interp(time, *np.array(corners).T)
    window = np.ones(11) / 11
    x = np.convolve(np.pad(sharp, 5, mode="edge"), window, mode="valid")
    v = np.gradient(x, 1 / RATE_HZ)
    torque = J * np.gradient(v, 1 / RATE_HZ) + B * v + F * np.sign(v)
    return time, x, torque + noise * np.random.default_rng(3).standard_normal(len(x))


def log_of(speeds):
    time, x, torque = strokes(speeds)
    return time, AxisLog(RATE_HZ, x, torque, "triangle", "0" * 64)


def test_one_speed_tells_the_friction_at_it_and_bounds_the_rest():
    fit = joint_fit(regressors(log_of([0.4])[1]))
    for form in (fit.symmetric, fit.per_direction):
        for name, each in form.parameters.items():
            truth = {"inertia": J, "viscous": B, "coulomb": F, "level": F, "offset": 0.0}[name.split("_")[0]]
            truth = -truth if name == "level_backward_nm" else truth
            assert each.low <= truth <= each.high, (name, each)
    assert fit.symmetric.parameters["coulomb_nm"].value == pytest.approx(F + 0.4 * B, rel=0.01)
    assert fit.symmetric.parameters["inertia_kgm2"].high < 1.0, "torque at the turns bounds it"
    said = " ".join(fit.warnings)
    assert "motion at even speeds: the friction at 0.39" in said
    assert "how much of the friction is viscous" in said


def test_several_speeds_tell_viscous_friction_too():
    fit = joint_fit(regressors(log_of([0.1, 0.25, 0.5, 1.0])[1]))
    found = fit.symmetric.parameters
    assert found["viscous_nms_rad"].value == pytest.approx(B, rel=0.05)
    assert found["coulomb_nm"].value == pytest.approx(F, rel=0.02)
    assert found["inertia_kgm2"].holds(J)


def test_points_of_one_speed_go_into_a_file_and_are_right(tmp_path):
    time, x, torque = strokes([0.4])
    path = tmp_path / "log.csv"
    np.savetxt(path, np.column_stack([time, x, torque]), delimiter=",", header="time_s,x,motor", comments="")
    columns = ("--column", "position=x", "--column", "torque=motor")
    code, out, err = said_by("--log", str(path), *columns, "--out", str(tmp_path / "found"), "--json")
    assert code == 0, err
    assert json.loads(out)["symmetric"]["parameters"]["inertia_kgm2"]["value"] == 0.0
    points = np.genfromtxt(tmp_path / "found" / "points.csv", delimiter=",", names=True)
    off = np.abs(np.abs(points["friction_torque_nm"]) / (F + 0.4 * B) - 1)
    assert np.quantile(off, 0.9) < 0.01
    assert off.max() < 0.1, "beside the turns a little acceleration is left in it"


def test_a_motion_that_tells_nothing_at_all_is_still_refused():
    _, log = log_of([0.4])
    turned = replace(log, torque_nm=-log.torque_nm)
    with pytest.raises(DataError, match="assists the motion"):
        joint_fit(regressors(turned))
    assert issubclass(TooEvenError, DataError)


def servo_in_triangles(seconds=60.0, speed=1.2, step_s=2e-4):
    """Time, position and torque at 100 Hz of a joint that a servo turns to and fro at one speed."""
    t = np.arange(0, seconds, step_s)
    wanted = np.abs(((speed * t + 1) % 4.0) - 2.0)
    rate, q, v, torque, rows = np.gradient(wanted, step_s), 1.0, 0.0, 0.0, []
    for k in range(len(t)):
        dry = 0.3 + 0.1 * math.exp(-abs(v) / 0.05)
        torque = 60 * (wanted[k] - q) + 2 * (rate[k] - v)
        v += step_s * (torque - dry * math.tanh(v / 0.01) - 0.08 * v) / 0.02
        q += step_s * v
        rows.append((q, torque))
    q, torque = np.array(rows)[::50].T
    rng = np.random.default_rng(1)
    return t[::50], np.round(q / 9.6e-5) * 9.6e-5, torque + 0.002 * rng.standard_normal(len(q))


@pytest.mark.parametrize("sign", [1, -1])
def test_strokes_of_a_servo_have_the_friction_of_their_speed_and_a_sign_that_is_turned(tmp_path, sign):
    time, x, torque = servo_in_triangles()
    path = tmp_path / "log.csv"
    np.savetxt(
        path, np.column_stack([time, x, sign * torque]), delimiter=",", header="time_s,x,motor", comments=""
    )
    columns = ("--column", "position=x", "--column", "torque=motor")
    code, out, err = said_by("--log", str(path), *columns, "--out", str(tmp_path / "found"), "--json")
    if sign < 0:
        assert code == 10
        assert "assists the motion" in out + err
        return
    assert code == 0, out + err
    points = np.genfromtxt(tmp_path / "found" / "points.csv", delimiter=",", names=True)
    assert np.median(np.abs(points["friction_torque_nm"])) == pytest.approx(0.3 + 0.08 * 1.2, rel=0.03)
