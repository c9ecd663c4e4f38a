import errno
import math
import threading
from pathlib import Path

import numpy as np
import pytest
from patience import PATIENCE_S, until

from rtctl.cli.events import line
from rtctl.control.vocabulary import Fault, State
from rtctl.errors import LoopDiedError
from rtctl.host import flight_recorder
from rtctl.host.exchange.rig_description import AxisDescription, RigDescription
from rtctl.host.flight_recorder import FlightRecorder
from rtctl.recording import event_log
from rtctl.recording.event_log import read_events
from rtctl.recording.incident import read_incident
from rtctl.tick import new_ticks

RIG = RigDescription(
    "mock", (AxisDescription("a", {}),), 1000.0, session=7, virtual=True, start_wall_ns=10**18
)


@pytest.fixture(autouse=True)
def _patient(monkeypatch):
    """A disk that is only busy is waited for."""
    monkeypatch.setattr(flight_recorder, "END_S", PATIENCE_S)


def rows(first, n, state=State.ACTIVE, fault=0):
    out = new_ticks(n, 1)
    out["tick"] = np.arange(first, first + n)
    out["time_ns"], out["state"], out["faults"] = out["tick"] * 1_000_000, state, int(fault)
    out["fault_first"] = int(fault).bit_length() - 1
    return out


def test_each_transition_and_fault_is_logged_once_with_tick_and_both_times(tmp_path):
    recorder = FlightRecorder(tmp_path, RIG)
    recorder.observe(rows(0, 300))
    recorder.observe(rows(300, 300, State.FAULT, Fault.JUMP))
    recorder.observe(rows(600, 300, State.IDLE))
    recorder.close()
    recorder.close()
    events, torn = read_events(tmp_path)
    kinds = [(e["event"], e["tick"]) for e in events if e["event"] != "incident"]
    assert torn == 0
    assert kinds == [
        ("started", -1), ("state", 0), ("fault", 300), ("state", 300), ("fault_cleared", 600), ("state", 600),
        ("ended", 899),
    ]  # fmt: skip
    fault = next(e for e in events if e["event"] == "state" and e["to"] == "FAULT")
    assert (fault["monotonic_s"], fault["cause"]) == (pytest.approx(0.3), "JUMP")
    assert fault["timestamp"] == pytest.approx(1e9 + 0.3)
    assert [e["sequence"] for e in events if "sequence" in e] == list(range(5))
    (incident,) = [e for e in events if e["event"] == "incident"]
    assert len(read_incident(Path(incident["file"])).ticks) == 251
    status = recorder.status()
    assert (status["broken"], status["written"], status["dropped"], status["incidents"]) == (None, 8, 0, 1)


def test_a_disk_that_hangs_never_holds_up_the_host(tmp_path, monkeypatch):
    release, entered = threading.Event(), threading.Event()

    def hang(_fd):
        entered.set()
        assert release.wait(PATIENCE_S)

    monkeypatch.setattr(event_log.os, "fdatasync", hang)
    monkeypatch.setattr(flight_recorder, "END_S", 0.01)
    recorder = FlightRecorder(tmp_path, RIG)
    assert entered.wait(PATIENCE_S)
    for k in range(2000):
        recorder.observe(rows(k, 1, State.IDLE if k % 2 else State.ACTIVE))
    assert recorder.status()["dropped"] > 1000
    assert recorder.status()["dropped"] <= 2000
    recorder.close()
    release.set()
    monkeypatch.setattr(flight_recorder, "END_S", PATIENCE_S)
    recorder.close()
    assert not recorder._thread.is_alive()


def test_a_missing_folder_is_told_and_nothing_else_happens(tmp_path):
    (tmp_path / "file").write_text("")
    recorder = FlightRecorder(tmp_path / "file" / "rig", RIG)
    recorder.observe(rows(0, 300))
    recorder.observe(rows(300, 300, State.FAULT, Fault.JUMP))
    recorder.close()
    status = recorder.status()
    assert "file" in status["broken"]
    assert (status["written"], status["incidents"], status["incidents_lost"]) == (0, 0, 1)
    assert status["dropped"] == 5


def test_incidents_that_a_full_disk_refused_are_written_once_there_is_room(tmp_path, monkeypatch):
    monkeypatch.setattr(flight_recorder, "RETRY_S", 0.01)
    full = tmp_path / "incidents"
    full.write_text("a file where the folder of incidents belongs: nothing can be written there")
    recorder, faults = FlightRecorder(tmp_path, RIG), flight_recorder.MOST_UNWRITTEN + 2
    for k in range(faults):
        recorder.observe(rows(800 * k, 400))
        recorder.observe(rows(800 * k + 400, 400, State.FAULT, Fault.JUMP))
    until(lambda: recorder.status()["incidents_lost"] == faults)
    assert recorder.broken
    full.unlink()
    until(lambda: recorder.status()["incidents_lost"] == 2, "the newest of them")
    recorder.close()
    assert (recorder.broken, recorder.status()["incidents"]) == (None, flight_recorder.MOST_UNWRITTEN)
    told = [Path(e["file"]) for e in read_events(tmp_path)[0] if e["event"] == "incident"]
    assert [int(read_incident(path).trigger["tick"]) for path in told] == [
        800 * k + 400 for k in range(2, faults)
    ]


