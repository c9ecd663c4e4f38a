"""What a script relies on: one JSON object on standard output whatever happens, and an exit code that says
when a motor is still on, or a name would have another folder taken away."""

import json
import sys
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import rtctl.cli as program
from rtctl.cli import operate
from rtctl.cli.json_text import end_with
from rtctl.errors import ClientError
from rtctl.host import supervisor
from rtctl.recording import incident as incidents
from rtctl.recording import reader, replay
from rtctl.recording.incident import Incident, write_incident
from rtctl.recording.replay import Difference, Verdict
from rtctl.tick import new_ticks


def run(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["rtctl", *map(str, arguments)])
    return program._exit_code()


@pytest.mark.parametrize(
    ("differs", "stopped", "said"),
    [(False, "", 0), (True, "", 10), (False, "a gap", 14), (True, "a gap", 10)],
)
def test_a_replay_that_differs_or_stops_is_one_object(monkeypatch, capsys, tmp_path, differs, stopped, said):
    first = Difference(3, "torque_wanted_nm", 0, 1.0, float("nan")) if differs else None
    verdict = Verdict(ticks=5, span_s=1.0, took_s=1.0, first=first, differing={"torque_wanted_nm": 2})
    verdict.stopped = stopped
    read = SimpleNamespace(about={}, parts=[tmp_path], missing_fields=list, motions=["rotary"])
    monkeypatch.setattr(reader, "RecordingReader", lambda _parts: read)
    monkeypatch.setattr(replay, "Replay", lambda _reader: SimpleNamespace(check=lambda: verdict))
    code = run(monkeypatch, "replay", tmp_path / "a.mcap", "--json")
    told = json.loads(capsys.readouterr().out)
    assert (code, told.get("exit_code", 0), told["ticks"]) == (said, said, 5)
    assert run(monkeypatch, "replay", tmp_path / "a.mcap") == said
    assert "stopped early, after 5 ticks: a gap" in capsys.readouterr().err or said != 14


def test_an_incident_whose_picture_cannot_be_drawn_is_one_object(monkeypatch, capsys, tmp_path):
    ticks = new_ticks(3, 1)
    ticks["tick"] = np.arange(3)
    trigger = {
        "event": "state",
        "from": "ACTIVE",
        "to": "FAULT",
        "tick": 1,
        "timestamp": 0.0,
        "monotonic_s": 0.0,
    }
    path = write_incident(tmp_path, Incident(trigger, ticks, [trigger], {"rig": "r"}))
    assert run(monkeypatch, "incident", path, "--json") == 0
    assert json.loads(capsys.readouterr().out)["ticks"] == 3
    gone = tmp_path / "gone"
    gone.mkdir()
    read = incidents.read_incident

    def then_the_folder_goes(file):
        found = read(file)
        gone.rmdir()
        return found

    monkeypatch.setattr(incidents, "read_incident", then_the_folder_goes)
    assert run(monkeypatch, "incident", path, "--json", "--plot", gone / "a.png") == 10
    assert json.loads(capsys.readouterr().out)["exit_code"] == 10


@pytest.mark.parametrize("more", [[], ["--json"], ["--plot", "a.png"]])
@pytest.mark.parametrize(
    ("trigger", "about", "state"),
    [
        ({"timestamp": "x"}, {}, 3),
        ({"timestamp": 1e300}, {}, 3),
        ({"tick": None}, {"axes": ["a", "b"], "motion": ["rotary"]}, 3),
        ({}, {"motion": 5}, 3),
        ({}, {}, 99),
    ],
)
def test_an_incident_of_another_version_is_told_by_name(
    monkeypatch, capsys, tmp_path, trigger, about, state, more
):
    ticks = new_ticks(3, 1)
    ticks["tick"], ticks["state"] = np.arange(3), state
    whole = {"event": "state", "from": "A", "to": "FAULT", "tick": 1, "timestamp": 0.0, "monotonic_s": 0.0}
    path = tmp_path / "other.npz"
    body = {"trigger": {**whole, **trigger}, "events": [5, {"event": "fault"}], "about": about}
    columns = {name: ticks[name] for name in ticks.dtype.names}
    np.savez_compressed(path, incident=np.array(json.dumps(body)), **columns)
    monkeypatch.chdir(tmp_path)
    code = run(monkeypatch, "incident", path, *more)
    told = capsys.readouterr()
    assert (code, "this version cannot tell" in told.err + told.out) in [(10, True), (0, False)]
    assert told.err.count("\n") <= 1


