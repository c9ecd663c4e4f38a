import errno
import os
from dataclasses import replace

import numpy as np
import pytest

from rtctl.control.vocabulary import Fault, State
from rtctl.errors import DataError
from rtctl.host.exchange.events import EventDetector
from rtctl.host.exchange.rig_description import AxisDescription, RigDescription
from rtctl.recording import incident as incidents
from rtctl.recording.incident import Capture, prune, read_incident, write_incident
from rtctl.recording.incident_plot import plot_incident
from rtctl.recording.incident_report import summary
from rtctl.tick import new_ticks

RIG = RigDescription(
    "mock", (AxisDescription("a", {}), AxisDescription("b", {})), 1000.0, start_wall_ns=10**18, session=7
)


def run(n=2000):
    rows = new_ticks(n, 2)
    rows["tick"] = np.arange(n)
    rows["time_ns"] = rows["tick"] * 1_000_000
    rows["state"], rows["fault_first"] = State.ACTIVE, -1
    rows["position_rad"] = np.random.default_rng(1).normal(size=(n, 2))
    return rows


def fault(rows, at, state=State.FAULT, cause=Fault.OVERSPEED):
    rows["state"][at:], rows["faults"][at:] = state, int(cause)
    rows["fault_first"][at:] = int(cause).bit_length() - 1


def capture(rows, batches, **more):
    taker, detector, done = Capture(**more), EventDetector(RIG), []
    for batch in np.split(rows, batches):
        done += taker.feed(batch, detector.detect(batch))
    return done, taker


@pytest.mark.parametrize(
    "batches", [[], [999], [1000], [1001], [1050], [1051], list(range(7, 2000, 7)), list(range(1, 2000))]
)
def test_an_incident_has_the_200_ticks_before_and_50_after_however_the_batches_fall(batches):
    rows = run()
    fault(rows, 1000)
    (incident,), taker = capture(rows, batches)
    assert incident.ticks.tobytes() == rows[800:1051].tobytes()
    assert (incident.trigger["to"], incident.trigger["cause"], incident.trigger["tick"]) == (
        "FAULT",
        "OVERSPEED",
        1000,
    )
    assert [event["event"] for event in incident.events] == ["fault", "state"]
    assert taker.flush() == []


@pytest.mark.parametrize("batches", [[], [1000], [1050], list(range(13, 2000, 13))])
@pytest.mark.parametrize(("second", "count"), [(1001, 1), (1049, 1), (1050, 1), (1051, 2), (1300, 2)])
def test_a_ramp_that_ends_in_a_fault_is_one_incident(batches, second, count):
    rows = run()
    fault(rows, 1000, State.STOPPING, Fault.PASSIVITY)
    rows["state"][second:] = State.FAULT
    done, _ = capture(rows, batches)
    assert len(done) == count
    if count == 1:
        assert done[0].ticks.tobytes() == rows[800 : second + 51].tobytes()
    else:
        assert done[1].ticks.tobytes() == rows[second - 200 : second + 51].tobytes()


@pytest.mark.parametrize("batches", [[], [1000], [1003], list(range(13, 2000, 13))])
@pytest.mark.parametrize(("pressed", "count"), [(1000, 1), (1003, 1), (1050, 1), (1400, 2)])
def test_an_emergency_stop_files_its_incident_under_its_own_name(batches, pressed, count):
    rows = run()
    fault(rows, 1000, cause=Fault.STALE)  # its supply died first, and stays the first cause that is latched
    rows["state"][pressed:], rows["faults"][pressed:] = State.ESTOP, int(Fault.STALE | Fault.ESTOP)
    done, taker = capture(rows, batches)
    done += taker.flush()
    assert len(done) == count
    assert "-ESTOP-ESTOP-tick" in done[-1].name
    assert (done[-1].trigger["cause"], done[-1].trigger["tick"]) == ("ESTOP", pressed)
    assert done[-1].ticks.tobytes() == rows[(800 if count == 1 else pressed - 200) : pressed + 51].tobytes()


def test_a_stop_that_was_asked_for_is_no_incident():
    rows = run()
    rows["state"][500:], rows["state"][550:] = State.STOPPING, State.IDLE
    assert capture(rows, [100, 520])[0] == []


def test_an_incident_at_the_very_start_or_end_has_what_there_is():
    rows = run(1000)
    fault(rows, 990)
    done, taker = capture(rows, [500])
    (late,) = taker.flush()
    assert done == []
    assert late.ticks.tobytes() == rows[790:].tobytes()
    rows = run(1000)
    fault(rows, 0)
    (early,), _ = capture(rows, [3])
    assert early.ticks.tobytes() == rows[:51].tobytes()


