"""An option that a command would not read is refused: who gives one believes that it counts."""

import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

import rtctl.cli as program
from rtctl.cli import cli, rig_argument, view
from rtctl.cli.unread import refuse_unread
from rtctl.client import view_server
from rtctl.errors import ConfigError


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("campaign --margins --still --rigs 1", "--margins and --still are two campaigns"),
        ("campaign --margins --rigs 1 --faults 3", "--faults means nothing with --margins"),
        ("campaign --admittance --rigs 1 --policy tanh", "--policy means nothing with --admittance"),
        ("campaign --rigs 1 --ticks 1 --first 3", "--first belongs to another campaign"),
        ("campaign --trace TRACE", "--trace is of one rig"),
        ("campaign --still --trace TRACE", "--trace means nothing with --still"),
        ("campaign --rig 0 --ticks 1 --rigs 7", "--rigs means nothing with --rig"),
        ("campaign --still --rig 0 --jobs 3", "--jobs means nothing with --rig"),
        ("campaign --admittance --rig 0 --first 5", "--first means nothing with --rig"),
        ("playback a.toml --lever-m 0.2", "--lever-m means nothing with a rig file"),
        ("playback a.toml --time t", "--time means nothing with a rig file"),
        ("playback a.toml --plot PICTURE", "--plot is about the model that is learned"),
        ("doctor --for 3", "--for counts with --watch alone"),
        ("identify --log a.csv --by-load", "--by-load is about the points that --out DIR writes"),
        ("doctor --watch --no-timing", "--no-timing means nothing with --watch"),
    ],
)
def test_what_would_not_be_read_is_wrong_usage(tmp_path, given, said):
    words = (
        given.replace("TRACE", str(tmp_path / "t.npz")).replace("PICTURE", str(tmp_path / "p.png")).split()
    )
    told = CliRunner().invoke(cli, words)
    assert (told.exit_code, said in told.output) == (2, True), told.output


def test_only_what_stands_on_the_command_line_is_refused(monkeypatch):
    @click.command()
    @click.option("--one", default=1, envvar="ONE")
    def command(one):
        refuse_unread({"one"}, "counts for nothing")

    monkeypatch.setenv("ONE", "2")
    assert CliRunner().invoke(command, []).exit_code == 0
    told = CliRunner().invoke(command, ["--one", "3"])
    assert (told.exit_code, "--one counts for nothing" in told.output) == (2, True)


def test_who_names_an_address_gets_a_page_of_their_own(monkeypatch, tmp_path):
    monkeypatch.setattr(view, "_shown_by_daemon", lambda *_: ("http://127.0.0.1:1/", "key=k"))
    asked = []

    def refuse(_client, host, port):
        asked.append((host, port))
        raise OSError(98, "Address already in use")

    monkeypatch.setattr(view_server, "ViewServer", refuse)
    words = ["view", "mock", "--runtime-dir", str(tmp_path)]
    assert "the daemon shows it already" in CliRunner().invoke(cli, words).output
    assert asked == []
    CliRunner().invoke(cli, [*words, "--host", "192.0.2.1"])
    assert asked == [("192.0.2.1", view.PORT)]


def test_a_name_that_no_file_can_have_is_told_as_a_wrong_name(monkeypatch, capsys):
    for words in (["status", "x" * 300], ["record", "x" * 300]):
        monkeypatch.setattr(sys, "argv", ["rtctl", *words])
        assert program._exit_code() == ConfigError.exit_code
        assert "at most 31 letters" in capsys.readouterr().err


def test_what_lies_where_this_user_may_not_look_is_told_where_it_is_read(monkeypatch, capsys):
    def refuse(path):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "is_dir", refuse)
    monkeypatch.setattr(sys, "argv", ["rtctl", "info", "not-for-you/a.mcap"])
    assert program._exit_code() == 10
    assert "not-for-you/a.mcap" in capsys.readouterr().err
    monkeypatch.setattr(Path, "is_file", refuse)
    assert not rig_argument.is_rig_file("not-for-you/rig")
