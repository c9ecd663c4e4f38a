"""A fault as events, `status` and `health` tell it, in one line for a person."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Entry = dict[str, Any]

PLACE = ("axis", "channel", "device", "detail")
"""What such an entry has beside `name` and `text`: each a text, or None where there is nothing to say."""


def place_of(entry: Mapping[str, Any]) -> str:
    """Where a fault is, for a person: `axis tip, current, device[0] 'drive'`; empty when nothing is known."""
    parts = [f"axis {entry['axis']}"] if entry.get("axis") else []
    parts += [str(entry[name]) for name in ("channel", "device") if entry.get(name)]
    return ", ".join(parts)


def sentence(entry: Mapping[str, Any]) -> str:
    """A fault as one line: name, place, what was seen, what to do."""
    place = place_of(entry)
    seen = f": {entry['detail']}" if entry.get("detail") else ""
    return f"{entry['name']}{f' ({place})' if place else ''}{seen}: {entry['text']}"
