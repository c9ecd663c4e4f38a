"""The daemon on a CAN bus: `rtctl run` with an slcan adapter on a pty."""

import subprocess
import sys
from pathlib import Path

import pytest

from rtctl.demo import shipped_config
from rtctl.errors import DeviceError

sys.path.insert(0, str(Path(__file__).parents[1] / "contract"))
from slcan_wire import SlcanWire


@pytest.fixture
def wire():
    made = SlcanWire()
    yield made
    made.close()


def rig_file(folder, name, port):
    text = Path(shipped_config(f"can-{name}.toml")).read_text()
    for before, after in (
        ('interface = "socketcan"', 'interface = "slcan"'),
        ('channel = "can0"', f'channel = "{port}"'),
        ('realtime = "require"', 'realtime = "off"'),
        (
            "rate_hz = 1000.0",
            "rate_hz = 200.0",
        ),  # a shared machine; the ratio of the rates does not matter here
        ("stiffness_nm_rad = 20.0", "stiffness_nm_rad = 3.0"),
        ("time_to_live_ms = 10", "time_to_live_ms = 50"),
        ("heartbeat_ms = 5 ", "heartbeat_ms = 20 "),
    ):
        text = text.replace(before, after)
    (folder / "rig.toml").write_text(text)
    return folder / "rig.toml"


def run(folder, name, wire):
    command = [
        sys.executable,
        "-m",
        "rtctl",
        "run",
        str(rig_file(folder, name, wire.ports[0])),
        "--for",
        "1",
        "--json",
    ]
    return subprocess.run(
        [*command, "--runtime-dir", str(folder)], capture_output=True, text=True, check=False, timeout=150
    )


def test_a_drive_that_is_not_there_is_a_device_error_with_what_to_check(tmp_path, wire):
    done = run(tmp_path, "odrive", wire)
    assert done.returncode == DeviceError.exit_code
    assert "no heartbeat within 1 s: check power, wiring and termination" in done.stdout + done.stderr
