"""`rtctl identify --log`: from recordings to a table and to points that `rtctl fit` reads."""

import hashlib
import json
from pathlib import Path

import in_process
import numpy as np
import pytest

from rtctl.cli.identify_log_text import ungeared
from rtctl.errors import ConfigError
from rtctl.friction.point_reader import read_points

CONFIG = Path(__file__).parents[3] / "configs" / "mock.toml"


@pytest.fixture
def log(tmp_path):
    t = np.arange(12_500) / 500.0
    w = [(a, 2 * np.pi * f) for a, f in ((0.4, 0.4), (0.15, 1.1), (0.06, 2.3))]
    x, v, acceleration = (
        sum(f(a, k) for a, k in w)
        for f in (
            lambda a, k: a * np.sin(k * t),
            lambda a, k: a * k * np.cos(k * t),
            lambda a, k: -a * k**2 * np.sin(k * t),
        )
    )
    noise = np.random.default_rng(3).normal(0, 0.01, len(t))
    torque = 0.012 * acceleration + 0.05 * v + 0.25 * np.sign(v) + 0.02 + noise
    path = tmp_path / "log.csv"
    rows = "\n".join(
        f"{a:.4f},{np.degrees(b):.9g},{1e3 * c:.9g},{30 / np.pi * d:.9g}"
        for a, b, c, d in zip(t, x, torque, v, strict=True)
    )
    path.write_text(f"time_s,angle,milli,speed\n{rows}\n")
    return path


def run(monkeypatch, capsys, *arguments):
    return in_process.run(monkeypatch, capsys, "identify", *arguments)


MAPPED = ("--column", "position=angle:deg", "--column", "torque=milli:mN m", "--torque-delay", "0")


def test_a_log_in_degrees_and_millinewtonmetres_gives_the_parameters_and_points(
    monkeypatch, capsys, log, tmp_path
):
    out = tmp_path / "out"
    code, text, _ = run(monkeypatch, capsys, "--log", log, *MAPPED, "--out", out, "--json")
    assert code == 0
    found = json.loads(text)["symmetric"]["parameters"]
    for name, truth in (("inertia_kgm2", 0.012), ("viscous_nms_rad", 0.05), ("coulomb_nm", 0.25)):
        assert found[name]["value"] == pytest.approx(truth, rel=0.02)
    speed, friction = read_points(out / "points.csv").branch(1)
    np.testing.assert_allclose(friction, 0.25 + 0.05 * speed, rtol=0.05)


def test_the_temperature_of_a_log_goes_into_its_points(monkeypatch, capsys, log, tmp_path):
    head, *rows = log.read_text().splitlines()
    log.write_text("\n".join([f"{head},motor", *(f"{row},{20 + k / 1000}" for k, row in enumerate(rows))]))
    out = tmp_path / "out"
    mapped = (*MAPPED, "--column", "temperature=motor:degC")
    code, text, _ = run(monkeypatch, capsys, "--log", log, *mapped, "--out", out)
    assert code == 0
    assert "motor in degC" in text
    low, high = read_points(out / "points.csv").temperature_range_c
    assert 20 < low < high < 32.5


def test_the_report_knows_its_points_the_speeds_and_the_offset_of_each_log(
    monkeypatch, capsys, log, tmp_path
):
    out, second = tmp_path / "out", tmp_path / "second.csv"
    head, *rows = log.read_text().splitlines()
    half = len(rows) // 2
    second.write_text("\n".join([head, *rows[half:]]))
    log = tmp_path / "first.csv"
    log.write_text("\n".join([head, *rows[:half]]))
    code, text, _ = run(monkeypatch, capsys, "--log", log, "--log", second, *MAPPED, "--out", out)
    assert code == 0
    assert "offset_2_nm" in text
    assert "below 0.1 rad/s" in text
    assert "nothing about lower speeds" in text
    document = json.loads((out / "regression.json").read_text())
    assert document["points_sha256"] == hashlib.sha256((out / "points.csv").read_bytes()).hexdigest()
    assert [each["parameter"] for each in document["offsets"]] == ["offset_1_nm", "offset_2_nm"]
    assert [each["file"] for each in document["logs"]] == [str(log), str(second)]
    assert document["torque_delay_s"] == [0.0, 0.0]


def test_a_log_given_twice_is_refused_whatever_its_name(monkeypatch, capsys, log, tmp_path):
    copy = tmp_path / "copy.csv"
    copy.write_bytes(log.read_bytes())
    code, _, error = run(monkeypatch, capsys, "--log", log, "--log", copy, *MAPPED)
    assert code == 10
    assert f"copy.csv: the same log as {log}" in error


