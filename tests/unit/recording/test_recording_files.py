import contextlib
import errno
import os
from pathlib import Path

import numpy as np
import pytest
from run_maker import run, setup, write

from rtctl.errors import DataError
from rtctl.recording import mcap_file
from rtctl.recording.limits import Limits
from rtctl.recording.overview import overview
from rtctl.recording.reader import RecordingReader, all_parts, with_earlier_parts


def unsealed(rows):
    rows = rows.copy()
    rows["seal"] = 0
    return rows


FORMS = {"rows": "1000.0", "columns": "10000.0"}
"""Rate that a recording says, by the form that its ticks have then."""


@pytest.fixture(scope="module", params=FORMS)
def whole(tmp_path_factory, request):
    rows, commands = run()
    folder = tmp_path_factory.mktemp("whole")
    made = setup(rate_hz=FORMS[request.param])
    parts = write(folder, rows, commands, made, events=[{"event": "state", "tick": 5, "timestamp": 1e9}])
    return parts.files[0], rows, commands


def test_everything_comes_back_bit_for_bit(whole):
    path, rows, commands = whole
    reader = RecordingReader([path])
    found = reader.read()
    assert found.rows.tobytes() == unsealed(rows).tobytes()
    assert found.commands.tobytes() == commands.tobytes()
    assert found.numbers.tolist() == list(range(len(rows)))
    assert found.events == [{"event": "state", "tick": 5, "timestamp": 1e9}]
    made = setup()
    law = reader.law()
    told = {k: v for k, v in made.about.items() if k not in ("began_wall_ns", "rate_hz")}
    assert reader.about.items() >= told.items()
    assert set(reader.attachments) == {"law.npz", "rig.toml", "model-joint.json"}
    assert law.params["torque_limit_nm"] == 2.0
    assert law.state is None
    assert reader.cut == []
    assert reader.ends[path] == {"reason": "test"}


