"""`rtctl identify` as a program: simulated, on the real loop, interrupted, continued."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner
from patience import PATIENCE_S, until
from shipped_friction import law_nm

from rtctl.cli import cli, identify
from rtctl.friction.points.reader import read_points

CONFIG = Path(__file__).parents[2] / "configs" / "mock-identify.toml"
QUICK = ["--train", "8", "--test", "2", "--measurements", "4", "--spots", "2", "--warm-up", "1"]
SHORT = [
    *[
        "--train",
        "2",
        "--test",
        "0",
        "--measurements",
        "2",
        "--spots",
        "1",
        "--warm-up",
        "0.3",
        "--bias",
        "0.5",
    ],
    *["--ramp", "0.2", "--speed-min", "0.2", "--speed-max", "0.5"],
]


def rtctl(*arguments):
    return [sys.executable, "-m", "rtctl", *map(str, arguments)]


def call(*arguments):
    return subprocess.run(rtctl(*arguments), capture_output=True, text=True, timeout=170, check=False)


@pytest.fixture
def narrow(tmp_path):
    """The mock with a travel of .8 rad, so that moves are short."""
    path = tmp_path / "rig.toml"
    limits = "position_min_rad = -0.4\nposition_max_rad = 0.4\n"
    path.write_text(CONFIG.read_text().replace("current_limit_a = 10.0", limits + "current_limit_a = 10.0"))
    return path


def test_a_simulated_identification_ends_in_points_that_the_fit_takes(tmp_path):
    out = tmp_path / "set"
    done = call("identify", CONFIG, "--simulate", "--out", out, *QUICK, "--json")
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert summary["complete"]
    assert (summary["points"], summary["train"], summary["test"]) == (22, 18, 4)
    assert [one["direction"] for one in summary["truth"]] == [1, -1]
    assert all(0 < one["rms_share"] < 0.03 and one["speeds"] == 10 for one in summary["truth"])
    assert len(read_points(out / "points_train.csv").branch(-1)[0]) == 9
    again = call("identify", CONFIG, "--simulate", "--out", out, *QUICK, "--json")
    assert (again.returncode, json.loads(again.stdout)["error"]) == (10, "DataError")


def test_a_log_on_the_command_line_is_given_to_its_own_command(monkeypatch):
    taken = []

    @click.command()
    @click.option("--log", multiple=True)
    def command(log):
        taken.append(log)

    monkeypatch.setattr(identify, "LOG_MODULE", __name__)
    monkeypatch.setitem(globals(), "command", command)
    assert CliRunner().invoke(cli, ["identify", "--log", "a.csv", "--log=b.csv"]).exit_code == 0
    assert taken == [("a.csv", "b.csv")]


def points_in(out):
    try:
        return len(json.loads((out / "dataset.json").read_text())["points"])
    except FileNotFoundError:
        return 0


def test_on_the_real_loop_ctrl_c_keeps_the_points_and_resume_completes_them(tmp_path, narrow):
    out = tmp_path / "set"
    arguments = ["identify", narrow, "--out", out, *SHORT, "--json", "--runtime-dir", tmp_path / "run"]
    running = subprocess.Popen(rtctl(*arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
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

    done = call(*arguments, "--resume")
    assert done.returncode == 0, done.stderr
    document = json.loads((out / "dataset.json").read_text())
    assert document["complete"]
    assert len(document["sessions"]) == 2
    for point in document["points"]:
        true = law_nm(abs(point["velocity_rad_s"]), point["direction"])
        assert abs(point["friction_torque_nm"]) == pytest.approx(true, abs=0.02)
    for point in document["points"]:
        with np.load(out / "ticks" / f"{point['name']}.npz", allow_pickle=False) as ticks:
            assert np.all(np.diff(ticks["tick"]) > 0)
            assert len(ticks["measurement_start"]) == point["count"]
            last = ticks["measurement_start"][-1] + ticks["measurement_rows"][-1]
            assert last <= len(ticks["tick"])
