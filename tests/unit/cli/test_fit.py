"""`rtctl fit`: from a CSV file to a model that reads back, and the errors in between."""

import json
import sys

import numpy as np
import pytest

from rtctl.__main__ import main
from rtctl.friction import artefact


@pytest.fixture
def csv(tmp_path):
    rng = np.random.default_rng(2)
    lines = ["velocity_rad_s,friction_torque_nm,direction"]
    for s in (1, -1):
        for v in [0.0, *np.geomspace(0.01, 2, 29)]:
            f = 0.25 + 0.1 * np.exp(-((v / 0.1) ** 2)) + 0.05 * v + rng.normal(0, 0.003)
            lines.append(f"{s * v:.6f},{s * f:.6f},{s}")
    path = tmp_path / "points.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def _run(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["rtctl", *map(str, arguments)])
    code = 0
    try:
        main()
    except SystemExit as stop:
        code = stop.code or 0
    streams = capsys.readouterr()
    return code, streams.out, streams.err


def test_points_become_a_model_file_with_report_and_plot(csv, monkeypatch, capsys, tmp_path):
    out, plot = tmp_path / "m.json", tmp_path / "m.png"
    code, text, err = _run(monkeypatch, capsys, "fit", csv, "--out", out, "--rig", "bench", "--plot", plot)
    assert (code, err) == (0, "")
    for row in ("support vectors", "mean training error", "max training error", "compile error"):
        assert row in text
    assert artefact.load(out).rig == "bench"
    assert plot.read_bytes().startswith(b"\x89PNG")


def test_json_reports_the_same_figures_as_the_file(csv, monkeypatch, capsys, tmp_path):
    out = tmp_path / "m.json"
    code, text, _ = _run(
        monkeypatch, capsys, "fit", csv, "--out", out, "--C", 200, "--epsilon", 0.004, "--json"
    )
    assert code == 0
    rows = json.loads(text)["directions"]
    for row, branch in zip(rows, artefact.load(out).branches, strict=True):
        assert row["points"] == branch.n_points == 30
        assert row["support_vectors"] == len(branch.support_vectors)
        assert row["train_max_error_nm"] == branch.train_max_error_nm
        assert (row["C"], row["epsilon_nm"]) == (200, 0.004)
        assert 0 <= row["compile_error_nm"] <= branch.rounding_bound_nm


def test_bad_points_exit_10_and_write_nothing(csv, monkeypatch, capsys, tmp_path):
    csv.write_text(csv.read_text().replace("friction_torque_nm", "torque"))
    code, _, err = _run(monkeypatch, capsys, "fit", csv, "--out", tmp_path / "m.json")
    assert code == 10
    assert str(csv) in err
    assert "friction_torque_nm is missing" in err
    assert not (tmp_path / "m.json").exists()


@pytest.mark.parametrize(
    ("option", "value"), [("--C", "nan"), ("--C", "0"), ("--epsilon", "inf"), ("--fade", "-1")]
)
def test_options_that_are_no_positive_number_are_wrong_usage(
    csv, monkeypatch, capsys, tmp_path, option, value
):
    code, _, err = _run(monkeypatch, capsys, "fit", csv, "--out", tmp_path / "m.json", option, value)
    assert code == 2
    assert option in err


def test_a_bad_rig_name_or_folder_is_a_model_error(csv, monkeypatch, capsys, tmp_path):
    code, _, err = _run(monkeypatch, capsys, "fit", csv, "--out", tmp_path / "m.json", "--rig", "two words")
    assert code == 4
    assert "rig" in err
    code, _, err = _run(monkeypatch, capsys, "fit", csv, "--out", tmp_path / "no" / "m.json")
    assert code == 4
    assert "cannot write" in err