def test_a_file_that_is_not_there_is_said_once(monkeypatch, capsys, tmp_path):
    code, _, error = run(monkeypatch, capsys, "--log", tmp_path / "gone.csv", *MAPPED)
    assert code == 3
    assert error.count("no file") == 1


def test_a_velocity_column_is_used_and_checked(monkeypatch, capsys, log):
    arguments = ("--log", log, *MAPPED, "--column")
    code, text, _ = run(monkeypatch, capsys, *arguments, "velocity=speed:rpm", "--json")
    assert code == 0
    assert json.loads(text)["symmetric"]["parameters"]["inertia_kgm2"]["value"] == pytest.approx(
        0.012, rel=0.02
    )
    code, _, error = run(monkeypatch, capsys, *arguments, "velocity=speed:deg/s")
    assert code == 10
    assert "column velocity: 0.1667 times the derivative of the position" in error


def test_the_rig_file_finds_a_wrong_unit(monkeypatch, capsys, log, tmp_path):
    wrong = ("--column", "position=angle:deg", "--column", "torque=milli:N m", "--out", tmp_path / "out")
    code, _, error = run(monkeypatch, capsys, "--log", log, *wrong, "--config", CONFIG)
    assert code == 10
    assert "motor torque" in error
    assert "at most 2.5 for joint of" in error
    assert not (tmp_path / "out").exists()
    code, text, _ = run(monkeypatch, capsys, "--log", log, *MAPPED, "--config", CONFIG)
    assert code == 0
    assert "inertia_kgm2 = " not in text, "found and rig file agree"


def test_an_axis_the_rig_file_does_not_have_is_refused(monkeypatch, capsys, log):
    code, _, error = run(monkeypatch, capsys, "--log", log, *MAPPED, "--config", CONFIG, "--axis", "3")
    assert code == 3
    assert "there is no axis 3" in error


def test_the_gearing_of_the_rig_file_turns_a_current_into_torque(monkeypatch, capsys, log):
    amperes = ("--column", "position=angle:deg", "--column", f"current=milli:mA:{1 / (80 * 0.72 * 0.0134)}")
    code, text, _ = run(
        monkeypatch, capsys, "--log", log, *amperes, "--torque-delay", "0", "--config", CONFIG, "--json"
    )
    assert code == 0
    assert json.loads(text)["symmetric"]["parameters"]["coulomb_nm"]["value"] == pytest.approx(0.25, rel=0.02)


def test_when_the_report_cannot_be_written_the_old_points_stay(monkeypatch, capsys, log, tmp_path):
    (tmp_path / "out" / "regression.json").mkdir(parents=True)
    (tmp_path / "out" / "points.csv").write_text("old")
    code, _, error = run(monkeypatch, capsys, "--log", log, *MAPPED, "--out", tmp_path / "out")
    assert code == 10
    assert "regression.json: is a folder" in error
    assert (tmp_path / "out" / "points.csv").read_text() == "old"


def test_a_map_in_a_file_does_as_well_and_the_table_shows_intervals(monkeypatch, capsys, log, tmp_path):
    table = tmp_path / "map.toml"
    table.write_text(
        '[position]\ncolumn = "angle"\nunit = "deg"\n[torque]\ncolumn = "milli"\nunit = "mN m"\n'
    )
    code, text, _ = run(monkeypatch, capsys, "--log", log, "--map", table)
    assert code == 0
    assert "95 % interval" in text
    assert "condition number" in text


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("--column", "position=angle:deg"), 3, "a torque"),
        (("--column", "position=angle:deg", "--column", "twist=milli"), 3, "unknown role"),
        (("--column", "position=angle:deg", "--column", "torque=gone"), 10, "no column 'gone'"),
        (
            ("--column", "position=angle:foo", "--column", "torque=milli"),
            10,
            "angle is there, and 'foo' is no unit",
        ),
    ],
)
def test_a_wrong_map_is_refused_and_leaves_nothing(
    monkeypatch, capsys, log, tmp_path, arguments, code, message
):
    out = tmp_path / "out"
    ended, _, error = run(monkeypatch, capsys, "--log", log, *arguments, "--out", out)
    assert ended == code
    assert message in error
    assert not out.exists()


def test_a_name_with_a_colon_and_the_unit_nm_without_a_space_are_read(monkeypatch, capsys, log):
    log.write_text(log.read_text().replace("time_s,angle,milli,speed", "time_s,joint:angle,t:1,speed"))
    colons = ("--column", "position=joint:angle:deg", "--column", "torque=t:1:mNm:1", "--torque-delay", "0")
    code, text, _ = run(monkeypatch, capsys, "--log", log, *colons, "--json")
    assert code == 0
    assert json.loads(text)["symmetric"]["parameters"]["coulomb_nm"]["value"] == pytest.approx(0.25, rel=0.02)


