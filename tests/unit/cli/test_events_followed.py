"""`rtctl events --follow`: nothing is lost, or said twice, between what was there and what comes."""

from __future__ import annotations

import json
from pathlib import Path

import in_process
import pytest

from rtctl.cli.events import line
from rtctl.recording import event_log


def _event(tick: int) -> dict[str, object]:
    return {"timestamp": 1e9 + tick, "monotonic_s": float(tick), "session": 1, "tick": tick, "event": "x"}


def test_what_is_written_while_the_log_is_read_is_shown_once(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    log, original = event_log.EventLog(tmp_path / "mock"), event_log.read_events
    log.append([_event(0)])

    def read(folder: Path, last: int) -> tuple[list[event_log.Event], int]:
        log.append([_event(1)])
        found = original(folder, last)
        log.append([_event(2)])
        return found

    def nothing_more(_seconds: float) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(event_log, "read_events", read)
    monkeypatch.setattr(event_log.time, "sleep", nothing_more)
    code, said, _ = in_process.run(
        monkeypatch, capsys, "events", "mock", "--state-dir", str(tmp_path), "--follow", "--json"
    )
    assert code == 0
    assert [json.loads(line)["tick"] for line in said.splitlines()] == [0, 1, 2]


def test_the_command_of_an_incident_can_be_pasted_wherever_its_file_lies() -> None:
    told = line({**_event(1), "event": "incident", "ticks": 3, "file": "/home/lab rig/a.npz"})
    assert told.endswith("incident '/home/lab rig/a.npz'")
