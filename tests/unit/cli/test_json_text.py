"""Every `--json` goes through one encoder, and a bench loses no row that it has measured."""

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from rtctl.bench.row import Row
from rtctl.cli import bench, cli
from rtctl.cli.json_text import json_text, plain
from rtctl.control.vocabulary import State

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
        plain({"a": object()})


@pytest.mark.parametrize("value", [1, 1.5, np.float64(1.5), np.int64(1), math.nan, np.float64("nan")])
@pytest.mark.parametrize("target", [None, 1, 2.0, np.float64(2.0), math.nan])
@pytest.mark.parametrize("sense", ["<=", ">="])
def test_a_row_of_every_kind_is_json(value, target, sense):
    told = json.loads(json_text(Row("name", value, "us", "beside", target, sense)))
    assert told["ok"] in (None, True, False)
    assert set(told) == {"name", "value", "unit", "against", "target", "sense", "ok"}


def _groups(monkeypatch, broken):
    def measure(name, **_):
        def rows():
            if name == "cycle":
                raise broken
            return [Row(name, np.float64(1.0), "us", "", np.float64(2.0)), Row(name, 1.0, "us", "")]

        return rows

    monkeypatch.setattr(bench, "_group", measure)


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
