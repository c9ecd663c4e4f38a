"""Recordings of real runs: by the host, by a client, and what the commands make of them."""

import contextlib
import json
import os
import signal
import subprocess
import sys

import nursery
import pytest
from click.testing import CliRunner
from patience import PATIENCE_S, until
from rtctl_process import CONFIGS, start

from rtctl.cli import cli
from rtctl.client import RigClient
from rtctl.errors import ClientError
from rtctl.host.auto_arm import AutoArm
from rtctl.host.supervisor import Host
from rtctl.recording.overview import overview
from rtctl.recording.reader import RecordingReader
from rtctl.recording.replay import Replay
from rtctl.rig_file.config import load


@pytest.fixture
def config(tmp_path):
    text = (CONFIGS / "mock.toml").read_text().replace('"friction/', f'"{CONFIGS}/friction/')
    path = tmp_path / "rig.toml"
    path.write_text("record = true\n" + text)
    return path


def in_force(client, request):
    """Make it and wait for the loop to take it: of two commands within one tick it takes the newer one
    only.
    """
    before = client.status()["command_seq_in_force"]
    request()
    until(lambda: client.status()["command_seq_in_force"] > before, "the command")


def test_a_wall_clock_run_with_commands_replays_bit_for_bit(config, folder, tmp_path):
    process = start(config, folder, "--arm", "--for", "150", "--record", str(tmp_path / "rec"))
    try:
        with RigClient("mock", runtime_dir=str(folder), timeout_s=60.0) as client:
            client.hello()
            until(
                lambda: client.status()["state"] in ("ACTIVE", "FAULT"),
                "arming, or its end on a busy machine",
            )
            in_force(
                client,
                lambda: client.set_environment("joint", "spring", stiffness_nm_rad=5.0, center_rad=0.1),
            )
            in_force(client, lambda: client.set_compensation(0.3))
            in_force(client, lambda: client.set_environment("joint", "remote"))
            with contextlib.suppress(ClientError):  # on a slow machine the renderer counts as lost
                for k in range(50):
                    client.set_target([0.001 * k], [0.1])
            in_force(client, client.stop)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE_S)
    finally:
        process.kill()
        process.wait()
    assert process.returncode in (0, 11), err  # 11: a machine so busy that a fault is latched
    summary = json.loads(out.splitlines()[-1])
    (file,) = (tmp_path / "rec").iterdir()
    assert (summary["recording"]["ticks"], summary["recording"]["dropped"]) == (summary["ticks"], 0)
    found = overview(RecordingReader([file]))
    assert (found["ticks"], found["lost"], found["cut_off"]) == (summary["ticks"], 0, [])
    assert found["commands"] >= 5  # and as many targets as came in time
    verdict = Replay(RecordingReader([file])).check()
    assert (verdict.first, verdict.stopped, verdict.ticks) == (None, "", summary["ticks"])
    assert summary["replayable"] == "yes"
    replay = CliRunner().invoke(cli, ["replay", str(file), "--json"])
    assert replay.exit_code == 0, replay.output
    assert json.loads(replay.output)["same_law_sources"] is True


def test_a_virtual_run_is_recorded_without_losing_a_tick(config, folder, tmp_path, monkeypatch):
    monkeypatch.setenv("RTCTL_STATE_DIR", str(tmp_path / "state"))
    config.write_text(config.read_text().replace('clock = "wall"', 'clock = "virtual"'))
    with Host(load(config), observers=[AutoArm()], runtime_dir=str(folder)) as host:
        summary = host.run(2.0)
    files = sorted((tmp_path / "state" / "mock" / "recordings").iterdir())
    assert summary["recording"]["dropped"] == 0
    assert summary["ticks"] > 500
    found = overview(RecordingReader(files))
    assert (found["ticks"], found["lost"]) == (summary["ticks"], 0)
    assert Replay(RecordingReader(files)).check().first is None


