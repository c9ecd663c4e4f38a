import errno
import json
import os
import threading

import pytest

from rtctl.recording import event_log
from rtctl.recording.event_log import CURRENT, EventLog, follow, log_files, read_events


def event(k, **more):
    return {
        "timestamp": 1e9 + k,
        "monotonic_s": float(k),
        "session": 1,
        "tick": k,
        "epoch": 0,
        "event": "x",
        **more,
    }


def ticks(events):
    return [found["tick"] for found in events]


def test_events_come_back_in_order_over_two_runs(tmp_path):
    for first in (0, 3):
        log = EventLog(tmp_path / "new" / "rig")
        log.append([event(k) for k in range(first, first + 3)])
        log.close()
    events, torn = read_events(tmp_path / "new" / "rig")
    assert (ticks(events), torn) == ([0, 1, 2, 3, 4, 5], 0)
    assert ticks(read_events(tmp_path / "new" / "rig", last=2)[0]) == [4, 5]
    assert read_events(tmp_path / "new" / "rig", last=0)[0] == []


def test_rotation_bounds_the_size_and_keeps_the_newest(tmp_path):
    log = EventLog(tmp_path, max_bytes=1000)
    for k in range(200):
        log.append([event(k)])
    log.close()
    files = log_files(tmp_path)
    assert len(files) == event_log.KEPT_FILES
    assert all(path.stat().st_size <= 1000 for path in files)
    found = ticks(read_events(tmp_path)[0])
    assert found == list(range(found[0], 200))
    assert len(found) > 20


@pytest.mark.parametrize("cut", [1, 10, 60])
def test_a_line_cut_off_by_a_crash_costs_only_itself(tmp_path, cut):
    log = EventLog(tmp_path)
    log.append([event(0), event(1)])
    log.close()
    path = tmp_path / CURRENT
    os.truncate(path, path.stat().st_size - cut)
    log = EventLog(tmp_path)
    log.append([event(2)])
    log.close()
    events, torn = read_events(tmp_path)
    assert ticks(events) == ([0, 1, 2] if cut == 1 else [0, 2])  # cut 1: only the line's end is missing
    assert torn == (0 if cut == 1 else 1)
    assert path.read_bytes().endswith(b"\n")


def test_a_full_disk_breaks_the_log_leaves_no_half_line_and_heals(tmp_path, monkeypatch):
    log = EventLog(tmp_path)
    log.append([event(0)])
    size = (tmp_path / CURRENT).stat().st_size
    real, full, room = os.write, [True], [25]

    def write(fd, data):
        if not full[0]:
            return real(fd, data)
        if not room[0]:
            room[0] = 25  # the half line is taken back
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        done, room[0] = real(fd, data[: room[0]]), 0
        return done

    monkeypatch.setattr(event_log.os, "write", write)
    for k in range(1, 4):
        log.append([event(k)])
        assert "No space left" in log.broken
        assert (tmp_path / CURRENT).stat().st_size == size
    assert (log.written, log.dropped) == (1, 3)
    full[0] = False
    log.append([event(4)])
    assert (log.broken, log.written, log.dropped) == (None, 2, 3)
    log.close()
    events, torn = read_events(tmp_path)
    assert torn == 0
    assert [(e["event"], e.get("lost")) for e in events] == [("x", None), ("log_gap", 3), ("x", None)]


def test_a_folder_that_cannot_be_made_breaks_the_log_only(tmp_path):
    (tmp_path / "file").write_text("")
    log = EventLog(tmp_path / "file" / "rig")
    log.append([event(0)])
    assert log.dropped == 1
    assert "file" in log.broken


def test_follow_sees_new_events_across_a_rotation(tmp_path):
    log = EventLog(tmp_path, max_bytes=400)
    log.append([event(0)])
    stream = follow(tmp_path, poll_s=0.01)
    got = []

    def read():
        got.extend(next(stream)["tick"] for _ in range(8))

    reader = threading.Thread(target=read, daemon=True)
    seen = threading.Event()
    original = event_log.time.sleep

    def sleep(seconds):
        seen.set()
        original(seconds)

    event_log.time.sleep, saved = sleep, event_log.time.sleep
    try:
        reader.start()
        for k in range(1, 9):
            seen.clear()
            assert seen.wait(60)  # the reader has caught up and waits
            log.append([event(k)])
        reader.join(60)
    finally:
        event_log.time.sleep = saved
    assert got == list(range(1, 9))


