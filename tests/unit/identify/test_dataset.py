"""The data set on disk: whole at any moment, readable by the fit, resumed only with what belongs to it."""

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest
from identified import CONFIG, SMALL, run

from rtctl.errors import DataError
from rtctl.friction.learn.point_evidence import presliding_of
from rtctl.friction.point_reader import read_points
from rtctl.identify import dataset_files as module
from rtctl.identify.dataset import Dataset
from rtctl.identify.dataset_files import read_document, write_whole
from rtctl.identify.measurement_order import tasks
from rtctl.identify.session import Point
from rtctl.identify.ticks import FIELDS
from rtctl.rig_file.config import load

MORE = replace(SMALL, train_levels=8)


@pytest.fixture(scope="module")
def loaded():
    return load(CONFIG)


@pytest.fixture(scope="module")
def whole(tmp_path_factory, loaded):
    """A finished data set."""
    store = Dataset.create(tmp_path_factory.mktemp("whole") / "set", loaded, MORE, simulated=True)
    run(settings=MORE, store=store)
    return store.folder


def test_the_fit_reads_its_points(whole):
    points = read_points(whole / "points_train.csv")
    document = read_document(whole)
    train = [point for point in document["points"] if point["use"] == "train"]
    assert len(points.branch(1)[0]) == len(points.branch(-1)[0]) == 9
    assert sorted(points.std_nm) == pytest.approx(sorted(p["std_nm"] for p in train), abs=1e-6)
    assert set(points.count) == {12}
    bent = presliding_of(points)
    assert bent.length_rad == pytest.approx(1.03 * 0.35 / 250, rel=0.03), "the mean of both directions"
    assert 0 < bent.spread_rad < 0.1 * bent.length_rad
    assert bent.ramps == 2 * 3, "every fifth ramp of twelve"
    assert all(p["weakest_place_nm"] / p["friction_torque_nm"] <= 1 for p in train)
    lines = (whole / "points_test.csv").read_text().splitlines()
    assert len(lines) == 2 + 4


def test_a_break_away_below_the_slowest_speeds_is_raised_to_what_they_show(whole, loaded, tmp_path):
    store = Dataset.create(tmp_path / "set", loaded, MORE, simulated=True)
    store.document |= {"sessions": read_document(whole)["sessions"]}
    slow, next_slow = 0.5, 0.45
    for task, torque in ((tasks(MORE)[0], 0.4),
        *zip(sorted((t for t in tasks(MORE) if t.speed_rad_s and t.direction > 0),
            key=lambda t: t.speed_rad_s), (slow, next_slow), strict=False)):  # fmt: skip
        model = next(one for one in read_document(whole)["points"] if one["target_rad_s"] == 0)
        fields = {name: model[name] for name in Point.__dataclass_fields__}
        store.add(
            Point(
                **{
                    **fields,
                    "name": task.name,
                    "direction": 1,
                    "target_rad_s": task.speed_rad_s,
                    "friction_torque_nm": torque,
                }
            ),
            (),
        )
    kept = read_document(store.folder)["points"][0]
    assert (kept["friction_torque_nm"], kept["ramp_nm"]) == (pytest.approx(slow), 0.4)


def test_it_says_where_it_comes_from(whole, loaded):
    document = read_document(whole)
    assert document["complete"]
    assert document["rig"] == "mock"
    assert document["config_sha256"] == loaded.sha256
    assert document["settings"]["seed"] == 1
    (session,) = document["sessions"]
    assert session["bias"]["temperature_c"] == 25.0
    assert {"rtctl", "numpy", "numba", "python"} <= session["versions"].keys()
    assert session["date"].startswith("20")


def test_a_rig_without_a_thermometer_is_identified_and_learned_from(loaded, tmp_path):
    few = replace(SMALL, train_levels=8, test_levels=0, measurements=2, spots=1, warm_up_s=0.5, bias_s=0.5)
    store = Dataset.create(tmp_path / "set", loaded, few, simulated=True)

    def takes_the_thermometer_away(rows):
        rows["temperature_c"] = np.nan

    run(settings=few, store=store, watch=takes_the_thermometer_away)
    document = read_document(store.folder)
    assert document["complete"]
    assert document["sessions"][0]["bias"]["temperature_c"] is None
    assert {point["temperature_c"] for point in document["points"]} == {None}
    assert read_points(store.folder / "points_train.csv").temperature_range_c is None


