import errno
import os
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from run_maker import run, setup

from rtctl.recording import mcap_file, parts, recorder
from rtctl.recording.limits import Limits
from rtctl.recording.overview import overview
from rtctl.recording.reader import RecordingReader
from rtctl.recording.recorder import Recorder

ROOM = Limits(free_bytes=0)


def feed(to, rows, commands, batch=20, first=0):
    for k in range(0, len(rows), batch):
        to.observe(first + k, rows[k : k + batch], [], commands if k == 0 else commands[:0])


def test_what_is_observed_is_on_disk_after_close(tmp_path):
    rows, commands = run()
    made = Recorder(tmp_path / "new", setup(), ROOM)
    feed(made, rows, commands)
    assert made.close("done")
    assert made.close("again")
    status = made.status()
    assert (status["ticks"], status["dropped"], status["broken"], status["queued"]) == (len(rows), 0, None, 0)
    found = overview(RecordingReader(made.files))
    assert (found["ticks"], found["lost"], found["replayable"]) == (len(rows), 0, True)
    assert found["ends"][made.files[0].name]["reason"] == "done"


@pytest.mark.parametrize("more", [20, 0], ids=["it goes on", "it ends there"])
def test_a_slow_disk_drops_ticks_but_never_holds_up_the_giver(tmp_path, monkeypatch, more):
    rows, commands = run()
    release, entered = threading.Event(), threading.Event()
    real = os.write

    def slow(fd, data):
        entered.set()
        release.wait(60)
        return real(fd, data)

    monkeypatch.setattr(mcap_file.os, "write", slow)
    made = Recorder(tmp_path, setup(), ROOM)
    made._most_rows = 1000
    made.observe(0, rows[:20], [{"event": "x", "tick": 0, "timestamp": 1.0}], commands[:1])
    assert entered.wait(60)
    for k in range(20, 2000, 20):
        late = [{"event": "late", "tick": k, "timestamp": 1.0}] if k == 1980 else []
        made.observe(k, rows[k : k + 20], late, commands[1:] if k == 1980 else commands[:0])
    dropped = made.status()["dropped"]
    assert 900 <= dropped <= 1020
    release.set()
    while made._queued:
        pass
    made.observe(2000, rows[2000 : 2000 + more], [], commands[:0])
    made.close()
    # of a run that ends there the last tick is kept, with what happened in it
    dropped -= more == 0
    assert made.status()["dropped"] == dropped
    found = overview(RecordingReader(made.files))
    assert found["ticks"] + dropped == 2000 + more
    assert found["lost"] == dropped
    assert found["events"] == {"x": 1, "late": 1}, "events outlive the ticks that were dropped"
    assert found["commands"] == len(commands)


def test_a_run_that_waits_for_its_disk_loses_nothing(tmp_path, monkeypatch):
    rows, commands = run()
    real = os.write

    def slow(fd, data):
        time.sleep(0.01)
        return real(fd, data)

    monkeypatch.setattr(mcap_file.os, "write", slow)
    made = Recorder(tmp_path, setup(), ROOM, wait=True)
    made._most_rows = 1000
    feed(made, rows, commands, batch=300)
    made.close()
    assert made.status()["dropped"] == 0
    assert overview(RecordingReader(made.files))["ticks"] == len(rows)


def test_a_power_cut_costs_two_seconds_at_most(tmp_path, monkeypatch):
    rows, commands = run()
    now, safe, real = [0.0], [], os.fdatasync

    def fdatasync(fd):
        real(fd)
        safe.append((now[0], str(Path(f"/proc/self/fd/{fd}").readlink()), os.fstat(fd).st_size))

    monkeypatch.setattr(mcap_file.os, "fdatasync", fdatasync)
    monkeypatch.setattr(mcap_file, "time", SimpleNamespace(monotonic=lambda: now[0]))
    made = parts.Parts(tmp_path, setup(), ROOM)
    for k in range(0, 4000, 20):
        now[0] = 1e-3 * k
        made.add(k, rows[k : k + 20], [], commands if k == 0 else commands[:0])
        kept = safe[-1][0] if safe else 0.0
        assert now[0] - kept < mcap_file.SYNC_S + 2 * parts.CHUNK_S
    assert {name for _, name, _ in safe} == {str(made.path)}, "under its own name, no draft's"
    assert len(safe) <= 4