def test_a_rotation_while_the_files_are_read_hides_no_event(tmp_path, monkeypatch):
    log = EventLog(tmp_path, max_bytes=200)
    for k in range(6):
        log.append([event(k)])
    before, original = ticks(read_events(tmp_path)[0]), event_log.opened
    assert len(log_files(tmp_path)) > 2
    looked = []

    def then_rotated(path, **more):
        looked.append(path)
        if len(looked) == 2:
            log.append([event(6)] * 3)
        return original(path, **more)

    monkeypatch.setattr(event_log, "opened", then_rotated)
    assert ticks(read_events(tmp_path)[0]) == before


def test_follow_begins_when_it_is_asked_for(tmp_path, monkeypatch):
    log = EventLog(tmp_path)
    log.append([event(0)])
    stream = follow(tmp_path)
    log.append([event(1)])
    monkeypatch.setattr(event_log.time, "sleep", lambda _: pytest.fail("it saw nothing"))
    assert next(stream)["tick"] == 1


def test_follow_reads_what_came_last_before_a_rotation(tmp_path, monkeypatch):
    log = EventLog(tmp_path, max_bytes=200)
    log.append([event(0)])
    original, coming = event_log._replaced, [1, 2, 3]

    def replaced(path, file):
        while coming:
            log.append([event(coming.pop(0))])
        return original(path, file)

    monkeypatch.setattr(event_log, "_replaced", replaced)
    monkeypatch.setattr(event_log.time, "sleep", lambda _: pytest.fail("it saw no more"))
    stream = follow(tmp_path)
    assert [next(stream)["tick"] for _ in range(3)] == [1, 2, 3]


def test_lines_that_are_no_objects_are_not_events(tmp_path):
    (tmp_path / CURRENT).write_bytes(
        b'{"tick": 1}\n\xff\xfe\n[1]\n' + json.dumps({"tick": 2}).encode() + b"\n"
    )
    events, torn = read_events(tmp_path)
    assert (ticks(events), torn) == ([1, 2], 1)


def test_follow_waits_for_a_log_that_is_not_there_yet_and_goes_on_where_it_was_taken_away(tmp_path):
    waits = []

    def sleep(_seconds):
        waits.append(1)
        if len(waits) == 3:
            EventLog(tmp_path).append([event(5)])
        if len(waits) == 6:
            (tmp_path / CURRENT).unlink()
        if len(waits) == 9:
            EventLog(tmp_path).append([event(6)])

    event_log.time.sleep, saved = sleep, event_log.time.sleep
    try:
        stream = follow(tmp_path)
        assert [next(stream)["tick"] for _ in range(2)] == [5, 6]
    finally:
        event_log.time.sleep = saved


def test_follow_goes_on_where_the_log_is_taken_away_before_it_is_opened(tmp_path, monkeypatch):
    stream, real = follow(tmp_path), event_log._replaced

    def replaced(path, file):
        found = real(path, file)
        if found and coming:
            path.unlink()
        return found

    coming = [1, 2]
    monkeypatch.setattr(event_log, "_replaced", replaced)
    monkeypatch.setattr(event_log.time, "sleep", lambda _: EventLog(tmp_path).append([event(coming.pop())]))
    assert next(stream)["tick"] == 1


def test_a_number_that_is_none_is_null(tmp_path):
    log = EventLog(tmp_path)
    log.append([event(0, gain=float("nan"), axes=[{"delay_s": float("inf")}])])
    log.close()
    ((found,), torn) = read_events(tmp_path)
    assert (found["gain"], found["axes"], torn) == (None, [{"delay_s": None}], 0)


def test_a_disk_that_refuses_to_close_the_log_raises_nothing(tmp_path, monkeypatch):
    real, refused = event_log.os.close, []

    def close(fd):
        real(fd)
        refused.append(fd)
        raise OSError(5, "Input/output error")

    log = EventLog(tmp_path, max_bytes=200)
    log.append([{"event": "x", "n": 0}])
    with monkeypatch.context() as patched:
        patched.setattr(event_log.os, "close", close)
        for n in range(1, 20):  # over several rotations
            log.append([{"event": "x", "n": n}])
        log.close()
    assert len(refused) >= 2
    log.append([{"event": "x", "n": 20}])
    log.close()
    log.close()
    assert log.written == 21
    assert [event["n"] for event in read_events(tmp_path)[0]][-1] == 20