def test_the_last_ticks_of_a_loop_that_died_are_an_incident():
    rows = run(1000)
    _, taker = capture(rows, [500])
    ended = {"event": "ended", "cause": "LoopDiedError", "tick": 999, "timestamp": 1e9, "monotonic_s": 1.0}
    (last,) = taker.flush(ended)
    assert last.ticks.tobytes() == rows[800:].tobytes()
    assert "ended" in last.name
    assert "LoopDiedError" in "\n".join(summary(last))


def test_a_fault_that_chatters_cannot_grow_a_window_for_ever():
    rows = run(20_000)
    rows["faults"], rows["fault_first"] = int(Fault.JUMP), 2
    rows["state"] = np.where(np.arange(20_000) % 20 < 10, State.FAULT, State.IDLE)
    done, _ = capture(rows, list(range(50, 20_000, 50)))
    assert all(len(incident.ticks) < incidents.MOST_TICKS + 300 for incident in done)


def an_incident():
    rows = run(300)
    rows["temperature_c"] = np.nan
    fault(rows, 250)
    _, taker = capture(rows, [100])
    (incident,) = taker.flush()
    incident.about = {"rig": "mock", "axes": ["a", "b"], "version": "1", "config_sha256": "ab"}
    return incident


def test_a_file_gives_back_every_field_bit_for_bit(tmp_path):
    incident = an_incident()
    path = write_incident(tmp_path / "incidents", incident)
    again = read_incident(path)
    assert again.ticks.tobytes() == incident.ticks.tobytes()
    assert (again.trigger, again.events, again.about) == (incident.trigger, incident.events, incident.about)
    assert path.stat().st_size < incident.ticks.nbytes / 2
    assert "FAULT-OVERSPEED-tick250" in path.name


def test_what_an_older_file_lacks_is_no_0(tmp_path):
    path = write_incident(tmp_path / "incidents", an_incident())
    kept = {name: array for name, array in np.load(path).items() if name != "observer_torque_nm"}
    np.savez(tmp_path / "old.npz", **kept)
    old = read_incident(tmp_path / "old.npz")
    assert np.isnan(old.ticks["observer_torque_nm"]).all()
    assert summary(old)


def test_summary_and_picture_show_the_cause(tmp_path):
    lines = "\n".join(summary(an_incident()))
    assert "ACTIVE -> FAULT, cause OVERSPEED" in lines
    assert "faster than its limit" in lines
    assert all(offset in lines for offset in ("-200", "+0", "+20"))
    plot_incident(an_incident(), tmp_path / "incident.png")
    assert (tmp_path / "incident.png").read_bytes()[:4] == b"\x89PNG"
    assert [path.name for path in tmp_path.iterdir()] == ["incident.png"]


def test_a_full_disk_leaves_no_half_file(tmp_path, monkeypatch):
    def full(fd):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(incidents.os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        write_incident(tmp_path, an_incident())
    assert list(tmp_path.iterdir()) == []


def test_the_oldest_files_go_first_by_count_and_by_size(tmp_path):
    for k in range(10):
        (tmp_path / f"2026010{k}.npz").write_bytes(bytes(100))
    (tmp_path / "x.part").write_bytes(b"left by a crash")
    prune(tmp_path, "20260109.npz", files=5)
    assert sorted(p.name[7] for p in tmp_path.iterdir()) == list("56789")
    prune(tmp_path, "20260109.npz", files=5, size=250)
    assert sorted(p.name[7] for p in tmp_path.iterdir()) == list("89")
    prune(tmp_path, "20260109.npz", files=5, size=10)
    assert len(list(tmp_path.iterdir())) == 1, "the newest stays whatever its size"


def test_what_a_clock_that_went_back_dates_long_ago_is_not_the_first_to_go(tmp_path, monkeypatch):
    for k in range(10):
        (tmp_path / f"20260101T00000{k}.npz").write_bytes(bytes(100))
    monkeypatch.setattr(incidents.prune, "__defaults__", (5, 1 << 20))
    made = an_incident()
    for year_2000_s in (946_684_800, 946_684_801):
        path = write_incident(tmp_path, replace(made, trigger={**made.trigger, "timestamp": year_2000_s}))
        assert path.exists()
    assert [path.name[:4] for path in sorted(tmp_path.iterdir())] == ["2000"] * 2 + ["2026"] * 3


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"no archive at all"])
def test_other_files_are_refused_by_name(tmp_path, content):
    path = tmp_path / "other.npz"
    path.write_bytes(content)
    with pytest.raises(DataError, match=r"other\.npz"):
        read_incident(path)
    with pytest.raises(DataError, match="missing"):
        read_incident(tmp_path / "missing.npz")
