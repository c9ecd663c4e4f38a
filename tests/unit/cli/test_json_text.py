"""Every `--json` goes through one encoder, and a bench loses no row that it has measured."""

import json
import math
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner

from rtctl.cli import bench, cli, main
from rtctl.cli.json_text import json_text
from rtctl.control.vocabulary import State
from rtctl.host.machine_examine import Report
from rtctl.host.machine_line import Line
from rtctl.plain_data import as_data
from tests.bench import groups
from tests.bench.row import Row

CLI = Path(bench.__file__).parent


@dataclass
class _Figure:
    value: np.float64
    where: Path


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (np.bool_(True), True),
        (np.int64(3), 3),
        (np.float32(0.5), 0.5),
        (np.array([[1.0, math.nan]]), [[1.0, None]]),
        (math.inf, None),
        (np.float64("nan"), None),
        (Path("out/points.csv"), "out/points.csv"),
        (State.ACTIVE, 3),
        ((1, "a", None), [1, "a", None]),
        ({State.ACTIVE: 1, "b": {2}}, {"3": 1, "b": [2]}),
        (_Figure(np.float64(2.0), Path("a")), {"value": 2.0, "where": "a"}),
    ],
)
def test_what_a_command_may_print_is_json(given, told):
    assert json.loads(json_text(given)) == told


def test_what_is_no_data_is_refused():
    with pytest.raises(TypeError, match="object is no data"):
        as_data({"a": object()})


@pytest.mark.parametrize("value", [1, 1.5, np.float64(1.5), np.int64(1), math.nan, np.float64("nan")])
@pytest.mark.parametrize("target", [None, 1, 2.0, np.float64(2.0), math.nan])
@pytest.mark.parametrize("sense", ["<=", ">="])
def test_a_row_of_every_kind_is_json(value, target, sense):
    told = json.loads(json_text(Row("name", value, "us", "beside", target, sense)))
    assert told["ok"] in (None, True, False)
    assert set(told) == {"name", "value", "unit", "against", "target", "sense", "ok"}


def _groups(monkeypatch, broken):
    def rows(name):
        if name == "cycle":
            raise broken
        return [Row(name, np.float64(1.0), "us", "", np.float64(2.0)), Row(name, 1.0, "us", "")]

    made = {name: partial(rows, name) for name in bench.GROUPS}
    monkeypatch.setattr(groups, "measurements", lambda **_: made)


def test_a_group_that_breaks_loses_no_row_of_the_others(monkeypatch):
    _groups(monkeypatch, ValueError("a defect"))
    done = CliRunner().invoke(cli, ["bench", "--json", "wakeup", "virtual", "cycle"])
    assert isinstance(done.exception, ValueError)
    told = json.loads(done.stdout)
    assert [row["name"] for row in told["rows"]] == ["wakeup", "wakeup", "virtual", "virtual"]


def test_a_group_that_cannot_be_measured_is_told(monkeypatch):
    _groups(monkeypatch, ModuleNotFoundError("no onnxruntime"))
    done = CliRunner().invoke(cli, ["bench", "--json", "cycle"])
    assert json.loads(done.stdout) == {"rows": [], "skipped": {"cycle": "no onnxruntime"}}
    assert "not measured: cycle" in CliRunner().invoke(cli, ["bench", "cycle", "wakeup"]).stderr


def test_no_command_has_an_encoder_of_its_own():
    assert [path.name for path in CLI.glob("*.py") if "json.dumps" in path.read_text()] == ["json_text.py"]


def test_every_command_has_json_as_the_readme_says():
    without = set()

    def look(group, path):
        for name in group.list_commands(click.Context(group)):
            command = group.get_command(click.Context(group), name)
            if isinstance(command, click.Group):
                look(command, f"{path}{name} ")
            elif not any("--json" in option.opts for option in command.params):
                without.add(path + name)

    look(cli, "")
    assert without == {"completion", "service status", "service logs"}


def test_wrong_usage_is_json_too(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(
        "sys.argv", ["rtctl", "fit", "points.csv", "--json", "--out", str(tmp_path / "no" / "m.json")]
    )
    with pytest.raises(SystemExit, match="2"):
        main()
    told = json.loads(capsys.readouterr().out)
    assert (told["exit_code"], "cannot write" in told["message"]) == (2, True)


@pytest.mark.parametrize(("no_color", "coloured"), [("", True), ("1", False)])
def test_no_color_is_honoured(no_color, coloured, monkeypatch):
    monkeypatch.setattr("rtctl.host.machine_examine.examine", _examined)
    done = CliRunner().invoke(cli, ["doctor", "--no-timing"], color=True, env={"NO_COLOR": no_color})
    assert ("\x1b[" in done.stdout) is coloured


def _examined(_config, _seconds, *, say, **_more):
    say(Line("kernel", "ok", "6.1"))
    return Report([Line("kernel", "ok", "6.1")], None)


def test_colour_has_one_source():
    assert [path.name for path in CLI.glob("*.py") if "click.style(" in path.read_text()] == ["colour.py"]


def test_a_command_told_to_a_script_is_one_that_runs_here(monkeypatch, capsys, tmp_path):
    """A refusal's remedy, and a line of `doctor`: with the program of this installation, as on a terminal."""
    own = tmp_path / "bin" / "rtctl"
    own.parent.mkdir()
    own.touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(own), "check", "missing.toml", "--json"])
    monkeypatch.setenv("PATH", "/usr/bin")
    with pytest.raises(SystemExit, match="3"):
        main()
    assert "`bin/rtctl init`" in json.loads(capsys.readouterr().out)["message"]
    told = json.loads(
        json_text({"lines": [Line("rights", "warn", "none", "rtctl service install rig.toml")]})
    )
    assert told["lines"][0]["fix"] == "bin/rtctl service install rig.toml"
