"""`rtctl service` on a folder: what is written, that doing it twice changes nothing, and what is taken
away.
"""

import os
import shlex
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from hw import registry
from rtctl.cli import service as cli
from rtctl.cli.service import command
from rtctl.errors import ConfigError
from rtctl.friction import artefact
from rtctl.host import service_steps as service
from rtctl.rig_file.config import load
from rtctl.simulation.shipped_files import shipped_config, write_copy


@pytest.fixture(autouse=True)
def reachable(monkeypatch):
    monkeypatch.setattr(service, "own_command", lambda: "/opt/rtctl/bin/python -m rtctl")


def call(*arguments):
    return CliRunner().invoke(command, [str(argument) for argument in arguments])


def tree(root):
    return {str(path.relative_to(root)): path.read_bytes() for path in root.rglob("*") if path.is_file()}


def test_install_writes_the_unit_the_rig_file_and_its_models_and_is_idempotent(tmp_path):
    done = call("install", shipped_config("mock.toml"), "--root", tmp_path)
    assert done.exit_code == 0, done.output
    files = tree(tmp_path)
    unit = files["etc/systemd/system/rtctl@.service"].decode()
    assert "ExecStart=/opt/rtctl/bin/python -m rtctl run /etc/rtctl/%i.toml" in unit
    assert "ExecStopPost=/opt/rtctl/bin/python -m rtctl stop-rig /etc/rtctl/%i.toml" in unit
    assert files["etc/rtctl/mock.toml"] == shipped_config("mock.toml").read_bytes()
    assert files["etc/rtctl/friction/mock.json"] == shipped_config("friction/mock.json").read_bytes()
    assert {"etc/sysusers.d/rtctl.conf", "etc/udev/rules.d/60-rtctl.rules"} <= set(files)
    assert not any("10-network" in name for name in files)
    again = call("install", shipped_config("mock.toml"), "--root", tmp_path)
    assert again.exit_code == 0
    assert all(line.startswith("unchanged ") for line in again.output.splitlines())
    assert tree(tmp_path) == files


def test_a_dry_run_says_everything_and_does_nothing(tmp_path):
    done = call("install", shipped_config("mock.toml"), "--root", tmp_path, "--dry-run")
    assert done.exit_code == 0
    assert done.output.count("would write") == 5
    assert tree(tmp_path) == {}
    live = call("install", shipped_config("mock.toml"), "--dry-run")
    assert "would run systemctl enable --now rtctl@mock.service" in live.output
    assert "would run systemd-sysusers /etc/sysusers.d/rtctl.conf" in live.output


def installed_drop_ins(folder, addition):
    shutil.copytree(shipped_config("friction"), folder / "rig/friction")
    text = shipped_config("mock.toml").read_text()
    (folder / "rig/rig.toml").write_text(text.replace("[loop]", f"{addition}\n\n[loop]"))
    assert call("install", folder / "rig/rig.toml", "--root", folder / "out").exit_code == 0
    return folder / "out/etc/systemd/system/rtctl@mock.service.d"


def test_a_device_on_the_network_gets_the_network(tmp_path, monkeypatch):
    found = registry.lookup
    monkeypatch.setattr(registry, "lookup", lambda kind: replace(found(kind), network=True))
    drop_ins = installed_drop_ins(tmp_path, "[view]")
    assert [path.name for path in drop_ins.iterdir()] == ["10-network.conf"]
    assert "PrivateNetwork=no" in (drop_ins / "10-network.conf").read_text()


def test_the_kinds_that_are_reached_by_ip_or_can_say_so():
    networked = {kind for kind, info in registry.BUILT_IN.items() if info.network}
    assert networked == {"can", "odrive", "moteus", "cia402", "rdt"}


@pytest.mark.parametrize("addition", ["[telemetry]\nplotjuggler = true", "[view]"])
def test_a_page_or_viewers_get_this_machine_only(addition, tmp_path):
    drop_ins = installed_drop_ins(tmp_path, addition)
    text = (drop_ins / "10-loopback.conf").read_text()
    assert "PrivateNetwork=no" in text
    assert "IPAddressDeny=any\nIPAddressAllow=localhost" in text


def test_a_chosen_core_stays_allowed(tmp_path):
    config = tmp_path / "rig.toml"
    model = shipped_config("friction/mock.json")
    text = shipped_config("mock.toml").read_text().replace("[loop]", "[loop]\ncpu = 3")
    config.write_text(text.replace('"friction/mock.json"', f'"{model}"'))
    assert call("install", config, "--root", tmp_path / "out").exit_code == 0
    drop_ins = tmp_path / "out/etc/systemd/system/rtctl@mock.service.d"
    assert "CPUAffinity=0-" in (drop_ins / "20-core.conf").read_text()


def test_a_rig_with_a_group_gets_the_drop_in_that_lets_the_daemon_share_its_sockets(tmp_path):
    text = (installed_drop_ins(tmp_path, '[gateway]\ngroup = "lab"') / "30-group.conf").read_text()
    assert "SupplementaryGroups=lab\n" in text
    assert "SystemCallFilter=@chown\n" in text


