"""The files that a service gets a copy of: the rig file, and what it names beside itself."""

from __future__ import annotations

import errno
import hashlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hw.outside import MOST_TABLE_BYTES, read_bounded, shown, toml_of
from rtctl.errors import ConfigError
from rtctl.rig_file.config import LoadedConfig
from rtctl.rig_file.mistakes import FILE_OPTIONS

# root copies it: a device or an endless file that somebody put there must end
MOST_NAMED_BYTES = 1 << 26
"""Largest file that a rig file may name."""


def _named(data: dict[str, Any]) -> Iterator[str]:
    """The files that a rig file names, by the keys that do so: a description that reads like a path is
    none."""
    for axis in data.get("axis", []):
        yield axis.get("friction", {}).get("model", "")
    for device in data.get("device", []):
        options = device.get("options", {})
        # options, and tables one deep in them: no kind of device names a file further down
        for table in (options, *(value for value in options.values() if isinstance(value, dict))):
            yield from (table[key] for key in FILE_OPTIONS if isinstance(table.get(key), str))


def rig_file(loaded: LoadedConfig) -> bytes:
    """The rig file as it was checked. Raises ConfigError when it has been changed since."""
    # read again: what is installed is what a person sees in the file now, or nothing
    content = _content(loaded.path.parent, Path(loaded.path.name))
    if hashlib.sha256(content).hexdigest() != loaded.sha256:
        raise ConfigError(f"{loaded.path}: was changed while it was read; install it again")
    return content


def named_files(loaded: LoadedConfig) -> list[tuple[Path, bytes]]:
    """Files beside the rig file that it names (friction models, frames, schedules), to go along with it."""
    folder, found = loaded.path.parent, {}
    for text in _named(toml_of(rig_file(loaded))):
        part = Path(text)
        if not text or part.is_absolute():
            continue  # the daemon reads it where it is
        if ".." in part.parts:
            raise ConfigError(
                f"{loaded.path}: {shown(repr(text))} leads out of the rig file's folder; give an absolute "
                "path, or move the file beside the rig file"
            )
        # lexists: a link that leads nowhere is refused where it is read, not left out without a word
        if os.path.lexists(folder / part):
            found[part] = _content(folder, part)
    return list(found.items())


def names(rig: Path, part: Path) -> bool:
    """Whether an installed rig file names this file, too; one that cannot be read names none."""
    try:
        return any(
            Path(text) == part for text in _named(toml_of(read_bounded(rig, MOST_TABLE_BYTES))) if text
        )
    except (OSError, ValueError, AttributeError, TypeError):
        return False


def _content(folder: Path, part: Path) -> bytes:
    """A file below the rig file's folder, through no link: root reads it, and everybody may read the copy."""
    for depth in range(1, len(part.parts)):  # the parents; the file itself is opened with O_NOFOLLOW
        if folder.joinpath(*part.parts[:depth]).is_symlink():
            raise ConfigError(
                f"{folder.joinpath(*part.parts[:depth])}: is a link; put the folder itself there"
            )
    try:
        return read_bounded(folder / part, MOST_NAMED_BYTES, follow=False)
    except OSError as error:
        why = "is a link; put the file itself there" if error.errno == errno.ELOOP else str(error.strerror)
        raise ConfigError(f"{folder / part}: cannot be copied: {why}") from error
