"""Keeps a fault that flickers, a device that does, or late ticks from filling the event log: its first events
are kept, then one now and then.

Nothing is left out silently: the next event of that fault that is kept says in `suppressed` how many were
not, and `flush` says it at the end of the run. Changes of state, and faults in the tick of one, always pass.
"""

from __future__ import annotations

from dataclasses import dataclass

from rtctl.recording.event_log import Event

BURST = 20
"""Events of one fault that pass at once."""

REFILL_S = 5.0
"""Loop time after which one more may pass."""


@dataclass
class _Fault:
    tokens: float
    at_s: float
    suppressed: int = 0


class ChatterFilter:
    """One per run; give it every event in order."""

    def __init__(self) -> None:
        self._faults: dict[str, _Fault] = {}

    def __call__(self, events: list[Event]) -> list[Event]:
        """The events to keep."""
        decisive = {event["tick"] for event in events if event["event"] == "state"}
        return [kept for event in events if (kept := self._judge(event, decisive)) is not None]

    def flush(self) -> list[Event]:
        """What to say at the end: name and number of the events left out that nothing has told of yet."""
        return [
            {"event": "fault_repeated", "name": name, "suppressed": fault.suppressed}
            for name, fault in self._faults.items()
            if fault.suppressed
        ]

    def _judge(self, event: Event, decisive: set[int]) -> Event | None:
        if event["event"] not in ("fault", "fault_cleared", "device", "late"):
            return event
        now_s = event["monotonic_s"]
        # by name alone: a fault that moves from axis to axis flickers as well
        fault = self._faults.setdefault(_name(event), _Fault(BURST, now_s))
        fault.tokens = min(BURST, fault.tokens + max(0.0, now_s - fault.at_s) / REFILL_S)
        fault.at_s = now_s
        if fault.tokens < 1.0 and event["tick"] not in decisive:
            fault.suppressed += 1
            return None
        # a decisive event passes without a token, and makes no debt
        fault.tokens = max(0.0, fault.tokens - 1.0)
        told, fault.suppressed = fault.suppressed, 0
        return {**event, "suppressed": told} if told else event


def _name(event: Event) -> str:
    """What flickers: a fault, or what a device says of itself or an axis."""
    if event["event"] == "late":
        return "late ticks"
    if event["event"] != "device":
        return str(event["name"])
    return f"of {event['device']}, axis {event['axis']}" if event["axis"] else f"of {event['device']}"