def test_a_rig_file_that_is_wrong_or_not_provable_installs_nothing(tmp_path):
    bad = tmp_path / "bad.toml"
    bad.write_text(shipped_config("mock.toml").read_text().replace("rate_hz = 1000.0", "rate_hz = nan"))
    assert call("install", bad, "--root", tmp_path / "out").exit_code != 0
    stiff = tmp_path / "stiff.toml"
    stiff.write_text(
        shipped_config("mock.toml").read_text().replace("stiffness_nm_rad = 60.0", "stiffness_nm_rad = 600.0",
            1)
        .replace('"friction/mock.json"', f'"{shipped_config("friction/mock.json")}"')
    )  # fmt: skip
    assert call("install", stiff, "--root", tmp_path / "out").exit_code != 0
    assert not (tmp_path / "out").exists()


def test_a_model_outside_the_rig_files_folder_is_refused(tmp_path):
    (tmp_path / "rig").mkdir()
    shutil.copy(shipped_config("friction/mock.json"), tmp_path / "mock.json")
    text = shipped_config("mock.toml").read_text().replace('"friction/mock.json"', '"../mock.json"')
    (tmp_path / "rig/rig.toml").write_text(text)
    done = call("install", tmp_path / "rig/rig.toml", "--root", tmp_path / "out")
    assert done.exit_code != 0
    assert "leads out of the rig file's folder" in str(done.exception)


def test_who_misspells_a_rig_is_told_those_that_there_are(tmp_path, monkeypatch):
    call("install", shipped_config("mock.toml"), "--root", tmp_path)
    stop = ["systemctl", "disable", "--now", "rtctl@mokc.service"]
    monkeypatch.setattr(service, "removal", lambda *_arguments, **_options: ([stop], []))
    told = call("uninstall", "mokc", "--root", tmp_path, "--dry-run")
    assert told.exit_code == 0
    assert "nothing of rig 'mokc' is installed; there are mock" in told.output


def test_uninstall_leaves_data_unless_purged_and_nothing_at_all_with_the_last_rig(tmp_path):
    call("install", shipped_config("mock.toml"), "--root", tmp_path)
    (tmp_path / "var/lib/rtctl/mock").mkdir(parents=True)
    first = call("uninstall", "mock", "--root", tmp_path)
    assert first.exit_code == 0
    assert set(tree(tmp_path)) == {"etc/rtctl/mock.toml", "etc/rtctl/friction/mock.json"}
    call("install", shipped_config("mock.toml"), "--root", tmp_path)
    call("uninstall", "mock", "--purge", "--root", tmp_path)
    assert tree(tmp_path) == {}
    assert "nothing of rig 'mock'" in call("uninstall", "mock", "--root", tmp_path).output


def test_data_that_a_link_leads_to_stay_when_the_link_is_purged(tmp_path):
    call("install", shipped_config("mock.toml"), "--root", tmp_path)
    (tmp_path / "disk").mkdir()
    (tmp_path / "disk/a.mcap").write_text("")
    (tmp_path / "var/lib/rtctl").mkdir(parents=True)
    (tmp_path / "var/lib/rtctl/mock").symlink_to(tmp_path / "disk")
    assert call("uninstall", "mock", "--purge", "--root", tmp_path).exit_code == 0
    assert tree(tmp_path) == {"disk/a.mcap": b""}
    assert not (tmp_path / "var/lib/rtctl/mock").is_symlink()


def test_a_python_the_service_cannot_see_is_refused(monkeypatch):
    monkeypatch.undo()
    monkeypatch.setattr(service.sys, "executable", "/home/anna/venv/bin/python")
    monkeypatch.setattr(service, "find_spec", lambda name: None if name == "can" else name)
    with pytest.raises(service.ConfigError, match="install rtctl for all users") as refused:
        service.own_command()
    commands = [shlex.split(line) for line in str(refused.value).splitlines()[1:]]
    assert [command[0] for command in commands] == ["sudo"] * 3
    assert commands[1][:-1] == ["sudo", "/opt/rtctl/bin/python", "-m", "pip", "install"]
    what, _, extras = commands[1][-1].partition("[")
    assert (Path(what) / "pyproject.toml").is_file()  # something pip can install, not a name nobody published
    assert extras == "serial]", "a rig on a serial port would not be found by its service"


def test_an_installed_rtctl_names_what_it_was_installed_from(monkeypatch, tmp_path):
    monkeypatch.setattr(service, "__file__", str(tmp_path / "site-packages/rtctl/service/plan.py"))

    class Installed:
        def __init__(self, told):
            self.told = told

        def read_text(self, _name):
            return self.told

    for told, wanted in (
        ('{"url": "file:///srv/rtctl-0.1.0-py3-none-any.whl"}', "/srv/rtctl-0.1.0-py3-none-any.whl"),
        (None, "RTCTL_WHEEL_OR_CHECKOUT"),
    ):
        monkeypatch.setattr(service, "distribution", lambda _name, told=told: Installed(told))
        assert service.source() == wanted


