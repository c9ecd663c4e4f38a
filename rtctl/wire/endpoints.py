"""A private place to listen: the rig's runtime folder, and the lock that makes it one daemon's own.

A second bind on a live `ipc://` path succeeds and takes the traffic, so the lock file, not the socket,
decides who runs the rig. Locks and stale sockets of a daemon that was killed are no obstacle: the kernel
drops the lock with the process, and binding replaces the socket."""

from __future__ import annotations

import fcntl
import os
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Self

from rtctl.errors import BusyError, ConfigError
from rtctl.standard_streams import above_standard_streams
from rtctl.wire.private_folder import REMEDY, objection, open_to_others
from rtctl.wire.protocol import LOCK_NAME, Endpoints, endpoints_in, rig_directory
from rtctl.wire.unix_group import give

_OF_THE_GROUP = 0o750
"""Mode of a runtime folder that a group may enter."""

ORPHAN_S = 3.0
"""Longest wait for the loop of a host that has died: a ramp takes 50 ms."""


class RuntimeDirectory:
    """A rig's runtime folder, held by this process until `release` or the end of the process."""

    def __init__(self, path: Path, lock_fd: int) -> None:
        self.path = path
        self.endpoints: Endpoints = endpoints_in(path)
        self._lock_fd = lock_fd

    @classmethod
    def acquire(cls, rig: str, root: str | Path | None = None) -> Self:
        """Make the rig's runtime folder, check that it is private, and take its lock.

        Raises
        ------
        BusyError
            Another process holds the rig; the text names it.
        ConfigError
            A folder that is not this user's own or that others may enter, or a path too long for a socket."""
        directory = rig_directory(rig, None if root is None else Path(root))
        endpoints_in(directory)  # raises for a path that is too long, before anything is made
        _make_private(directory)
        try:
            return cls(directory, _lock(rig, directory / LOCK_NAME))
        except OSError as error:
            raise _unusable(error, directory) from error

    @property
    def lock_fd(self) -> int:
        """Descriptor that holds the lock, -1 once released; a process that inherits it holds the lock too."""
        return self._lock_fd

    def open_to(self, group: int) -> None:
        """Let the members of a group in, to the sockets that are theirs. Raises ConfigError."""
        try:
            give(self.path, group, _OF_THE_GROUP)
        except OSError as error:
            raise ConfigError(
                f"{self.path}: cannot give it to group {group}: {error.strerror}; {REMEDY}"
            ) from error

    def note_holder(self, pid: int) -> None:
        """Write down a process that inherits the lock, for whoever finds the rig held."""
        # over the line of `_lock`, which is shorter: two writes would leave a moment without a holder
        os.pwrite(self._lock_fd, f"{os.getpid()} {pid}\n".encode(), 0)

    def lost(self) -> str:
        """Why no new client can reach the daemon; empty while the folder is the one that it opened.

        A folder for as long as a user is logged in (XDG_RUNTIME_DIR), or one that is cleaned (/tmp), goes
        with its sockets and its lock while the daemon runs on."""
        lock = self.path / LOCK_NAME
        try:
            here, held = lock.stat(), os.fstat(self._lock_fd)
        except OSError as error:
            return f"{lock}: {error.strerror}"
        # a door that is cut goes with its socket for a moment (decision 0010); the lock never does
        return "" if os.path.samestat(here, held) else f"{lock}: it is another file than was locked"

    def describe(self) -> list[str]:
        """Lines that tell a person where to connect."""
        return [
            f"telemetry {self.endpoints.telemetry}",
            f"commands  {self.endpoints.command}",
            f"targets   {self.endpoints.targets}",
        ]

    def release(self) -> None:
        """Let another daemon have the rig. Idempotent. The lock file stays: removing it would be a race."""
        if self._lock_fd >= 0:
            os.ftruncate(self._lock_fd, 0)  # while the lock still holds: nobody reads who held it last
            os.close(self._lock_fd)
            self._lock_fd = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.release()