def test_the_ticks_behind_a_point_give_the_point_again(whole):
    document = read_document(whole)
    bias_nm = document["sessions"][0]["bias"]["motor_torque_nm"]
    point = next(p for p in document["points"] if p["target_rad_s"] == 2.0)
    with np.load(whole / "ticks" / f"{point['name']}.npz", allow_pickle=False) as ticks:
        starts, rows = ticks["measurement_start"], ticks["measurement_rows"]
        assert len(starts) == point["count"]
        windows = [slice(start, start + n) for start, n in zip(starts, rows, strict=True)]
        means = [ticks["current_a"][window].mean() for window in windows]
        positions = [ticks["position_rad"][window].mean() for window in windows]
        times_s = 1e-9 * (ticks["first_time_ns"] + (ticks["tick"] - ticks["tick"][0]) * ticks["period_ns"])
        middle_s = 0.5 * (times_s[windows[0]].mean() + times_s[windows[-1]].mean())
    per_ampere = 80 * 0.72 * 0.0134
    assert np.mean(means) * per_ampere - bias_nm == pytest.approx(point["friction_torque_nm"], abs=1e-3)
    assert np.mean(positions) == pytest.approx(point["position_rad"], abs=1e-12)
    assert middle_s - document["sessions"][0]["bias"]["time_s"] == pytest.approx(point["time_s"], abs=1e-6)


def test_every_tick_from_the_bias_to_the_last_point_is_kept(whole):
    document = read_document(whole)
    names = [*document["sessions"][0]["ticks_sha256"], *(point["name"] for point in document["points"])]
    seen = []
    for name in names:
        with np.load(whole / "ticks" / f"{name}.npz", allow_pickle=False) as ticks:
            assert set(FIELDS) <= set(ticks)
            assert len(ticks["force_n"]) == len(ticks["tick"])
            seen.append(ticks["tick"])
    assert names[:2] == ["session00_bias", "session00_warm_up"]
    assert np.all(np.diff(np.concatenate(seen)) == 1)


def test_each_file_of_ticks_is_the_one_the_header_means(whole):
    document = read_document(whole)
    named = {point["name"]: point["ticks_sha256"] for point in document["points"]}
    for name, wanted in {**named, **document["sessions"][0]["ticks_sha256"]}.items():
        assert hashlib.sha256((whole / "ticks" / f"{name}.npz").read_bytes()).hexdigest() == wanted


def test_residuals_against_position_and_time_can_be_drawn(whole):
    points = read_points(whole / "points_train.csv")
    times_s, positions = (points.columns[name] for name in ("time_s", "position_rad"))
    assert len(times_s) == len(positions) == len(points.direction)
    assert np.isfinite(positions).all()
    assert len(np.unique(times_s)) == len(times_s)


def test_nothing_but_whole_files_is_left(whole):
    names = {path.name for path in whole.iterdir()}
    assert names == {"dataset.json", "points_train.csv", "points_test.csv", "points_places.csv", "ticks"}
    assert len(list((whole / "ticks").iterdir())) == len(tasks(MORE)) + 2


def test_a_cut_off_identification_is_continued_to_the_same_plan(tmp_path, loaded):
    store = Dataset.create(tmp_path / "set", loaded, SMALL, simulated=True)
    seen = []

    def cut(rows):
        seen.append(len(rows))
        if len(store.document["points"]) == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(store=store, watch=cut)
    before = read_document(tmp_path / "set")
    assert not before["complete"]
    assert len(before["points"]) == 5
    again = Dataset.resume(tmp_path / "set", loaded, SMALL, simulated=True)
    run(store=again)
    after = read_document(tmp_path / "set")
    assert after["complete"]
    assert after["points"][:5] == before["points"]
    assert [point["name"] for point in after["points"]] == [task.name for task in tasks(SMALL)]
    assert [session["points_before"] for session in after["sessions"]] == [0, 5]
    assert after["points"][-1]["session"] == 1
    text = (tmp_path / "set" / "points_train.csv").read_text().splitlines()[2:]
    times_s = np.sort([float(line.split(",")[-1]) for line in text])
    assert len(np.unique(times_s)) == len(times_s), "the second session begins where the first ended"
    assert after["sessions"][1]["began_s"] > before["points"][-1]["time_s"] - 1e-9


