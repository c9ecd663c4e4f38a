"""`rtctl fit` on files that other programs wrote: columns by name and unit, averaged by file or by speed."""

import json
import re
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from rtctl.__main__ import main
from rtctl.cli import fit_points
from rtctl.cli.fit_report import prepare
from rtctl.errors import ConfigError, DataError
from rtctl.friction.logs.other_programs import read_mapped
from rtctl.friction.point_reader import read_points

DRIVES = Path(__file__).parents[4] / "shared" / "data" / "screw_drives"

HEAD = (
    'Date:;2020-07-06 15:32:33\nSampling period:;6.400\nTrigger:;1;0.000000;"Channel 1"\n;Velocity '
    "actual;Torque actual\nms;rpm;%\n"
)

MAPPED = {"velocity": {"column": "Velocity actual", "unit": "rpm"}, "torque": {"column": "#3", "scale": 0.01}}

TEXT = {"delimiter": None, "decimal": None}


def runs(folder, sign=1.0, speeds=(2, 5, 10, 20, 40, 60, 80, 100)):
    """A file of each speed as a drive exports it: whole rpm, percent of a torque; friction .2 N m + .001 N
    m/rpm.
    """
    rng, files = np.random.default_rng(1), []
    for speed in (*speeds, *(-speed for speed in speeds)):
        rpm = np.round(speed + rng.normal(0, 0.7, 200))
        percent = np.sign(speed) * sign * 100 * (0.2 + 0.001 * abs(speed)) + rng.normal(0, 1, 200)
        rows = [f"{6.4 * k:.3f};{v:.0f};{t:.1f}" for k, (v, t) in enumerate(zip(rpm, percent, strict=True))]
        files.append(folder / f"{'n' if speed < 0 else ''}{abs(speed)}.csv")
        files[-1].write_text(HEAD + "\n".join(rows) + "\n")
    return files


def test_each_file_becomes_a_point_in_si_units(tmp_path):
    points, notes = read_mapped(runs(tmp_path), MAPPED, "file", TEXT)
    assert not notes
    speed, friction = points.branch(-1)
    np.testing.assert_allclose(speed, np.array([2, 5, 10, 20, 40, 60, 80, 100]) * 2 * np.pi / 60, rtol=0.1)
    np.testing.assert_allclose(friction, 0.2 + 0.001 * speed * 60 / 2 / np.pi, atol=0.003)
    assert set(points.count) == {200}
    assert points.std_nm == pytest.approx(0.01, rel=0.3)


def test_rows_of_all_files_are_averaged_by_speed(tmp_path):
    points, _ = read_mapped(runs(tmp_path), MAPPED, "speed", TEXT)
    speed, friction = points.branch(1)
    np.testing.assert_allclose(friction, 0.2 + 0.001 * speed * 60 / 2 / np.pi, atol=0.01)


def test_a_row_that_somebody_marked_is_left_out_and_told(tmp_path):
    files = runs(tmp_path)
    text = files[0].read_text().split("\n")
    text[5] = "0.000;2;-1200,,was 20.1"
    files[0].write_text("\n".join(line if "," in line else line + ",," for line in text if line))
    points, notes = read_mapped(files, MAPPED, "file", TEXT)
    assert len(notes) == 1
    assert f"{files[0]}: 1 rows left out, the furthest row 1 with -12 N m" in notes[0]
    assert points.branch(1)[1][0] == pytest.approx(0.202, abs=0.003)


