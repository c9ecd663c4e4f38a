"""`rtctl record`: how it ends."""

import json

import pytest
from click.testing import CliRunner

from rtctl.cli import record
from rtctl.client import capture
from rtctl.errors import RecordingError

STATUS = {"ticks": 0, "bytes": 0, "files": 0, "dropped": 20, "lost": 0, "folder": "f"}


@pytest.fixture
def recorded(monkeypatch, tmp_path):
    """The command, of a rig that is made up: what it says, and its exit code."""

    class Nobody:
        def __init__(self, _endpoints):
            pass

        def __enter__(self):
            return self

        def __exit__(self, *_error):
            pass

    monkeypatch.setattr(capture, "Capture", Nobody)
    monkeypatch.setattr(record, "_await", lambda *_: None)

    def run(*arguments, broken):
        monkeypatch.setattr(record, "_record", lambda *_: [{**STATUS, "broken": broken}])
        return CliRunner().invoke(record.command, ["mock", "--runtime-dir", str(tmp_path), *arguments])

    return run


def test_a_recording_that_the_disk_refused_ends_with_the_exit_code_of_one(recorded):
    assert recorded(broken=None).exit_code == 0
    assert isinstance(recorded(broken="disk full").exception, RecordingError)
    told = recorded("--json", broken="disk full")
    assert told.exit_code == RecordingError.exit_code
    assert json.loads(told.stdout)["recordings"][0]["broken"] == "disk full"
