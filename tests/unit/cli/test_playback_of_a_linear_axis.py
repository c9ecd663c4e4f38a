"""`rtctl playback` over the log of a carriage: learned, judged and told in m and N."""

import json
from pathlib import Path

import numpy as np
import pytest
from in_process import run

from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation

pytestmark = pytest.mark.compiled

SLIDE = Path(__file__).parents[3] / "configs" / "mock-linear.toml"

PLAYED = """
[[device]]
kind = "playback"

[device.options]
file = "rec.npz"
rate_hz = 1000.0

[[device.options.axis]]
position = { column = "x", unit = "mm" }
motor_torque = { column = "motor", unit = "N" }
hand_torque = { column = "hand", unit = "N" }
"""


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    """A rig file that plays what the shipped carriage did in a hand, the zero of its force 1 N off."""
    folder = tmp_path_factory.mktemp("played")
    simulation = Simulation(load(SLIDE))
    simulation.arm()
    rows = simulation.run(16.0)[2_000:]
    motor, hand = (rows[f"{name}_torque_nm"][:, 0] for name in ("motor", "hand"))
    np.savez(folder / "rec.npz", x=1e3 * rows["position_rad"][:, 0], motor=motor, hand=hand + 1.0)
    path = folder / "play.toml"
    text = SLIDE.read_text().split("# ---- the simulated rig")[0].replace("tare_s = 0.3", "tare_s = 0.0")
    path.write_text(text + PLAYED)
    return path


def test_a_carriage_is_played_back_in_its_own_units(monkeypatch, capsys, played):
    log = played.with_name("rec.npz")
    code, text, err = run(monkeypatch, capsys, "playback", played, "--fit-from", log)
    assert code == 0, err
    assert [line for line in text.splitlines() if any(one in line for one in ("rad", "N m", " kg m"))] == []
    assert "viscous" in text
    assert "N s/m" in text
    code, out, err = run(monkeypatch, capsys, "playback", played, "--fit-from", log, "--json")
    assert code == 0, err
    told = json.loads(out)
    found = told["log"]
    assert found["regression"]["inertia_kg"] == pytest.approx(1.2, rel=0.1)
    assert found["bias_n"] == pytest.approx(1.0, abs=0.2)
    assert told["prediction"]["rmse_n"] < 0.1 * told["prediction"]["friction_rms_n"]
    assert told["interaction"]["all"]["left_rms_n"] < 0.5 * told["interaction"]["all"]["hand_rms_n"]


def test_a_linear_log_without_a_rig_file_is_refused_with_the_remedy(monkeypatch, capsys, played):
    log = played.with_name("rec.npz")
    columns = ("--time", "t", "--position", "x:mm", "--hand-torque", "hand:N")
    code, _, err = run(monkeypatch, capsys, "playback", "--log", log, "--fit-from", log, *columns)
    assert code == 3
    assert 'configs/playback.toml with motion = "linear"' in err
