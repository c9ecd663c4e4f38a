"""The event log and the incidents of real runs on the mock, and the commands that show them."""

import json
import os
import subprocess
import sys
from pathlib import Path

import nursery
import pytest
from click.testing import CliRunner

from rtctl.cli import cli
from rtctl.errors import FaultError
from rtctl.host.auto_arm import AutoArm
from rtctl.host.supervisor import Host
from rtctl.recording.event_log import follow, read_events
from rtctl.recording.incident import read_incident
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("RTCTL_STATE_DIR", str(tmp_path / "state"))
    return tmp_path / "state"


@pytest.fixture
def slow_config(tmp_path):
    """A joint whose hand is faster than its limit allows: OVERSPEED at full swing, or a joint that moves
    while it is armed.
    """
    text = (CONFIGS / "mock.toml").read_text().replace('"friction/', f'"{CONFIGS}/friction/')
    text = text.replace('clock = "wall"', 'clock = "virtual"')
    text = text.replace("velocity_limit_rad_s = 6.0", "velocity_limit_rad_s = 0.7")
    # virtual time runs ahead of the host that arms the rig
    assert "start_s = 1.0 " in text
    text = text.replace("start_s = 1.0 ", "start_s = 10.0 ")
    path = tmp_path / "slow.toml"
    path.write_text(text)
    return path


def faulty_run(config, tmp_path, seconds=1.0):
    folder = tmp_path / "run"
    folder.mkdir(mode=0o700, exist_ok=True)
    rows = []

    def look(host, batch):
        rows.append(batch)
        if len(batch) and batch["fault_first"][-1] >= 0:
            host.finish()

    with Host(load(config), observers=[AutoArm(), look], runtime_dir=str(folder)) as host:
        summary = host.run(seconds * 20)
    return summary, host.record.flight.status(), rows


def test_a_fault_leaves_one_incident_with_the_rings_own_ticks(state, slow_config, tmp_path):
    import numpy as np

    summary, status, batches = faulty_run(slow_config, tmp_path)
    assert summary["fault_first"]
    assert (status["broken"], status["incidents"], status["dropped"]) == (None, 1, 0)
    events, torn = read_events(state / "mock")
    assert torn == 0
    path = [e["file"] for e in events if e["event"] == "incident"]
    incident = read_incident(Path(path[0]))
    rows = np.concatenate(batches)
    first = int(np.flatnonzero(rows["tick"] == incident.ticks["tick"][0])[0])
    assert incident.ticks.tobytes() == rows[first : first + len(incident.ticks)].tobytes()
    assert len(incident.ticks) >= 251
    assert rows[first + 200]["tick"] == incident.trigger["tick"]
    states = [(e["from"], e["to"]) for e in events if e["event"] == "state"]
    assert states[:2] == [("INIT", "IDLE"), ("IDLE", "ARMING")]
    assert sum(to == "FAULT" for _, to in states) == 1
    assert events[0]["event"] == "started"
    assert events[-1]["event"] == "ended"


def test_the_commands_show_log_and_incident(state, slow_config, tmp_path):
    cause = faulty_run(slow_config, tmp_path)[0]["fault_first"]
    run = CliRunner().invoke
    shown = run(cli, ["events", str(slow_config)])
    assert shown.exit_code == 0, shown.output
    assert cause in shown.output
    lines = run(cli, ["events", "mock", "--json", "--last", "3"]).output.splitlines()
    assert len(lines) == 3
    file = next(
        json.loads(line)["file"]
        for line in run(cli, ["events", "mock", "--json"]).output.splitlines()
        if '"incident"' in line
    )
    picture = tmp_path / "incident.png"
    told = run(cli, ["incident", file, "--plot", str(picture)])
    assert told.exit_code == 0, told.output
    assert f"cause {cause}" in told.output
    assert picture.stat().st_size > 10_000
    body = json.loads(run(cli, ["incident", file, "--json"]).output)
    assert body["trigger"]["cause"] == cause


def test_without_a_log_the_command_says_where_it_looked(state):
    process = nursery.run(
        [sys.executable, "-m", "rtctl", "events", "mock"], capture_output=True, text=True, timeout=60
    )
    assert process.returncode == 10
    assert str(state / "mock") in process.stderr


def test_a_run_whose_log_cannot_be_written_goes_on_and_says_so(slow_config, tmp_path, monkeypatch):
    blocked = tmp_path / "blocked"
    blocked.write_text("a file where a folder should be")
    monkeypatch.setenv("RTCTL_STATE_DIR", str(blocked))
    summary, status, _ = faulty_run(slow_config, tmp_path)
    assert summary["fault_first"]
    assert str(blocked) in status["broken"]
    assert status["incidents_lost"] == 1


def test_a_killed_host_leaves_only_whole_lines(state, tmp_path):
    folder = tmp_path / "run"
    folder.mkdir(mode=0o700)
    command = [
        sys.executable,
        "-m",
        "rtctl",
        "run",
        str(CONFIGS / "mock.toml"),
        "--arm",
        "--runtime-dir",
        str(folder),
    ]
    following, told = follow(state / "mock", poll_s=0.02), []  # before there is anything
    process = nursery.Program(command, env=os.environ, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        for event in following:
            told.append(event)
            if event.get("to") in ("ACTIVE", "FAULT"):  # a fault: of a machine that stood still
                break
    finally:
        process.kill()
        process.wait()
    events, torn = read_events(state / "mock")
    assert torn == 0
    assert events[: len(told)] == told, "what was there is there; more may have come before the end"
    assert FaultError.exit_code == 11
