"""`rtctl record`: how it ends."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from rtctl.cli import record
from rtctl.client import capture
from rtctl.errors import RecordingError
from rtctl.tick import new_ticks

PERIOD_NS = 1_000_000
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


class Rig:
    """Ticks of a run that come in batches of so many, some numbers left out; then nothing."""

    def __init__(self, *batches, missing=0):
        self.run, self.next, self.missing = (
            SimpleNamespace(setup={"about": {"period_ns": str(PERIOD_NS)}}),
            0,
            missing,
        )
        self.batches = list(batches)

    def receive(self, _timeout_s):
        if not self.batches:
            return None
        rows = new_ticks(self.batches.pop(0), 1)
        rows["time_ns"] = 5_000 + PERIOD_NS * np.arange(self.next, self.next + len(rows))
        first, self.next = self.next, self.next + len(rows) + self.missing
        return capture.Ticks(first, rows, [], np.zeros(0))


@pytest.mark.parametrize(
    ("batches", "missing", "kept"),
    [
        ([4800], 0, 3000),  # waited already: the host was late at the start
        ([1000] * 5, 0, 3000),
        ([1500] * 5, 500, 2500),  # ticks that are lost are time, too
        ([2000], 0, 2000),  # and then none come
    ],
)
def test_a_recording_of_some_seconds_ends_with_the_tick_so_long_after_the_first(batches, missing, kept):
    rows = []
    recorder = SimpleNamespace(observe=lambda _first, more, *_, **__: rows.extend(more["time_ns"]))
    rig = Rig(*batches, missing=missing)
    # the host's own clock says that the time is over: what waits is taken all the same
    assert record._one_run(rig, rig.run, recorder, 3.0, 0.0) <= 0.0
    assert (len(rows), rows[-1] - rows[0] < 3_000 * PERIOD_NS) == (kept, True)
