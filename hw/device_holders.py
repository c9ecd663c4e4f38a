"""Which processes hold a device file, as far as this user may see: by their descriptors, their locks, or a
lock file."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

SHOWN = 60
"""Most characters of a command line that are shown."""


def holders(path: str, root: Path = Path("/")) -> list[tuple[int, str]]:
    """Process id and command of every other process that has the device `path` open or locked.

    Descriptors of other users' processes are hidden; a lock (flock, which pyserial takes) or a lock file of
    theirs is not. `root` is where the system's files are."""
    device = root / path.lstrip("/")
    found = {
        *_by_descriptor(root, os.path.realpath(device)),
        *_by_lock(root, device),
        *_by_file(root, device),
    }
    return [(pid, command_of(root, pid)) for pid in sorted(found - {os.getpid(), 0})]


def is_other_end(pid: int, path: str, root: Path = Path("/")) -> bool:
    """Whether the pseudo terminal `path` leads to this process: it plays the device, as a simulator does."""
    name = Path(os.path.realpath(root / path.lstrip("/")))
    if name.parent.name != "pts":
        return False
    for told in (root / "proc" / str(pid) / "fdinfo").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            # proc(5): which terminal a descriptor of /dev/ptmx is the master of
            if ["tty-index:", name.name] in map(str.split, told.read_text().splitlines()):
                return True
    return False


def _by_descriptor(root: Path, wanted: str) -> Iterator[int]:
    # a process may end while it is looked at: what is gone holds nothing
    for process in (root / "proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            for descriptor in (process / "fd").iterdir():
                with contextlib.suppress(OSError):
                    if str(descriptor.readlink()) == wanted:
                        yield int(process.name)
                        break


def _by_lock(root: Path, device: Path) -> Iterator[int]:
    """Locks of all processes stand in one file: `1: FLOCK ADVISORY WRITE 4242 00:06:1084 0 EOF`."""
    with contextlib.suppress(OSError):
        status = device.stat()
        # device in hex, inode in decimal
        wanted = f"{os.major(status.st_dev):02x}:{os.minor(status.st_dev):02x}:{status.st_ino}"
        for line in (root / "proc/locks").read_text().splitlines():
            words = line.split()
            # a lock that waits has an arrow more in its line, and holds nothing yet
            if len(words) > 5 and words[5] == wanted and words[4].isdecimal():
                yield int(words[4])


def _by_file(root: Path, device: Path) -> Iterator[int]:
    """What terminal programs leave; the file of a program that has ended says nothing."""
    for folder in ("run/lock", "var/lock"):
        with contextlib.suppress(OSError, ValueError, IndexError):
            # FHS: the process id as text
            pid = int((root / folder / f"LCK..{Path(os.path.realpath(device)).name}").read_text().split()[0])
            if (root / "proc" / str(pid)).is_dir():
                yield pid


def command_of(root: Path, pid: int) -> str:
    """How a process was started, shortened; its name where that is hidden."""
    folder = root / "proc" / str(pid)
    for name in ("cmdline", "comm"):
        with contextlib.suppress(OSError):
            text = (folder / name).read_bytes().replace(b"\0", b" ").decode(errors="replace").strip()
            if text:
                return text if len(text) <= SHOWN else text[: SHOWN - 3] + "..."
    return "a process"
