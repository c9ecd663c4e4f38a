"""How the faults of a rig file are told: by key and value, few at a time, in texts that no terminal obeys."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from hw.outside import MOST_SHOWN, shown
from rtctl.tiny_numbers import LEAST, too_small

FILE_OPTIONS = ("file", "faults", "dbc")
"""Options of devices that name a file: a recorded log, a schedule of faults, a description of CAN frames."""

MOST_FAULTS = 50
"""Faults of one table of a file that are told one by one."""

MOST_MESSAGE = 2000
"""Characters of one fault's text: that of a schedule of faults tells all of its own."""


def fault_lines(path: Path, prefix: str, error: ValidationError) -> list[str]:
    """One line for each fault, at most `MOST_FAULTS`, in texts that no terminal obeys."""
    found = error.errors(include_url=False)
    deeper = {fault["loc"][:k] for fault in found for k in range(len(fault["loc"]))}
    out = []
    for fault in found:
        if (
            fault["type"] == "too_short" and fault["loc"] in deeper
        ):  # only says that the entries below it were refused
            continue
        where = prefix + "".join(
            f"[{part}]" if isinstance(part, int) else f".{shown(part)}" for part in fault["loc"]
        )
        key = where.lstrip(".") or "(file)"
        value = fault.get("input")
        given = "" if isinstance(value, dict | list | tuple | BaseModel) else f" (got {_given(value)})"
        remedy = "; remove it or correct its spelling" if fault["type"] == "extra_forbidden" else ""
        out.append(f"{path}: {key}: {shown(fault['msg'], MOST_MESSAGE)}{given}{remedy}")
    if len(out) > MOST_FAULTS:
        out[MOST_FAULTS:] = [f"{path}: and {len(out) - MOST_FAULTS} more of the kind"]
    return out


def _given(value: object) -> str:
    """A refused value, as far as it helps to see it."""
    if isinstance(value, str):
        return shown(repr(value[: 2 * MOST_SHOWN]))
    return shown(repr(value))


def no_files(folder: Path, device: dict[str, Any]) -> list[str]:
    """Options that name a file, and something else is there: a device without an end, a pipe nobody writes into."""
    options = device.get("options")
    named = {key: options[key] for key in FILE_OPTIONS if key in options} if isinstance(options, dict) else {}
    found = []
    for key, name in named.items():
        if isinstance(name, str) and "\0" not in name and len(name) < MOST_MESSAGE:
            place = Path(folder, name).expanduser()
            if name and place.exists() and not place.is_file():
                found.append(f"{key}: {shown(repr(name))} is not a file; name one")
    return found


def tiny_lines(path: Path, data: dict[str, Any]) -> list[str]:
    """One line for each number so near to 0 that nobody means it."""
    return [
        f"{path}: {shown(key)}: {value!r} is nearer to 0 than {LEAST:g}; write 0, or the number that is meant"
        for key, value in too_small(data)[:MOST_FAULTS]
    ]