class Rig:
    """A client of a rig whose motor goes off after so many questions, and whose loop takes a stop up after so
    many.
    """

    def __init__(self, motor_off, taken_up=0):
        self._motor_off, self._taken_up, self.asked, self.stopped = motor_off, taken_up, 0, False

    def stop(self):
        self.stopped = True
        return 7

    def status(self):
        self.asked += 1
        return {
            "enabled": self.asked < self._motor_off,
            "command_seq_in_force": 6 + (self.asked >= self._taken_up),
        }


@pytest.fixture
def stop(monkeypatch):
    """What `rtctl stop` does to a client, in a time of its own."""
    now = [0.0]
    clock = SimpleNamespace(monotonic=lambda: now[0], sleep=lambda s: now.__setitem__(0, now[0] + s))
    monkeypatch.setattr(operate, "time", clock)
    return operate.stop.callback.__wrapped__


def test_a_motor_that_stays_on_is_no_success_of_stop(stop):
    rig = Rig(5)
    stop(rig)
    assert rig.stopped
    with pytest.raises(ClientError, match="after 2 s the motor is enabled"):
        stop(Rig(10**6))


def test_a_motor_that_was_off_before_the_stop_is_no_success_of_it(stop):
    """An arm that came a moment earlier may be on its way to the loop."""
    rig = Rig(0, taken_up=5)
    stop(rig)
    assert rig.asked == 5
    with pytest.raises(ClientError, match="after 2 s the loop has not taken it up"):
        stop(Rig(0, taken_up=10**6))


@pytest.mark.parametrize("name", ["..", ".", "", "../../home", "/", "mock/.."])
def test_a_name_that_is_a_path_takes_nothing_away(monkeypatch, capsys, tmp_path, name):
    files = [tmp_path / "var/lib" / at for at in ("others/data", "rtctl/mock/recordings/a.mcap")]
    files.append(tmp_path / "etc/rtctl/mock.toml")
    for file in files:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch()
    assert run(monkeypatch, "service", "uninstall", name, "--purge", "--root", tmp_path) == 3
    assert "a letter, then at most 31" in capsys.readouterr().err
    assert all(Path(file).exists() for file in files)


@pytest.mark.parametrize("ended", [0, 1, ClientError])
def test_what_ends_in_a_no_says_so_in_its_object(capsys, ended):
    with pytest.raises(SystemExit) as left:
        end_with({"a": float("nan")}, ended)
    told = json.loads(capsys.readouterr().out)
    of_error = {"error": "ClientError", "exit_code": 12}
    assert told == {"a": None} | {0: {}, 1: {"exit_code": 1}}.get(ended, of_error)
    assert left.value.code == told.get("exit_code", 0)


@pytest.mark.parametrize(("first", "code"), [("", 130), ("STALE", 11)])
@pytest.mark.parametrize("more", [[], ["--json"]])
def test_a_demonstration_that_was_stopped_has_no_figure(monkeypatch, capsys, first, code, more):
    figures = {"ticks": 5, "rate_hz": 1000.0, "missed_ticks": 0, "wakeup_us": {}, "cycle_us": {}}
    summary = {**figures, "state": "SHUTDOWN", "faults": [first], "fault_first": first}
    host = SimpleNamespace(run=lambda: summary)
    monkeypatch.setattr(supervisor, "Host", lambda *_a, **_k: nullcontext(host))
    assert run(monkeypatch, "demo", *more) == code
    told = capsys.readouterr()
    if more:
        assert json.loads(told.out)["exit_code"] == code
    assert "nan" not in told.out.lower()
