"""Several files written together: all whole, or none of them changed."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from rtctl.errors import DataError


def write_together(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files (name -> content) into `folder`, made if absent; renamed in their order once all are written.

    Nothing is left behind when one cannot be written; the folder goes again if it was made here.

    Raises
    ------
    DataError
        Names the file and what to do.
    """
    made = not folder.exists()
    beside = {name: folder / f".{name}.{os.getpid()}.tmp" for name in files}
    at = folder
    complete = False
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            at = folder / name
            if at.is_dir():
                raise DataError(f"{at}: is a folder; remove it, or choose another --out")
            with beside[name].open("wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
        for name in files:
            at = folder / name
            beside[name].replace(at)
        complete = True
    except OSError as error:
        raise DataError(
            f"{at}: cannot write: {error.strerror}; free space or choose another --out"
        ) from error
    finally:
        if not complete:
            _clear(folder, beside.values(), made=made)


def _clear(folder: Path, leftovers: Iterable[Path], *, made: bool) -> None:
    if not folder.is_dir():
        return
    for path in leftovers:
        path.unlink(missing_ok=True)
    if made and not any(folder.iterdir()):
        folder.rmdir()