def test_what_cannot_be_is_refused(tmp_path):
    files = runs(tmp_path, sign=-1.0)
    with pytest.raises(DataError, match=r"has not the sign of the motion.*scale -1"):
        read_mapped(files, MAPPED, "file", TEXT)
    still = tmp_path / "still.csv"
    still.write_text(HEAD + "\n".join(f"{6.4 * k:.3f};0;{20 + k % 3:.1f}" for k in range(200)) + "\n")
    with pytest.raises(DataError, match=r"still.csv: nothing moves: .*leave it out"):
        read_mapped([still, *files], MAPPED, "file", TEXT)
    with pytest.raises(DataError, match="the same as"):
        read_mapped([files[0], files[0]], MAPPED, "file", TEXT)
    with pytest.raises(ConfigError, match=r"current .#3. needs its scale, .*N m/A"):
        read_mapped(files, {"velocity": MAPPED["velocity"], "current": {"column": "#3"}}, "file", TEXT)
    with pytest.raises(ConfigError, match="torque or current, not both"):
        read_mapped(files, {**MAPPED, "current": {"column": "#3"}}, "file", TEXT)
    with pytest.raises(DataError, match="read in rad/s, the file says rpm"):
        read_mapped(files, {**MAPPED, "velocity": {"column": "Velocity actual"}}, "file", TEXT)
    ramp = tmp_path / "ramp.csv"
    ramp.write_text("v,f\n" + "\n".join(f"{0.01 * k},0.2" for k in range(1, 200)))
    with pytest.raises(
        DataError, match=r"not one speed: 0\.255 rad/s in a quarter of it, 1\.75 rad/s in another"
    ):
        read_mapped([ramp], {"velocity": {"column": "v"}, "torque": {"column": "f"}}, "file", TEXT)


def limited(folder, top, step=1e-6):
    """Runs of a torque that ends at `top` and has steps, N m."""
    rng, files = np.random.default_rng(2), []
    for speed in np.outer([1, -1], np.geomspace(0.1, 5, 12)).ravel():
        torque = np.sign(speed) * (0.2 + 0.05 * abs(speed)) + rng.normal(0, 0.01, 300)
        torque = np.round(torque.clip(-top, top) / step) * step
        files.append(folder / f"{speed:+.2f}.csv")
        np.savetxt(files[-1], np.column_stack([np.full(300, speed), torque]), delimiter=",", header="v,f")
    return files


V_F = {"velocity": {"column": "v"}, "torque": {"column": "f"}}


def test_a_run_whose_torque_ends_at_a_limit_is_refused(tmp_path):
    with pytest.raises(
        DataError, match=r"\+5\.00\.csv: the torque stands at 0\.4 N m, .* in 100% of .*clipped"
    ):
        read_mapped(limited(tmp_path, 0.4), V_F, "file", TEXT)
    for top, step in ((9.0, 1e-6), (9.0, 0.05)):  # free of limits; coarse
        assert len(read_mapped(limited(tmp_path, top, step), V_F, "file", TEXT)[0].count) == 24
    for file in limited(tmp_path, 9.0):  # a constant torque that was commanded, and whatever speed came of it
        v, f = np.loadtxt(file, delimiter=",", unpack=True)
        v += np.random.default_rng(3).normal(0, 0.01, 300)
        np.savetxt(file, np.column_stack([v, np.full(300, f[0])]), delimiter=",", header="v,f")
    assert len(read_mapped(sorted(tmp_path.glob("*.csv")), V_F, "file", TEXT)[0].count) == 24


def test_units_of_a_carriage_are_in_what_is_told_of_its_points(tmp_path, capsys):
    files = limited(tmp_path, 9.0)
    v, f = np.loadtxt(files[5], delimiter=",", unpack=True)
    np.savetxt(files[5], np.column_stack([v, 1000 * f]), delimiter=",", header="v,f")
    units = {"velocity": {"column": "v", "unit": "m/s"}, "torque": {"column": "f", "unit": "N"}}
    points, _ = read_mapped(files, units, "file", TEXT)
    fit_points.without_outliers(points, keep=False)
    told = capsys.readouterr().err
    assert re.search(r"m/s, [\d.]+ N is left out: its neighbours in speed say [\d.]+ N; measure", told)
    assert not re.search(r"rad|N m\b", told)


