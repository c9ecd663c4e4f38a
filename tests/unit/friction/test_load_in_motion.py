"""Friction that grows with the torque through a gear, from logs of a joint in motion."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from rtctl.cli.identify_log import command
from rtctl.errors import DataError
from rtctl.friction.learn.beside_speed import judge_load
from rtctl.friction.logs.loads import with_load
from rtctl.friction.point_reader import read_points

RATE_HZ, SECONDS, INERTIA, LIMIT_NM = 200.0, 40.0, 0.05, 6.0
BASE_NM, VISCOUS, OUTSIDE, MOTOR = 0.2, 0.15, 0.1, 0.04


def written(path, load_nm, seed=3):
    """A joint that a motor moves against a torque from outside, its friction by both: closed form, no code of
    ours."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    w = 2 * np.pi * np.array([0.17, 0.41, 0.93])
    sizes = np.array([0.5, 0.25, 0.1])
    phases = np.outer(t, w) + rng.uniform(0, 6, 3)
    x, v, a = np.sin(phases) @ sizes, np.cos(phases) @ (sizes * w), -np.sin(phases) @ (sizes * w**2)
    outside = load_nm * np.sin(0.23 * t + 1) + 0.15 * load_nm * np.sin(3.1 * t)
    motor = INERTIA * a - outside
    for _ in range(30):  # friction is by the motor's torque, which overcomes friction: a contraction
        dry = BASE_NM + np.abs(OUTSIDE * outside - MOTOR * motor)
        motor = INERTIA * a - outside + np.tanh(v / 0.01) * dry + VISCOUS * v
    noise = 0.003 * LIMIT_NM * rng.standard_normal((2, len(t)))
    shown = np.round(x * 65536 / (2 * np.pi)) * (2 * np.pi / 65536)
    table = np.column_stack([t, shown, motor + noise[0], outside + noise[1]])
    np.savetxt(path, table, delimiter=",", header="t,q,motor,hand", comments="", fmt="%.8g")
    return path


def identified(log, tmp_path, *more):
    columns = ("time=t", "position=q", "torque=motor", "external=hand")
    roles = [word for one in columns for word in ("--column", one)]
    wanted = ["--log", str(log), *roles, "--gear-ratio", "1", "--torque-delay", "0", *more]
    return CliRunner().invoke(command, [*wanted, "--out", str(tmp_path / "found")], catch_exceptions=False)


@pytest.fixture(scope="module")
def loaded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("loaded")
    assert identified(written(folder / "log.csv", 0.7 * LIMIT_NM), folder, "--by-load").exit_code == 0
    return read_points(folder / "found" / "points.csv")


def test_a_log_in_motion_tells_the_share_of_a_load_within_a_tenth(loaded):
    verdict = judge_load(loaded, "speed")
    assert verdict.chosen is not None, verdict.reason
    terms = verdict.chosen.terms
    assert terms.value("outside") + terms.value("motor") == pytest.approx(OUTSIDE + MOTOR, rel=0.1)
    assert verdict.less_share > 0.8


def test_a_point_is_of_one_speed_and_one_load(loaded):
    load, speed = loaded.columns["load_nm"], loaded.velocity_rad_s
    for direction in (1, -1):
        mine = loaded.rows_of(direction)
        slowest = mine[np.argsort(np.abs(speed[mine]))][:9]
        assert np.ptp(load[slowest]) > LIMIT_NM
    # the torques are in balance but for the acceleration, which goes either way
    motor = loaded.columns["motor_nm"]
    rest = motor + load - loaded.direction * loaded.friction_nm
    assert np.abs(rest).mean() < 0.1


def test_a_load_that_hardly_changes_is_told(tmp_path):
    assert identified(written(tmp_path / "log.csv", 0.05), tmp_path, "--by-load").exit_code == 0
    verdict = judge_load(read_points(tmp_path / "found" / "points.csv"), "speed")
    assert verdict.chosen is None
    assert "do not span it" in verdict.reason


def test_one_torque_tells_no_load():
    alone = SimpleNamespace(external_nm=None, source="log.csv")
    with pytest.raises(DataError, match="needs two torques"):
        with_load(None, alone)
