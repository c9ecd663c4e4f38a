"""The event log: JSON lines, rotated by size, whole after a crash, honest when the disk is full.

A line is written at once and forced to the disk. What a crash cut off is one line without an end, which
readers skip and count; the next run starts on a line of its own. A write that fails leaves no half line:
the log is `broken`, its events are counted in `dropped`, and the first write that works again is preceded
by a line `log_gap` that says how many are missing."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, BinaryIO

from hw.outside import json_of, opened, whole_of
from rtctl.errors import DataError
from rtctl.plain_data import as_data

Event = dict[str, Any]

CURRENT = "events.jsonl"
# four files of it, 16 MB: what flickers for days must not fill a disk
MAX_BYTES = 4 << 20
KEPT_FILES = 4
MOST_BYTES = 16 * MAX_BYTES
"""Largest file that is read: a batch of events is written whole, whatever its size."""

TAIL_BYTES = 1 << 16
"""As much is read to find the last event."""

# a look costs two `stat`; sooner than that nobody reads
FOLLOW_S = 0.2


def log_files(folder: Path) -> list[Path]:
    """Files of the log that exist, oldest first."""
    return list(filter(Path.is_file, _names(folder)))


def _names(folder: Path) -> list[Path]:
    # one of the kept files is the current one, which has no number
    rotated = [folder / _rotated(k) for k in range(1, KEPT_FILES)]
    return [*reversed(rotated), folder / CURRENT]


def _rotated(k: int) -> str:
    return f"events.{k}.jsonl"


class EventLog:
    """Appends to the log of one folder. Never raises for what the disk does.

    Attributes
    ----------
    written, dropped : int
        Events on disk, and events lost to a disk that refused them.
    broken : str or None
        Why the last write failed."""

    def __init__(self, folder: Path, max_bytes: int = MAX_BYTES) -> None:
        self._folder = folder
        self._max_bytes = max_bytes
        self._fd = -1
        self._size = 0
        self._gap = 0
        self.written = self.dropped = 0
        self.broken: str | None = None

    def append(self, events: list[Event]) -> None:
        """Write the events, one line each."""
        lines = [_line(event) for event in events]
        if self._gap:
            # in front of what is written again: who reads in order meets the hole where it is
            lines.insert(0, _line({**_times(events), "event": "log_gap", "lost": self._gap}))
        try:
            self._write(lines)
        except OSError as error:
            # opened anew by the next write: the file may have been removed, or the disk mounted again
            self.close()
            self.broken = f"{error.filename or self._folder / CURRENT}: {error.strerror or error}"
            self.dropped += len(events)
            self._gap += len(events)
            return
        self.broken, self._gap = None, 0
        self.written += len(events)

    def close(self) -> None:
        """Close the file. Idempotent."""
        fd, self._fd = self._fd, -1
        with suppress(OSError):  # it is closed all the same (close(2)), and a closed one is none
            os.close(fd)

    def _write(self, lines: list[bytes]) -> None:
        data = b"".join(lines)
        if self._fd < 0:
            self._open()
        # a batch that is longer than a file goes whole into one of its own
        if self._size and self._size + len(data) > self._max_bytes:
            self._rotate()
        try:
            done = os.write(self._fd, data)
            while done < len(data):
                done += os.write(self._fd, data[done:])
            # not fsync: times of the file tell nothing that its lines do not
            os.fdatasync(self._fd)
        except OSError:
            with suppress(OSError):  # else the next run of `_open` ends the half line
                os.ftruncate(self._fd, self._size)
            raise
        self._size += len(data)

    def _open(self) -> None:
        self._folder.mkdir(mode=0o750, parents=True, exist_ok=True)
        path = self._folder / CURRENT
        # read, too: of its last byte; appended: the next line begins at the end, wherever that is by then
        self._fd = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC, 0o640)
        self._size = os.fstat(self._fd).st_size
        if self._size and os.pread(self._fd, 1, self._size - 1) != b"\n":  # cut off by a crash
            self._size += os.write(self._fd, b"\n")

    def _rotate(self) -> None:
        self.close()
        for k in range(KEPT_FILES - 1, 0, -1):  # from the oldest on: each name is free when its turn comes
            source = self._folder / (_rotated(k - 1) if k > 1 else CURRENT)
            if source.exists():
                source.replace(self._folder / _rotated(k))
        self._open()


def _line(event: Event) -> bytes:
    # a gain that was not measured is NaN, which JSON has not: null, and the line is read by anything
    return json.dumps(as_data(event), allow_nan=False, separators=(",", ":")).encode() + b"\n"


def _times(events: list[Event]) -> Event:
    names = ("timestamp", "monotonic_s", "session")
    return {name: events[0][name] for name in names if name in events[0]}


def read_events(folder: Path, last: int | None = None) -> tuple[list[Event], int]:
    """Events of all files, oldest first, at most the `last` ones; and the number of lines that are torn."""
    # the newest first: a rotation meanwhile moves each file towards those that are still to be read, so that
    # one may be met twice, but none is missed
    wholes: dict[int, bytes] = {}
    for path in filter(Path.is_file, reversed(_names(folder))):
        with suppress(FileNotFoundError):
            number, data = _whole(path)
            wholes.setdefault(number, data)
    read = [_parse(data.split(b"\n")) for data in reversed(wholes.values())]
    events = [event for found, _ in read for event in found]
    torn = sum(bad for _, bad in read)
    # not [-last:]: of the last 0 that would be all
    return (events if last is None else events[max(0, len(events) - last) :]), torn


def last_event(folder: Path) -> Event | None:
    """The newest event of the current file; None where there is none that can be read."""
    try:
        with (folder / CURRENT).open("rb") as file:
            file.seek(max(0, os.fstat(file.fileno()).st_size - TAIL_BYTES))
            events, _ = _parse(file.read(TAIL_BYTES).split(b"\n"))
    except OSError:
        return None
    return events[-1] if events else None


def _parse(lines: Iterable[bytes]) -> tuple[list[Event], int]:
    events, torn = [], 0
    for line in lines:
        if not line:
            continue
        try:
            event = json_of(line)
        except ValueError:
            torn += 1
            continue
        # else it is JSON and no event: nobody could say when it was
        if isinstance(event, dict):
            events.append(event)
    return events, torn


def _whole(path: Path) -> tuple[int, bytes]:
    """A file of the log: its inode, and what stands in it. Raises FileNotFoundError; DataError when it cannot
    be one."""
    try:
        with opened(path) as file:
            return os.fstat(file.fileno()).st_ino, whole_of(file, MOST_BYTES)
    except FileNotFoundError:
        raise
    except OSError as error:
        raise DataError(f"{path}: cannot read the event log: {error.strerror}") from error


def follow(folder: Path, poll_s: float = FOLLOW_S) -> Iterator[Event]:
    """Events written from this call on, for ever; over rotations, and also when there is no log yet."""
    path = folder / CURRENT
    with suppress(FileNotFoundError), ExitStack() as stack:
        file = stack.enter_context(path.open("rb"))
        file.seek(0, os.SEEK_END)
        # opened at the call, not when the first event is asked for: what comes in between is new
        return _written(path, file, stack.pop_all(), poll_s)
    return _written(path, None, ExitStack(), poll_s)


def _written(path: Path, file: BinaryIO | None, closing: ExitStack, poll_s: float) -> Iterator[Event]:
    pending = b""
    with closing as stack:
        while True:
            # asked before the reading: all that the old file ever gets is then read
            replaced = _replaced(path, file)
            data = file.read() if file is not None else b""
            *lines, pending = (pending + data).split(b"\n")
            yield from _parse(lines)[0]
            if replaced:
                stack.close()
                file, pending = None, b""
                # taken away since it was asked for: then as before there was one
                with suppress(FileNotFoundError):
                    file = stack.enter_context(path.open("rb"))
            elif not data:
                time.sleep(poll_s)


def _replaced(path: Path, file: BinaryIO | None) -> bool:
    """True when the log's name now stands for another file, or has come into being."""
    try:
        now = path.stat()
    except FileNotFoundError:
        return False
    if file is None:
        return True
    open_file = os.fstat(file.fileno())
    return (now.st_ino, now.st_dev) != (open_file.st_ino, open_file.st_dev)