def measured_beside(folder):
    """Rows at eight speeds each way, two logs: place, load, temperature, time."""
    files = []
    for log in (0, 1):
        lines = ["v,f,place,load,warm,t"]
        for k in range(160):
            speed = (1 + k % 8) * (1 if k < 80 else -1)
            place, torque = 0.5 * k, np.sign(speed) * (0.2 + 0.01 * abs(speed) + 1e-4 * (k % 5))
            lines.append(f"{speed},{torque},{place},{1 + abs(speed)},{20 + 10 * log},{k + 1000 * log}")
        files.append(folder / f"log{log}.csv")
        files[-1].write_text("\n".join(lines))
    return files


@pytest.mark.parametrize("average", ["none", "speed"])
def test_what_was_measured_beside_reaches_the_points(tmp_path, average):
    roles = {"velocity": "v", "torque": "f", "load": "load", "temperature": "warm"}
    tables = {role: {"column": name} for role, name in roles.items()}
    tables |= {"position": {"column": "place", "unit": "deg"}, "time": {"column": "t", "unit": "ms"}}
    files = measured_beside(tmp_path)
    points, _ = read_mapped(files, tables, average, TEXT)
    np.testing.assert_allclose(points.columns["load_nm"], 1 + np.abs(points.velocity_rad_s))
    assert points.temperature_range_c == pytest.approx((20, 30))
    if average == "none":
        assert points.columns["log"].tolist() == [0.0] * 160 + [1.0] * 160
        np.testing.assert_allclose(points.columns["position_rad"][:160], np.radians(0.5 * np.arange(160)))
        assert points.time_s[-1] == pytest.approx(1.159)
    else:
        assert {"position_rad", "time_s"}.isdisjoint(points.columns), "they differ within a level"
        log, warm = points.columns["log"], points.columns["temperature_c"]
        mixed = np.isnan(log)
        np.testing.assert_allclose(warm[~mixed], 20 + 10 * log[~mixed])
        assert ((warm[mixed] > 20) & (warm[mixed] < 30)).all()
    tables["load"]["scale"] = 1e6
    with pytest.raises(DataError, match=r"load_nm 2e\+06 is not within"):
        read_mapped(files, tables, average, TEXT)


def fitted(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["rtctl", "fit", *map(str, arguments)])
    code = 0
    try:
        main()
    except SystemExit as ended:
        code = int(ended.code or 0)
    return code, capsys.readouterr()


def test_the_command_learns_from_them(monkeypatch, capsys, tmp_path):
    (tmp_path / "runs").mkdir()
    files = runs(tmp_path / "runs")
    columns = ("--column", "velocity=Velocity actual:rpm", "--column", "torque=#3:Nm:0.01")
    out = tmp_path / "model.json"
    code, said = fitted(monkeypatch, capsys, *files, *columns, "--average", "file", "--out", out, "--json")
    assert code == 0, said.err
    assert [row["points"] for row in json.loads(said.out)["directions"]] == [8, 8]
    code, said = fitted(monkeypatch, capsys, *files, "--out", out)
    assert code == 3
    assert "--average file or speed" in said.err


@pytest.mark.realdata
@pytest.mark.skipif(not DRIVES.is_dir(), reason=f"no recordings in {DRIVES}")
@pytest.mark.parametrize("drive", ["worm", "lead_screw"])
def test_exports_of_epos_studio_are_read_as_they_are(drive):
    files = sorted((DRIVES / drive / "steady_state").rglob("*.csv"))
    columns = {
        "velocity": {"column": "Velocity actual value averaged", "unit": "rpm"},
        "torque": {"column": "Torque actual value averaged", "scale": 0.01},
    }
    points, notes = read_mapped(files, columns, "file", TEXT)
    assert len(points.friction_nm) == len(files)
    for direction in (1, -1):
        speed, friction = points.branch(direction)
        assert speed[-1] == pytest.approx(200 * 2 * np.pi / 60, rel=0.1)
        assert friction.min() > 0.02
        assert friction.max() < 0.6
    assert len(notes) <= 4, "rows that somebody marked with values that no drive gives"


