"""Point-to-point by the law's own program, on the real loop."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from rtctl.cli import cli
from rtctl.experiments import point_to_point, positioning_on_rig

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.mark.slow
def test_the_command_runs_it_on_the_real_loop(tmp_path, monkeypatch):
    monkeypatch.setattr(point_to_point, "STEPS_RAD", (0.1, 0.05, -0.05))
    monkeypatch.setattr(point_to_point, "SECONDS", 0.5)
    folder = tmp_path / "run"
    folder.mkdir(mode=0o700)
    arguments = ["experiment", "point-to-point", str(CONFIGS / "mock-identify.toml"), "--json"]
    arguments += ["--points", str(CONFIGS / "friction/mock_points.csv"), "--model", "epsilon-SVR, spline"]
    arguments += ["--out", str(tmp_path / "out"), "--runtime-dir", str(folder)]
    done = CliRunner().invoke(cli, arguments, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    page = (tmp_path / "out/report.html").read_text()
    assert "on rig mock" in page
    with np.load(tmp_path / "out/runs.npz") as runs:
        assert len(runs["PID/step 100 mrad/epsilon-SVR, spline/position_rad"]) == 500
        without = runs["PD/step 100 mrad/none/position_rad"][-1]
        with_it = runs["PD/step 100 mrad/epsilon-SVR, spline/position_rad"][-1]
    assert abs(with_it - 0.1) < 0.2 * abs(without - 0.1)
    monkeypatch.setattr(positioning_on_rig, "Host", None)  # not to be entered
    again = CliRunner().invoke(cli, [*arguments, "--resume"], catch_exceptions=False)
    assert again.exit_code == 0, again.output
    assert "nothing is left to do" in again.stderr
    assert json.loads(again.stdout)["experiments"] == json.loads(done.stdout)["experiments"]
