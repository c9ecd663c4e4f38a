"""`rtctl check` of an axis displayed as an admittance: rows, refusals with what passes, JSON, picture."""

import dataclasses
import json
import re
import sys

import pytest

from rtctl.__main__ import main
from rtctl.check import admittance_figures, verdicts_of_admittance
from rtctl.check.law_plan import build
from rtctl.check.stability_report import examine
from rtctl.check.verdict import Outcome
from rtctl.control.proofs import admittance_margin
from rtctl.errors import StabilityError
from rtctl.rig_file.config import load

LOOP, STUCK, SNAPS, ANY, KEPT, LATE, COUNT, FORCE = (
    "admittance in a hand",
    "admittance, joint that sticks",
    "admittance, worlds that are not linear",
    "admittance without lag, any hand",
    "admittance, damping of vibrations",
    "admittance, delay and lag",
    "admittance, one encoder count",
    "admittance, one step of the force",
)

RIG = """
schema = 1
[rig]
name = "bench"
[[axis]]
name = "joint"
display = "admittance"
inertia_kgm2 = 0.012
viscous_nms_rad = 0.05
encoder_counts_per_rev = {counts}
torque_constant_nm_a = 0.0134
gear_ratio = 80.0
lever_m = [0.0, 0.1, 0.0]
torque_limit_nm = 2.0
torque_rate_nm_s = 200.0
velocity_limit_rad_s = 6.0
[axis.admittance]
mass_kgm2 = {m}
damping_nms_rad = {b_v}
velocity_gain_nms_rad = 2.0
feedforward = {z}
position_gain_nm_rad = {K_p}
hand_stiffness_nm_rad = {k_h}
[axis.coupling]
delay_ticks = {d}
[axis.drive]
{drive}
[axis.friction]
policy = "off"
[[device]]
kind = "mock"
"""
PASSES = {
    "counts": 160000,
    "m": 0.03,
    "b_v": 0.3,
    "z": 0.0,
    "K_p": 0.0,
    "k_h": 600.0,
    "d": 1.0,
    "whole": 1,
    "drive": "",
}


@pytest.fixture
def rig(tmp_path):
    """Path of a rig file with changes."""

    def write(**changes):
        path = tmp_path / "bench.toml"
        path.write_text(RIG.format(**{**PASSES, **changes}))
        return path

    return write


def rows_of(path):
    """Those that may refuse a file: what more is told takes a third of the time."""
    (axis,) = examine(load(path), telling=False).axes
    return {row.name: row for row in axis.verdicts}


def test_a_display_that_is_proved_passes_and_says_what_more_would(rig):
    rows = rows_of(rig(b_v=0.6))
    assert [rows[name].outcome for name in (LOOP, ANY, KEPT, LATE, COUNT, FORCE)] == [Outcome.PASS] * 6
    assert "proved between the points" in rows[LOOP].meaning
    assert rows[ANY].meaning.startswith("without lags it would be passive")
    assert rows[STUCK].outcome == Outcome.PASS
    assert rows[SNAPS].outcome == Outcome.NOT_PROVED


def test_the_certificate_is_asked_of_the_loop_that_the_file_describes(rig):
    (axis,) = examine(load(rig(d=1.5, K_p=4.0, drive="current_loop_hz = 500.0")), telling=False).axes
    loop = axis.loop
    assert (loop.mass_kgm2, loop.virtual_damping_nms_rad, loop.velocity_gain_nms_rad) == (0.03, 0.3, 2.0)
    assert (loop.delay, loop.lag_hz, loop.position_gain_nm_rad) == (1.5, 500.0, 4.0)
    assert (loop.force_lowpass_hz, loop.velocity_lowpass_hz) == (150.0, 100.0)
    assert (loop.inertia_kgm2, loop.box.stiffness_nm_rad) == (0.012, 600.0)
    assert len(admittance_figures.faster(loop)) == 5
    old = admittance_figures.faster(dataclasses.replace(loop, sample_ticks=3))
    assert sorted(one.sample_ticks for one in old) == [1] * 6 + [3] * 5
    (told,) = (row for row in axis.verdicts if row.name == ANY)
    assert "K_p" in told.bound
    assert "not even without lags" in told.meaning


