"""An event as telemetry, the event log and recordings carry it, in one line for a person."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rtctl.wire.fault_words import sentence


def line_of(event: Mapping[str, Any]) -> str:
    """One event for a person; empty for those that say nothing to one who watches the rig."""
    match event["event"]:
        case "state":
            cause = event.get("cause") or "the law"
            return f"{event['from']} -> {event['to']}: {cause}"
        case "fault":
            return f"fault {sentence(dict(event))}"
        case "fault_cleared":
            return f"fault {event['name']} is gone"
        case "device":
            return device_line(event)
        case "warning":
            return f"warning: {event['text']}"
        case "warning_cleared":
            return f"warning {event['name']} of axis {event['axis']} is gone"
        # measured, late, started, ended: in the log, and no news to who watches
        case _:
            return ""


def device_line(said: Mapping[str, Any]) -> str:
    """What a device says (`Voice.as_dict`, or an event `device`), as one line."""
    # without an axis the name says all
    where = f"{said['device']}, axis {said['axis']}" if said["axis"] else str(said["device"])
    link = [*said["faults"], *(["no fresh sample"] if said["silent"] else [])]
    return f"{where}: " + (
        "; ".join(part for part in (said["text"], ", ".join(link)) if part) or "well again"
    )
