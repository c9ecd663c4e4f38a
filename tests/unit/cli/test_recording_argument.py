"""A folder of recordings stands for its newest one, in every command that reads a recording."""

import os

import click
import pytest
from click.testing import CliRunner

from rtctl.cli import cli
from rtctl.cli.recording_argument import RecordingFile

READS = {
    "info": ["file"],
    "plot": ["file"],
    "compare": ["a", "b"],
    "replay": ["file"],
    "export": ["file"],
    "drift": ["file"],
}


def made(folder, **ages):
    """Files with these times of change, s."""
    for name, age in ages.items():
        path = folder / name.replace("__", "-").replace("_dot_", ".")
        path.write_bytes(b"")
        os.utime(path, (age, age))


@pytest.mark.parametrize("name", READS)
def test_every_command_that_reads_a_recording_takes_a_folder(name):
    command = cli.get_command(click.Context(cli), name)
    types = {option.name: option.type for option in command.params}
    assert all(isinstance(types[argument], RecordingFile) for argument in READS[name])


def test_a_folder_is_its_newest_recording_and_what_was_exported_beside_it_is_none(tmp_path, capsys):
    made(
        tmp_path,
        a__000_dot_mcap=3,
        b__000_dot_mcap=7,
        b__001_dot_mcap=8,
        b__001__ticks_dot_mcap=9,
        x_dot_csv=10,
    )
    found = RecordingFile().convert(str(tmp_path), None, None)
    assert found == tmp_path / "b-001.mcap"
    assert "b-001.mcap" in capsys.readouterr().err


def test_a_renamed_recording_is_found_and_a_file_is_taken_as_it_is(tmp_path, capsys):
    made(tmp_path, mine_dot_mcap=3)
    assert RecordingFile().convert(str(tmp_path), None, None) == tmp_path / "mine.mcap"
    capsys.readouterr()
    assert RecordingFile().convert("not-there.mcap", None, None).name == "not-there.mcap"
    assert capsys.readouterr().err == ""


def test_a_folder_without_a_recording_is_told_by_name(tmp_path):
    told = CliRunner().invoke(cli, ["info", str(tmp_path)])
    assert told.exit_code == 2
    assert "no recording" in told.output
    assert tmp_path.name in told.output


@pytest.mark.parametrize(
    "asked", [["compare", "A", "A", "--fields", "torque_applied_nm"], ["replay", "A", "--plot", "a.png"]]
)
def test_what_would_be_drawn_without_a_picture_is_refused(tmp_path, asked):
    made(tmp_path, mine_dot_mcap=3)
    told = CliRunner().invoke(cli, [str(tmp_path / "mine.mcap") if one == "A" else one for one in asked])
    assert told.exit_code == 2
    assert "give both" in told.output