def test_the_unit_goes_on_without_a_view_that_the_kernel_ended():
    """What each line does: tests/system/test_out_of_memory_in_vm.py."""
    lines = service.shipped(service.UNIT).decode().splitlines()
    assert [line for line in lines if line.startswith("OOM")] == ["OOMScoreAdjust=-900", "OOMPolicy=continue"]


@pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="no systemd-analyze on this machine")
@pytest.mark.parametrize(
    ("added", "threshold"), [(None, 18), (service.LOOPBACK_DROP_IN, 18), (service.NETWORK_DROP_IN, 22)]
)
def test_the_sandbox_is_as_tight_as_promised(added, threshold, tmp_path):
    unit = service.shipped(service.UNIT).decode()
    if added:
        drop_in = service.shipped(added).decode().partition("[Service]\n")[2]
        unit = unit.replace("\n[Install]", f"\n{drop_in}\n[Install]")
    path = tmp_path / "rtctl@test.service"
    path.write_text(unit)
    done = subprocess.run(
        ["systemd-analyze", "security", "--offline=true", f"--threshold={threshold}", str(path)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr


def test_it_compiles_as_the_user_of_the_service_in_its_cache_before_that_starts(monkeypatch):
    """systemd makes and gives away the folder as it will for the service."""
    made = service.plan(
        load(shipped_config("mock.toml")), Path("/"), "/opt/rtctl/bin/python -m rtctl", start=True
    )
    (step,) = (one for one in made.commands if one[0] == service.COMPILER)
    assert made.commands.index(step) == len(made.commands) - 2, "then it is started"
    assert " ".join(step).endswith("/opt/rtctl/bin/python -m rtctl compile /etc/rtctl/mock.toml")
    unit = service.unit_text("rtctl").decode()
    for name in ("User", "Group", "CacheDirectory", "CacheDirectoryMode", "UMask"):
        (line,) = (line for line in unit.splitlines() if line.startswith(f"{name}="))
        assert line in step, "as the unit says"


def test_a_python_below_a_folder_with_a_space_is_one_word_of_the_unit(monkeypatch):
    monkeypatch.undo()
    monkeypatch.setattr(service, "HIDDEN", ())
    monkeypatch.setattr(service.sys, "executable", "/opt/my rig/bin/python")
    command = service.own_command()
    assert shlex.split(command) == ["/opt/my rig/bin/python", "-m", "rtctl"]
    step = service.compile_command(command, Path("/etc/rtctl/mock.toml"))
    assert step[-5:-2] == ["/opt/my rig/bin/python", "-m", "rtctl"]


def test_an_installation_goes_on_where_nothing_could_be_compiled_before(capfd, monkeypatch, tmp_path):
    program = tmp_path / service.COMPILER
    program.write_text("#!/bin/sh\necho 98 functions so far\nexit 5\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    cli._run([service.COMPILER, "rtctl", "compile"])
    said = capfd.readouterr()
    assert said.out == "", "for scripts"
    assert "98 functions so far" in said.err
    assert "first start does it" in said.err


def test_a_rig_takes_no_file_of_another_rig_away(tmp_path):
    root, folder = tmp_path / "root", tmp_path / "mine"
    folder.mkdir()
    write_copy("mock.toml", folder / "one.toml", "one")
    assert call("install", folder / "one.toml", "--root", root).exit_code == 0
    before = tree(root)
    text = (folder / "one.toml").read_text()
    # another joint's model under the same name
    other = folder / "two.toml"
    other.write_text(text.replace('name = "one"', 'name = "two"'))
    (model,) = folder.rglob("*.json")
    artefact.save(replace(artefact.load(model), rig="two"), model)
    done = call("install", other, "--root", root)
    assert isinstance(done.exception, ConfigError)
    assert "rig one would lose its own file" in str(done.exception)
    # a schedule by the name of a rig, another one's and its own
    schedule = '[[fault]]\nchannel = "link"\nkind = "drop"\nat_s = 1.0\nfor_ticks = 1\n'
    for name in ("one", "three"):
        rig = tmp_path / name / "three-rig.toml"
        write_copy("mock.toml", rig, "three")
        (rig.parent / f"{name}.toml").write_text(schedule)
        rig.write_text(
            rig.read_text().replace("[device.options]", f'[device.options]\nfaults = "{name}.toml"')
        )
        done = call("install", rig, "--root", root)
        assert f"rig {name} would lose" in str(done.exception)
    assert tree(root) == before
    # its own files it may replace
    artefact.save(replace(artefact.load(model), rig="one"), model)
    (folder / "one.toml").write_text(f"{text}\n# changed\n")
    assert call("install", folder / "one.toml", "--root", root).exit_code == 0
