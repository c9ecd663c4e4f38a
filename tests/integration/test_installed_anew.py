"""rtctl is installed anew while its daemon runs: the files that it was imported from are gone."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from rtctl_process import CONFIGS, children, greet
from test_can_run import Wire, arm, drive, heard, rig_file

import hw
from rtctl.client import RigClient
from rtctl.errors import LoopDiedError, RtctlError
from rtctl.host.supervisor import Host
from rtctl.rig_file.config import load

ROOT = Path(__file__).parents[2]
PATIENCE_S = 60.0


@pytest.fixture
def installed(tmp_path):
    place = tmp_path / "installed"
    for name in ("rtctl", "hw"):
        shutil.copytree(ROOT / name, place / name, ignore=shutil.ignore_patterns("__pycache__"))
    return place


@contextlib.contextmanager
def daemon(installed, folder, config, rig, *more):
    """A daemon of its own copy of rtctl, and its client; nothing of the copy is left once it serves."""
    env = {**os.environ, "PYTHONPATH": str(installed), "RTCTL_STATE_DIR": str(folder / "state")}
    command = [sys.executable, "-m", "rtctl", "run", str(config), "--runtime-dir", str(folder), *more]
    process = subprocess.Popen(
        command, env=env, cwd=installed, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    try:
        with RigClient(rig, runtime_dir=str(folder)) as client:
            greet(client, process, PATIENCE_S)
            for name in ("rtctl", "hw"):
                (installed / name).rename(installed / f"~{name}")  # as pip does before it writes the new one
            yield process, client
    finally:
        process.kill()
        sys.stderr.write(str(process.communicate()))  # shown when the test fails


def test_a_loop_that_dies_after_that_is_still_stopped_through_a_device_opened_afresh(installed, folder):
    wire = Wire()
    with (
        contextlib.closing(wire),
        drive("odrive", wire.ports[1]),
        daemon(installed, folder, rig_file(folder, "odrive", wire.ports[0]), "odrive") as (process, client),
    ):
        arm(client)
        os.kill(children(process.pid)[0], signal.SIGKILL)
        _, said = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == LoopDiedError.exit_code, said
    assert "device[0] 'odrive': opened afresh and stopped" in said


FAULT = """
[[fault]]
channel = "link"
kind = "drop"
at_s = 4.0
for_s = 0.0
"""


def test_a_fault_its_incident_a_reload_a_recording_and_the_end_need_no_file_of_it(installed, folder):
    rig, faults = folder / "rig.toml", folder / "faults.toml"
    shutil.copy(CONFIGS / "mock.toml", rig)
    shutil.copytree(CONFIGS / "friction", folder / "friction")
    faults.write_text(FAULT)
    more = ("--arm", "--faults", str(faults), "--record", str(folder / "recorded"))
    with daemon(installed, folder, rig, "mock", *more) as (process, client):
        end = time.monotonic() + PATIENCE_S
        while client.status()["state"] != "FAULT":
            assert time.monotonic() < end
            time.sleep(0.1)
        text = rig.read_text().replace("stiffness_nm_rad = 5.0", "stiffness_nm_rad = 4.0")
        rig.write_text(text)
        process.send_signal(signal.SIGHUP)
        heard(process, "reload: device[0].options.hand[0].stiffness_nm_rad needs a restart")
        process.send_signal(signal.SIGTERM)
        _, said = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 11, said
    assert "Error" not in said
    assert list((folder / "state").rglob("incident*")), said


@pytest.fixture
def replaced(monkeypatch):
    monkeypatch.setattr(hw, "_found", (0, 0))


@pytest.mark.usefixtures("replaced")
def test_one_that_was_installed_anew_while_it_started_does_not_serve(folder):
    with (
        pytest.raises(RtctlError, match="installed anew while it started: start it again"),
        Host(load(CONFIGS / "mock.toml"), runtime_dir=str(folder)),
    ):
        pass
