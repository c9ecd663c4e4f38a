"""What happens to a rig, said in the terminal (or the journal) as it happens: one line each, never
waiting."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rtctl.host.notices import Notices
from rtctl.recording.log_lines import Level, level_of
from rtctl.terminal import Grade
from rtctl.wire.event_words import line_of

LINES_PER_S = 16
"""Most lines a second of each kind: changes of state with their faults, and the rest. What is beyond is
counted in a later one, and stands in the event log whole."""

REMEDY = "remove what hinders it (room, rights): it is tried again"

_GRADES = {
    Level.INFO: Grade.INFO,
    Level.WARNING: Grade.WARNING,
    Level.ERROR: Grade.ERROR,
    Level.FATAL: Grade.CRITICAL,
}


class Speaker:
    """Says events and a broken recording or event log.

    Parameters
    ----------
    notices
        Where to say it; None: nowhere."""

    def __init__(self, notices: Notices | None) -> None:
        self._notices = notices
        # two rows of kinds, as `Notices` writes one of a kind a second: devices that chatter leave room for
        # states
        self._lines = {"run": 0, "state": 0}
        self._broken: dict[str, str | None] = {}

    def tell(self, events: list[dict[str, Any]], broken: Mapping[str, str | None]) -> None:
        """Say new events, and of each of `broken` (what it is, why it cannot be written) when that
        changes."""
        # by the tick: a device or a warning that flickers must not hide why the rig stopped
        decisive = {event.get("tick") for event in events if event["event"] == "state"}
        for event in events:
            if text := line_of(event):
                decides = event["event"] in ("state", "fault") and event.get("tick") in decisive
                self._say(text, _GRADES[level_of(event)], "state" if decides else "run")
        for what, why in broken.items():
            if why != self._broken.get(what):
                self._broken[what] = why
                if why:
                    self._say(f"{what.upper()} BROKEN: {why}; {REMEDY}", Grade.ERROR)
                else:
                    self._say(f"{what}: written again", Grade.INFO)

    def refused(self, op: str, why: str) -> None:
        """Say that what a client asked for was refused: whoever comes later finds it in the journal."""
        if self._notices is not None:
            self._notices("refused", f"{op} refused: {why}", Grade.WARNING)

    def _say(self, text: str, grade: Grade, kind: str = "run") -> None:
        if self._notices is None:
            return
        # each of a kind once a second
        self._notices(f"{kind} {self._lines[kind] % LINES_PER_S}", text, grade)
        self._lines[kind] += 1
