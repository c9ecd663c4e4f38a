"""`rtctl status | arm | stop | reset | tare`, and one way of naming the rig in every command that talks to
one.
"""

import json
import tempfile
from pathlib import Path

import click
import pytest
from click.testing import CliRunner
from fake_rig import FakeRig
from patience import PATIENCE_S, until
from standstill import patient_clients

from rtctl.cli import cli, operate
from rtctl.cli.command_table import COMMANDS
from rtctl.errors import ClientError, RefusedError

NAMING = ("status", "arm", "stop", "reset", "tare", "adapt", "monitor", "record", "events", "view", "world")


@pytest.fixture
def root():
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        yield Path(folder)


@pytest.fixture
def rig(root):
    with FakeRig(root, names=("base", "tip")) as running:
        yield running


def call(root, *arguments):
    """As ever, but for how long a loaded machine is waited for."""
    with patient_clients() as patience:
        patience.setattr(operate, "STOP_S", PATIENCE_S)
        return CliRunner().invoke(cli, [*arguments, "--runtime-dir", str(root)])


def state(root):
    return json.loads(call(root, "status", "--json").stdout)["state"]


def test_a_person_arms_stops_and_resets_a_rig_by_the_command_line(rig, root):
    until(lambda: call(root, "status").exit_code == 0)
    armed = call(root, "arm")
    assert armed.exit_code == 0, armed.exception
    assert armed.stdout.startswith("mock: ACTIVE")
    assert "tip:" in armed.stdout
    stopped = call(root, "stop", "mock")
    assert "no torque" in stopped.stdout
    assert state(root) == "IDLE"
    rig.loop.trip.set()
    until(lambda: state(root) == "FAULT")
    told = call(root, "status").stdout
    assert "stopped by OVERSPEED: the joint is faster than its limit" in told
    assert "present:" not in told
    refused = call(root, "arm")
    assert isinstance(refused.exception, RefusedError)
    assert "then reset" in str(refused.exception)
    assert json.loads(call(root, "reset", "--json").stdout)["state"] == "IDLE"
    assert call(root, "tare").exit_code == call(root, "tare", "--hands-off").exit_code == 0


def test_the_compensation_of_a_rig_that_asks_for_nothing_is_held_and_refused_to_follow(rig, root):
    until(lambda: call(root, "status").exit_code == 0)
    assert call(root, "adapt", "off", "mock").exit_code == 0
    refused = call(root, "adapt", "on", "--axis", "tip")
    assert isinstance(refused.exception, RefusedError)
    assert "axis tip: it follows nothing: adapt_per_min" in str(refused.exception)


def test_the_rig_is_named_by_its_name_its_file_or_not_at_all(rig, root, tmp_path):
    file = tmp_path / "my.toml"
    file.write_text('[rig]\nname = "mock"\n')
    for name in ([], ["mock"], [str(file)]):
        assert call(root, "status", *name).stdout.startswith("mock: ")
    file.write_text('[rig]\nname = "another"\n')
    failed = CliRunner().invoke(cli, ["status", str(file), "--runtime-dir", str(root)])
    assert isinstance(failed.exception, ClientError)


def test_without_a_daemon_every_command_says_how_to_start_one(root):
    for name in ("status", "arm", "stop", "reset", "tare", "monitor", "view", "record", "events"):
        arguments = [name] if name == "events" else [name, "--runtime-dir", str(root)]
        done = CliRunner().invoke(cli, arguments, env={"RTCTL_RUNTIME_DIR": str(root)})
        assert isinstance(done.exception, ClientError), name
        assert "start one with: rtctl run CONFIG" in str(done.exception)


@pytest.mark.parametrize("name", NAMING)
def test_every_command_takes_the_rig_as_its_first_argument(name):
    command = cli.get_command(click.Context(cli), name)
    *before, argument = (one for one in command.params if isinstance(one, click.Argument))
    assert [one.name for one in before] == (["follow"] if name == "adapt" else [])
    assert (argument.name, argument.metavar, argument.required) == ("rig", "[CONFIG|RIG]", False)


def test_no_command_names_its_rig_in_another_way():
    """What reads a rig file takes CONFIG; `--rig` is left to what makes a file for a rig by its name."""
    for name in COMMANDS:
        command = cli.get_command(click.Context(cli), name)
        for one in command.params:
            if isinstance(one, click.Argument) and "rig" in str(one.metavar or one.name).lower():
                assert name in NAMING
