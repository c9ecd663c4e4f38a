"""`rtctl service install` where the rig is installed, or runs, already."""

import shutil

import pytest
from click.testing import CliRunner

from rtctl.cli import service as cli
from rtctl.cli.service import command
from rtctl.host import service_steps as service
from rtctl.simulation.shipped_files import shipped_config


@pytest.fixture(autouse=True)
def reachable(monkeypatch):
    monkeypatch.setattr(service, "own_command", lambda: "/opt/rtctl/bin/python -m rtctl")


def call(*arguments):
    return CliRunner().invoke(command, [str(argument) for argument in arguments])


def test_what_an_earlier_rig_file_asked_for_is_taken_away_and_nothing_else(tmp_path):
    (tmp_path / "rig").mkdir()
    shutil.copytree(shipped_config("friction"), tmp_path / "rig/friction")
    asked = '[gateway]\ngroup = "lab"\nbind = "192.168.1.20"\ncurve_dir = "keys"'
    text = shipped_config("mock.toml").read_text()
    (tmp_path / "rig/rig.toml").write_text(text.replace("[loop]", f"{asked}\n\n[loop]"))
    assert call("install", tmp_path / "rig/rig.toml", "--root", tmp_path / "out").exit_code == 0
    drop_ins = tmp_path / "out/etc/systemd/system/rtctl@mock.service.d"
    assert {path.name for path in drop_ins.iterdir()} == {"10-network.conf", "30-group.conf"}
    (drop_ins / "override.conf").write_text("")
    before = ("install", shipped_config("mock.toml"), "--root", tmp_path / "out")
    assert call(*before, "--dry-run").output.count("would remove") == 2
    assert call(*before).exit_code == 0
    assert [path.name for path in drop_ins.iterdir()] == ["override.conf"]
    assert "remove" not in call(*before).output


@pytest.mark.parametrize("active", [True, False])
def test_a_daemon_that_runs_is_said_to_run_on_as_it_was_started(active, monkeypatch, tmp_path):
    steps = []
    plan = service.plan
    # a plan below another root that is said to be the system's
    monkeypatch.setattr(service.Installation, "live", property(lambda _: True))
    monkeypatch.setattr(
        service, "plan", lambda loaded, *more, start: plan(loaded, tmp_path, *more[1:], start=start)
    )
    monkeypatch.setattr(cli, "_require_root", lambda: None)
    monkeypatch.setattr(cli, "_run", steps.append)
    monkeypatch.setattr(cli, "_is_active", lambda unit: active and unit == "rtctl@mock.service" and not steps)
    done = call("install", shipped_config("mock.toml"))
    assert done.exit_code == 0, done.output
    assert ("sudo systemctl restart rtctl@mock" in done.output) is active
    assert steps[-1] == ["systemctl", "enable", "--now", "rtctl@mock.service"]