def test_a_disk_that_fills_up_for_real(tmp_path):
    """A limit on the size of files stands for the end of the disk: writes fail in the middle of a line."""
    import resource
    import subprocess
    import sys

    code = (
        "import resource, signal, sys; sys.path[:0] = sys.argv[2:];"
        "sys.dont_write_bytecode = True;"  # it would be cut off, too, and found so by the next run
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000));"
        "from pathlib import Path; from test_flight_recorder import *;"
        "flight_recorder.END_S = PATIENCE_S; r = FlightRecorder(Path(sys.argv[1]), RIG);"
        "[r.observe(rows(400 * k, 400, *((State.FAULT, Fault.JUMP) if k % 2 else ()))) for k in range(20)];"
        "r.close(); s = r.status(); print(s['broken']); print(s['dropped'], s['incidents_lost'])"
    )
    out = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path), str(Path(__file__).parent), *sys.path],
        capture_output=True, text=True, timeout=170,
    )  # fmt: skip
    assert out.returncode == 0, out.stderr
    broken, counts = out.stdout.splitlines()
    assert "File too large" in broken
    assert int(counts.split()[0]) > 0
    assert int(counts.split()[1]) == 10
    events, torn = read_events(tmp_path)
    assert torn == 0
    assert len(events) > 5
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] == resource.RLIM_INFINITY
    assert not list((tmp_path / "incidents").iterdir())


def test_the_end_of_a_loop_that_died_is_told_with_its_last_ticks(tmp_path):
    recorder = FlightRecorder(tmp_path, RIG)
    recorder.observe(rows(0, 300))
    recorder.close(LoopDiedError("gone"))
    events, _ = read_events(tmp_path)
    (ended,) = [e for e in events if e["event"] == "ended"]
    assert ended["cause"] == "LoopDiedError: gone"
    (incident,) = [e for e in events if e["event"] == "incident"]
    assert len(read_incident(Path(incident["file"])).ticks) == 200


def test_a_fault_that_flickers_is_counted_instead_of_filling_the_log(tmp_path):
    recorder = FlightRecorder(tmp_path, RIG)
    flicker = rows(0, 100_000, State.IDLE)
    flicker["faults"][::2] = int(Fault.JUMP)
    flicker["state"][50_001:] = State.FAULT
    flicker["faults"][50_001] = int(Fault.STALE)
    for batch in np.split(flicker, range(20, 100_000, 20)):
        recorder.observe(batch)
    recorder.close()
    events, _ = read_events(tmp_path)
    assert len(events) < 120
    told = [e for e in events if e.get("name") == "JUMP"]
    listed = sum(e["event"] != "fault_repeated" for e in told)
    changes = int((np.diff(np.concatenate(([0], flicker["faults"] & np.uint64(Fault.JUMP)))) != 0).sum())
    assert listed + sum(e.get("suppressed", 0) for e in told) == changes
    assert any(e.get("name") == "STALE" and e["event"] == "fault" for e in events)
    assert any(e.get("to") == "FAULT" for e in events)


@pytest.mark.parametrize("torn", [b"", b'{"event":"sta'], ids=["whole", "torn"])
def test_a_run_that_told_no_end_is_told_by_the_next_one_alone(tmp_path, torn):
    first = FlightRecorder(tmp_path, RIG)
    first.observe(rows(0, 300))
    until(lambda: first.status()["written"] == 2)
    first._log.close()  # as a kill does, or the power: no `ended`
    with (tmp_path / event_log.CURRENT).open("ab") as file:
        file.write(torn)
    found = []
    for _ in range(2):
        recorder = FlightRecorder(tmp_path, RIG)
        recorder.close()
        found.append(recorder.cut_off)
    assert found == [pytest.approx(1e9), None]
    started = [event for event in read_events(tmp_path)[0] if event["event"] == "started"]
    assert [event["cut_off"] for event in started] == [None, *found]
    assert "cut off (power, a kill or a crash), its last event is of 20" in line(started[1])
    assert "cut off" not in line(started[2])
    assert "of an unknown time" in line({**started[1], "cut_off": math.nan})
    first.close()


def test_a_number_that_is_none_does_not_end_the_log(tmp_path):
    recorder = FlightRecorder(tmp_path, RIG)
    recorder.observe(rows(0, 300, State.ARMING))
    measured = rows(300, 300, State.FAULT, Fault.JUMP)
    measured["arming_delay_ticks"], measured["arming_gain"] = 2.0, np.nan
    recorder.observe(measured)
    recorder.close()
    events, torn = read_events(tmp_path)
    assert torn == 0
    assert events[-1]["event"] == "ended"
    assert next(e for e in events if e["event"] == "measured")["gain"] is None
    (incident,) = [e for e in events if e["event"] == "incident"]
    assert read_incident(Path(incident["file"])).trigger["to"] == "FAULT"


def test_what_the_next_run_is_not_told_is_known_until_it_is(tmp_path):
    def full():
        raise OSError(errno.ENOSPC, "No space left on device")

    recorder = FlightRecorder(tmp_path, RIG)
    recorder.later("zero of the force", full)
    until(lambda: recorder.state_broken["zero of the force"] == f"{tmp_path}: No space left on device")
    assert recorder.status()["broken"] == f"{tmp_path}: No space left on device"
    assert recorder.broken is None, "the event log is another file"
    recorder.later("zero of the force", lambda: None)
    recorder.close()
    assert recorder.status()["broken"] is None
