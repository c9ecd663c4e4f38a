"""docs/commissioning.md: every command in it exists, with these options, and those that can run here do."""

import json
import os
import re
import shlex
import subprocess
import sys
import time
from pathlib import Path

import can
import click
import nursery
import pytest
from click.testing import CliRunner

from hw.simulators.can_device import TORQUE_CONSTANT_NM_A, DriveSim, make_drives
from hw.simulators.can_plant import Inertia
from rtctl.cli import cli
from rtctl.control.faults import TABLE

ROOT = Path(__file__).parents[3]
TEXT = (ROOT / "docs" / "commissioning.md").read_text()


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", TEXT, re.DOTALL)


COMMANDS = [
    shlex.split(line)[shlex.split(line).index("rtctl") + 1 :]
    for block in blocks("sh")
    for line in block.splitlines()
]


def resolved(words):
    """The click command that these words call, and what is left of them."""
    command, context, left = cli, click.Context(cli), list(words)
    while isinstance(command, click.Group):
        name = left.pop(0)
        command = command.get_command(context, name)
        assert command is not None, f"no command {name!r} in {words}"
    return command, left


def test_the_checklist_has_its_commands():
    assert {words[0] for words in COMMANDS} >= {
        "doctor", "check", "probe", "run", "monitor", "events", "stop-rig", "identify", "fit", "campaign",
        "service", "experiment",
    }  # fmt: skip


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_each_command_exists_with_its_options_and_has_a_help(words):
    command, left = resolved(words)
    known = {option for parameter in command.params for option in parameter.opts}
    for word in left:
        assert not word.startswith("--") or word in known, f"{word} of {words}"
    names = words[: len(words) - len(left)]
    done = CliRunner().invoke(cli, [*names, "--help"])
    assert done.exit_code == 0
    assert "Usage" in done.output


@pytest.mark.parametrize(
    ("words", "codes"),
    [
        (["doctor", "RIG", "--no-timing"], {0, 1}),
        (["check", "RIG", "--plot", "OUT/region.png"], {0}),
        (["probe", "RIG", "--seconds", "0.3", "--runtime-dir", "OUT"], {0}),
        (["stop-rig", "RIG"], {0}),
        (["run", "RIG", "--for", "0.3", "--runtime-dir", "OUT"], {0}),
        (["events", "mock", "--last", "20"], {0}),
        (["campaign", "--rigs", "2", "--ticks", "500", "--jobs", "1"], {0}),
    ],
    ids=lambda words: words[0] if isinstance(words, list) else "",
)
def test_what_can_run_on_the_mock_runs(words, codes, tmp_path):
    tmp_path.chmod(0o700)
    rig = str(ROOT / "configs" / "mock.toml")
    words = [word.replace("RIG", rig).replace("OUT", str(tmp_path)) for word in words]
    done = nursery.run(
        [sys.executable, "-m", "rtctl", *words], capture_output=True, text=True, check=False, timeout=280
    )
    assert done.returncode in codes, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("name", "kind", "options"),
    [
        ("cia402", "cia402", ""),
        ("moteus", "moteus", ""),
        ("odrive", "odrive-request", 'feedback = "request"'),
        ("odrive", "odrive-0.5", 'feedback = "request"'),
        ("board", "can", ""),
    ],
    ids=["cia402", "moteus", "odrive request", "odrive 0.5", "board"],
)
def test_its_probe_shows_a_drive_that_answers_only_when_asked(name, kind, options, tmp_path):
    tmp_path.chmod(0o700)
    text = (ROOT / "configs" / f"can-{name}.toml").read_text()
    for before, after in (
        ('interface = "socketcan"', 'interface = "virtual"'),
        ('channel = "can0"', f'channel = "commissioning {kind}"'),
        ("rate_hz = 1000.0", "rate_hz = 100.0"),  # a shared machine
        ('feedback = "cyclic"', options),
        ("time_to_live_ms = 10 ", "time_to_live_ms = 100 "),
        ("time_to_live_ms = 10.0 ", "time_to_live_ms = 100.0 "),
        ("heartbeat_ms = 5 ", "heartbeat_ms = 40 "),
    ):
        text = text.replace(before, after)
    rig = tmp_path / "rig.toml"
    rig.write_text(text)
    fd = kind == "moteus"
    with can.Bus(interface="virtual", channel=f"commissioning {kind}", fd=fd, ignore_config=True) as bus:
        sim = DriveSim(bus, make_drives(kind, [1]), Inertia(1, TORQUE_CONSTANT_NM_A), fd=fd)
        sim.start()
        try:
            words = ["probe", str(rig), "--seconds", "1.5", "--json", "--runtime-dir", str(tmp_path)]
            done = CliRunner().invoke(cli, words)
            stopped = CliRunner().invoke(cli, ["stop-rig", str(rig)])
        finally:
            sim.stop()
    assert done.exit_code == 0, done.output
    (shown,) = json.loads(done.output)["devices"]
    assert shown["samples"] > shown["cycles"] / 2, shown
    assert shown["faults"]["LOST"] < shown["cycles"] / 2, shown
    assert all(drive.current_a == 0.0 for drive in sim.drives)
    assert "opened afresh and stopped" in stopped.output


def test_the_lines_that_arm_it_arm_the_mock(tmp_path, monkeypatch, capsys):
    folder = tmp_path / "run"
    folder.mkdir(mode=0o700)
    monkeypatch.setenv("RTCTL_RUNTIME_DIR", str(folder))
    (script,) = blocks("python")
    text = (ROOT / "configs/mock.toml").read_text().replace('"friction/', f'"{ROOT}/configs/friction/')
    rig = tmp_path / "rig.toml"  # its hand rests: on a busy machine the lines may come when it swings already
    rig.write_text(text.replace("amplitude_rad = 0.3", "amplitude_rad = 0.0"))
    command = [sys.executable, "-m", "rtctl", "run", str(rig)]
    process = nursery.Program(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=os.environ)
    try:
        end = time.monotonic() + 120
        while not (folder / "mock" / "command").exists():
            assert process.poll() is None
            assert time.monotonic() < end
            time.sleep(0.05)
        exec(script.replace('RigClient("rig")', 'RigClient("mock", timeout_s=200)'), {})
        assert capsys.readouterr().out.strip() == "ACTIVE"
    finally:
        process.terminate()
        process.wait(60)


def test_the_faults_it_names_are_faults_of_the_table():
    states_and_others = {"IDLE", "ACTIVE", "ESTOP", "KILL", "PID", "STO"}
    named = set(re.findall(r"`([A-Z_]{4,})`", TEXT)) - states_and_others
    assert named
    assert named <= {row.name for row in TABLE}


def test_the_files_it_points_to_are_there():
    for target in re.findall(r"\]\(([^)#]+)\)", TEXT):
        assert (ROOT / "docs" / target).exists(), target
