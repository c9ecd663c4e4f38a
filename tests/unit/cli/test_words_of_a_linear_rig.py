"""What a rig of carriages alone says and draws: m, N, kg and forces, never rad, N m or torques."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from in_process import run

from hw.motion import words
from rtctl import pictures
from rtctl.check import stability_figure, stability_report
from rtctl.cli import fit_points, replay
from rtctl.cli.operate import lines
from rtctl.client.view_panel import signals_of
from rtctl.control.vocabulary import State
from rtctl.friction import outliers
from rtctl.friction.logs import other_programs
from rtctl.recording import compare
from rtctl.recording import replay as replaying
from rtctl.recording.replay import Verdict
from rtctl.rig_file.config import load
from rtctl.tick import FIELD

SLIDE = Path(__file__).parents[3] / "configs" / "mock-linear.toml"
ROTARY = re.compile(r"\brad\b|N m\b|kg m|\btorques?\b")

ADMITTANCE = """
display = "admittance"
dry_friction_n = 2.0
[axis.admittance]
mass_kg = 1.2
damping_ns_m = 10.0
velocity_gain_ns_m = 200.0
position_gain_n_m = 1000.0
force_lowpass_hz = 150.0
force_deadband_n = 0.03
velocity_lowpass_hz = 100.0
hand_stiffness_n_m = 12000.0
hand_damping_ns_m = 100.0
hand_inertia_kg = 0.5
"""


@pytest.fixture
def admittance(tmp_path):
    """A carriage that is displayed as a virtual mass."""
    text = SLIDE.read_text()
    coupling = re.search(r"\[axis\.coupling\].*?(?=\[axis\.environment\])", text, re.DOTALL)[0]
    first, rest = ADMITTANCE.split("[axis.admittance]")
    text = text.replace(coupling, f"[axis.admittance]{rest}").replace(
        "[axis.velocity]", f"{first}[axis.velocity]"
    )
    path = tmp_path / "slide.toml"
    path.write_text(text)
    return path


@pytest.fixture
def drawn(monkeypatch):
    """Texts of every figure that is saved."""
    found = []

    def keep(figure, *_):
        for panel in figure.axes:
            found.extend([panel.get_xlabel(), panel.get_ylabel(), panel.get_title()])

    monkeypatch.setattr(pictures, "save", keep)
    return found


def test_check_tells_a_carriage_in_forces(monkeypatch, capsys):
    code, out, err = run(monkeypatch, capsys, "check", SLIDE)
    assert code == 0, err
    assert "force of an empty account" in out
    assert not ROTARY.search(out)


def test_check_tells_the_hands_of_a_virtual_mass_that_slides_in_m(monkeypatch, capsys, admittance):
    _, out, _ = run(monkeypatch, capsys, "check", admittance)
    assert "in hands to 12000 N/m, 100 N s/m, 0.5 kg" in out
    assert not ROTARY.search(out)


@pytest.mark.parametrize("display", ["impedance", "admittance"])
def test_the_figure_of_check_is_in_the_units_of_its_axis(display, admittance, drawn):
    report = stability_report.examine(load(SLIDE if display == "impedance" else admittance))
    stability_figure.draw(report, "region.png")
    assert any("N/m" in text for text in drawn)
    assert not [text for text in drawn if ROTARY.search(text)]


def test_the_figure_of_two_laws_says_what_it_draws(drawn):
    signals = {name: np.zeros((3, 1)) for name in compare.SHOWN}
    found = compare.Comparison(np.arange(3.0), signals, signals, ["carriage"], ["linear"], None)
    compare.plot_comparison(found, Path("two.png"), ("one", "other"))
    assert {"position_m, m", "torque_applied_n, N"} <= set(drawn)
    drawn.clear()
    both = {name: np.zeros((3, 2)) for name in compare.SHOWN}
    mixed = replace(found, recorded=both, other=both, axes=["a", "b"], motions=["rotary", "linear"])
    compare.plot_comparison(mixed, Path("two.png"), ("one", "other"))
    assert "position_rad, rad\nposition_m, m" in drawn


TOLD = {
    "rig": "slide", "state": "IDLE", "authority": 0.0, "enabled": False, "estop": False, "faults": [],
    "fault_first": None, "warnings": [], "waiver": False, "lease_holder": None,
    "axes": [{"axis": "carriage", "motion": "linear", "environment": {"kind": "free"}, "compensation": 1.0,
              "display": {"kind": "impedance"}}],
    "position_rad": [0.01], "velocity_rad_s": [0.0],
}  # fmt: skip


def test_status_of_carriages_says_that_there_is_no_force():
    assert lines(TOLD)[0] == "slide: IDLE, no force"
    joint = {**TOLD["axes"][0], "axis": "joint", "motion": "rotary"}
    both = {**TOLD, "axes": [*TOLD["axes"], joint], "position_rad": [0.0, 0.0], "velocity_rad_s": [0.0, 0.0]}
    assert lines(both)[0] == "slide: IDLE, no torque"


def test_the_page_explains_its_curves_in_forces():
    meant = signals_of({"axes": [{"name": "carriage", "motion": "linear"}]})
    of_axes = [one for one in meant if FIELD[one["name"].partition(".")[0]].shape == "axis"]
    assert not [one["meaning"] for one in of_axes if ROTARY.search(one["meaning"])]


def test_the_page_says_what_a_state_means_in_forces():
    from rtctl.client.view_guidance import next_step

    said = [words(next_step(state, faults), "linear") for state in State for faults in (0, 1)]
    assert "Force is on." in said
    assert not [text for text in said if "orque" in text]


@pytest.mark.parametrize(
    "text",
    [
        "--column torque=NAME:N",
        "column 'torque' row 7",
        "--torque-delay does",
        "torque_limit_n",
        "give its torque constant",
        "a torque on its screw",
        "out/torque.csv",
    ],
)
def test_names_and_the_motors_own_torque_stay(text):
    assert words(text, "linear") == text


def test_a_position_of_a_carriage_is_no_joint_angle():
    assert words("joint angle, link side, unwrapped", "linear") == "position, link side, unwrapped"
    assert words("joint angle, rad", "rotary") == "joint angle, rad"


def test_points_of_a_carriage_that_are_left_out_are_told_in_its_units(monkeypatch, capsys):
    points = SimpleNamespace(motion="linear")
    said = "slide.csv: 0.02 rad/s, 9 N m is left out"
    monkeypatch.setattr(outliers, "without_outliers", lambda points: (points, (said,)))
    fit_points.without_outliers(points, keep=False)
    assert capsys.readouterr().err == "warning: slide.csv: 20 mm/s, 9 N is left out\n"
    monkeypatch.setattr(other_programs, "read_mapped", lambda *_: (points, (said,)))
    fit_points.read((), ("velocity=v:m/s",), None, "none", {}, of_speeds=False)
    assert capsys.readouterr().err == "warning: slide.csv: 20 mm/s, 9 N is left out\n"


@pytest.mark.parametrize(("motions", "told"), [(["linear"], "force"), (["linear", "rotary"], "torque")])
def test_a_replay_of_carriages_alone_tells_of_forces(monkeypatch, capsys, motions, told):
    found = Verdict(ticks=1, span_s=1.0, took_s=1.0)
    monkeypatch.setattr(replaying, "Replay", lambda _reader: SimpleNamespace(check=lambda: found))
    replay._same(SimpleNamespace(about={}, motions=motions, missing_fields=list), as_json=False)
    assert f"state and {told} are the same" in capsys.readouterr().out
