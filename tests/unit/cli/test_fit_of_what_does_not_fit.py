"""`rtctl fit` given files that do not belong together: told before anything is searched or written over."""

from pathlib import Path

import numpy as np
import pytest
from in_process import run

from hw.motion import name
from rtctl.friction import artefact
from rtctl.friction.gain import recommend
from rtctl.friction.learn import ladder
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[3] / "configs"
MOCK, SLIDE = (CONFIGS / "mock.toml", "mock"), (CONFIGS / "mock-linear.toml", "slide")
N = 40


def table(path, motion="rotary", ripple_nm=0.0, period_rad=1.0):
    """Points of both directions over a period of places, in the columns of that motion."""
    x = np.linspace(0, period_rad, N, endpoint=False)
    header = ("velocity_rad_s", "friction_torque_nm", "position_rad")
    rows = [",".join(name(one, motion) for one in header)]
    for way in (1, -1):
        v = way * np.linspace(0.02, 0.2, N) if not ripple_nm else way * np.full(N, 0.01)
        torque = way * (0.3 + 0.1 * np.abs(v)) + ripple_nm * np.sin(2 * np.pi * x / period_rad)
        rows += [
            f"{a!r},{b!r},{c!r}" for a, b, c in zip(v.tolist(), torque.tolist(), x.tolist(), strict=True)
        ]
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize("given", ["--places", "--sweep"])
def test_a_file_of_places_that_cannot_be_read_is_told_before_the_search(tmp_path, monkeypatch, capsys, given):
    def searched(*_):
        raise AssertionError("the search had begun")

    monkeypatch.setattr(ladder, "ascend", searched)
    points, out = table(tmp_path / "p.csv"), tmp_path / "m.json"
    code, _, err = run(monkeypatch, capsys, "fit", points, "--out", out, "--ladder", given, "nowhere.csv")
    assert code == 10
    assert "nowhere.csv: cannot read the points" in err


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("--places",), "is of a linear axis, the points are of a rotary one"),
        (("--sweep",), "is of a linear axis, the points are of a rotary one"),
        (("--report", "report", "--test"), "is of a linear axis, the points are of a rotary one"),
    ],
)
def test_m_is_never_read_as_rad(tmp_path, monkeypatch, capsys, given, said):
    monkeypatch.chdir(tmp_path)
    points, other = table(tmp_path / "p.csv"), table(tmp_path / "o.csv", "linear")
    code, _, err = run(monkeypatch, capsys, "fit", points, "--out", "m.json", *given, other)
    assert code == 10
    assert f"o.csv: {said}" in err
    assert not (tmp_path / "m.json").exists()


@pytest.mark.parametrize(("motion", "rig"), [("linear", MOCK), ("rotary", SLIDE)])
def test_a_rig_without_an_axis_of_that_motion_gets_no_advice(tmp_path, monkeypatch, capsys, motion, rig):
    points, out = table(tmp_path / "p.csv", motion), tmp_path / "m.json"
    config, named = rig
    code, _, err = run(monkeypatch, capsys, "fit", points, "--out", out, "--config", config, "--rig", named)
    assert code == 10
    assert f"p.csv: is of a {motion} axis" in err
    assert not out.exists()


def test_test_points_that_are_not_there_are_told_as_other_points_are(tmp_path, monkeypatch, capsys):
    points, out = table(tmp_path / "p.csv"), tmp_path / "m.json"
    report = ("--report", tmp_path / "report", "--test", "nowhere.csv")
    code, _, err = run(monkeypatch, capsys, "fit", points, "--out", out, *report)
    assert (code, err.partition(":")[0]) == (10, "rtctl")
    assert "nowhere.csv: cannot read the points" in err


def test_a_picture_does_not_replace_the_model(tmp_path, monkeypatch, capsys):
    points = table(tmp_path / "p.csv")
    both = ("--out", tmp_path / "m.png", "--plot", tmp_path / "." / "m.png")
    code, _, err = run(monkeypatch, capsys, "fit", points, *both)
    assert code == 2
    assert "is what is drawn, too" in err


def test_where_the_index_of_a_carriage_is_now_is_told_in_m(tmp_path, monkeypatch, capsys):
    places = {"ripple_nm": 0.05, "period_rad": 0.005}
    points, sweep = table(tmp_path / "p.csv", "linear"), table(tmp_path / "s.csv", "linear", **places)
    out = ("--out", tmp_path / "m.json", "--kernel", "formula", "--backend", "sequential")
    code, _, err = run(monkeypatch, capsys, "fit", points, *out, "--sweep", sweep, "--turn", "0.005")
    assert code == 0, err
    judge = ("fit", points, "--judge", tmp_path / "m.json", "--sweep")
    _, text, _ = run(monkeypatch, capsys, *judge, sweep)
    assert "rad" not in text.partition("direction")[0]
    assert "friction.place_shift_m = " in text
    turned = table(tmp_path / "t.csv", "rotary", **places)
    code, _, err = run(monkeypatch, capsys, *judge, turned)
    assert code == 10
    assert "is of a rotary axis" in err


def test_a_rig_of_both_motions_advises_on_the_axis_that_the_model_is_of():
    crank, slide = (load(CONFIGS / f"{one}.toml") for one in ("mock", "mock-linear"))
    axes = [slide.config.axis[0], crank.config.axis[0]]
    both = crank.model_copy(update={"config": crank.config.model_copy(update={"axis": axes})})
    model = artefact.load(CONFIGS / "friction" / "mock.json")
    assert [one.axis for one in recommend(model, both).axes] == [axes[1].name]
