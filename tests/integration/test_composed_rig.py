"""A rig of two devices through the real processes: config, host, loop process, armed and moving."""

import json
import sys
from pathlib import Path

import nursery

from rtctl.host.auto_arm import AutoArm
from rtctl.host.supervisor import Host
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[2] / "configs"

TWO = """
[[device]]
kind = "mock"
name = "drive"
channels = ["position", "current", "temperature", "current_command"]

[[device.options.hand]]
kind = "sine"
amplitude_rad = 0.3

[[device]]
kind = "mock"
name = "finger"
channels = ["force", "estop"]

[device.options.force]
noise_n = 0.01

[[device.options.hand]]
kind = "sine"
amplitude_rad = 0.3
"""


def rig_file(folder):
    text = (CONFIGS / "mock.toml").read_text()
    text = text[: text.index("[[device]]")].replace('model = "friction/mock.json"', 'model = ""')
    path = folder / "two.toml"
    path.write_text(text.replace('"wall"  ', '"virtual"') + TWO)
    return path


def test_a_rig_of_two_devices_runs_armed_without_a_fault(tmp_path):
    loaded = load(rig_file(tmp_path))
    assert loaded.config.loop.clock == "virtual"
    seen = []

    def keep(host, rows):
        seen.append(
            (rows["position_rad"][:, 0].copy(), rows["force_n"].copy(), rows["sample_age_ticks"].copy())
        )

    with Host(loaded, observers=[AutoArm(), keep], runtime_dir=str(tmp_path / "run")) as host:
        summary = host.run(4.0)
    assert summary["faults"] == []
    position = [abs(rows[0]).max(initial=0.0) for rows in seen]
    force = [abs(rows[1]).max(initial=0.0) for rows in seen]
    assert max(position) > 0.05, "the drive's hand moved the joint"
    assert max(force) > 0.5, "the finger's sensor felt its hand"
    assert max(rows[2].max(initial=0) for rows in seen) == 0, "every tick was fresh"


def test_a_gap_is_a_config_error_with_its_exit_code(tmp_path):
    path = rig_file(tmp_path)
    path.write_text(path.read_text().replace(', "current_command"', ""))
    command = [sys.executable, "-m", "rtctl", "check", str(path), "--json"]
    shown = nursery.run(command, capture_output=True, text=True, check=False, timeout=60)
    body = json.loads(shown.stdout)
    assert (shown.returncode, body["error"]) == (3, "ConfigError")
    assert any(
        "no device takes the torque or current" in line and "'drive'" in line for line in body["faults"]
    )


def test_the_check_tells_who_provides_what(tmp_path):
    command = [sys.executable, "-m", "rtctl", "check", str(rig_file(tmp_path)), "--json"]
    shown = nursery.run(command, capture_output=True, text=True, check=False, timeout=60)
    drive, finger = json.loads(shown.stdout)["members"]
    assert drive["device"] == "device[0] 'drive'"
    assert drive["channels"] == ["current", "current_command", "position", "temperature"]
    assert (finger["channels"], finger["max_age_ticks"], finger["axes"]) == (["estop", "force"], 0, [0])
