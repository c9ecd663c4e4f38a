"""What is held out together: speeds of averaged points, stretches of time of a log's samples."""

import json
import sys

import numpy as np
import pytest

from rtctl.__main__ import main
from rtctl.errors import DataError
from rtctl.friction import artefact
from rtctl.friction.learn import fit, ladder, report_evidence, report_measured_range, search
from rtctl.friction.learn.hold_out import TRAINS, folds_of, way_for
from rtctl.friction.point_reader import read_points
from rtctl.friction.points import FrictionPoints, require_enough

N = 200


def samples(drift_nm=0.0, count=np.nan, seed=4):
    """A log: speeds at random, friction that drifts to and fro slowly, both directions by turns."""
    rng = np.random.default_rng(seed)
    rows = []
    for i in range(2 * N):
        v, direction = rng.uniform(0.02, 2.0), 1 if i % 2 else -1
        f = 0.25 + 0.1 * np.exp(-((v / 0.1) ** 2)) + 0.05 * v + rng.normal(0, 0.001)
        rows.append((direction * v, f + drift_nm * np.sin(4 * i / N), direction, np.nan, count))
    times = {"time_s": 0.01 * np.arange(2 * N)}
    return FrictionPoints.from_rows(rows, "log.csv", "0" * 64, times)


def test_samples_with_times_are_held_out_by_time_and_averages_by_speed():
    assert way_for(samples()) == way_for(samples(count=1.0)) == "time"
    assert way_for(samples(count=100.0)) == "speed"
    assert way_for(samples(count=100.0), "time") == "time"
    assert way_for(samples(), "speed") == "speed"


def test_times_that_are_not_all_there_are_refused_when_asked_for_and_left_alone_when_not():
    points = samples()
    points.time_s[3] = np.nan
    assert way_for(points) == "speed"
    with pytest.raises(DataError, match=r"log\.csv: folds by time need the column time_s"):
        way_for(points, "time")


@pytest.mark.parametrize("directions", [(1,), (-1,), (1, -1)])
def test_every_fold_by_time_is_one_stretch(directions):
    points = samples()
    fold = folds_of(points, directions, "time")
    rows = np.concatenate([points.rows_of(direction) for direction in directions])
    speed, time_s = np.abs(points.velocity_rad_s[rows]), points.time_s[rows]
    assert set(speed[fold == TRAINS]) == {speed.min(), speed.max()}
    order = np.argsort(time_s)
    kept = fold[order][fold[order] != TRAINS]
    assert np.all(np.diff(kept) >= 0)
    assert set(kept) == {0, 1, 2, 3, 4}


def test_the_search_trains_without_the_stretch_it_judges(monkeypatch):
    points, seen = samples(), []
    right = search.train

    def spy(candidate, speed, *more, **options):
        seen.append(np.sort(speed))
        return right(candidate, speed, *more, **options)

    monkeypatch.setattr(search, "train", spy)
    options = ladder.Options(
        families=("coulomb_viscous",), symmetric="no", backend="sequential", n_jobs=1, folds="time"
    )
    found = ladder.ascend(points, options)
    assert found.folds == "time"
    at, speeds = points.rows_of(1), np.abs(points.velocity_rad_s)
    stretch = (points.time_s[at] - points.time_s[at].min()) / np.ptp(points.time_s[at])
    for k in range(5):
        inside = (stretch >= k / 5) & ((stretch < (k + 1) / 5) | (k == 4))
        ends = np.isin(speeds[at], [speeds[at].min(), speeds[at].max()])
        expected = np.sort(speeds[at][~inside | ends])
        assert any(len(one) == len(expected) and np.all(one == expected) for one in seen)


def test_folds_by_time_see_a_drift_that_folds_by_speed_hide():
    points = samples(drift_nm=0.02)
    held = {
        way: fit.fit_points(points, rig="bench", c=10.0, folds=way).branches[0].validation_rmse_nm
        for way in ("speed", "time")
    }
    assert held["time"] > 1.05 * held["speed"]
    steady = {
        way: fit.fit_points(samples(), rig="bench", c=10.0, folds=way).branches[0].validation_rmse_nm
        for way in ("speed", "time")
    }
    assert steady["time"] == pytest.approx(steady["speed"], rel=0.05)


