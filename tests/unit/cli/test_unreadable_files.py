"""Whatever a person names as a file, a command answers with a named error: never with a traceback."""

import os
import stat

import click
import numpy as np
import pytest
from click.testing import CliRunner

from rtctl.cli import cli
from rtctl.errors import RtctlError

NOT_READ = {"doctor", "demo", "bench"}
"""`doctor` measures for seconds and only adds a line about the file; the others take no file."""


def _taking_a_file():
    """Every command with one argument, or several of a kind, that names a file or folder."""
    context = click.Context(cli)
    for name in cli.list_commands(context):
        command = cli.get_command(context, name)
        arguments = [one for one in command.params if isinstance(one, click.Argument)]
        if name not in NOT_READ and len(arguments) == 1 and isinstance(arguments[0].type, click.Path):
            yield name, command


COMMANDS = dict(_taking_a_file())


def _named(kind, folder):
    path = folder / f"given.{'toml' if kind != 'other table' else 'csv'}"
    if kind == "random":
        path.write_bytes(np.random.default_rng(1).bytes(3000))
    elif kind == "empty":
        path.touch()
    elif kind == "folder":
        path.mkdir()
    elif kind == "circle of links":
        path.symlink_to(path)
    elif kind == "pipe nobody writes into":
        os.mkfifo(path)
        assert stat.S_ISFIFO(path.stat().st_mode)
    elif kind == "other table":
        path.write_text("t,x\n0,nan\n")
    elif kind == "JSON":
        path.write_text('{"a": NaN}')
    return path


def test_the_commands_that_take_a_file_are_found():
    assert {"check", "run", "fit", "evidence", "info", "plot", "replay", "playback"} <= set(COMMANDS)


@pytest.mark.parametrize(
    "kind",
    [
        "missing",
        "random",
        "empty",
        "folder",
        "circle of links",
        "pipe nobody writes into",
        "other table",
        "JSON",
    ],
)
@pytest.mark.parametrize("name", COMMANDS)
def test_a_file_that_cannot_be_read_is_told(name, kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(COMMANDS[name], [str(_named(kind, tmp_path))])
    assert done.exit_code != 0
    assert isinstance(done.exception, (RtctlError, SystemExit)), done.exception
