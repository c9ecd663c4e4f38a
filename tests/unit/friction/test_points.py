"""Reading friction points: what is taken, and how bad files are refused."""

import hashlib

import numpy as np
import pytest

from rtctl.errors import DataError
from rtctl.friction.learn import fit, report_evidence
from rtctl.friction.learn.point_evidence import with_evidence
from rtctl.friction.point_reader import read_points

SPEEDS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0]


def _lines():
    header = ["velocity_rad_s,friction_torque_nm,direction"]
    return header + [f"{s * v},{s * (0.25 + 0.05 * v)},{s}" for s in (1, -1) for v in SPEEDS]


def _write(path, lines):
    path.write_text("\n".join(lines) + "\n")
    return path


def test_points_are_split_by_direction_and_sorted(tmp_path):
    lines = _lines()
    path = _write(tmp_path / "p.csv", [lines[0], *reversed(lines[1:]), "0,0.35,1", "0,-0.37,-1"])
    points = read_points(path)
    speed, friction = points.branch(-1)
    assert speed.tolist() == [0.0, *SPEEDS]
    assert friction[0] == 0.37
    assert points.branch(1)[1][0] == 0.35
    assert points.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


def test_a_break_away_point_without_direction_follows_its_torque(tmp_path):
    lines = [
        "velocity_rad_s,friction_torque_nm",
        *(line.rsplit(",", 1)[0] for line in _lines()[1:]),
        "0,-0.4",
    ]
    assert read_points(_write(tmp_path / "p.csv", lines)).branch(-1)[1][0] == 0.4


def test_comments_blank_lines_and_other_columns_are_ignored(tmp_path):
    lines = ["# a rig", "note," + _lines()[0] + ",std_nm,count", ""]
    lines += ["x," + line + ",0.004,100" for line in _lines()[1:]]
    points = read_points(_write(tmp_path / "p.csv", lines))
    assert len(points.friction_nm) == 16
    assert points.std_nm.tolist() == [0.004] * 16
    assert points.count.tolist() == [100] * 16


def test_missing_optional_columns_are_nan(tmp_path):
    assert np.isnan(read_points(_write(tmp_path / "p.csv", _lines())).std_nm).all()


@pytest.mark.parametrize(
    ("row", "text", "named"),
    [
        (0, "velocity,friction_torque_nm,direction", ["row 1", "velocity_rad_s", "missing"]),
        (0, "velocity_rad_s,velocity_rad_s,friction_torque_nm", ["row 1", "twice"]),
        (3, "nan,0.25,1", ["row 4", "velocity_rad_s", "nan"]),
        (3, "0.05,inf,1", ["row 4", "friction_torque_nm", "inf"]),
        (3, "0.05,,1", ["row 4", "friction_torque_nm"]),
        (3, "0.05,abc,1", ["row 4", "friction_torque_nm", "abc"]),
        (3, "1e9,0.25,1", ["row 4", "velocity_rad_s", "10000"]),
        (3, "0.05,0.25", ["row 4", "2 cells"]),
        (3, "0.05,-0.25,1", ["row 4", "friction_torque_nm", "against the motion"]),
        (3, "0,-0.25,1", ["row 4", "friction_torque_nm", "against the motion"]),
        (3, "0.05,0,1", ["row 4", "friction_torque_nm", "drop the row"]),
        (3, "0.05,0.25,-1", ["row 4", "direction", "contradicts"]),
        (3, "0.05,0.25,0.5", ["row 4", "direction", "+1 nor -1"]),
    ],
)
def test_a_bad_row_is_refused_naming_file_row_column_and_remedy(tmp_path, row, text, named):
    lines = _lines()
    lines[row] = text
    path = _write(tmp_path / "p.csv", lines)
    with pytest.raises(DataError) as caught:
        read_points(path)
    for part in [str(path), *named]:
        assert part in str(caught.value)


@pytest.mark.parametrize(
    ("lines", "named"),
    [
        ([], "empty"),
        (_lines()[:1], "at least 8"),
        (_lines()[:9], "direction -1: no row moves that way"),
        (_lines()[:-1], "direction -1: 7 points"),
        ([_lines()[0], *(["0.1,0.25,1"] * 7), "0.1,0.26,1", *_lines()[9:]], "only 1 different speeds"),
        ([_lines()[0], *(f"{v},0.25,1" for v in SPEEDS), *_lines()[9:]], "constant at 0.25"),
        ([_lines()[0], *_lines()[1:9] * 251, *_lines()[9:]], "at most 2000"),
    ],
)
def test_too_few_one_sided_or_constant_points_are_refused(tmp_path, lines, named):
    path = _write(tmp_path / "p.csv", lines)
    with pytest.raises(DataError, match=named) as caught:
        read_points(path)
    assert str(path) in str(caught.value)


