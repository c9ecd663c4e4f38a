"""`rtctl identify --log` of a linear axis: the same motion on a screw gives the same parameters, in m and
N.
"""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from in_process import run

from rtctl.friction.logs.plausibility import largest_speed
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation

SLIDE = Path(__file__).parents[3] / "configs" / "mock-linear.toml"
LEAD_M = 0.005
M = LEAD_M / (2 * math.pi)
"""Travel of the screw per rad, m."""


@pytest.fixture
def logs(tmp_path):
    """The same motion of a screw in rad and N m, in m and N, and in mm and N.

    Its largest speed is 2 rad/s: that is what the largest speed of a linear axis stands for.
    """
    t = np.arange(2_000) / 100.0
    w = [(a, 2 * np.pi * f) for a, f in ((0.4, 0.4), (0.15, 1.1), (0.06, 2.3))]
    quickest = largest_speed(sum(a * np.sin(k * t) for a, k in w), 100.0)
    w = [(2.0 / quickest * a, k) for a, k in w]
    x = sum(a * np.sin(k * t) for a, k in w)
    v = sum(a * k * np.cos(k * t) for a, k in w)
    acceleration = sum(-a * k**2 * np.sin(k * t) for a, k in w)
    noise = np.random.default_rng(3).normal(0, 0.01, len(t))
    torque = 0.012 * acceleration + 0.05 * v + 0.25 * np.sign(v) + 0.02 + noise
    made = {}
    for name, place, effort in (
        ("rotary", x, torque),
        ("m", M * x, torque / M),
        ("mm", 1e3 * M * x, torque / M),
    ):
        made[name] = tmp_path / f"{name}.csv"
        rows = "\n".join(
            f"{a:.4f},{b!r},{c!r}" for a, b, c in zip(t, place.tolist(), effort.tolist(), strict=True)
        )
        made[name].write_text(f"time_s,place,effort\n{rows}\n")
    return made


def identified(monkeypatch, capsys, log, place, effort, *more):
    columns = (
        "--column",
        f"position=place:{place}",
        "--column",
        f"torque=effort:{effort}",
        "--torque-delay",
        "0",
    )
    code, out, err = run(monkeypatch, capsys, "identify", "--log", log, *columns, *more, "--json")
    assert code == 0, err
    return json.loads(out)


def parameters(found):
    return {
        (fit, name): each["value"]
        for fit in ("symmetric", "per_direction")
        for name, each in found[fit]["parameters"].items()
    }


PER = {"kgm2": (1 / M**2, "kg"), "nms_rad": (1 / M**2, "ns_m"), "nm": (1 / M, "n")}


def test_a_log_in_m_and_n_gives_what_its_screw_does_scaled(monkeypatch, capsys, logs):
    rotary = identified(monkeypatch, capsys, logs["rotary"], "rad", "N m")
    linear = identified(monkeypatch, capsys, logs["m"], "m", "N", "--lead-m", LEAD_M)
    turned = identified(monkeypatch, capsys, logs["rotary"], "rad", "N m", "--lead-m", LEAD_M)
    found, told = parameters(linear), parameters(turned)
    for (fit, key), value in parameters(rotary).items():
        factor, own = next((f, key[: -len(end)] + o) for end, (f, o) in PER.items() if key.endswith(end))
        assert found[fit, own] == pytest.approx(value * factor, rel=1e-9)
        assert told[fit, own] == pytest.approx(value * factor, rel=1e-9)
    assert linear["motion"] == turned["motion"] == "linear"
    assert linear["speeds"][0]["low_speed_rows"] == rotary["speeds"][0]["low_speed_rows"]
    length = rotary["presliding"]["length_rad"]
    assert linear["presliding"]["length_m"] == pytest.approx(M * length, rel=1e-9)
    assert linear["reversals"]["chosen"] == rotary["reversals"]["chosen"]
    for one, other in zip(rotary["reversals"]["rungs"], linear["reversals"]["rungs"], strict=True):
        assert other["near_n"] == pytest.approx(one["near_nm"] / M, rel=1e-6)


def test_the_thresholds_do_not_depend_on_lead_or_unit(monkeypatch, capsys, logs):
    screw = identified(monkeypatch, capsys, logs["m"], "m", "N", "--lead-m", LEAD_M)
    metres = identified(monkeypatch, capsys, logs["m"], "m", "N")
    milli = identified(monkeypatch, capsys, logs["mm"], "mm", "N")
    for key, value in parameters(metres).items():
        assert parameters(milli)[key] == pytest.approx(value, rel=1e-9)
        assert parameters(screw)[key] == pytest.approx(value, rel=1e-9)
    for name, truth in (("inertia_kg", 0.012 / M**2), ("viscous_ns_m", 0.05 / M**2), ("coulomb_n", 0.25 / M)):
        assert metres["symmetric"]["parameters"][name]["value"] == pytest.approx(truth, rel=0.02)