def test_a_disk_that_refuses_leaves_the_run_alone(config, folder, tmp_path):
    blocked = tmp_path / "blocked"
    blocked.write_text("a file where a folder should be")
    with Host(load(config), observers=[AutoArm()], runtime_dir=str(folder), record_to=blocked / "x") as host:
        summary = host.run(1.0)
    assert summary["state"] == "SHUTDOWN"
    assert str(blocked) in summary["recording"]["broken"]
    assert summary["recording"]["dropped"] == summary["ticks"]


def test_a_killed_host_leaves_a_recording_with_all_its_whole_chunks(config, folder, tmp_path):
    process = start(config, folder, "--arm", "--record", str(tmp_path / "rec"))
    try:
        with RigClient("mock", runtime_dir=str(folder), timeout_s=60.0) as client:
            client.hello()
            health = client.health()
            while not ((next(health).get("recording") or {}).get("ticks", 0)) > 1000:
                pass
    finally:
        process.kill()
        process.communicate()
    (file,) = (tmp_path / "rec").iterdir()
    found = overview(RecordingReader([file]))
    assert found["ticks"] > 1000
    assert (found["lost"], found["cut_off"], found["ends"]) == (0, [str(file)], {})
    assert Replay(RecordingReader([file])).check().first is None


def test_a_client_records_a_rig_that_runs_and_the_commands_show_it(config, folder, tmp_path):
    config.write_text(config.read_text().replace("record = true", "record = false"))
    process = start(config, folder, "--arm")
    recorder = None
    try:
        with RigClient("mock", runtime_dir=str(folder), timeout_s=60.0) as client:
            client.hello()
            out = tmp_path / "attached"
            command = [sys.executable, "-m", "rtctl", "record", str(config), "--out", str(out), "--json"]
            recorder = nursery.Program(
                [*command, "--runtime-dir", str(folder)],
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
            states = client.states()
            while not out.is_dir() or not list(out.iterdir()):
                next(states)
            client.set_compensation(0.5)
            for _ in range(100):
                next(states)
            recorder.send_signal(signal.SIGINT)
            said, err = recorder.communicate(timeout=PATIENCE_S)
            assert recorder.returncode == 0, err
            assert client.status()["state"] in ("ACTIVE", "IDLE", "ARMING"), "the rig runs on"
    finally:
        for child in (process, recorder):
            if child is not None:
                child.kill()
                child.communicate()
    (status,) = json.loads(said)["recordings"]
    assert (status["dropped"], status["lost"], status["broken"]) == (0, 0, None)
    (file,) = out.iterdir()
    found = overview(RecordingReader([file]))
    assert found["ticks"] == status["ticks"] > 300  # of 1000 slots: a busy machine leaves some out
    assert found["lost"] == 0
    assert found["commands"] >= 2, "what was in force at the start, and the change"
    assert found["attachments"].keys() >= {"law.npz", "rig.toml", "model-joint.json"}
    assert found["before_recording"] > 0
    verdict = Replay(RecordingReader([file])).check()
    assert (verdict.first, verdict.stopped, verdict.ticks) == (None, "", found["ticks"])
    shown = CliRunner().invoke(cli, ["info", str(file)])
    assert shown.exit_code == 0, shown.output
    assert "lost ticks: 0" in shown.output
    table = CliRunner().invoke(cli, ["export", str(file), "--out", str(tmp_path / "x.csv")])
    assert table.exit_code == 0, table.output
    assert CliRunner().invoke(cli, ["export", str(file), "--out", str(tmp_path / "x.txt")]).exit_code == 2
    assert (tmp_path / "x.csv").read_text().count("\n") == found["ticks"] + 1


def test_without_a_daemon_record_says_so_in_one_line(folder):
    command = [sys.executable, "-m", "rtctl", "record", "mock", "--runtime-dir", str(folder)]
    process = nursery.run(command, capture_output=True, text=True, timeout=60, env=os.environ)
    assert process.returncode == 12
    assert process.stderr.count("\n") == 1
    assert "rtctl run" in process.stderr
