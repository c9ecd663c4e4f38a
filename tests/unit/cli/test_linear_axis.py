"""A linear axis in the rig file, in `rtctl check`, in friction models and in what a recording calls its
columns.
"""

import json
import math
import os
import re
from pathlib import Path

import numpy as np
import pytest
from in_process import run

from hw import motion
from rtctl.check import stability_report
from rtctl.errors import ConfigError, ModelError
from rtctl.friction import artefact
from rtctl.recording.export import columns
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[3] / "configs"
SLIDE = CONFIGS / "mock-linear.toml"
SCREWS = Path(os.environ.get("RTCTL_DATA", "/nowhere"), "screw_drives/lead_screw/steady_state/0.096kg")
"""Recordings that are not in this repository: RTCTL_DATA names their folder, as `rtctl evidence --data`
does."""


def rotary_words(text):
    return [line for line in text.splitlines() if any(one in line for one in (" rad", "N m", "_nm", "_rad"))]


def changed(tmp_path, old, new):
    text = SLIDE.read_text()
    assert old in text
    path = tmp_path / "rig.toml"
    path.write_text(text.replace(old, new, 1))
    return path


def test_a_screw_gives_the_ratio_and_the_counts_of_a_metre():
    axis, hardware = load(SLIDE).config.axis[0], load(SLIDE).config.hardware()
    assert axis.torque_limit_nm == 60.0
    assert axis.motor_ratio == pytest.approx(2 * math.pi / 0.005)
    assert 2 * math.pi / axis.counts_of_turn == pytest.approx(0.005 / 20_000)
    assert hardware.moves(0) == ("linear", 0.005)
    assert load(CONFIGS / "mock.toml").config.hardware().moves(0) == ("rotary", 0.0)


def test_without_a_lead_counts_are_of_a_metre_and_the_motor_pulls_itself(tmp_path):
    axis = load(changed(tmp_path, "lead_m = 0.005", "lead_m = 0.0")).config.axis[0]
    assert axis.motor_ratio == 1.0
    assert 2 * math.pi / axis.counts_of_turn == pytest.approx(1 / 20_000)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("torque_limit_n =", "torque_limit_nm =", "the axis is linear: write torque_limit_n"),
        ("stiffness_n_m = 6000.0", "stiffness_nm_rad = 6000.0", "the axis is linear: write stiffness_n_m"),
        ("coulomb_n = 6.0", "coulomb_nm = 6.0", "the axis is linear: write coulomb_n"),
        ("inertia_kg = 1.2", "inertia_kg = 1e9", "axis[0].inertia_kg"),
        ('motion = "linear"', 'motion = "rotary"', "torque_limit_n"),
        (
            "position_min_m = -0.2",
            "position_min_m = 0.3",
            "position_min_m 0.3 must be below position_max_m 0.2",
        ),
    ],
)
def test_a_key_that_cannot_be_is_told_by_the_name_and_line_it_has(tmp_path, old, new, told):
    path = changed(tmp_path, old, new)
    with pytest.raises(ConfigError) as refused:
        load(path)
    faults = [fault for fault in refused.value.faults if told in fault]
    assert faults
    if "must be below" not in told and "rotary" not in new:
        line = next(k for k, text in enumerate(path.read_text().splitlines(), 1) if text.startswith(new))
        assert f"{path}:{line}:" in faults[0]


def test_check_speaks_of_m_and_n(monkeypatch, capsys):
    code, text, _ = run(monkeypatch, capsys, "check", SLIDE)
    assert code == 0
    assert "6000 N/m" in text
    assert "2.5e-07 m " in text
    assert rotary_words(text) == []


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("inertia_kg = 1.2", "inertia_kg = 600.0", "0.1 m/s^2; real rigs have 0.3 to 1000 m/s^2"),
        ("inertia_kg = 1.2", "inertia_kg = 0.0012", "5e+04 m/s^2; real rigs have 0.3 to 1000 m/s^2"),
        ("lead_m = 0.005", "lead_m = 5.0", "see gear_ratio, lead_m (a lead of 5 mm is 0.005)"),
        ("encoder_counts_per_rev = 20000", "encoder_counts_per_rev = 4", "per turn of the screw: lines x 4"),
    ],
)
def test_a_slipped_unit_is_told_by_what_real_carriages_have(tmp_path, old, new, told):
    report = stability_report.examine(load(changed(tmp_path, old, new)))
    lines = [row.refusal for axis in report.axes for row in axis.verdicts if told in row.refusal]
    assert lines
    for line in lines:
        assert "link" not in line
        assert "N m " not in line.replace("N m/A", "")


