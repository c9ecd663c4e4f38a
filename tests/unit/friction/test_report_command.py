"""`rtctl fit --report`: what the command writes, and the mistakes it tells before anything is fitted."""

import json
import os
import tomllib
from pathlib import Path

import in_process

ROOT = Path(__file__).parents[3]
POINTS = ROOT / "configs/friction/mock_points.csv"


def _run(monkeypatch, capsys, *args):
    return in_process.run(monkeypatch, capsys, "fit", POINTS, *args)


def test_the_command_writes_model_and_report(monkeypatch, capsys, tmp_path):
    out, folder, rig = tmp_path / "m.json", tmp_path / "r", ROOT / "configs/mock.toml"
    others = tmp_path / "others.csv"
    others.write_text("\n".join(POINTS.read_text().splitlines()[:4]))  # few points of one direction will do
    code, said, _ = _run(
        monkeypatch, capsys,
        "--out", out, "--report", folder, "--search", "none", "--C", 1000, "--test", others, "--config", rig,
    )  # fmt: skip
    assert code == 0
    assert f"report: {folder / 'report.html'}" in said
    document = json.loads((folder / "report.json").read_text())
    assert document["prediction_on"] == "test points"
    assert document["provenance"]["options"]["search"] == "none"
    assert document["folds"] == "speed"
    assert "Held out in 5 folds by speed" in (folder / "report.html").read_text()
    pasted = tomllib.loads(said[said.index("[axis.friction]") : said.index("learned curve")])["axis"][
        "friction"
    ]
    assert pasted["model"] == Path(os.path.relpath(out, rig.parent)).as_posix()
    assert "gain = " in (folder / "report.html").read_text()
    assert len(document["gain"]["axes"]) == 1


def test_a_mistake_is_told_before_anything_is_fitted(monkeypatch, capsys, tmp_path):
    out, rig = tmp_path / "m.json", ROOT / "configs/mock.toml"
    code, _, err = _run(monkeypatch, capsys, "--out", out, "--test", POINTS)
    assert code == 2
    assert "--report" in err
    code, _, err = _run(monkeypatch, capsys, "--out", out, "--folds", "time")
    assert code == 10
    assert "column time_s" in err
    code, _, err = _run(
        monkeypatch, capsys, "--out", out, "--report", tmp_path / "r", "--config", rig, "--rig", "x"
    )
    assert code == 10
    assert "correct --rig or --config" in err
    (tmp_path / "one.csv").write_text("velocity_rad_s,friction_torque_nm,direction\n0.1,0.3,1\n")
    code, _, err = _run(
        monkeypatch, capsys, "--out", out, "--report", tmp_path / "r", "--test", tmp_path / "one.csv"
    )
    assert code == 10
    assert "one.csv: 1 points, a test has at least 2" in err
    (tmp_path / "one.csv").unlink()
    (tmp_path / "thesis.txt").write_text("")
    code, _, err = _run(monkeypatch, capsys, "--out", out, "--report", tmp_path)
    assert code == 10
    assert "thesis.txt" in err
    assert not out.exists()
