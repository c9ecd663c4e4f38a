"""`rtctl init`: every shipped rig file can be one's own, complete, and nothing that exists is lost."""

import json
import resource
import shlex
import subprocess
import sys

import pytest
from click.testing import CliRunner

from rtctl.cli import cli, invocation
from rtctl.errors import ConfigError, ModelError
from rtctl.friction import artefact
from rtctl.rig_file.config import load
from rtctl.simulation.shipped_files import about, rig_files, shipped, write_copy


def call(*arguments):
    return CliRunner().invoke(cli, [str(argument) for argument in arguments])


def test_without_arguments_it_lists_every_shipped_file_with_what_it_is():
    told = call("init").stdout.splitlines()
    assert [line.split()[0] for line in told] == [path.name for path in rig_files()]
    assert all(len(line.split()) > 4 for line in told)
    assert json.loads(call("init", "--json").stdout)["mock.toml"] == about(shipped("configs/mock.toml"))


@pytest.mark.parametrize("path", rig_files(), ids=lambda path: path.stem)
def test_a_copy_of_each_loads_under_its_new_name(path, tmp_path):
    target = tmp_path / "new folder" / "my-rig.toml"
    done = call("init", path.name, target)
    assert done.exit_code == 0, done.output
    if path.stem == "playback":  # a log of one's own belongs beside it
        (target.parent / "my_log.csv.gz").touch()
    loaded = load(target)
    assert loaded.config.rig.name == "my-rig"
    for axis in loaded.config.axis:
        if model := loaded.model_path(axis):
            artefact.require_rig(artefact.load(model), "my-rig", model)
            assert model.is_relative_to(tmp_path)
    assert f"configs/{path.name}" not in target.read_text()
    assert len(target.read_text().splitlines()) == len(path.read_text().splitlines())


def test_two_rigs_live_in_one_folder_and_nothing_is_overwritten(tmp_path):
    first = write_copy("mock", tmp_path / "a.toml", "a")
    write_copy("mock.toml", tmp_path / "b.toml", "b")
    before = {path: path.read_bytes() for path in first}
    with pytest.raises(ConfigError, match="exists already"):
        write_copy("mock-wall.toml", tmp_path / "a.toml", "c")
    with pytest.raises(ConfigError, match="exists already"):
        write_copy("mock-wall.toml", tmp_path / "c.toml", "a")  # its model is there
    assert {path: path.read_bytes() for path in first} == before
    assert not (tmp_path / "c.toml").exists()


@pytest.mark.parametrize(
    ("source", "name", "words"),
    [
        ("mok.toml", "a", "did you mean mock.toml"),
        ("xyzzy", "a", "rtctl init lists"),
        ("mock", "a b", "--name"),
    ],
)
def test_what_cannot_be_copied_is_told_with_a_remedy(source, name, words, tmp_path):
    with pytest.raises(ConfigError, match=words):
        write_copy(source, tmp_path / "x.toml", name)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match="file"):
        write_copy("mock", tmp_path / "file" / "x.toml", "x")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_every_shell_gets_a_completion(shell):
    assert "_RTCTL_COMPLETE" in call("completion", shell).stdout


def test_completion_offers_shipped_files(monkeypatch):
    words = {"_RTCTL_COMPLETE": "bash_complete", "COMP_WORDS": "rtctl init mock-sp", "COMP_CWORD": "2"}
    done = CliRunner().invoke(cli, [], prog_name="rtctl", env=words, standalone_mode=False)
    assert "mock-spring.toml" in done.stdout


def test_commands_are_printed_as_they_run_here(monkeypatch, tmp_path):
    (tmp_path / "bin").mkdir()
    own = tmp_path / "bin" / "rtctl"
    own.write_text("#!/bin/sh\n")
    own.chmod(0o755)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(own)])
    monkeypatch.setenv("PATH", "/usr/bin")
    text = "see rtctl check a.toml, rtctl@mock, configs/rtctl check, `rtctl stop-rig X`, rtctl: no"
    assert invocation.as_run(text) == text.replace("see rtctl", "see bin/rtctl").replace(
        "`rtctl", "`bin/rtctl"
    )
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    assert invocation.as_run(text) == text
    monkeypatch.setattr(sys, "argv", ["-m"])
    monkeypatch.setattr(sys, "executable", str(tmp_path / "other python"))
    assert invocation.program() == f"'{tmp_path}/other python' -m rtctl"


def test_an_extra_is_installed_by_its_packages_and_this_python():
    told = invocation.as_run("needs python-can: pip install 'rtctl[can]'")
    assert told.startswith(f"needs python-can: {sys.executable} -m pip install ")
    packages = shlex.split(told.partition(" -m pip install ")[2])
    assert "python-can>=4.4" in packages
    assert all("rtctl" not in one for one in packages)
    assert invocation.as_run("sudo /opt/rtctl/bin/python -m pip install /src") == (
        "sudo /opt/rtctl/bin/python -m pip install /src"
    )


