"""A disk that is full from the first write on, for a while: what is recorded afterwards is found and read."""

import errno

import numpy as np
import pytest

from rtctl.check.law_plan import build
from rtctl.control.records import command_dtype
from rtctl.host.run_record import RunRecord
from rtctl.host.speaker import REMEDY, Speaker
from rtctl.recording.limits import Limits
from rtctl.recording.mcap_file import McapFile
from rtctl.recording.parts import Parts
from rtctl.recording.reader import RecordingReader, all_parts
from rtctl.recording.setup import Setup, setup_of
from rtctl.rig_file.config import load
from rtctl.simulation.shipped_files import shipped_config
from rtctl.tick import new_ticks

pytestmark = pytest.mark.compiled


@pytest.fixture(scope="module")
def setup() -> Setup:
    loaded = load(shipped_config("mock.toml"))
    return setup_of(loaded, build(loaded), 7, 10**18)


class Disk:
    """Takes so many writes more, then none; `room` is for a person to change."""

    def __init__(self, monkeypatch):
        self.room = 0
        self._write = McapFile._write
        monkeypatch.setattr(McapFile, "_write", lambda file, data: self.write(file, data))

    def write(self, file, data):
        if self.room <= 0:
            raise OSError(errno.ENOSPC, "No space left on device", str(file.path))
        self.room -= 1
        self._write(file, data)


def ticks(first, n=700):
    rows = new_ticks(n, 1)
    rows["tick"] = np.arange(first, first + n)
    rows["time_ns"] = rows["tick"] * 1_000_000
    return rows


def add(parts, first):
    parts.add(first, ticks(first), [], np.zeros(0, command_dtype(1)))


@pytest.mark.parametrize("writes", range(7), ids=lambda n: f"full after {n} writes")
def test_a_part_without_ticks_is_taken_away_and_the_rest_is_found(tmp_path, monkeypatch, setup, writes):
    """Header, facts and attachments are a write each; the first chunk comes after them."""
    disk, parts = Disk(monkeypatch), Parts(tmp_path, setup, Limits(free_bytes=0))
    disk.room = writes
    for _ in range(3):  # it tries again every second
        try:
            add(parts, 0)
        except OSError:
            parts.abandon()
    failed = [path for path in parts.files if RecordingReader([path]).n_axes != 1]
    assert not failed
    before = sorted(tmp_path.iterdir())
    assert before == parts.files  # no stub, and no draft
    disk.room = 1000
    add(parts, 700)
    parts.close({"reason": "test"})
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]
    assert parts.files[0].name.endswith("-000.mcap")
    reader = RecordingReader(all_parts(parts.files[0]))
    assert reader.read().rows["tick"][-1] == 1399
    assert not reader.left_out


def test_a_rig_name_of_a_stranger_names_no_other_folder(tmp_path, setup):
    evil = Setup({**setup.about, "rig": "../../evil\x1b/x"}, setup.attachments)
    parts = Parts(tmp_path, evil, Limits(free_bytes=0))
    add(parts, 0)
    parts.close({"reason": "test"})
    assert [path.parent for path in parts.files] == [tmp_path]
    assert "\x1b" not in parts.files[0].name


class Kept:
    broken = None
    state_broken = {"zero of the force": None}


def test_a_log_or_a_recording_that_breaks_is_told_once_each_time():
    record = RunRecord.__new__(RunRecord)
    record.flight, record.recorder = Kept(), Kept()
    said = []
    speaker = Speaker(lambda _kind, text, _grade: said.append(text))

    def new():
        said.clear()
        speaker.tell([], record.broken())
        return list(said)

    assert new() == []
    record.flight.broken = "events.jsonl: No space left on device"
    assert new() == [f"EVENT LOG BROKEN: events.jsonl: No space left on device; {REMEDY}"]
    assert new() == []
    record.recorder.broken, record.flight.broken = "x", None
    assert new() == ["event log: written again", f"RECORDING BROKEN: x; {REMEDY}"]
    record.flight.broken = "again"
    assert new() == [f"EVENT LOG BROKEN: again; {REMEDY}"]
    record.flight.state_broken = {"zero of the force": "full"}
    assert new() == [f"ZERO OF THE FORCE BROKEN: full; {REMEDY}"]