def test_what_fails_is_refused_with_what_passes_nearest_by(rig):
    changes = {"m": 0.012, "b_v": 0.05}
    path = rig(**changes)
    report = examine(load(path), telling=False)
    with pytest.raises(StabilityError, match="mass_kgm2"):
        report.require()
    (axis,) = report.axes
    (stuck,) = (row for row in axis.verdicts if row.name == STUCK)
    assert stuck.outcome == Outcome.NOT_PROVED
    assert "within a presliding of 5 mrad, where friction is a spring, the joint shakes" in stuck.meaning
    assert "are assumed" in stuck.meaning
    refusal = report.refusal()
    assert "bench.toml: axis[0].admittance.mass_kgm2: axis joint" in refusal
    nearest = re.split(", if no stiffer hand holds it; ", refusal)[-2].split(": ")[-1]
    remedies = dict(part.split(" = ") for part in nearest.split(", or "))
    keys = {"mass_kgm2": "m", "damping_nms_rad": "b_v", "hand_stiffness_nm_rad": "k_h"}
    assert set(remedies) <= set(keys)
    assert {"mass_kgm2", "hand_stiffness_nm_rad"} <= set(remedies)
    for key, value in remedies.items():
        assert admittance_margin.judge(
            admittance_figures.loop_of(
                axis, load(rig(**{**changes, keys[key]: float(value)})).config.axis[0], _joint(path), 1e-3
            )
        ).ok


def test_a_joint_that_shakes_while_it_sticks_is_refused_with_the_damping_that_calms_it(rig):
    """With a heavy hand that nothing else holds; how long its bristles are somebody said."""

    def stuck(damping=0.0):
        path = rig(b_v=0.2)
        text = path.read_text().replace('policy = "off"', 'policy = "off"\npresliding_rad = 0.0014')
        path.write_text(text.replace("[axis.coupling]", f"rest_damping_nms_rad = {damping}\n[axis.coupling]"))
        return rows_of(path)[STUCK]

    row = stuck()
    assert row.outcome == Outcome.FAIL
    assert float(row.figure.split()[0]) > 0.002
    assert "axis[0].admittance.rest_damping_nms_rad" in row.refusal
    named = float(row.meaning.split("rest_damping_nms_rad = ")[1].split(",")[0])
    assert stuck(named).outcome == Outcome.PASS


def _joint(path):
    from rtctl.check import devices_of_axis

    return devices_of_axis.joint_of_axis(load(path), 0)


def test_a_servo_that_dry_friction_keeps_swinging_is_refused_with_what_helps(rig):
    rows = rows_of(rig(m=0.04, b_v=0.1, k_h=10.0, K_p=60.0))
    row = rows["admittance, dry friction"]
    assert row.outcome == Outcome.FAIL
    assert "admittance.position_gain_nm_rad" in row.refusal
    assert "less position_gain_nm_rad" in row.refusal
    together = row.refusal.split("dry friction and a joint that sticks pass with ")[1]
    path = rig(m=0.04, b_v=0.1, k_h=10.0, K_p=60.0)
    for line in together.split(", "):
        before, after = path.read_text().split("[axis.admittance]\n")
        after = re.sub(rf"{line.split(' = ')[0]} = .*\n", "", after, count=1)
        path.write_text(f"{before}[axis.admittance]\n{line}\n{after}")
    rows = rows_of(path)
    assert rows[LOOP].outcome == rows["admittance, dry friction"].outcome == Outcome.PASS


def test_a_heavier_mass_that_may_be_asked_for_is_judged_with_dry_friction_too(rig):
    """It passes; the heaviest mass a client may ask for swung on at .09 rad/s in a hand of 20 N m/rad."""
    path = rig(m=0.012, b_v=0.1, k_h=120.0, K_p=20.0, d=0.0)
    text = path.read_text().replace(
        "hand_stiffness_nm_rad", "hand_inertia_kgm2 = 0.005\nhand_stiffness_nm_rad"
    )
    path.write_text(text)
    assert rows_of(path)["admittance, dry friction"].outcome == Outcome.PASS
    path.write_text(
        text.replace(
            "[axis.coupling]", "feedforward_lowpass_hz = 20.0\nmass_max_kgm2 = 0.05\n[axis.coupling]"
        )
    )
    assert rows_of(path)["admittance, dry friction"].outcome == Outcome.FAIL


