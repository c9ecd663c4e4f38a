"""`rtctl fit --judge`: the verdict follows from the points."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from rtctl.cli.fit import command


def _points(path: Path, *, factor: float = 1.0, fastest: float = 5.0) -> Path:
    rows = ["velocity_rad_s,friction_torque_nm"]
    for v in np.linspace(0.1, fastest, 24):
        friction = factor * (0.2 + 0.02 * v + 0.1 * np.exp(-v))
        rows += [f"{v},{friction}", f"{-v},{-friction}"]
    path.write_text("\n".join(rows) + "\n")
    return path


def _run(*words: object) -> Result:
    return CliRunner().invoke(command, [str(word) for word in words])


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("judge")
    done = _run(_points(folder / "p.csv"), "--out", folder / "m.json", "--C", "100")
    assert done.exit_code == 0, done.output
    return folder / "m.json"


def test_its_own_points_are_held(model: Path) -> None:
    done = _run(model.parent / "p.csv", "--judge", model)
    assert done.exit_code == 0, done.output
    assert "the model holds" in done.output


def test_weaker_friction_breaks_the_bound_with_its_sign(model: Path, tmp_path: Path) -> None:
    done = _run(_points(tmp_path / "w.csv", factor=0.7), "--judge", model, "--json")
    body = json.loads(done.output)
    assert done.exit_code == 1
    assert not body["holds"]
    assert all(row["bias_nm"] > 0 and row["over_bound"] for row in body["directions"])
    assert any("Coulomb + viscous" in fault for fault in body["faults"])


def test_speeds_beyond_the_range_are_counted_and_left_out(model: Path, tmp_path: Path) -> None:
    done = _run(_points(tmp_path / "f.csv", fastest=8.0), "--judge", model, "--json")
    assert done.exit_code == 1
    assert all(
        0 < row["outside"] < 24 and not row["over_bound"] for row in json.loads(done.output)["directions"]
    )


def test_options_of_a_fit_are_refused(model: Path) -> None:
    done = _run(model.parent / "p.csv", "--judge", model, "--C", "3")
    assert done.exit_code == 2
    assert "--C" in done.output
