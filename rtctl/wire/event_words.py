"""An event as telemetry, the event log and recordings carry it, in one line for a person."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from datetime import datetime
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


def cut_off_line(last_s: float) -> str:
    """That the run before told no end; `last_s` is when its last event happened, s since 1970."""
    when = "an unknown time"
    with suppress(ValueError, OverflowError, OSError):  # of a log that somebody edited
        when = f"{datetime.fromtimestamp(last_s).astimezone():%Y-%m-%d %H:%M:%S}"
    return f"the run before was cut off (power, a kill or a crash), its last event is of {when}"


def device_line(said: Mapping[str, Any]) -> str:
    """What a device says (`Voice.as_dict`, or an event `device`), as one line."""
    # without an axis the name says all
    where = f"{said['device']}, axis {said['axis']}" if said["axis"] else str(said["device"])
    link = [*said["faults"], *(["no fresh sample"] if said["silent"] else [])]
    return f"{where}: " + (
        "; ".join(part for part in (said["text"], ", ".join(link)) if part) or "well again"
    )
