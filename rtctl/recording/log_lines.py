"""Events of a recording once more as lines of a log, in the form that Foxglove's log panel reads
(`foxglove.Log`)."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from typing import Any

import orjson

from rtctl.wire.event_words import line_of

SCHEMA_NAME = "foxglove.Log"
"""By this name Foxglove knows what the messages are."""

SCHEMA = {
    "type": "object",
    "properties": {
        "timestamp": {
            "type": "object",
            "title": "time",
            "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}},
        },
        "level": {"type": "integer", "description": "1 debug, 2 info, 3 warning, 4 error, 5 fatal"},
        "message": {"type": "string"},
        "name": {"type": "string", "description": "the rig"},
        "file": {"type": "string"},
        "line": {"type": "integer"},
    },
    "required": ["timestamp", "level", "message", "name", "file", "line"],
}


class Level(IntEnum):
    """How grave a line is, as Foxglove counts."""

    INFO = 2
    WARNING = 3
    ERROR = 4
    FATAL = 5


_LEVELS = {"fault": Level.ERROR, "device": Level.WARNING, "warning": Level.WARNING}
_STATES = {"FAULT": Level.ERROR, "ESTOP": Level.ERROR, "LOCKOUT": Level.FATAL}


def level_of(event: Mapping[str, Any]) -> Level:
    """How grave an event is; a state counts by what it leads to."""
    kind = str(event.get("event"))
    if kind == "state":
        # a stop by a person is no error
        return _STATES.get(str(event.get("to")), Level.INFO)
    return _LEVELS.get(kind, Level.INFO)  # what is not known is told, and no alarm


def log_line(event: Mapping[str, Any], rig: str, time_ns: int) -> bytes:
    """One event as such a message.

    Parameters
    ----------
    event
        May come from a daemon of another version: what it lacks only makes the text poorer.
    rig
        Name of the rig.
    time_ns
        Time of the event, ns since 1970."""
    try:
        text = line_of(event)
    # an event of another version: a poorer line, not a recording that ends
    except (KeyError, TypeError, AttributeError):
        text = ""
    # in whole numbers: a float of ns since 1970 has steps of a quarter of a microsecond
    seconds, rest_ns = divmod(time_ns, 1_000_000_000)
    return orjson.dumps(
        {
            "timestamp": {"sec": seconds, "nsec": rest_ns},
            "level": int(level_of(event)),
            "message": text or str(event.get("event")),
            "name": rig,
            # required by the schema, and nothing of a rig: empty
            "file": "",
            "line": 0,
        }
    )