def test_an_independent_reader_accepts_the_file_with_all_its_checksums(whole):
    from mcap.reader import NonSeekingReader, make_reader

    path, rows, _ = whole
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        ticks = list(reader.iter_messages(topics=["rtctl/tick"]))
        assert {channel.topic for channel in summary.channels.values()} >= {"rtctl/tick", "rtctl/event"}
        encodings = {schema.name: schema.encoding for schema in summary.schemas.values()}
        assert encodings.pop("rtctl_msgs/msg/Tick") == "ros2msg"
        columns = encodings.pop("rtctl_msgs/msg/TickColumns", None)
        assert encodings.pop("rtctl_msgs/msg/LawState", None) == columns
        assert set(encodings.values()) == {"jsonschema"}
        assert {m.name for m in reader.iter_metadata()} == {"rtctl", "rtctl.end"}
        assert {a.name for a in reader.iter_attachments()} == {"law.npz", "rig.toml", "model-joint.json"}
    assert len(ticks) == summary.statistics.channel_message_counts[1]
    numbers = [message.sequence for _, _, message in ticks]
    if columns:
        assert set(range(0, len(rows), 100)) <= set(numbers)
        assert len(numbers) < len(rows) / 50
    else:
        assert numbers == list(range(len(rows)))
    for _, _, message in ticks[:: len(ticks) // 7]:
        assert message.log_time == message.publish_time == rows["time_ns"][message.sequence] + 10**18
    with path.open("rb") as file:
        assert sum(1 for _ in NonSeekingReader(file, validate_crcs=True).iter_messages()) > len(ticks)


def chunk_ends(path):
    """Where each chunk's record ends, by the independent library's index."""
    from mcap.reader import make_reader

    with path.open("rb") as file:
        index = make_reader(file).get_summary().chunk_indexes
    return [(i.chunk_start_offset + i.chunk_length) for i in index]


def test_a_file_cut_at_any_byte_gives_back_every_whole_chunk(whole, tmp_path):
    path, rows, _ = whole
    data, ends = path.read_bytes(), chunk_ends(path)
    per_chunk = np.cumsum([0, *(len(b.rows) for b in RecordingReader([path]).batches())])
    random = np.random.default_rng(7)
    cuts = [
        *random.integers(ends[0], len(data), 60),
        *(e + d for e in ends for d in (-1, 0, 1)),
        len(data) - 1,
    ]
    for cut in cuts:
        part = tmp_path / "cut.mcap"
        part.write_bytes(data[:cut])
        reader = RecordingReader([part])
        found = reader.read()
        chunks = sum(end <= cut for end in ends)
        assert len(found.rows) == per_chunk[chunks], cut
        assert found.rows.tobytes() == unsealed(rows[: len(found.rows)]).tobytes()
        assert reader.cut == [part]


def test_a_file_cut_before_its_first_chunk_is_named_or_empty(whole, tmp_path):
    path, _, _ = whole
    data, first = path.read_bytes(), chunk_ends(path)[0]
    for cut in [0, 1, 7, 8, 20, 100, *np.random.default_rng(3).integers(0, first, 30)]:
        part = tmp_path / "cut.mcap"
        part.write_bytes(data[:cut])
        with contextlib.suppress(DataError):
            assert len(RecordingReader([part]).read().rows) == 0


def test_a_damaged_chunk_is_left_out_and_counted(whole, tmp_path):
    path, rows, _ = whole
    data, ends = bytearray(path.read_bytes()), chunk_ends(path)
    data[ends[1] - 100] ^= 0xFF
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(data)
    found = overview(RecordingReader([bad]))
    assert found["bad_chunks"] == 1
    assert found["lost"] == len(rows) - found["ticks"] > 0


def test_infinities_and_unusual_nans_are_kept_exactly(tmp_path):
    rows, commands = run()
    rows, commands = rows[:200].copy(), commands.copy()
    rows["position_rad"][50], rows["force_n"][60, 1], rows["current_a"][70] = np.inf, -np.inf, np.nan
    words = rows.view(np.uint64).reshape(len(rows), -1)
    words[80, rows.dtype.fields["velocity_rad_s"][1] // 8] = 0xFFF8000000000123
    commands["target_position_rad"][0] = np.nan
    commands["program_min_rad"][0] = -np.inf
    found = RecordingReader(write(tmp_path, rows, commands).files).read()
    assert found.rows.tobytes() == unsealed(rows).tobytes()
    assert found.commands.tobytes() == commands[commands["seq"] <= rows["command_seq"].max()].tobytes()


def test_files_rotate_by_size_and_by_time_and_read_as_one(tmp_path):
    rows, commands = run()
    for limits in (Limits(file_bytes=100_000, free_bytes=0), Limits(file_s=0.6, free_bytes=0)):
        folder = tmp_path / str(limits.file_bytes)
        files = write(folder, rows, commands, limits=limits).files
        assert len(files) >= 3
        assert all_parts(files[1]) == files
        assert with_earlier_parts(files[1]) == files[:2]
        reader = RecordingReader(files)
        assert reader.read().rows.tobytes() == unsealed(rows).tobytes()
        assert reader.cut == []
        later = RecordingReader(files[2:3])
        assert not later.from_start
        assert later.read().commands["seq"][0] <= later.read().rows["command_seq"][0], (
            "what was in force is said again"
        )


def test_a_name_that_ends_with_a_date_is_one_file(tmp_path, monkeypatch):
    named, original = [], Path.with_name
    monkeypatch.setattr(Path, "with_name", lambda path, name: named.append(name) or original(path, name))
    file = tmp_path / "rig-110827.mcap"
    file.touch()
    assert with_earlier_parts(file) == [file]
    assert len(named) == 1


def test_parts_of_two_runs_are_not_mixed(tmp_path):
    rows, commands = run()
    one = write(tmp_path / "a", rows[:100], commands).files
    two = write(tmp_path / "b", rows[:100], commands, setup(session="8")).files
    with pytest.raises(DataError, match="another run"):
        RecordingReader([*one, *two]).read()


def test_lost_ticks_are_counted_apart_from_missed_slots(tmp_path):
    from rtctl.recording.parts import Parts

    rows, commands = run()
    rows = rows[:300].copy()
    rows["tick"][200:] += 5  # the loop missed five slots
    parts = Parts(tmp_path, setup(), Limits(free_bytes=0))
    parts.add(0, rows[:100], [], commands[:1])
    parts.add(150, rows[150:], [], commands[:0])  # fifty ticks never came
    parts.close({})
    found = overview(RecordingReader(parts.files))
    assert (found["ticks"], found["lost"], found["missed"]) == (250, 50, 5)


def test_a_write_that_fails_takes_its_half_chunk_back(tmp_path, monkeypatch):
    rows, commands = run()
    parts = write(tmp_path, rows[:1200], commands, end=False)
    real, calls = os.write, []

    def full(fd, data):
        if not calls:
            calls.append(1)
            return real(fd, data[:1000])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(mcap_file.os, "write", full)
    with pytest.raises(OSError, match="No space"):
        parts.add(1200, rows[1200:2000], [], commands[:0])
    monkeypatch.undo()
    reader = RecordingReader(parts.files)
    found = reader.read()
    assert 0 < len(found.rows) <= 1200
    assert found.rows.tobytes() == unsealed(rows[: len(found.rows)]).tobytes()
    parts.add(2000, rows[2000:2500], [], commands[:0])
    parts.close({})
    assert len(parts.files) == 2
    assert len(RecordingReader(parts.files).read().rows) == len(found.rows) + 500


@pytest.mark.parametrize("content", [b"", b"no mcap", b"\x89MCAP0\r\n", b"\x89MCAP0\r\n" + bytes(100)])
def test_other_files_are_refused_by_name(tmp_path, content):
    path = tmp_path / "other.mcap"
    path.write_bytes(content)
    with pytest.raises(DataError, match=r"other\.mcap"):
        RecordingReader([path])
    with pytest.raises(DataError, match="missing"):
        RecordingReader([tmp_path / "missing.mcap"])


@pytest.mark.parametrize("motion", ['["rotary"', '["lineaR"]', '["rotary", "rotary"]', "7", '"rotary"'])
def test_a_motion_that_is_damaged_is_told_and_what_is_taken_in_its_place(tmp_path, motion):
    rows, commands = run()
    reader = RecordingReader(write(tmp_path, rows, commands, setup(motion=motion)).files)
    assert reader.motions == ["rotary"]
    (note,) = reader.notes
    assert "motion is" in note
    assert overview(reader)["damaged"] == [note]
