"""A motor warmer than its friction model, on the real loop: a warning that stops nothing."""

from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from rtctl.cli import cli
from rtctl.friction import artefact
from rtctl.host.auto_arm import AutoArm
from rtctl.host.supervisor import Host
from rtctl.recording.event_log import read_events
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture
def rig(tmp_path, monkeypatch):
    """The mock, its motor at 47 degC, its friction learned at 22 to 31."""
    monkeypatch.setenv("RTCTL_STATE_DIR", str(tmp_path / "state"))
    model = artefact.load(CONFIGS / "friction" / "mock.json")
    artefact.save(replace(model, temperature_min_c=22.0, temperature_max_c=31.0), tmp_path / "m.json")
    text = (CONFIGS / "mock.toml").read_text().replace("friction/mock.json", "m.json")
    text = text.replace('clock = "wall"', 'clock = "virtual"')
    assert text.count("seed = 1 ") == 1
    path = tmp_path / "rig.toml"
    path.write_text(text.replace("seed = 1 ", "temperature_c = 47.0\nseed = 1 "))
    return path


def test_it_is_one_event_in_the_log_and_no_fault(rig, tmp_path):
    folder = tmp_path / "run"
    folder.mkdir(mode=0o700)
    states = []

    def look(host, rows):
        states.extend(rows["state"][-1:])
        if len(states) > 30:
            host.finish()

    with Host(load(rig), observers=[AutoArm(), look], runtime_dir=str(folder)) as host:
        summary = host.run(20.0)
    assert summary["fault_first"] is None
    events, _torn = read_events(tmp_path / "state" / "mock")
    (warning,) = [event for event in events if event["event"] == "warning"]
    assert warning["text"].startswith("axis joint: friction was learned at 22-31 degC, the motor is at 47: ")
    shown = CliRunner().invoke(cli, ["events", "mock"])
    assert "warning TEMPERATURE: axis joint: friction was learned at 22-31" in shown.output


def test_check_names_the_range(rig):
    shown = CliRunner().invoke(cli, ["check", str(rig)])
    assert "friction was learned at 22-31 degC" in shown.output