def test_a_disk_that_refuses_what_it_had_taken_is_told(tmp_path, monkeypatch):
    def fdatasync(_fd):
        raise OSError(errno.EIO, "Input/output error")

    rows, commands = run()
    monkeypatch.setattr(mcap_file.os, "fdatasync", fdatasync)
    monkeypatch.setattr(mcap_file, "SYNC_S", 0.0)
    made = Recorder(tmp_path, setup(), ROOM, wait=True)
    feed(made, rows[:1100], commands)
    made.close()
    assert "Input/output error" in made.status()["broken"]


def test_a_full_disk_marks_the_recording_broken_and_a_new_file_follows(tmp_path, monkeypatch):
    rows, commands = run()
    full = [False]

    def statvfs(_path):
        return SimpleNamespace(f_bavail=0 if full[0] else 10**9, f_frsize=4096)

    monkeypatch.setattr(parts.os, "statvfs", statvfs)
    monkeypatch.setattr(recorder, "RETRY_S", 0.0)
    made = Recorder(tmp_path, setup(), Limits(), wait=True)
    made._most_rows = 20  # one batch at a time
    feed(made, rows[:1100], commands)
    full[0] = True
    feed(made, rows[1100:1800], commands[:0], first=1100)
    full[0] = False
    feed(made, rows[1800:], commands[:0], first=1800)
    made.close()
    status = made.status()
    assert "less than 200 MB would be left on the disk" in status["broken"]  # as docs/recording.md says it
    assert status["files"] == 2
    assert status["dropped"] > 0
    found = overview(RecordingReader(made.files))
    assert found["ticks"] == status["ticks"] == len(rows) - status["dropped"]
    assert found["lost"] == status["dropped"]
    assert found["ends"][made.files[1].name]["broken"] == status["broken"]


def test_a_folder_that_cannot_be_made_costs_the_recording_only(tmp_path):
    (tmp_path / "file").write_text("")
    rows, commands = run()
    made = Recorder(tmp_path / "file" / "folder", setup(), ROOM)
    feed(made, rows, commands)
    made.close()
    assert made.status()["dropped"] == len(rows)
    assert "file" in made.status()["broken"]


@pytest.mark.parametrize("event", [{"event": "fault"}, {"timestamp": 1.0, "event": object()}])
def test_an_event_that_cannot_be_recorded_is_told_and_what_comes_after_it_is_kept(
    tmp_path, monkeypatch, event
):
    monkeypatch.setattr(recorder, "RETRY_S", 0.0)
    rows, commands = run()
    made = Recorder(tmp_path, setup(), ROOM, wait=True)
    made.observe(0, rows[:20], [event], commands)
    feed(made, rows[20:], commands[:0], first=20)
    assert made.close()
    status = made.status()
    assert "cannot be recorded" in status["broken"]
    assert (status["dropped"], status["ticks"]) == (20, len(rows) - 20)


def test_a_disk_that_is_really_full(tmp_path):
    """A limit on the size of files: the write fails in the middle of a chunk, as on a full disk."""
    import subprocess
    import sys
    from pathlib import Path

    code = (
        "import resource, signal, sys; sys.path[:0] = sys.argv[2:]\n"
        "from pathlib import Path; from run_maker import run, setup\n"
        "from rtctl.recording.recorder import Recorder; from rtctl.recording.limits import Limits\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "rows, commands = run(); r = Recorder(Path(sys.argv[1]), setup(), Limits(free_bytes=0))\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, 150_000))\n"
        "[r.observe(k, rows[k:k+20], [], commands if k == 0 else commands[:0]) for k in range(0, "
        "len(rows), 20)]\n"
        "r.close(); s = r.status(); print(s['broken']); print(s['ticks'], s['dropped'], len(rows))"
    )
    folder = str(Path(__file__).parent)
    out = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path), folder, *sys.path],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert out.returncode == 0, out.stderr
    broken, counts = out.stdout.splitlines()
    ticks, dropped, total = map(int, counts.split())
    assert "File too large" in broken
    assert 0 < ticks < total
    assert ticks + dropped == total
    reader = RecordingReader(sorted(tmp_path.glob("*.mcap"))[:1])
    assert 0 < len(reader.read().rows) <= ticks
    assert errno.EFBIG


@pytest.mark.parametrize("wait", [False, True])
def test_an_end_without_a_tick_leaves_no_file(tmp_path, wait):
    made = Recorder(tmp_path, setup(), ROOM, wait=wait)
    made.close()
    assert list(tmp_path.iterdir()) == []
