"""`rtctl run` of a rig file that it refuses, or of a name that is taken."""

import os
import shutil
import subprocess

import pytest
from rtctl_process import CONFIGS, finish, greet, start

from rtctl.client import RigClient

PATIENCE_S = 600
"""Nothing meets a clock here: beside others it gets the time that they leave."""


def test_a_config_that_cannot_be_proved_stable_is_refused_before_anything_starts(folder, tmp_path):
    text = (CONFIGS / "mock.toml").read_text().replace('"friction/', f'"{CONFIGS}/friction/')
    lines = [
        "stiffness_nm_rad = 5000.0" if "stiffness_nm_rad = 60" in line else line for line in text.splitlines()
    ]
    config = tmp_path / "stiff.toml"
    config.write_text("\n".join(lines))
    code, body, _ = finish(start(config, folder), PATIENCE_S)
    assert code == 5
    assert "5000" in body["message"]
    assert str(config) in body["message"]


def test_a_missing_model_is_refused_by_name(folder, tmp_path):
    text = (CONFIGS / "mock.toml").read_text()
    config = tmp_path / "rig.toml"
    config.write_text(text)
    code, body, _ = finish(start(config, folder), PATIENCE_S)
    assert code == 4
    assert "friction/mock.json" in body["message"]


def test_all_config_faults_come_in_one_json_object(folder, tmp_path):
    config = tmp_path / "rig.toml"
    config.write_text(
        (CONFIGS / "mock.toml").read_text().replace("rate_hz = ", "rate_hertz = 1\nrate_hz = -")
    )
    code, body, _ = finish(start(config, folder), PATIENCE_S)
    assert code == 3
    assert len(body["faults"]) == 2


@pytest.mark.skipif(os.geteuid() != 0, reason="mounts a small disk")
@pytest.mark.parametrize("files", [2, 3, 4, 5])
def test_a_runtime_folder_without_room_for_its_sockets_is_told_and_not_waited_for(tmp_path, files):
    small = tmp_path / "run"
    small.mkdir()
    made = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"nr_inodes={files},mode=700", "small", small], check=False
    )
    if made.returncode:
        pytest.skip("may not mount")
    try:
        code, body, _ = finish(start(CONFIGS / "mock.toml", small), 120)
    finally:
        subprocess.run(["umount", "--lazy", small], check=True)
    assert code == 3
    assert f"{small}/mock/" in body["message"]
    assert "No space left on device" in body["message"]
    assert "RTCTL_RUNTIME_DIR" in body["message"]


def test_a_second_daemon_of_a_name_is_refused_wherever_its_sockets_are(folder, tmp_path):
    first = start(CONFIGS / "mock.toml", folder)
    with RigClient("mock", runtime_dir=folder) as client:
        greet(client, first)
    code, body, _ = finish(start(CONFIGS / "mock.toml", tmp_path / "other"), PATIENCE_S)
    assert code == 8
    assert f"already run by process {first.pid}" in body["message"]
    first.terminate()
    assert finish(first)[0] == 0


def test_a_daemon_at_rest_whose_sockets_went_ends_too(folder):
    """An armed one: test_unreachable_daemon.py."""
    daemon = start(CONFIGS / "mock.toml", folder)
    with RigClient("mock", runtime_dir=folder) as client:
        greet(client, daemon)
        shutil.rmtree(folder / "mock")
        code, body, _ = finish(daemon, 120)
    assert code == 1
    assert f"{folder}/mock/lock" in body["message"]