def test_paths_are_printed_as_this_folder_needs_them(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert invocation.shown(tmp_path / "a b.toml") == "'a b.toml'"
    assert invocation.shown(tmp_path.parent / "x") == str(tmp_path.parent / "x")


def test_what_the_demonstration_names_exists(capsys):
    from rtctl.cli.demo import _table

    figures = dict.fromkeys(("p50", "p99"), 1.0)
    told = _table(
        {
            **dict.fromkeys(("wakeup_us", "cycle_us"), figures),
            "ticks": 1,
            "rate_hz": 1.0,
            "missed_ticks": 0,
            "state": "IDLE",
            "faults": [],
        },
        {"off": 1.0, "on": 0.5, "reduction": 0.5},
        "linear",
    )
    # a carriage is told of in N
    assert told[:2] == ["hand force, RMS", "  compensation off   1.0000 N"]
    commands = [line for line in told if line.startswith("  ") and (" run " in line or " check " in line)]
    assert len(commands) == 2
    program, word, file = commands[1].split()
    assert subprocess.run([program, word, file], capture_output=True, check=False).returncode == 0


def test_half_of_a_rig_is_not_left_in_the_way_of_the_next_try(tmp_path):
    target = tmp_path / "my-rig.toml"
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    for source in ("mock.toml", "serial.toml"):  # the model is refused, the rig file is cut
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
        try:
            with pytest.raises((ConfigError, ModelError)):
                write_copy(source, target, "my-rig")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
        assert [path for path in tmp_path.rglob("*") if path.is_file()] == []
    assert target in write_copy("serial.toml", target, "my-rig")


def test_a_path_is_ones_own_file_and_a_rig_is_renamed_by_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_copy("mock.toml", tmp_path / "mock.toml", "left")  # a name that a shipped file has, too
    own = tmp_path / "mock.toml"
    own.write_text(own.read_text().replace("torque_limit_nm = 2.0", "torque_limit_nm = 1.5"))
    done = call("init", "./mock.toml", "right.toml")
    assert done.exit_code == 0, done.output
    assert "of another one: rtctl identify" in done.output
    loaded = load("right.toml")
    (axis,) = loaded.config.axis
    assert (loaded.config.rig.name, axis.torque_limit_nm) == ("right", 1.5)
    assert artefact.load(loaded.model_path(axis)).rig == "right"
    # the shipped file by its path is the shipped file
    done = call("init", rig_files()[-1], "fourth.toml")
    assert "of another one" not in done.output
    # a bare name is that of the list
    assert call("init", "mock.toml", "third.toml").exit_code == 0
    assert load("third.toml").config.axis[0].torque_limit_nm == 2.0


def test_of_several_models_each_comes_along_and_what_both_rigs_find_stays(tmp_path):
    write_copy("mock-2axis.toml", tmp_path / "two.toml", "two")
    text = (tmp_path / "two.toml").read_text()
    write_copy("mock.toml", tmp_path / "a.toml", "b")
    (tmp_path / "friction" / "b.json").rename(tmp_path / "friction" / "pitch.json")
    fault = '[[fault]]\nchannel = "link"\nkind = "drop"\nat_s = 1.0\nfor_ticks = 1\n'
    (tmp_path / "faults.toml").write_text(fault)
    head, tail = text.rsplit("friction/two.json", 1)
    text = f"{head}friction/pitch.json{tail}".replace("seed = 1 ", 'faults = "faults.toml"\nseed = 1 ')
    (tmp_path / "two.toml").write_text(text)
    write_copy(str(tmp_path / "two.toml"), tmp_path / "three.toml", "three")
    loaded = load(tmp_path / "three.toml")
    models = [loaded.model_path(axis) for axis in loaded.config.axis]
    assert [model.name for model in models] == ["three-two.json", "three-pitch.json"]
    assert {artefact.load(model).rig for model in models} == {"three"}


def test_a_file_of_ones_own_that_is_written_otherwise_is_refused(tmp_path):
    own, to = tmp_path / "own.toml", tmp_path / "x.toml"
    for text, words in (
        ('[[axis]]\nname = "joint"\n[rig]\nname = "a"\n', "begin with"),
        ("[rig]\nname = 'a'\n", "begin with"),
        ("[rig\n", "rtctl check tells more"),
    ):
        own.write_text(text)
        with pytest.raises(ConfigError, match=words):
            write_copy(str(own), to, "b")
    assert list(tmp_path.iterdir()) == [own]