def test_the_table_and_the_points_speak_of_m_and_n(monkeypatch, capsys, logs, tmp_path):
    columns = ("--column", "position=place:mm", "--column", "torque=effort:N", "--torque-delay", "0")
    code, text, _ = run(
        monkeypatch, capsys, "identify", "--log", logs["mm"], *columns, "--out", tmp_path / "out"
    )
    assert code == 0
    assert all(unit in text for unit in ("inertia_kg ", "viscous_ns_m", " mm/s", " mN"))
    assert [line for line in text.splitlines() if any(unit in line for unit in ("rad", "N m", "_nm"))] == []
    head = (tmp_path / "out" / "points.csv").read_text().splitlines()[0].split(",")
    assert head[:4] == ["velocity_m_s", "friction_torque_n", "direction", "std_n"]


def first_line(monkeypatch, capsys, log, *columns, more=()):
    mapped = [word for column in columns for word in ("--column", column)]
    code, text, err = run(
        monkeypatch, capsys, "identify", "--log", log, *mapped, "--torque-delay", "0", *more
    )
    assert code == 0, err
    return text.splitlines()[0]


def test_a_unit_that_the_file_does_not_say_is_asked_before_anything_else(monkeypatch, capsys, logs):
    kilograms = 0.012 / M**2
    asked = first_line(monkeypatch, capsys, logs["m"], "position=place:m", "torque=effort:kN")
    assert asked.startswith("please confirm: is 'effort' in kN? The file does not say")
    told = [float(each) for each in re.findall(r"([\d.e+-]+) kg\b", asked)]
    assert told == pytest.approx([1e3 * kilograms, 1e-3 * kilograms, kilograms], rel=0.02)
    asked = first_line(monkeypatch, capsys, logs["rotary"], "position=place", "torque=effort")
    assert re.match(r"please confirm: is 'effort' in N m\?.* 0\.012 kg m\^2 \(as 1\.2 kg at 100 mm\)", asked)


@pytest.mark.parametrize("name", ["effort [N]", "effort_n", "effort_n.carriage"])
def test_a_unit_that_the_file_says_is_not_asked(monkeypatch, capsys, logs, name):
    said = logs["m"].with_name("said.csv")
    said.write_text(logs["m"].read_text().replace("effort", name))
    line = first_line(monkeypatch, capsys, said, "position=place:m", f"torque={name}:N")
    assert line.startswith("symmetric: ")
    scaled = first_line(monkeypatch, capsys, logs["m"], "position=place:m", "torque=effort:N:1.5")
    assert scaled.startswith("symmetric: ")


def test_a_log_of_no_units_is_asked_whether_its_axis_turns(monkeypatch, capsys, logs):
    asked = first_line(monkeypatch, capsys, logs["rotary"], "position=place", "torque=effort")
    assert asked.startswith("please confirm: ")
    assert asked.endswith("of one that slides say so, position=NAME:m, torque=NAME:N")
    said = first_line(monkeypatch, capsys, logs["rotary"], "position=place:rad", "torque=effort")
    assert "slides" not in said


@pytest.mark.parametrize(
    ("place", "effort", "told"),
    [
        ("mm", "N m", "'effort' is read in 'N m', which this axis does not have"),
        ("rad", "N", "'place' is read in 'rad', which this axis does not have"),
    ],
)
def test_units_of_both_motions_in_one_log_are_refused(monkeypatch, capsys, logs, place, effort, told):
    columns = ("--column", f"position=place:{place}", "--column", f"torque=effort:{effort}")
    code, _, err = run(monkeypatch, capsys, "identify", "--log", logs["m"], *columns)
    assert code != 0
    assert told in err


def test_a_recording_of_a_screw_driven_carriage_is_no_late_torque(monkeypatch, capsys, tmp_path):
    """A carriage whose screw turns at 250 rad/s: by its radian bending would count as sliding, and the torque
    look 100 ms late.
    """
    simulation = Simulation(load(SLIDE))
    simulation.arm()
    rows = simulation.run(16.0)[2_000:]
    fields = {name: rows[f"{name}_torque_nm"][:, 0] for name in ("motor", "hand")}
    seconds = (rows["time_ns"] - rows["time_ns"][0]) * 1e-9
    np.savez(tmp_path / "rec.npz", time_s=seconds, position=rows["position_rad"][:, 0], **fields)
    columns = ("position=position:m", "torque=motor:N", "external=hand:N")
    mapped = [part for column in columns for part in ("--column", column)]
    code, out, err = run(
        monkeypatch, capsys, "identify", "--log", tmp_path / "rec.npz", "--config", SLIDE, *mapped, "--json"
    )
    assert code == 0, err
    found = json.loads(out)["symmetric"]["parameters"]
    for name, truth in (("inertia_kg", 1.2), ("viscous_ns_m", 5.0), ("coulomb_n", 6.0)):
        assert found[name]["value"] == pytest.approx(truth, rel=0.03)
    code, _, err = run(
        monkeypatch, capsys, "identify", "--log", tmp_path / "rec.npz", "--column", "position=position_rad:m",
        "--column", "torque=motor:N",
    )  # fmt: skip
    assert code != 0
    assert "no column 'position_rad'" in err  # as it was written, not in the words of a carriage
