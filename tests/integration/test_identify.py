"""`rtctl identify` as a program on the real loop: interrupted, continued."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import nursery
import pytest
from patience import PATIENCE_S, until

from rtctl.rig_file.config import load
from rtctl.simulation.friction_truth import true_friction_nm

CONFIG = Path(__file__).parents[2] / "configs" / "mock-identify.toml"
SHORT = [
    "--train",
    "2",
    "--test",
    "0",
    "--measurements",
    "2",
    "--spots",
    "1",
    "--warm-up",
    "0.1",
    "--bias",
    "0.5",
    "--ramp",
    "0.2",
    "--speed-min",
    "0.2",
    "--speed-max",
    "0.5",
]
LIMITS = "position_min_rad = -0.4\nposition_max_rad = 0.4\n"


def rtctl(*arguments):
    return [sys.executable, "-m", "rtctl", *map(str, arguments)]


def call(*arguments):
    return nursery.run(rtctl(*arguments), capture_output=True, text=True, timeout=170, check=False)


@pytest.fixture
def narrow(tmp_path):
    """The mock with a travel of .8 rad and a third of its friction, so that moves and ramps are short."""
    path, text = tmp_path / "rig.toml", CONFIG.read_text()
    for old, new in (
        ("current_limit_a = 10.0", f"{LIMITS}current_limit_a = 10.0"),
        ("coulomb_nm = 0.25 ", "coulomb_nm = 0.08 "),
        ("breakaway_nm = 0.35 ", "breakaway_nm = 0.11 "),
    ):
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return path


def points_in(out):
    try:
        return len(json.loads((out / "dataset.json").read_text())["points"])
    except FileNotFoundError:
        return 0


def test_on_the_real_loop_ctrl_c_keeps_the_points_and_resume_completes_them(tmp_path, narrow):
    out = tmp_path / "set"
    arguments = ["identify", narrow, "--out", out, *SHORT, "--json", "--runtime-dir", tmp_path / "run"]
    running = nursery.Program(rtctl(*arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        until(lambda: points_in(out) >= 1 or running.poll() is not None, "a point", 120)
        running.send_signal(signal.SIGINT)
        stdout, stderr = running.communicate(timeout=PATIENCE_S)
    finally:
        running.kill()
    assert running.returncode == 130, stdout + stderr
    summary = json.loads(stdout)
    assert not summary["complete"]
    assert 1 <= summary["points"] < summary["points_wanted"]

    for sessions in range(2, 5):  # a loop that other programs keep late gives up a speed, and says so
        done = call(*arguments, "--resume")
        assert done.returncode == 0, done.stderr
        document = json.loads((out / "dataset.json").read_text())
        assert document["complete"]
        assert len(document["sessions"]) == sessions
        if not document["skipped"]:
            break
        assert all("left out" in done.stderr and one["why"] for one in document["skipped"])
    found = [
        [point[name] for name in ("velocity_rad_s", "friction_torque_nm")] for point in document["points"]
    ]
    speed, torque = np.array(found).T
    assert len(speed) == summary["points_wanted"], document["skipped"]
    moving = speed != 0.0
    true_nm = true_friction_nm(load(narrow), 0, speed[moving])
    assert np.abs(torque[moving]) == pytest.approx(true_nm, abs=0.01)
    assert np.abs(torque[~moving]) == pytest.approx(0.11, abs=0.03)
    for point in document["points"]:
        with np.load(out / "ticks" / f"{point['name']}.npz", allow_pickle=False) as ticks:
            assert np.all(np.diff(ticks["tick"]) > 0)
            assert len(ticks["measurement_start"]) == point["count"]
            last = ticks["measurement_start"][-1] + ticks["measurement_rows"][-1]
            assert last <= len(ticks["tick"])
