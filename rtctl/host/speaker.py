"""What happens to a rig, said in the terminal (or the journal) as it happens: one line each, never
waiting."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rtctl.host.notices import Notices
from rtctl.wire.event_words import line_of

LINES_PER_S = 16
"""Most lines a second of each kind: changes of state with their faults, and the rest. What is beyond is
counted in a later one, and stands in the event log whole."""


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
                self._say(text, "state" if decides else "run")
        for what, why in broken.items():
            if why != self._broken.get(what):
                self._broken[what] = why
                self._say(f"{what.upper()} BROKEN: {why}" if why else f"{what}: written again")

    def _say(self, text: str, kind: str = "run") -> None:
        if self._notices is None:
            return
        self._notices(f"{kind} {self._lines[kind] % LINES_PER_S}", text)  # each of a kind once a second
        self._lines[kind] += 1