def test_no_row_of_a_check_has_the_name_of_a_rotary_key(tmp_path):
    rows = [row for axis in stability_report.examine(load(SLIDE)).axes for row in axis.verdicts]
    assert rows
    for row in rows:
        assert "_nm" not in row.name + row.figure + row.bound
        assert " rad" not in row.figure + row.bound + row.meaning


def test_what_is_left_out_is_as_at_a_handle_of_ten_centimetres(tmp_path):
    slide, joint = load(SLIDE).config.axis[0], load(CONFIGS / "mock.toml").config.axis[0]
    assert slide.friction.blend_rad_s == pytest.approx(0.008)  # .08 rad/s
    assert slide.friction.tanh_rad_s == pytest.approx(0.002)  # .02 rad/s
    assert slide.admittance.hand_stiffness_nm_rad == pytest.approx(6e4)  # 600 N m/rad
    assert slide.admittance.hand_damping_nms_rad == pytest.approx(100.0)
    assert slide.admittance.hand_inertia_kgm2 == pytest.approx(2.0)  # .02 kg m^2
    assert slide.environment.pitch_rad == pytest.approx(0.02)
    assert joint.friction.blend_rad_s == 0.08
    said = changed(
        tmp_path, "[axis.environment]\n", "[axis.friction]\nintent_n = 0.7\n\n[axis.environment]\n"
    )
    assert load(said).config.axis[0].friction.intent_nm == 0.7
    assert load(said).config.axis[0].friction.blend_rad_s == pytest.approx(0.008)
    assert load(changed(tmp_path, "position_min_m = -0.2 ", "")).config.axis[0].position_min_rad == -1e3


def test_hands_that_hold_a_carriage_are_those_that_hold_a_joint(monkeypatch, capsys, tmp_path):
    """The model's own advice passes with a hand of 2 kg, and an intent for joints does not."""
    model = tmp_path / "slide.json"
    table = points(tmp_path / "points.csv", "velocity_m_s", "friction_torque_n")
    arguments = (
        "fit",
        table,
        "--out",
        model,
        "--rig",
        "slide",
        "--kernel",
        "formula",
        "--backend",
        "sequential",
    )
    code, text, err = run(monkeypatch, capsys, *arguments, "--config", SLIDE, "--presliding", 0.00013)
    assert code == 0, err
    block = text[text.index("[axis.friction]") :].partition("\n\n")[0]
    assert "drift_n = " in block
    lines = [line for line in block.splitlines() if "=" in line and not line.startswith("model")]
    lines.insert(0, "[axis.friction]")
    own = "\n".join([*lines, 'model = "slide.json"', "", "[axis.environment]\n"])
    code, text, _ = run(monkeypatch, capsys, "check", changed(tmp_path, "[axis.environment]\n", own))
    assert code == 0
    assert "hands to 60000 N/m, 100 N s/m, 2 kg" in text
    assert re.search(r"push that is helped at rest +1\.2\d* N .*\(intent_n\); ", text)
    joints = own.replace('model = "slide.json"', 'model = "slide.json"\nintent_n = 0.05')
    code, _, err = run(monkeypatch, capsys, "check", changed(tmp_path, "[axis.environment]\n", joints))
    assert code == 5
    assert "a hand of 2 kg buzz" in err


def test_a_recording_of_both_motions_names_each_column_by_its_own_units():
    rows = np.zeros(3, np.dtype([("position_rad", "f8", (2,)), ("force_n", "f8", (3,))]))
    found = columns(rows, ["position_rad", "force_n"], ["joint", "slide"], ["rotary", "linear"])
    assert set(found) == {"position_rad.joint", "position_m.slide", "force_n.x", "force_n.y", "force_n.z"}


def test_a_text_keeps_paths_and_constants_of_the_motor():
    said = (
        "/data/a_rad/log_nm.csv: torque_limit_nm 3 N m, 2 N m s/rad, 5 mN m/A of torque_constant_nm_a, 1 "
        "rad/s"
    )
    own = "/data/a_rad/log_nm.csv: torque_limit_n 3 N, 2 N s/m, 5 mN m/A of torque_constant_nm_a, 1 m/s"
    assert motion.words(said, "rotary") == said
    assert motion.words(said, "linear") == own


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("3 rows, 0.0101 to 0.05 rad/s", "3 rows, 10.1 to 50 mm/s"),
        ("0.002 to 0.2 rad/s", "0.002 to 0.2 m/s"),
        ("at 2.4e-05 rad/s, -0.03 rad/s", "at 0.024 mm/s, -30 mm/s"),
        ("0 rad/s, 0.01 rad/s^2, 0.5 rad/s", "0 m/s, 0.01 m/s^2, 0.5 m/s"),
        ("no column 'position_rad'", "no column 'position_rad'"),
    ],
)
def test_small_speeds_are_told_in_mm_s_and_quoted_names_are_left(said, told):
    assert motion.words(said, "linear") == told
    assert motion.words(said, "rotary") == said