def test_points_behind_semicolons_are_told_how_they_are_read(tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("velocity_rad_s;friction_torque_nm\n0,5;0,2\n")
    with pytest.raises(DataError, match="--column velocity=velocity_rad_s and so on reads other marks"):
        read_points(path)


def test_a_time_that_starts_over_parts_sessions_and_shuffled_rows_do_not(tmp_path):
    tables = {"velocity": {"column": "v"}, "torque": {"column": "f"}, "time": {"column": "t"}}
    speeds = [*range(1, 9), *range(-8, 0)]
    rows = [
        f"{v},{np.sign(v) * (0.2 + 0.01 * abs(v) + 0.001 * k)},{t}"
        for k in range(3)
        for t, v in enumerate(speeds)
    ]
    path = tmp_path / "p.csv"
    path.write_text("\n".join(["v,f,t", *rows]))
    points, notes = read_mapped([path], tables, "none", TEXT)
    assert points.columns["log"].tolist() == [0.0] * 16 + [1.0] * 16 + [2.0] * 16
    assert "the time starts over before row 17: taken for 3 sessions" in notes[0]
    path.write_text("\n".join(["v,f,t", *np.random.default_rng(1).permutation(rows)]))
    points, notes = read_mapped([path], tables, "none", TEXT)
    assert "log" not in points.columns
    assert not notes


def test_points_named_as_our_own_are_doubted_as_those_of_others(monkeypatch, capsys, tmp_path):
    v = np.geomspace(0.2, 100.0, 12)
    rows = [f"{s * one},{s * (0.25 + 0.01 * one)}" for s in (1, -1) for one in v]
    (tmp_path / "p.csv").write_text("\n".join(["velocity_rad_s,friction_torque_nm", *rows]))
    code, said = fitted(monkeypatch, capsys, tmp_path / "p.csv", "--C", "10", "--out", tmp_path / "m.json")
    assert code == 0
    assert "is the velocity in rpm or deg/s" in said.err


@pytest.mark.parametrize(("speeds", "told"), [(9, True), (12, False)])
def test_a_spline_alone_on_few_speeds_is_warned_of(monkeypatch, capsys, tmp_path, speeds, told):
    v = np.repeat(np.geomspace(0.01, 2.0, speeds), 3) * np.tile([1, 1.003, 1.006], speeds)
    rows = [f"{s * one},{s * (0.25 + 0.01 * one)}" for s in (1, -1) for one in v]
    (tmp_path / "p.csv").write_text("\n".join(["velocity_rad_s,friction_torque_nm", *rows]))
    code, said = fitted(monkeypatch, capsys, tmp_path / "p.csv", "--C", "10", "--out", tmp_path / "m.json")
    assert code == 0
    assert ("only 9 speeds in a direction" in said.err) is told


def test_points_to_judge_by_have_the_columns_of_the_others_or_are_a_file_of_our_own(tmp_path):
    read = partial(
        fit_points.read, columns=("velocity=v:mm/s", "torque=F:N"), map_file=None, average="none", text=TEXT
    )
    foreign, own = tmp_path / "test.csv", tmp_path / "own.csv"
    foreign.write_text("v,F\n10,30.2\n-20,-31\n")
    own.write_text("velocity_m_s,friction_torque_n\n0.01,30.2\n-0.02,-31\n")
    for path in (foreign, own):
        test = prepare(tmp_path / "report", path, None, "x", read).test
        assert test is not None
        assert (test.motion, *test.velocity_rad_s) == ("linear", 0.01, -0.02)


def test_what_is_wrong_with_forces_is_said_in_their_units_with_the_weight(tmp_path):
    path = tmp_path / "lift.csv"
    path.write_text(
        "v,F\n" + "\n".join(f"{v},{150 + 30 * (v > 0) - 30 * (v < 0)}" for v in range(-9, 10) if v)
    )
    said = r"120 N points against the motion \(-9 mm/s.*take off what pulls one way \(a weight"
    with pytest.raises(DataError, match=said):
        fit_points.read((path,), ("velocity=v:mm/s", "torque=F:N"), None, "none", TEXT)
