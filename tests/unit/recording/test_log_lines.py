"""Events as lines of Foxglove's log panel, in recordings; and the layout that shows them."""

import json
import re
from pathlib import Path

import jsonschema
import pytest
from run_maker import run, write

from rtctl.recording.log_lines import SCHEMA, Level, level_of, log_line
from rtctl.recording.parts import TOPICS
from rtctl.tick import FIELD

LAYOUT = Path(__file__).parents[3] / "docs" / "foxglove-layout.json"
FAULT = {
    "event": "fault",
    "name": "STALE",
    "text": "no samples: check the cable",
    "axis": "joint",
    "tick": 9,
    "timestamp": 2.5,
}
PATH = re.compile(r"(rtctl/tick)\.([a-z0-9_]+)(\[0\])?")


def test_a_recording_says_its_events_as_a_log_that_another_reader_finds(tmp_path):
    from mcap.reader import make_reader

    rows, commands = run()
    moved = {"event": "state", "from": "ARMING", "to": "ACTIVE", "cause": "", "tick": 8, "timestamp": 2.0}
    foreign = {"event": "of another version", "tick": 9, "timestamp": 3.0}
    (path,) = write(tmp_path, rows[:200], commands[:1], events=[moved, FAULT, foreign]).files
    with path.open("rb") as file:
        found = [
            (schema, message)
            for schema, _channel, message in make_reader(file).iter_messages(topics=["rtctl/log"])
        ]
    assert [schema.name for schema, _message in found] == ["foxglove.Log"] * 3
    lines = [json.loads(message.data) for _schema, message in found]
    for line in lines:
        jsonschema.validate(line, SCHEMA)
    assert [line["message"] for line in lines] == [
        "ARMING -> ACTIVE: the law",
        "fault STALE (axis joint): no samples: check the cable",
        "of another version",
    ]
    assert [line["level"] for line in lines] == [Level.INFO, Level.ERROR, Level.INFO]
    assert lines[1]["timestamp"] == {"sec": 2, "nsec": 500_000_000}
    assert found[1][1].log_time == 2_500_000_000
    assert {line["name"] for line in lines} == {"mock"}


@pytest.mark.parametrize(
    ("to", "level"),
    [("ACTIVE", Level.INFO), ("FAULT", Level.ERROR), ("ESTOP", Level.ERROR), ("LOCKOUT", Level.FATAL)],
)
def test_a_state_is_as_grave_as_what_it_leads_to(to, level):
    assert level_of({"event": "state", "to": to}) == level


def test_an_event_that_is_not_whole_still_makes_a_line():
    assert json.loads(log_line({"event": "fault"}, "mock", 1))["message"] == "fault"
    assert json.loads(log_line({"event": ["fault"]}, "mock", 1))["level"] == Level.INFO


def panels(node):
    return [node] if isinstance(node, str) else [*panels(node["first"]), *panels(node["second"])]


def test_the_foxglove_layout_shows_what_recordings_have():
    layout = json.loads(LAYOUT.read_text())
    assert sorted(panels(layout["layout"])) == sorted(layout["configById"])
    paths = [path["value"] for panel in layout["configById"].values() for path in panel.get("paths", [])]
    assert len(paths) > 10
    for path in paths:
        topic, field, index = PATH.fullmatch(path).groups()
        assert topic in TOPICS.values()
        assert (FIELD[field].shape == "axis") == (index is not None)
    (log,) = (panel for name, panel in layout["configById"].items() if name.startswith("RosOut!"))
    assert log["topicToRender"] in TOPICS.values()
