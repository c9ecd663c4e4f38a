"""`rtctl fit`: from a CSV file to a model that reads back, and the errors in between."""

import json
import re
import sys

import numpy as np
import pytest

from rtctl.__main__ import main
from rtctl.errors import ModelError
from rtctl.friction import artefact
from rtctl.friction.learn import fit


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


def test_a_bad_rig_name_or_folder_is_told_before_anything_is_learned(csv, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("rtctl.friction.point_reader.read_points", None)  # work would fail otherwise
    code, _, err = _run(monkeypatch, capsys, "fit", csv, "--out", tmp_path / "m.json", "--rig", "two words")
    assert code == 2
    assert "'two words' is no rig's name: a letter, then at most 31 letters, digits, - or _" in err
    code, _, err = _run(monkeypatch, capsys, "fit", csv, "--out", tmp_path / "no" / "m.json")
    assert code == 2
    assert f"cannot write {tmp_path}/no/m.json: there is no folder" in " ".join(err.split())


def test_the_ladder_is_shown_with_its_reason_and_the_winner_written(csv, monkeypatch, capsys, tmp_path):
    out, plot = tmp_path / "m.json", tmp_path / "m.png"
    code, text, _ = _run(
        monkeypatch, capsys, "fit", csv, "--out", out, "--ladder", "--kernel", "formula", "--backend",
        "sequential",
        "--plot", plot,
    )  # fmt: skip
    assert code == 0
    for family in ("coulomb", "coulomb_viscous", "tustin", "gaussian", "lorentzian"):
        assert f"\n{family} " in "\n" + text
    assert "<- chosen" in text
    assert "Chosen: the mean of" in text
    assert "One rung alone would be gaussian" in text
    model = artefact.load(out)
    assert model.kind == "mean"
    assert model.selection in text
    assert plot.read_bytes().startswith(b"\x89PNG")


def test_a_rung_that_cannot_be_compiled_has_its_row_and_the_ladder_a_model(
    csv, monkeypatch, capsys, tmp_path
):
    compile_curve = fit.compile_curve

    def broken(curve, speed_max):
        if curve.kind == "gaussian":
            raise ModelError("too many cells: stribeck_rad_s = 0.1")
        return compile_curve(curve, speed_max)

    monkeypatch.setattr(fit, "compile_curve", broken)
    out, report = tmp_path / "m.json", tmp_path / "report"
    code, text, _ = _run(
        monkeypatch, capsys, "fit", csv, "--out", out, "--ladder", "--kernel", "formula", "--backend",
        "sequential",
        "--report", report, "--no-mean",
    )  # fmt: skip
    assert code == 0
    why = "refused: direction +1: too many cells: stribeck_rad_s = 0.1"
    assert re.search(rf"^gaussian +{re.escape(why)}$", text, re.MULTILINE)
    assert artefact.load(out).kind in ("lorentzian", "tustin")
    assert why in (report / "report.html").read_text()
    row = next(
        r for r in json.loads((report / "report.json").read_text())["ladder"] if r["family"] == "gaussian"
    )
    assert row["held_out_rmse_nm"] is None
    assert why.endswith(row["refused"])


def test_a_search_of_one_kernel_reports_every_rung_as_json(csv, monkeypatch, capsys, tmp_path):
    code, text, _ = _run(
        monkeypatch, capsys, "fit", csv, "--out", tmp_path / "m.json", "--kernel", "spline", "--symmetric",
        "yes",
        "--backend", "sequential", "--temperature", "20", "30", "--json",
    )  # fmt: skip
    assert code == 0
    found = json.loads(text[text.index("{") :])
    assert [row["family"] for row in found["ladder"]] == ["epsilon-spline", "nu-spline", "mean"]
    assert found["chosen"] == "mean"
    assert found["runner_up"] != found["chosen"]
    assert found["symmetric"] is True
    assert found["kind"] == "mean"
    assert found["evaluation_ns"] > 0
    assert all(row["held_out_rmse_nm"] > 0 and row["held_out_se_nm"] > 0 for row in found["ladder"])
    assert artefact.load(tmp_path / "m.json").temperature_max_c == 30


def test_a_bound_on_the_support_vectors_is_kept_and_said_or_refused_with_the_remedy(
    csv, monkeypatch, capsys, tmp_path
):
    out = tmp_path / "m.json"
    few = ("fit", csv, "--out", out, "--kernel", "spline", "--backend", "sequential", "--max-support-vectors")
    code, _, err = _run(monkeypatch, capsys, *few, 2)
    assert code == 10
    assert "raise --max-support-vectors" in err
    assert not out.exists()
    code, text, _ = _run(monkeypatch, capsys, *few, 7, "--json")
    assert code == 0
    found = json.loads(text[text.index("{") :])
    assert found["max_support_vectors"] == 7
    assert max(row["support_vectors"] for row in found["directions"]) <= 7
    assert "more than 7 support vectors, as asked" in artefact.load(out).selection


@pytest.mark.parametrize(
    "wrong",
    [
        ("--ladder", "--C", "10"),
        ("--max-support-vectors", "0"),
        ("--max-support-vectors", "9", "--C", "10"),
        ("--tolerance", "nan"),
        ("--tolerance", "-1"),
        ("--tolerance", "1", "--search", "none"),
        ("--search", "full", "--epsilon", "0.01"),
        ("--search", "none", "--kernel", "rbf"),
        ("--temperature", "30", "20"),
        ("--temperature", "nan", "20"),
        ("--backend", "cloud"),
    ],
)
def test_options_that_contradict_each_other_are_wrong_usage(csv, monkeypatch, capsys, tmp_path, wrong):
    code, _, err = _run(monkeypatch, capsys, "fit", csv, "--out", tmp_path / "m.json", *wrong)
    assert code == 2
    assert any(word in err for word in wrong if word.startswith("--"))
    assert not (tmp_path / "m.json").exists()
