"""A small file in a rig's state folder: what one run knows of each axis for the next, JSON, of one set of
devices.

A file that is missing, damaged or of other devices says nothing of this rig: it is left alone and written
over."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hw.outside import json_of, read_bounded
from rtctl.whole_files import write_whole


def write(file: Path, devices: str, axes: Mapping[str, object]) -> None:
    """Keep the axes, by their names; `devices` is the checksum of the rig's devices. A reader sees it whole.

    Raises OSError, and ValueError for a number that is not finite: of a file with it nothing could be used.
    """
    text = json.dumps({"devices_sha256": devices, "axes": axes}, default=_plain, allow_nan=False)
    # there is none before the first run
    file.parent.mkdir(mode=0o750, parents=True, exist_ok=True)
    write_whole(file, f"{text}\n".encode())


def _plain(value: object) -> object:
    """A NumPy number or array as Python's."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is no data")


def read(file: Path, devices: str, most_bytes: int) -> dict[str, Any]:
    """What was kept, by the name of the axis; nothing from a file that says nothing of these devices, or is
    longer than `most_bytes`."""
    of, axes = read_whoevers(file, most_bytes)
    return axes if of == devices else {}


def read_whoevers(file: Path, most_bytes: int) -> tuple[object, dict[str, Any]]:
    """The checksum of the devices that a file is of, and what was kept of each axis; nothing from a file that
    is damaged or longer than `most_bytes`."""
    try:
        body = json_of(read_bounded(file, most_bytes))
    except (OSError, ValueError):
        return None, {}
    axes = body.get("axes") if isinstance(body, dict) else None
    return (body.get("devices_sha256"), axes) if isinstance(axes, dict) else (None, {})
