"""A folder for compiled code that is this user's alone: what lies in it is executed.

Numba keeps machine code in files that it unpickles, so whoever can put a file there has it run with the
rights of the next user, on the rig. Whose the files are is asked at every load; those of another user are as
good as absent."""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from hw.numba_alone import caching

_OTHERS = stat.S_IRWXG | stat.S_IRWXO
_WRITE = stat.S_IWGRP | stat.S_IWOTH
_told: set[Path] = set()


def make_private(folder: Path, levels: int) -> bool:
    """Have `folder` and the `levels` - 1 above it, made where absent, for this user alone (mode 0700).

    False, told once on stderr, where one of them cannot be: then nothing may be kept there, nor read."""
    row = [folder, *folder.parents][:levels]
    try:
        row[-1].parent.mkdir(parents=True, exist_ok=True)
        for path in reversed(row):
            path.mkdir(mode=0o700, exist_ok=True)
            # not stat: a link to a folder of ours in a folder of somebody else may lead elsewhere tomorrow
            status = path.lstat()
            if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.geteuid():
                return _refuse(path, f"belongs to user {status.st_uid}, or is a link")
            # made before, perhaps by a careless umask: closed, and used from now on
            if status.st_mode & _OTHERS:
                path.chmod(0o700)
    except OSError as error:
        return _refuse(row[-1], error.strerror or str(error))
    return True


def _refuse(path: Path, why: str) -> bool:
    if path not in _told:
        _told.add(path)
        sys.stderr.write(
            f"rtctl: {path}: {why}; compiled code is neither kept nor taken there, so every start compiles "
            "anew, which takes a minute: set RTCTL_CACHE_DIR to a folder of your own\n"
        )
    return False


def is_own(path: str | Path, *, folder: bool = False) -> bool:
    """Whether this is a plain file (or folder) of this user that nobody else may write."""
    try:
        status = os.lstat(path)
    except OSError:
        return False
    # a link is neither: it may lead into somebody else's folder by the time of the load
    kind = stat.S_ISDIR if folder else stat.S_ISREG
    return kind(status.st_mode) and status.st_uid == os.geteuid() and not status.st_mode & _WRITE


class OwnFiles(caching.IndexDataCacheFile):
    """Numba's index and data files of one function, as far as they are this user's."""

    def load(self, key: object) -> object:
        """What was compiled before; None where nothing was, or not by this user."""
        place = Path(self._cache_path)
        if not all(is_own(path, folder=True) for path in (place, place.parent)):
            return None
        numbas: Any = super()
        return numbas.load(key)

    def _load_index(self) -> dict[Any, str]:
        numbas: Any = super()
        index: dict[Any, str] = numbas._load_index() if is_own(self._index_path) else {}
        return index

    def _load_data(self, name: str) -> object:
        numbas: Any = super()
        path = numbas._data_path(name)
        if not is_own(path):
            raise FileNotFoundError(path)
        return numbas._load_data(name)

    @contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[IO[bytes]]:
        with super()._open_for_write(filepath) as file:
            os.fchmod(file.fileno(), 0o600)  # Numba opens it with what the umask leaves
            yield file