def test_a_file_that_is_absent_or_binary_is_refused(tmp_path):
    with pytest.raises(DataError, match="cannot read"):
        read_points(tmp_path / "absent.csv")
    (tmp_path / "b.csv").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(DataError, match=r"not a text file.*--column velocity="):
        read_points(tmp_path / "b.csv")


def test_the_range_of_temperature_is_read_where_it_is_told(tmp_path):
    lines = _lines()
    assert read_points(_write(tmp_path / "p.csv", lines)).temperature_range_c is None
    told = ["# warm", lines[0] + ",temperature_c", *(f"{line},{20 + i}" for i, line in enumerate(lines[1:]))]
    told[-1] = lines[-1] + ","
    path = _write(tmp_path / "p.csv", told)
    assert read_points(path).temperature_range_c == (20.0, 20.0 + len(lines) - 3)
    assert len(read_points(path).friction_nm) == 16
    for bad in ("warm", "400", "inf"):
        told[3] = lines[2] + "," + bad
        with pytest.raises(DataError, match="temperature_c"):
            read_points(_write(tmp_path / "p.csv", told))
    told[3] = lines[2] + ",nan"
    assert read_points(_write(tmp_path / "p.csv", told)).temperature_range_c[0] == 20.0


def test_a_rig_without_a_temperature_sensor_has_no_range(tmp_path):
    header, *rows = _lines()
    told = [f"{header},temperature_c", *(f"{row},0.00" for row in rows)]
    assert read_points(_write(tmp_path / "p.csv", told)).temperature_range_c is None


def test_every_column_of_numbers_is_kept_and_the_file_is_read_once(tmp_path):
    header, *rows = _lines()
    told = [f"{header},time_s,position_rad,load_nm,temperature_c,log,humidity,note"]
    told += [f"{row},{k},{0.1 * k},,{20 + k},{k // 8},{50 + k},fine" for k, row in enumerate(rows)]
    path = _write(tmp_path / "p.csv", told)
    points = read_points(path)
    path.unlink()
    k = np.arange(len(rows))
    assert set(points.columns) == {
        "time_s",
        "position_rad",
        "temperature_c",
        "log",
        "humidity",
    }  # load: empty
    assert points.columns["log"].tolist() == (k // 8).tolist()
    assert points.columns["humidity"].tolist() == (50 + k).tolist()
    assert points.time_s.tolist() == k.tolist()
    backward = points.rows_of(-1)
    assert np.array_equal(points.columns["position_rad"][backward], 0.1 * k[8:])
    model = with_evidence(fit.fit_points(points, rig="mock", c=10.0), points)
    assert set(report_evidence.gather(points, model, None).extra) == {"position_rad", "time_s"}


@pytest.mark.parametrize(("column", "cell"), [("load_nm", "1e7"), ("log", "-1"), ("position_rad", "north")])
def test_a_column_beside_is_held_to_its_bounds(tmp_path, column, cell):
    header, *rows = _lines()
    told = [f"{header},{column}", *(f"{row},1" for row in rows)]
    told[4] = f"{rows[3]},{cell}"
    with pytest.raises(DataError, match=rf"row 5: column {column}: '{cell}' is not a finite number"):
        read_points(_write(tmp_path / "p.csv", told))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda v, f: (v, -f), "so do all rows: turn the sign of one of the two columns"),
        (lambda v, f: (v, abs(f)), "all rows of that direction: give friction, not its amount, the sign"),
        (
            lambda v, f: (v, np.where(v == -0.5, 9999.0, f)),
            "so do 1 of 16 rows: drop them if the sensor had no",
        ),
        (lambda v, f: (v, f - 0.28), "take its offset away, leave out what turns round, or average"),
        (lambda v, f: (abs(v), abs(f)), "direction -1: no row moves that way: the velocity needs the sign"),
    ],
)
def test_friction_against_the_motion_is_told_by_what_it_is(tmp_path, change, said):
    v = np.array([*SPEEDS, *(-one for one in SPEEDS)])
    rows = [
        f"{one},{other}" for one, other in zip(*change(v, np.sign(v) * (0.25 + 0.05 * abs(v))), strict=True)
    ]
    with pytest.raises(DataError, match=said):
        read_points(_write(tmp_path / "p.csv", ["velocity_rad_s,friction_torque_nm", *rows]))