def test_both_displays_are_judged_where_the_display_may_change_and_all_masses_that_may_be_asked_for(rig):
    path = rig(b_v=0.6)
    text = path.read_text().replace('display = "admittance"', 'display = "admittance"\ndisplay_change = true')
    text = text.replace(
        "[axis.coupling]\n", "[axis.coupling]\nstiffness_nm_rad = 10.0\ndamping_nms_rad = 0.01\n"
    )
    path.write_text(text.replace("[axis.coupling]", "mass_max_kgm2 = 0.1\n[axis.coupling]"))
    rows = rows_of(path)
    assert {LOOP, "coupling, sampled and late"} <= set(rows)
    assert "masses to 0.1 kg m^2" in rows[LOOP].meaning
    assert "proved between the points" in rows[LOOP].meaning


def test_rows_of_a_coupling_are_not_of_an_admittance(rig):
    names = set(rows_of(rig(b_v=0.6)))
    couplings = {
        "coupling, sampled and late",
        "steps of the encoder",
        "elastic joint",
        "delay of the devices",
    }
    assert not names & couplings
    text = rig(b_v=0.6).read_text().replace('display = "admittance"', 'display = "impedance"')
    path = rig(b_v=0.6)
    path.write_text(text)
    names = set(rows_of(path))
    assert "coupling, sampled and late" in names
    assert not any(name.startswith("admittance") for name in names)


def test_a_device_that_does_not_say_its_delay_and_one_that_varies_are_not_proved(rig):
    steady = rows_of(rig())[LATE]
    assert steady.outcome == Outcome.PASS
    assert "1 ticks" in steady.figure
    path = rig()
    path.write_text(
        path.read_text().replace("[axis.drive]", "[axis.measured]\njitter_ticks = 0.5\n[axis.drive]")
    )
    assert rows_of(path)[LATE].outcome == Outcome.NOT_PROVED


def test_samples_older_than_a_tick_are_judged_at_the_points_only(rig):
    path = rig(m=0.06)
    path.write_text(
        path.read_text().replace("[axis.drive]", "[axis.measured]\nsample_ticks = 2\n[axis.drive]")
    )
    row = rows_of(path)[LOOP]
    assert row.outcome == Outcome.NOT_PROVED
    assert "between them not proved" in row.meaning


def test_a_coarse_encoder_is_refused_by_the_torque_of_one_count(rig):
    row = rows_of(rig(counts=2000))[COUNT]
    alpha = 1 - 2.718281828 ** (-2 * 3.141592653 * 0.1)
    assert float(row.figure.split()[0]) == pytest.approx(2.0 * alpha * 6.2831853 / 2000 / 1e-3, rel=5e-3)
    assert row.outcome == Outcome.FAIL
    assert "a finer encoder" in row.refusal


def _run(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["rtctl", *map(str, arguments)])
    code = 0
    try:
        main()
    except SystemExit as stop:
        code = stop.code or 0
    return code, capsys.readouterr().out


def test_the_text_the_json_and_the_picture(rig, monkeypatch, capsys, tmp_path):
    path, picture = rig(), tmp_path / "masses.png"
    code, text = _run(monkeypatch, capsys, "check", path, "--plot", picture)
    assert code == 0
    assert "joint as an admittance is stable in hands to 600 N m/rad" in text
    assert "coupling is passive" not in text
    assert "stiffest hand that passes" in text
    assert picture.read_bytes()[:4] == b"\x89PNG"
    code, text = _run(monkeypatch, capsys, "check", path, "--json")
    assert code == 0
    body = json.loads(text)
    (axis,) = body["axes"]
    assert axis["admittance"]["proved"]
    assert axis["admittance"]["hand_stiffness_max_nm_rad"] > 600
    assert axis["loop"]["mass_kgm2"] == 0.03
    assert any(row["name"] == LOOP for row in body["verdicts"])


def test_the_delay_watch_of_an_admittance_covers_what_is_declared_and_no_more(rig):
    plan = build(load(rig(d=1.5)))
    assert plan.params[0]["proof_delay_s"][0] == pytest.approx(1.5e-3)


def test_the_reasons_name_every_row_that_is_left_out():
    text = verdicts_of_admittance.__doc__
    for name in (
        "coupling, sampled and late",
        "elastic joint",
        "steps of the encoder",
        "two-line",
        "in a hand",
    ):
        assert name in text