def test_a_scale_that_is_no_number_is_wrong_usage(monkeypatch, capsys, log):
    code, _, error = run(monkeypatch, capsys, "--log", log, "--column", "position=angle:deg:much")
    assert code == 2
    assert "the scale must be a number" in error


def test_the_help_of_identify_names_logs(monkeypatch, capsys):
    code, text, _ = run(monkeypatch, capsys, "--help")
    assert code == 0
    assert "rtctl identify --log FILE" in " ".join(text.split())


def test_the_report_says_the_units_taken_and_what_nothing_in_the_log_tells(monkeypatch, capsys, log):
    code, text, _ = run(monkeypatch, capsys, "--log", log, *MAPPED)
    assert code == 0
    assert "units: angle in deg, milli in mN m\n" in text
    assert "cannot be told: whether the scale of the only torque is right" in text
    assert "cannot be told: whether the scales of position and time are right" in text
    code, text, _ = run(monkeypatch, capsys, "--log", log, *MAPPED, "--config", CONFIG)
    assert "units: angle in deg, milli in mN m\n" in text
    code, text, _ = run(monkeypatch, capsys, "--log", log, *MAPPED, "--json")
    assert json.loads(text)["units"] == {"angle": "deg", "milli": "mN m"}
    plain = json.loads(text)
    assert any("--gear-ratio: 1 where it is at the joint" in each for each in plain["warnings"])
    code, text, _ = run(monkeypatch, capsys, "--log", log, *MAPPED, "--gear-ratio", "9", "--json")
    geared = json.loads(text)
    assert any("the only torque" in each for each in geared["cannot_tell"])
    assert not any("--gear-ratio" in each for each in geared["warnings"])
    inertia = [each["symmetric"]["parameters"]["inertia_kgm2"]["value"] for each in (plain, geared)]
    assert inertia[1] == pytest.approx(9 * inertia[0])
    code, text, _ = run(
        monkeypatch, capsys, "--log", log, *MAPPED, "--column", "external=speed:Nm:1e-6", "--json"
    )
    assert any("whether friction is a share of" in each for each in json.loads(text)["cannot_tell"])


def test_a_constant_that_nobody_gave_is_said_and_counts_are_not_guessed(monkeypatch, capsys, log):
    columns = ("--column", "position=angle:deg", "--column", "current=milli:mA", "--torque-delay", "0")
    said = "the current is taken for a torque by 1 N m/A, since no torque constant is given"
    assert f"warning: {said}" in run(monkeypatch, capsys, "--log", log, *columns)[1]
    given = {"torque_constant": None, "counts_per_rev": None}
    current = {"position": {"unit": "deg"}, "current": {"unit": "mA"}}
    assert said in ungeared(current, given)[0]
    for known in (given | {"torque_constant": 0.5}, given | {"counts_per_rev": 4096.0}):
        assert (
            ungeared({"position": {"unit": "counts", "scale": 2e-4}, "current": {"scale": 0.5}}, known) == ()
        )
    assert ungeared(current, given | {"torque_constant": 0.5}) == ()
    with pytest.raises(ConfigError, match=r"--counts-per-rev \(after quadrature\), or --config RIG"):
        ungeared({"position": {"unit": "counts"}}, given)


def test_a_decimal_comma_and_a_delimiter_may_be_given(monkeypatch, capsys, log):
    log.write_text(log.read_text().replace(",", ";").replace(".", ","))
    given = ("--delimiter", "semicolon", "--decimal", "comma")
    for options in ((), given):
        code, text, error = run(monkeypatch, capsys, "--log", log, *MAPPED, *options, "--json")
        assert code == 0, error
        found = json.loads(text)["symmetric"]["parameters"]["coulomb_nm"]["value"]
        assert found == pytest.approx(0.25, rel=0.02)
    code, _, error = run(monkeypatch, capsys, "--log", log, *MAPPED, "--delimiter", "tab")
    assert code == 10
    assert "no column" in error


@pytest.mark.parametrize(
    ("given", "code", "said"),
    [
        # five points tell no velocity above a fifth of the rate, and the filter none above half of it
        (("--cutoff-hz", 300), 10, "cut-off 300 Hz must lie in 0..100 Hz (rate / 5)"),
        (("--axis", 1), 2, "--axis is a number in --config RIG"),
    ],
)
def test_an_option_that_cannot_be_is_told(monkeypatch, capsys, log, given, code, said):
    ended, text, err = run(monkeypatch, capsys, "--log", log, *MAPPED, *given)
    assert (ended, text) == (code, "")
    assert said in err