@contextmanager
def kept_alone(rig: str, folder: Path) -> Iterator[None]:
    """Hold the rig's state folder: a second daemon of that name, which has another runtime folder, would take
    up what this one knows of its devices, and write over it (decision 0141).

    Raises
    ------
    BusyError
        Another process holds it; the text names it."""
    try:
        # as the event log would make it, which comes later: what happened at a rig is not for everybody
        folder.mkdir(mode=0o750, parents=True, exist_ok=True)
        fd = _lock(rig, folder / LOCK_NAME)
    except OSError:
        yield  # where nothing can be written nobody is written over; what is lost is told as it is lost
        return
    try:
        yield
    finally:
        os.close(fd)


def _lock(rig: str, path: Path) -> int:
    """Take the lock file; returns its descriptor, which holds the lock until it is closed."""
    # through a link another file would be emptied below
    fd = above_standard_streams(os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600))
    if not _take(fd):
        holders = os.pread(fd, 64, 0).decode("ascii", "replace").split() or ["unknown"]
        alive = [pid for pid in holders if not pid.isdecimal() or _is_alive(int(pid))]
        os.close(fd)
        raise BusyError(
            f"rig {rig!r} is already run by process {' and '.join(alive or holders)} (lock {path}); "
            "stop that one first, or give this rig another name"
        )
    # the one before may have written a longer line
    os.ftruncate(fd, 0)
    os.pwrite(fd, f"{os.getpid()}\n".encode(), 0)
    return fd


def _take(fd: int) -> bool:
    """Lock it; a loop whose host has died holds the lock while it ramps down: that is waited for."""
    end = time.monotonic() + ORPHAN_S
    while True:
        try:
            # the lock is of the open file: the loop, which inherits the descriptor, holds it as well
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            host = os.pread(fd, 64, 0).decode("ascii", "replace").partition(" ")[0].strip()
            orphaned = host.isdecimal() and not _is_alive(int(host))
            if not orphaned or time.monotonic() > end:
                return False
            # a ramp takes 50 ms: asked often enough to follow it at once
            time.sleep(0.01)
        else:
            return True


def _is_alive(pid: int) -> bool:
    """Whether such a process runs; one that has ended and was not yet waited for does not."""
    try:
        stat_line = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    # Z: ended, and not yet waited for; X: gone while it was looked at (proc(5))
    return stat_line.rpartition(")")[2].split()[0] not in "ZX"


def _make_private(directory: Path) -> None:
    root = directory.parent
    try:
        # from the first moment on: a chmod afterwards would leave one in which others come in
        with private_umask():
            root.mkdir(mode=0o700, parents=True, exist_ok=True)
            directory.mkdir(mode=0o700, exist_ok=True)
        _close_to_groups(directory)
        reason = open_to_others(root) or objection(directory, {os.geteuid()}, stat.S_IRWXG | stat.S_IRWXO)
    except OSError as error:
        raise _unusable(error, directory) from error
    if reason:
        raise ConfigError(reason)


def _unusable(error: OSError, directory: Path) -> ConfigError:
    # a full disk is told of a descriptor, without a name
    return ConfigError(
        f"{error.filename or directory}: cannot use it as runtime folder: {error.strerror}; {REMEDY}"
    )


def _close_to_groups(directory: Path) -> None:
    """Take back what a daemon before this one gave to a group (`open_to`). Raises OSError."""
    status = directory.lstat()
    if (
        stat.S_ISDIR(status.st_mode)
        and status.st_uid == os.geteuid()
        and stat.S_IMODE(status.st_mode) == _OF_THE_GROUP
    ):
        directory.chmod(0o700)


@contextmanager
def private_umask() -> Iterator[None]:
    """Files and sockets made inside are for this user alone."""
    # of the whole process, threads too: put back at once
    before = os.umask(0o077)
    try:
        yield
    finally:
        os.umask(before)
