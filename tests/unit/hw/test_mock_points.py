"""Friction points measured on the mock are those of its true curve, within a laboratory's error."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from hw.simulators.jit import records
from hw.simulators.mock_bristles import static_friction
from hw.simulators.mock_records import plant_records
from rtctl.errors import DataError
from rtctl.friction import artefact
from rtctl.friction.point_reader import read_points
from rtctl.rig_file.config import load
from rtctl.simulation import mock_points
from rtctl.simulation.family import with_plant

COLUMNS = ("weakest_place_nm", "presliding_rad", "presliding_spread_rad", "presliding_ramps")
CONFIGS = Path(__file__).parents[3] / "configs"


@pytest.fixture(scope="module")
def loaded():
    return load(CONFIGS / "mock.toml")


@pytest.fixture(scope="module")
def curve(loaded):
    params = records(plant_records(loaded.options, loaded.config.hardware())[0])
    params["modulation_share"] = 0  # points average over the whole turn

    def friction_nm(velocity_rad_s, direction):
        return abs(static_friction(velocity_rad_s or direction * 1e-12, 0.0, params[0], 0))

    return friction_nm


@pytest.mark.compiled
def test_a_joint_that_does_not_break_away_is_told_and_no_point(loaded, monkeypatch):
    monkeypatch.setattr(mock_points, "RAMP_MAX_S", 0.2)  # 10 mN m
    with pytest.raises(DataError, match=r"did not break away at 0\.01 N m.*rtctl identify"):
        mock_points.measure(loaded, levels=1, measurements=2)


def test_points_measured_now_lie_on_the_true_curve(loaded, curve):
    points = mock_points.measure(loaded, levels=6, measurements=20)
    assert [(p.direction, p.velocity_rad_s == 0) for p in points[:2]] == [(1, True), (1, False)]
    assert len(points) == 14
    for p in points:
        assert p.direction * p.friction_torque_nm == pytest.approx(
            curve(p.velocity_rad_s, p.direction), abs=0.005
        )
        assert 0 < p.std_nm < 0.02
        assert p.count == 20


def test_so_many_presliding_lengths_pass_before_a_measurement(loaded, monkeypatch):
    seen = []

    def point(velocity, direction, bent_rad=None):
        return mock_points.Point(velocity, 0.3 * direction, 0.0, 1, direction, presliding_rad=bent_rad)

    def at_speed(rig, velocity, _measurements):
        seen.append(rig.settle_rad)
        return point(velocity, 1)

    monkeypatch.setattr(mock_points, "rested_a", lambda _rig: 0.0)
    monkeypatch.setattr(mock_points, "_break_away_point", lambda _rig, way, _n: point(0.0, way, 0.007))
    monkeypatch.setattr(mock_points, "constant_velocity_point", at_speed)
    mock_points.measure(loaded, levels=2)
    assert seen == [mock_points.SETTLE_RAD, *[pytest.approx(0.035)] * 5]  # a warm-up and two speeds each way


def test_a_joint_that_swings_on_is_waited_for(loaded, monkeypatch):
    rig = mock_points.Rig(loaded)
    swing = iter([*(0.01 * (-1) ** k for k in range(20)), *[0.0] * 100])
    moments = []

    def rest(tick, _state, _params, ticks):
        tick["position_rad"][0, 0] = next(swing)
        moments.append(ticks)
        return 0.0

    monkeypatch.setattr(mock_points, "_rest", rest)
    mock_points._come_to_rest(rig)
    assert sum(moments) == rig.ticks(4 * mock_points.PAUSE_S)
    moments.clear()
    mock_points._come_to_rest(rig)
    assert sum(moments) == rig.ticks(mock_points.PAUSE_S)  # as long as it takes where nothing swings


@pytest.mark.compiled
def test_soft_bristles_have_slid_before_they_are_measured(loaded, curve):
    """They bend over 7 mrad: after 8 mrad at a speed a third of the friction was still missing; and they
    swung on where their break-away began.
    """
    points = mock_points.measure(with_plant(loaded, "lugre-soft"), levels=4, measurements=10)
    assert points[0].friction_torque_nm == pytest.approx(curve(0.0, 1), rel=0.05)
    assert points[0].presliding_rad == pytest.approx(0.007, rel=0.1)
    for p in points[1:5]:
        assert p.friction_torque_nm == pytest.approx(curve(p.velocity_rad_s, p.direction), rel=0.01)


def test_the_points_come_from_the_sensors_and_not_from_the_truth(loaded, curve):
    wrong = {**loaded.options, "axis": [{**loaded.options["axis"][0], "torque_scale": 0.8}]}
    points = mock_points.measure(loaded.model_copy(update={"options": wrong}), levels=2, measurements=5)
    for p in points:  # a motor 20 % weaker than the data sheet needs 25 % more current
        expected = curve(p.velocity_rad_s, p.direction) / 0.8
        assert p.direction * p.friction_torque_nm == pytest.approx(expected, abs=0.01)


def test_the_shipped_points_are_the_54_speeds_and_break_away_of_both_directions(curve):
    points = read_points(CONFIGS / "friction" / "mock_points.csv")
    speeds = np.concatenate([[0.0], np.geomspace(0.005, 2.0, 54)])
    for direction in (1, -1):
        measured_at, friction_nm = points.branch(direction)
        assert measured_at == pytest.approx(speeds, rel=1e-6)
        true_nm = np.array([curve(direction * v, direction) for v in speeds])
        assert np.max(np.abs(friction_nm - true_nm)) < 0.004
        assert np.sqrt(np.mean((friction_nm - true_nm) ** 2)) < 0.0012
    assert np.all(points.count == 100)


def test_the_shipped_model_was_learned_from_the_shipped_points_and_follows_the_true_curve(curve):
    model = artefact.load(CONFIGS / "friction" / "mock.json")
    assert model.data_sha256 == read_points(CONFIGS / "friction" / "mock_points.csv").sha256
    assert model.rig == "mock"
    speeds = np.linspace(0, 2, 801)
    for direction, branch in zip((1, -1), model.branches, strict=True):
        true_nm = np.array([curve(direction * v, direction) for v in speeds])
        error_nm = branch.magnitude(speeds) - true_nm
        assert np.max(np.abs(error_nm)) < 0.005
        assert np.sqrt(np.mean(error_nm**2)) < 0.0025


def test_the_shipped_model_knows_the_bristles_and_the_weakest_place(curve, loaded):
    model = artefact.load(CONFIGS / "friction" / "mock.json")
    friction = loaded.options["axis"][0]["friction"]
    lengths = [curve(0.0, sign) / friction["bristle_stiffness_nm_rad"] for sign in (1, -1)]
    assert model.presliding_rad == pytest.approx(np.mean(lengths), rel=0.02)
    assert 0 < model.presliding_spread_rad < 0.1 * model.presliding_rad
    assert model.presliding_ramps == 200
    modulated = friction["modulation_share"] * np.array([curve(0.0, sign) for sign in (1, -1)])
    ripple = loaded.options["axis"][0]["ripple_nm"]
    assert (model.place_spread_nm > modulated).all()
    assert (model.place_spread_nm < modulated + ripple + 0.006).all()


def test_the_file_names_its_columns_and_reads_back(tmp_path):
    point = mock_points.Point(-0.5, -0.3, 0.004, 100, -1)
    mock_points.write_csv([point], tmp_path / "points.csv")
    with (tmp_path / "points.csv").open() as file:
        row = next(csv.DictReader(file))
    assert list(row) == ["velocity_rad_s", "friction_torque_nm", "std_nm", "count", "direction", *COLUMNS]
    assert all(row[name] == "" for name in COLUMNS)
    assert math.isclose(float(row["friction_torque_nm"]), -0.3)


def test_wrong_usage_is_told(tmp_path):
    with pytest.raises(SystemExit, match="usage"):
        mock_points.main([])


def test_without_a_rig_file_the_shipped_rig_is_measured(tmp_path, monkeypatch):
    monkeypatch.setattr(mock_points, "measure", lambda loaded: [loaded.config.rig.name])
    monkeypatch.setattr(mock_points, "write_csv", lambda rows, path: path.write_text(*rows))
    mock_points.main([str(tmp_path / "points.csv")])
    assert (tmp_path / "points.csv").read_text() == "mock"
