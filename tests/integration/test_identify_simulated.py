"""`rtctl identify` as a program, simulated: no clock, no loop; and what its command line hands on."""

import json
import subprocess
import sys
from pathlib import Path

import click
import in_process
from click.testing import CliRunner

from rtctl.cli import cli, identify
from rtctl.friction.point_reader import read_points

CONFIG = Path(__file__).parents[2] / "configs" / "mock-identify.toml"
QUICK = ["--train", "8", "--test", "2", "--measurements", "4", "--spots", "2", "--warm-up", "1"]


def simulate(out):
    """A program of its own, with as much time as a busy machine may take."""
    words = ["identify", CONFIG, "--simulate", "--out", out, *QUICK, "--json"]
    command = [sys.executable, "-m", "rtctl", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_a_simulated_identification_ends_in_points_that_the_fit_takes(tmp_path):
    out = tmp_path / "set"
    done = simulate(out)
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert summary["complete"]
    assert (summary["points"], summary["train"], summary["test"]) == (22, 18, 4)
    assert [one["direction"] for one in summary["truth"]] == [1, -1]
    assert all(0 < one["rms_share"] < 0.03 and one["speeds"] == 10 for one in summary["truth"])
    assert len(read_points(out / "points_train.csv").branch(-1)[0]) == 9
    again = simulate(out)
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


def test_a_simulated_hand_is_told_with_the_key_that_takes_it_off(monkeypatch, capsys, tmp_path):
    rig = CONFIG.with_name("mock.toml")
    code, _, said = in_process.run(
        monkeypatch, capsys, "identify", str(rig), "--simulate", "--out", str(tmp_path / "set")
    )
    assert code == 13
    assert f'{rig}: kind = "none" in [[device.options.hand]]' in said