def points(path, *names, top=0.2):
    speed = np.linspace(0.01 * top, top, 24)
    rows = [f"{d * v:.6g},{d * (6 + 2 * math.exp(-v / 0.01) + 5 * v):.9g}" for d in (1, -1) for v in speed]
    path.write_text("\n".join([",".join(names), *rows]))
    return path


def test_a_model_of_a_linear_axis_says_its_units_and_is_refused_on_a_rotary_one(
    monkeypatch, capsys, tmp_path
):
    out = tmp_path / "slide.json"
    table = points(tmp_path / "points.csv", "velocity_m_s", "friction_torque_n")
    code, text, err = run(
        monkeypatch, capsys, "fit", table, "--out", out, "--rig", "slide", "--kernel", "formula"
    )
    assert code == 0, err
    assert "trained range, m/s" in text
    assert rotary_words(text) == []
    document = json.loads(out.read_text())
    assert (document["motion"], document["units"]["nms_rad"]) == ("linear", "N s/m")
    artefact.require_rig(artefact.load(out), "slide", out, "linear")
    with pytest.raises(ModelError, match="made for a linear axis, this one is rotary"):
        artefact.require_rig(artefact.load(out), "slide", out)
    rotary = points(tmp_path / "rotary.csv", "velocity_rad_s", "friction_torque_nm")
    code, _, err = run(monkeypatch, capsys, "fit", rotary, "--judge", out)
    assert code != 0
    assert "made for a linear axis" in err


def test_a_slow_carriage_is_reported_in_mm_s(monkeypatch, capsys, tmp_path):
    table = points(tmp_path / "points.csv", "velocity_m_s", "friction_torque_n", top=0.02)
    arguments = (
        "fit",
        table,
        "--out",
        tmp_path / "m.json",
        "--rig",
        "slide",
        "--kernel",
        "formula",
        "--backend",
        "sequential",
    )
    code, text, err = run(monkeypatch, capsys, *arguments, "--report", tmp_path / "report")
    assert code == 0, err
    (trained,) = [line for line in text.splitlines() if line.startswith("trained range")]
    assert trained.split() == ["trained", "range,", "mm/s", "20", "20"]
    page = (tmp_path / "report" / "report.html").read_text()
    assert "against speed in mm/s" in page
    assert "speed max, mm/s" in page
    assert " m/s" not in page
    code, text, _ = run(monkeypatch, capsys, "fit", table, "--judge", tmp_path / "m.json")
    assert code == 0
    assert "at, mm/s" in text


@pytest.mark.parametrize("option", [("--kernel", "polynomial"), ("--search", "none")])
def test_kernels_that_know_a_unit_of_speed_are_refused(monkeypatch, capsys, tmp_path, option):
    table = points(tmp_path / "points.csv", "velocity_m_s", "friction_torque_n")
    code, _, err = run(monkeypatch, capsys, "fit", table, "--out", tmp_path / "m.json", *option)
    assert code != 0
    assert "of a linear axis" in err


def test_places_of_a_carriage_need_the_period_of_its_friction(monkeypatch, capsys, tmp_path):
    table = points(tmp_path / "points.csv", "velocity_m_s", "friction_torque_n")
    out = ("--out", tmp_path / "m.json", "--kernel", "formula", "--backend", "sequential")
    code, _, err = run(monkeypatch, capsys, "fit", table, *out, "--places", table)
    assert code != 0
    assert "give --turn in m, or --config RIG with its lead" in err
    turn = ("--places", table, "--turn", "0.005")
    code, _, err = run(monkeypatch, capsys, "fit", table, *out, *turn)
    assert code != 0
    assert "no column position_m" in err


@pytest.mark.skipif(not SCREWS.is_dir(), reason="RTCTL_DATA does not name the recordings")
def test_the_runs_of_a_screw_are_told_in_m_and_n(monkeypatch, capsys, tmp_path):
    arguments = (
        *(
            "fit",
            *sorted(SCREWS.glob("*.csv")),
            "--average",
            "file",
            "--lead-m",
            0.002,
            "--kernel",
            "formula",
        ),
        *("--column", "velocity=Velocity actual value averaged:rpm"),
        *("--column", "torque=Torque actual value averaged:Nm:0.000257"),
        *("--out", tmp_path / "m.json", "--report", tmp_path / "report"),
    )
    code, text, err = run(monkeypatch, capsys, *arguments)
    assert code == 0, err
    assert "m/s" in text
    page = (tmp_path / "report" / "report.html").read_text()
    assert "friction in N against speed in m/s" in page
    assert "speed_max_m_s" in (tmp_path / "report" / "report.json").read_text()
