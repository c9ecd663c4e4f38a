"""A kernel of waves, from `rtctl fit` by the model file to the law's feed-forward and the model's judge."""

import json
from pathlib import Path

import numpy as np
import pytest
from in_process import run

from rtctl.check.law_plan import build
from rtctl.control.friction_curve import friction_magnitude
from rtctl.control.jit import records
from rtctl.rig_file.config import load

SPEED = np.geomspace(0.01, 2.0, 24)


def friction_nm(speed):
    """Of a joint that slides the easier the faster it goes: a wave of speed."""
    return 0.3 + 0.1 * np.cos(speed)


@pytest.fixture
def points(tmp_path):
    path = tmp_path / "points.csv"
    rows = [(d * v, d * friction_nm(v)) for d in (1, -1) for v in SPEED]
    path.write_text("velocity_rad_s,friction_torque_nm\n" + "".join(f"{v:.9g},{f:.9g}\n" for v, f in rows))
    return path


def test_it_is_fitted_compiled_and_judged(monkeypatch, capsys, tmp_path, points):
    model = tmp_path / "model.json"
    chosen = ["--kernel", "waves", "--backend", "sequential", "--rig", "mock"]
    code, out, err = run(monkeypatch, capsys, "fit", points, *chosen, "--out", model)
    assert code == 0, out + err
    assert json.loads(model.read_text())["kind"] == "waves"
    code, out, err = run(monkeypatch, capsys, "fit", points, "--judge", model, "--json")
    assert code == 0, out + err
    judged = json.loads(out)
    assert judged["holds"]
    assert all(0.0 < row["error_share"] < 0.01 for row in judged["directions"])
    rig = tmp_path / "rig.toml"
    rig.write_text(Path("configs/mock.toml").read_text().replace('"friction/mock.json"', f'"{model}"'))
    record = records(build(load(rig)).model)[0]
    for v in (-1.7, -0.2, 0.5, 2.0):
        assert friction_magnitude(record, v) == pytest.approx(friction_nm(v), rel=0.01)
