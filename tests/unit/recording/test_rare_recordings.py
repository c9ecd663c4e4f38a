"""What happens to a recording once in a year: clocks before 1970, a thousand parts, two recorders at once, a
disk that hangs at the end, and files of strangers that unpack to gigabytes."""

import errno
import io
import json
import os
import struct
import threading
import tracemalloc
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from mcap.reader import make_reader
from run_maker import run, setup, write

from rtctl.bounded_npz import read_arrays
from rtctl.check.law_plan import build
from rtctl.control.records import command_dtype
from rtctl.errors import DataError
from rtctl.recording import as_columns, mcap_file, parts, recorder
from rtctl.recording.incident import read_incident
from rtctl.recording.limits import Limits
from rtctl.recording.mcap_format import Op
from rtctl.recording.overview import overview
from rtctl.recording.parts import Parts
from rtctl.recording.reader import RecordingReader, all_parts, with_earlier_parts
from rtctl.recording.recorder import Recorder
from rtctl.recording.replay import Replay
from rtctl.recording.setup import RIG_NAME, setup_of
from rtctl.rig_file.config import load
from rtctl.simulation.shipped_files import write_copy
from rtctl.tick import new_ticks

ROOM = Limits(free_bytes=0)


def ticks(seconds=2.0):
    """Ticks that no law has made, and the command in force: what the files are asked here is not about
    laws."""
    rows = new_ticks(round(seconds * 1000), 1)
    rows["tick"] = np.arange(len(rows))
    rows["time_ns"], rows["command_seq"] = rows["tick"] * 1_000_000, 1
    commands = np.zeros(1, command_dtype(1))
    commands["seq"] = 1
    return rows, commands


def two_processes(monkeypatch):
    """Each recording believes to be in a process of its own."""
    pids = iter(range(100, 200))
    monkeypatch.setattr(parts, "os", SimpleNamespace(getpid=lambda: next(pids), statvfs=parts.os.statvfs))


@pytest.mark.parametrize(
    ("started_ns", "event_s"), [(-5 * 10**12, 1.0), (10**18, -1.0), (10**18, np.inf), (10**18, 1e300)]
)
def test_times_that_no_file_can_have_do_not_end_the_recorder_unheard(
    tmp_path, monkeypatch, started_ns, event_s
):
    monkeypatch.setattr(recorder, "RETRY_S", 0.0)
    rows, commands = ticks()
    made = Recorder(tmp_path, setup(start_wall_ns=str(started_ns)), ROOM, wait=True)
    made.observe(0, rows[:20], [{"event": "x", "tick": 0, "timestamp": event_s}], commands)
    made.observe(20, rows[20:], [], commands[:0])
    assert made.close()
    status = made.status()
    kept = len(rows) if event_s < 10 else len(rows) - 20
    assert (status["ticks"], status["dropped"]) == (kept, len(rows) - kept)
    assert bool(status["broken"]) == (kept < len(rows))
    assert len(RecordingReader(made.files).read().rows) == kept


def test_a_disk_that_hangs_at_the_end_is_no_success(tmp_path, monkeypatch):
    rows, commands = ticks()
    release, real = threading.Event(), mcap_file.os.write
    monkeypatch.setattr(mcap_file.os, "write", lambda fd, data: release.wait(60) and real(fd, data))
    monkeypatch.setattr(recorder, "END_S", 0.05)
    made = Recorder(tmp_path, setup(), ROOM)
    made.observe(0, rows, [], commands)
    try:
        assert not made.close()
        assert "at the end" in made.status()["broken"]
        # the daemon asks once more on its way out, and is not to wait as long again
        asked = []
        with monkeypatch.context() as patch:
            patch.setattr(made._thread, "join", asked.append)
            assert not made.close()
        assert asked == [0.0]
    finally:
        release.set()
        made._thread.join(60)


@pytest.mark.parametrize("step", ["unlink", "close"])
def test_a_disk_that_becomes_read_only_does_not_end_the_recorder_unheard(tmp_path, monkeypatch, step):
    refused = [True]
    write, close, unlink = mcap_file.os.write, mcap_file.os.close, Path.unlink

    def refuse(done, mine=lambda *_arguments: True):
        def call(*arguments, **options):
            if refused[0] and mine(*arguments):
                raise OSError(errno.EROFS, "Read-only file system")
            return done(*arguments, **options)

        return call

    def draft(path):
        return path.name.endswith(".draft") and path.exists()

    fake = SimpleNamespace(**vars(os))
    fake.write = refuse(write, lambda _fd, data: bytes(data[:1]) == bytes([Op.CHUNK]))
    fake.close = refuse(close) if step == "close" else close
    monkeypatch.setattr(mcap_file, "os", fake)
    monkeypatch.setattr(Path, "unlink", refuse(unlink, draft) if step == "unlink" else unlink)
    monkeypatch.setattr(recorder, "RETRY_S", 0.0)
    rows, commands = ticks()
    made = Recorder(tmp_path, setup(), ROOM, wait=True)
    made._most_rows = 1000  # one batch at a time
    made.observe(0, rows[:1000], [], commands)
    with made._change:
        made._change.wait_for(lambda: made._queued == 0, 60)
    refused[0] = False
    made.observe(1000, rows[1000:], [], commands[:0])
    assert made.close()
    status = made.status()
    assert "Read-only" in status["broken"]
    assert (status["ticks"], status["dropped"]) == (1000, 1000)


