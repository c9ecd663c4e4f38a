"""How the faults of a rig file are told: by line, key and value, few at a time, in texts that no terminal
obeys."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from hw.outside import shown
from hw.plain_words import MOST_FAULTS, MOST_MESSAGE, Key, explain, written
from rtctl.rig_file.tiny_numbers import LEAST, too_small

FILE_OPTIONS = ("file", "faults", "dbc")
"""Options of devices that name a file: a recorded log, a schedule of faults, a description of CAN frames."""

Where = Callable[[Key], str]
"""File and line of a key (`rtctl.rig_file.toml_lines.read_toml`)."""


def fault_lines(
    where: Where, prefix: Key, error: ValidationError, model: type[BaseModel], data: object
) -> list[str]:
    """One line for each fault of `data`, which stands at the key `prefix` of its file."""
    return [_line(where, (*prefix, *told.key), told.text) for told in explain(error, model, data)]


def no_files(where: Where, prefix: Key, folder: Path, device: dict[str, Any]) -> list[str]:
    """One line for each option that names a file where something else is: a device without an end, a pipe
    nobody writes into."""
    options = device.get("options")
    named = {key: options[key] for key in FILE_OPTIONS if key in options} if isinstance(options, dict) else {}
    found = []
    for key, name in named.items():
        # what the system would refuse to look up
        if isinstance(name, str) and "\0" not in name and len(name) < MOST_MESSAGE:
            place = Path(folder, name).expanduser()
            if name and place.exists() and not place.is_file():
                found.append(_line(where, (*prefix, key), f"{shown(repr(name))} is not a file; name one"))
    return found


def tiny_lines(where: Where, data: dict[str, Any]) -> list[str]:
    """One line for each number so near to 0 that nobody means it."""
    return [
        _line(where, key, f"{value!r} is nearer to 0 than {LEAST:g}; write 0, or the number that is meant")
        for key, value in too_small(data)[:MOST_FAULTS]
    ]


def _line(where: Where, key: Key, text: str) -> str:
    return f"{where(key)}: {written(key) or '(file)'}: {text}"