def test_a_data_set_begun_before_positions_were_kept_is_continued(tmp_path, loaded):
    store = Dataset.create(tmp_path / "set", loaded, SMALL, simulated=True)
    with pytest.raises(KeyboardInterrupt):
        run(store=store, watch=_cut_after(store, 3))
    document = read_document(tmp_path / "set")
    for one in document["points"]:
        del one["position_rad"], one["time_s"]
    for one in document["sessions"]:
        del one["began_s"], one["ticks_sha256"]
    (tmp_path / "set" / "dataset.json").write_text(json.dumps(document))
    run(store=Dataset.resume(tmp_path / "set", loaded, SMALL, simulated=True))
    rows = [line.split(",") for line in (tmp_path / "set" / "points_train.csv").read_text().splitlines()[2:]]
    before = sum(point["use"] == "train" for point in document["points"])
    assert sum(row[-1] == "" for row in rows) == before > 0
    assert all(row[-1] == row[-2] == "" or float(row[-1]) > 0 for row in rows)


def _cut_after(store, n_points):
    def cut(_rows):
        if len(store.document["points"]) == n_points:
            raise KeyboardInterrupt

    return cut


def test_other_settings_or_another_rig_file_are_not_mixed_in(whole, loaded):
    with pytest.raises(DataError, match=r"settings .*measurements 12 then, 13 now"):
        Dataset.resume(whole, loaded, replace(MORE, measurements=13), simulated=True)
    with pytest.raises(DataError, match="rig file"):
        Dataset.resume(whole, load(CONFIG.parent / "mock.toml"), MORE, simulated=True)


def test_a_folder_in_use_is_not_written_into(whole, loaded):
    with pytest.raises(DataError, match="not empty"):
        Dataset.create(whole, loaded, MORE, simulated=True)


def test_a_folder_in_which_nothing_was_measured_is_begun_anew(tmp_path, loaded):
    Dataset.create(tmp_path, loaded, SMALL, simulated=True)  # refused before its bias was measured
    again = Dataset.create(tmp_path, loaded, MORE, simulated=False)
    assert (
        json.loads((tmp_path / "dataset.json").read_text())["simulated"]
        is again.document["simulated"]
        is False
    )
    (tmp_path / "notes.txt").write_text("of somebody else")
    with pytest.raises(DataError, match="not empty"):
        Dataset.create(tmp_path, loaded, SMALL, simulated=True)


@pytest.mark.parametrize("content", ["", "{", "[]", '{"schema": 99}', '{"schema": 1}'])
def test_a_damaged_header_is_refused(tmp_path, loaded, content):
    (tmp_path / "dataset.json").write_text(content)
    with pytest.raises(DataError, match="begin a new --out"):
        Dataset.resume(tmp_path, loaded, SMALL, simulated=True)


@pytest.mark.parametrize("settings", [{"axis": 0, "soak_s": 5.0}, []])
def test_a_setting_of_a_later_version_is_told_and_not_passed_over(tmp_path, loaded, settings):
    Dataset.create(tmp_path, loaded, SMALL, simulated=True)
    header = json.loads((tmp_path / "dataset.json").read_text())
    (tmp_path / "dataset.json").write_text(json.dumps({**header, "settings": settings}))
    with pytest.raises(DataError, match="settings that this version does not know"):
        Dataset.resume(tmp_path, loaded, SMALL, simulated=True)


def test_nothing_to_resume_is_said(tmp_path, loaded):
    with pytest.raises(DataError, match="nothing to resume"):
        Dataset.resume(tmp_path / "none", loaded, SMALL, simulated=True)


def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    path = tmp_path / "file.json"
    write_whole(path, b"old")

    def full(_descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(module.whole_files.os, "fsync", full)
    with pytest.raises(DataError, match="No space left"):
        write_whole(path, b"new")
    assert path.read_bytes() == b"old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["file.json"]


def test_no_number_that_is_not_finite_gets_into_the_header(whole):
    json.loads((whole / "dataset.json").read_text(), parse_constant=pytest.fail)
