"""Files written so that a reader finds the old content or the new, never half of it; several together all or
none."""

from __future__ import annotations

import errno
import os
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from rtctl.errors import DataError

LEFT_NS = 3600 * 10**9
"""A half-written file is nobody's any more when it is so old and its process is gone: the age tells where
another machine writes into the same folder, whose processes nobody knows here."""


def _beside(path: Path) -> Path:
    """The hidden file in the same folder that becomes `path` once it is whole; what a power cut left of
    earlier ones is removed."""
    # by process: two take no draft of each other; in the same folder: a rename crosses no disks
    before, after = f".{path.name}.", ".tmp"
    # a folder that is not there yet, or that cannot be looked at, is for the writing to tell
    with suppress(OSError):
        for part in path.parent.iterdir():
            pid = part.name.removeprefix(before).removesuffix(after)
            if part.name == f"{before}{pid}{after}" and pid.isdecimal() and pid.isascii():
                _remove_left(part, int(pid))
    return path.with_name(f"{before}{os.getpid()}{after}")


def _remove_left(part: Path, pid: int) -> None:
    # not younger than now: a clock that was set back tells no age
    if part.is_symlink() or not part.is_file() or time.time_ns() - part.stat().st_mtime_ns < LEFT_NS:
        return
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):  # gone, or no number that a process can have
        part.unlink(missing_ok=True)


def _take_place(new: Path, path: Path) -> None:
    """Rename; but root's file would take the place of a device or a pipe of that name, so those are refused.
    Raises OSError."""
    if path.exists() and not path.is_file():
        raise OSError(errno.EEXIST, "it is no file but a device, a pipe or a folder", str(path))
    new.replace(path)


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A name to write under, which becomes `path` at the end; nothing of it is left when anything fails.

    Raises
    ------
    DataError
        It cannot be written; names the file and what to do."""
    new = _beside(path)
    try:
        yield new
        with new.open("rb") as file:
            # else a power cut may leave the name, and nothing in it
            os.fsync(file.fileno())
        _take_place(new, path)
    except OSError as error:
        raise DataError(
            f"{path}: cannot write: {error.strerror or error}; free space or choose another place"
        ) from error
    finally:
        new.unlink(missing_ok=True)  # gone already when the rename was done


def write_whole(path: Path, content: bytes) -> None:
    """Write one file. Raises OSError, and then the old content is there, and nothing else."""
    new = _beside(path)
    try:
        _write(new, content)
        _take_place(new, path)
    finally:
        new.unlink(missing_ok=True)  # gone already when the rename was done


def _write(path: Path, content: bytes) -> None:
    path.unlink(missing_ok=True)  # left by a process that died, or a link to somewhere else
    with path.open("xb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def write_together(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files (name -> content) into `folder`, made if absent; renamed in their order once all are
    written.

    Nothing is left behind when one cannot be written; the folder goes again if it was made here.

    Raises
    ------
    DataError
        Names the file and what to do."""
    made = not folder.exists()
    new = {name: _beside(folder / name) for name in files}
    at = folder
    complete = False
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            at = folder / name
            if at.is_dir():
                raise DataError(f"{at}: is a folder; remove it, or choose another --out")
            _write(new[name], content)
        # only now: whatever could not be written has ended it before the first old file went
        for name in files:
            at = folder / name
            _take_place(new[name], at)
        complete = True
    except OSError as error:
        raise DataError(
            f"{at}: cannot write: {error.strerror}; free space or choose another --out"
        ) from error
    finally:
        if not complete:
            _clear(folder, new.values(), made=made)


def _clear(folder: Path, leftovers: Iterable[Path], *, made: bool) -> None:
    if not folder.is_dir():
        return
    for path in leftovers:
        path.unlink(missing_ok=True)
    if made and not any(folder.iterdir()):
        folder.rmdir()