def test_a_chunk_that_is_on_the_disk_is_not_counted_as_dropped_for_its_summary(tmp_path, monkeypatch):
    def full(*_args):
        raise OSError(28, "No space left on device")

    rows, commands = ticks()
    monkeypatch.setattr(mcap_file.McapFile, "close", full)
    made = Recorder(tmp_path, setup(), ROOM)
    made.observe(0, rows[:20], [], commands)
    made.close()
    status = made.status()
    assert (status["ticks"], status["dropped"]) == (20, 0)
    assert "No space" in status["broken"]


def test_two_recordings_of_a_session_are_not_parts_of_each_other(tmp_path):
    rows, commands = ticks()
    made = setup()
    one = write(tmp_path, rows[:300], commands, made).files
    two = write(tmp_path, rows, commands, made, limits=Limits(file_s=0.6, free_bytes=0)).files
    assert (len(one), len(two)) == (1, 2)
    assert all_parts(one[0]) == one
    assert all_parts(two[1]) == two
    assert overview(RecordingReader(all_parts(two[0])))["ticks"] == len(rows)


def test_of_two_that_begin_at_once_neither_takes_the_others_file_away(tmp_path, monkeypatch):
    two_processes(monkeypatch)
    rows, commands = ticks()
    made = setup()
    both = [Parts(tmp_path, made, ROOM) for _ in range(2)]
    for one in both:  # both have a draft before either has a chunk
        one.add(0, rows[:20], [], commands)
    for one in both:
        one.close({})
    files = [one.files[0] for one in both]
    assert len(set(files)) == 2
    assert [len(RecordingReader([file]).read().rows) for file in files] == [20, 20]


def test_the_part_before_the_thousandth_is_found(tmp_path):
    names = [f"rig-{number:03d}.mcap" for number in range(1002)]
    for name in names:
        (tmp_path / name).touch()
    for number in (0, 999, 1000, 1001):
        assert [path.name for path in all_parts(tmp_path / names[number])] == names
        found = [path.name for path in with_earlier_parts(tmp_path / names[number])]
        assert found == names[: number + 1]


def test_a_first_chunk_that_is_damaged_is_a_loss_and_not_another_law(tmp_path):
    rows, commands = run(seconds=0.1)
    (file,) = write(tmp_path, rows, commands).files
    with file.open("rb") as stream:
        first = make_reader(stream).get_summary().chunk_indexes[0]
    data = bytearray(file.read_bytes())
    data[first.chunk_start_offset + first.chunk_length - 10] ^= 1
    file.write_bytes(data)
    verdict = Replay(RecordingReader([file])).check()
    assert (verdict.ticks, verdict.first, verdict.differing) == (0, None, {})
    assert "missing" in verdict.stopped


def test_an_array_that_unpacks_to_more_than_its_head_says_is_not_unpacked():
    size, packed = 64 << 20, io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.npy", bytes(size))
    bomb = packed.getvalue().replace(struct.pack("<I", size), struct.pack("<I", 128))
    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match=r"a\.npy"):
            read_arrays(io.BytesIO(bomb), 1 << 20)
        assert tracemalloc.get_traced_memory()[1] < size / 8
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_an_array_that_is_packed_otherwise_than_numpy_does_is_refused(method):
    plain, packed = io.BytesIO(), io.BytesIO()
    np.save(plain, np.zeros(3))
    with zipfile.ZipFile(packed, "w", method) as archive:
        archive.writestr("a.npy", plain.getvalue())
    with pytest.raises(ValueError, match="packed by method"):
        read_arrays(packed, 1 << 20)


def test_an_incident_whose_ticks_would_not_fit_is_refused(tmp_path):
    path, body = tmp_path / "bomb.npz", {"trigger": {}, "events": [], "about": {}}
    columns = {"tick": np.zeros(200_000, np.uint8), "position_rad": np.zeros((0, 8))}
    np.savez_compressed(path, incident=np.array(json.dumps(body)), **columns)
    with pytest.raises(DataError, match="200000 ticks"):
        read_incident(path)


def test_a_topic_of_two_channels_is_read_whole_and_in_order(tmp_path):
    from mcap.writer import Writer
    from test_joint_states import SCHEMA, message

    path = tmp_path / "merged_0.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="test")
        kind = writer.register_schema(SCHEMA, "ros2msg", b"")
        channels = [writer.register_channel("/joint_states", "cdr", kind) for _ in range(2)]
        for k in (1, 0, 3, 2):
            writer.add_message(channels[k % 2], k * 10**6, message(k), k * 10**6)
        writer.finish()
    as_columns.register()
    found = as_columns.read(path)
    assert found["/joint_states/elbow/position"].tolist() == [0.0, 1.0, 2.0, 3.0]


def test_a_rig_file_that_was_edited_since_it_was_read_is_not_recorded_as_what_ran(tmp_path):
    write_copy("mock.toml", path := tmp_path / "mine.toml", "mine")
    loaded = load(path)
    plan = build(loaded)
    assert RIG_NAME in setup_of(loaded, plan, 7, 10**18).attachments
    path.write_text(path.read_text() + "# edited while the first start compiled\n")
    assert RIG_NAME not in setup_of(loaded, plan, 7, 10**18).attachments
