"""What is written is tried before work begins, by every command, and trying leaves nothing behind."""

import os
import stat
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from rtctl.cli import cli
from rtctl.cli.command_table import COMMANDS, SECTIONS
from rtctl.cli.outputs import OutputFile, OutputFolder, why_no_folder

WRITES = ("--out", "--plot", "--report", "--record", "--save-model", "--trace", "--picture")


def commands(group, ctx, path=()):
    for name in group.list_commands(ctx):
        command = group.get_command(ctx, name)
        if isinstance(command, click.Group):
            yield from commands(command, ctx, (*path, name))
        else:
            yield (*path, name), command


ALL = dict(commands(cli, click.Context(cli)))


def outputs():
    for path, command in ALL.items():
        for option in command.params:
            if set(option.opts) & set(WRITES):
                yield path, option


def test_no_help_shows_the_mark_that_keeps_its_lines_apart():
    helps = [command.get_help(click.Context(command, info_name=path[-1])) for path, command in ALL.items()]
    assert len(helps) > 30
    assert not [text for text in helps if "\\b" in text]
    assert sum("\n      rtctl init mock.toml my-rig.toml\n" in text for text in helps) == 1


def test_the_list_of_commands_says_of_each_in_one_line_what_it_does():
    said = CliRunner().invoke(cli, ["--help"], terminal_width=80).output.splitlines()
    lines = [line.split(maxsplit=1) for line in said if line.split()[:1] and line.split()[0] in COMMANDS]
    about = [[name, text] for section in SECTIONS.values() for name, (_, text) in section.items()]
    assert lines == about


@pytest.mark.parametrize(
    ("word", "said"), [("chek", "Did you mean 'check'?"), ("xyz", "`rtctl --help` lists them.")]
)
def test_a_command_that_there_is_not_is_told_with_what_is_near(word, said):
    done = CliRunner().invoke(cli, [word])
    assert done.exit_code == 2
    assert f"No such command '{word}'. {said}" in done.output


def test_every_option_that_names_an_output_is_one():
    found = list(outputs())
    assert len(found) > 15
    assert len(ALL) >= len(COMMANDS)
    wrong = [path for path, option in found if not isinstance(option.type, OutputFile | OutputFolder)]
    assert wrong == []


@pytest.mark.parametrize("path", sorted({path for path, _ in outputs()}), ids=" ".join)
def test_no_command_begins_when_its_output_cannot_be_written(path, tmp_path, monkeypatch):
    file = tmp_path / "a file"
    file.write_text("")
    given = [tmp_path / "nothing"] if path[0] != "keys" else ["anna", "--role", "renderer", "--dir", tmp_path]
    for option in (option for found, option in outputs() if found == path):
        ending = "x.png" if isinstance(option.type, OutputFile) else "x"
        before = sorted(tmp_path.iterdir())
        called = [*path, *given, option.opts[0], file / ending]
        called += ["free-motion"] if path == ("experiment",) else []
        if path == ("experiment",):
            called = ["experiment", "free-motion", tmp_path / "nothing", option.opts[0], file / ending]
        done = CliRunner().invoke(cli, [str(one) for one in called])
        assert done.exit_code == 2, done.output
        assert "cannot write" in done.output
        assert "a file" in done.output
        assert sorted(tmp_path.iterdir()) == before


def test_a_picture_has_the_ending_of_one(tmp_path):
    done = CliRunner().invoke(cli, ["check", "configs/mock.toml", "--plot", str(tmp_path / "region.txt")])
    assert done.exit_code == 2
    assert "a picture ends in .png" in done.output


def test_trying_leaves_nothing_and_takes_nothing(tmp_path):
    assert why_no_folder(tmp_path / "a" / "b") == ""
    kept = tmp_path / "kept.json"
    kept.write_text("old")
    OutputFile().convert(str(kept), None, None)
    OutputFolder().convert(str(tmp_path / "new" / "er"), None, None)
    assert [path.name for path in tmp_path.iterdir()] == ["kept.json"]
    assert kept.read_text() == "old"


def test_a_folder_that_takes_no_file_is_told(tmp_path, monkeypatch):
    def full(**_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("tempfile.TemporaryFile", full)
    assert why_no_folder(tmp_path / "x") == f"No space left on device ({tmp_path})"


def test_a_device_is_never_written_over(tmp_path):
    """Root could: a file that is renamed to the name of a device takes the place of the device."""
    pipe = tmp_path / "null.csv"
    os.mkfifo(pipe)
    with pytest.raises(click.BadParameter, match="a device or a pipe; name a file"):
        OutputFile().convert(str(pipe), None, None)
    assert stat.S_ISFIFO(pipe.stat().st_mode)


def test_what_a_link_names_is_written_not_the_link(tmp_path):
    there, link = tmp_path / "there.csv", tmp_path / "link.csv"
    there.write_text("old")
    link.symlink_to(there)
    assert OutputFile().convert(str(link), None, None) == there


def test_a_full_disk_under_standard_output_is_told_in_one_line():
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "rtctl", "schema"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert (done.returncode, done.stderr) == (
        1,
        "rtctl: standard output: No space left on device; make room\n",
    )


@pytest.mark.parametrize(
    ("command", "written", "read"),
    [
        ("fit", "--out", ["points.csv"]),
        ("fit", "--out", ["other.csv", "--test", "points.csv"]),
        ("playback", "--save-model", ["points.csv"]),
        ("playback", "--save-model", ["other.csv", "--fit-from", "points.csv"]),
        ("evidence", "--out", ["points.csv"]),
    ],
)
def test_what_was_measured_is_not_written_over(tmp_path, monkeypatch, command, written, read):
    monkeypatch.chdir(tmp_path)
    Path("points.csv").write_text("measured once")
    Path("link.csv").symlink_to("points.csv")
    for name in ("points.csv", "../" + tmp_path.name + "/points.csv", "link.csv"):
        told = CliRunner().invoke(cli, [command, *read, written, name])
        assert told.exit_code == 2, told.output
        assert "is what is read" in told.output
    assert Path("points.csv").read_text() == "measured once"