def test_the_report_shows_the_errors_of_the_folds_that_were_used():
    points = samples(drift_nm=0.02)
    model = fit.fit_points(points, rig="bench", c=10.0, folds="time")
    gathered = report_evidence.gather(points, model, None, folds="time")
    for one, branch in zip(gathered.of(gathered.chosen), model.branches, strict=True):
        rmse = np.sqrt(np.mean(one.held_out.error_nm**2))
        assert rmse == pytest.approx(branch.validation_rmse_nm, rel=1e-9)


@pytest.mark.parametrize(("options", "way"), [((), "time"), (("--folds", "speed"), "speed")])
def test_the_command_says_how_it_held_out(monkeypatch, capsys, tmp_path, options, way):
    points = samples()
    columns = (points.velocity_rad_s, points.friction_nm * points.direction, points.time_s)
    lines = ["velocity_rad_s,friction_torque_nm,time_s"]
    lines += [",".join(repr(float(value)) for value in row) for row in zip(*columns, strict=True)]
    path, out, folder = tmp_path / "log.csv", tmp_path / "m.json", tmp_path / "r"
    path.write_text("\n".join(lines))
    assert way_for(read_points(path)) == "time"
    arguments = ["fit", path, "--out", out, "--C", 10, "--report", folder, *options, "--json"]
    monkeypatch.setattr(sys, "argv", ["rtctl", *map(str, arguments)])
    with pytest.raises(SystemExit, match="0"):
        main()
    body = json.loads(capsys.readouterr().out)
    assert body["folds"] == json.loads((folder / "report.json").read_text())["folds"] == way
    said = {"time": "5 stretches of time", "speed": "5 folds by speed"}[way]
    assert said in (folder / "report.html").read_text()
    want = fit.fit_points(points, rig="mock", c=10.0, folds=way).branches[0].validation_rmse_nm
    assert artefact.load(out).branches[0].validation_rmse_nm == pytest.approx(want, rel=1e-9)


def test_repeats_of_a_nominal_speed_are_held_out_together_however_they_were_measured():
    rng = np.random.default_rng(3)
    nominal = np.repeat(np.geomspace(0.004, 2.0, 6), 4)
    speed = nominal * (1 + 0.003 * rng.standard_normal(len(nominal)))
    rows = [(d * v, 0.3 + 0.1 * v, d, np.nan, np.nan) for d in (1, -1) for v in speed]
    points = FrictionPoints.from_rows(rows, "runs.csv", "0" * 64)
    fold = folds_of(points, (1,), "speed").reshape(6, 4)  # by rising speed
    assert (fold == fold[:, :1]).all()
    assert (fold[[0, -1]] == TRAINS).all()
    assert len(set(fold[1:-1, 0])) == 4
    even = np.repeat(np.linspace(0.2, 2.0, 8), 4) * (1 + 0.003 * rng.standard_normal(32))
    assert len(report_measured_range.unmeasured(even)) == 1, "below the slowest"
    few = np.isin(nominal, np.unique(nominal)[:3])
    with pytest.raises(DataError, match="only 3 different speeds"):
        require_enough(FrictionPoints.from_rows([rows[k] for k in np.flatnonzero(np.tile(few, 2))], "r", "0"))


def test_the_viscous_slope_is_not_told_by_repeats_of_one_speed():
    rng = np.random.default_rng(3)
    speed = np.repeat([0.01, 0.1, 0.9, 2.0], 8) * (1 + 0.003 * rng.standard_normal(32))
    friction = 0.3 + 0.1 * speed + 0.02 * rng.standard_normal(32)
    assert fit.viscous_slope(speed, friction) == pytest.approx(0.1, abs=0.03)
