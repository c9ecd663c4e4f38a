"""Files of a data set: written whole, and its header read back."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

from hw.motion import rotary_named
from hw.outside import json_of, read_bounded
from rtctl import whole_files
from rtctl.errors import DataError
from rtctl.identify.bias import Bias
from rtctl.identify.session import Point
from rtctl.identify.settings import Settings

SCHEMA = 1
HEADER = "dataset.json"
# 64 MB: a file from elsewhere must not fill the memory
MOST_HEADER_BYTES = 1 << 26


def write_whole(path: Path, content: bytes) -> None:
    """Write a file so that at any moment either the old or the new content is there. Raises DataError."""
    try:
        whole_files.write_whole(path, content)
    except OSError as error:
        raise DataError(
            f"{path}: cannot write: {error.strerror}; free space or choose another --out"
        ) from error


def read_document(folder: Path) -> dict[str, Any]:
    """The header of a data set, under the names of a rotary axis whatever its motion.

    Raises
    ------
    DataError
        Missing, not JSON, or not of this schema."""
    path = folder / HEADER
    try:
        document = json_of(read_bounded(path, MOST_HEADER_BYTES))
    except OSError as error:
        raise DataError(
            f"{path}: cannot read: {error.strerror}; there is nothing to resume in {folder}"
        ) from error
    except ValueError as error:
        raise DataError(f"{path}: damaged ({error}); begin a new --out") from error
    keys = {"config_sha256", "rig", "simulated", "settings", "sessions", "points"}
    if not isinstance(document, dict) or document.get("schema") != SCHEMA or not keys <= document.keys():
        raise DataError(f"{path}: not a data set of schema {SCHEMA}; begin a new --out")
    # only names of ours are turned back into those of a rotary axis
    known = {one.name for kind in (Settings, Point, Bias) for one in fields(kind)}
    told = rotary_named(document, str(document.get("motion", "rotary")), known)
    header: dict[str, Any] = told if isinstance(told, dict) else document
    settings, ours = header["settings"], {one.name for one in fields(Settings)}
    # of a later version: nobody here knows what such a setting changed
    if not isinstance(settings, dict) or not settings.keys() <= ours:
        raise DataError(
            f"{path}: was begun with settings that this version does not know "
            f"({', '.join(sorted(set(settings) - ours))}): resume it with the rtctl that began it, or begin "
            "a new --out"
        )
    return header
