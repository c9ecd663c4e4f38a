"""Whose is a folder: what a daemon asks of the one it listens in, and a client of the one it connects to.

A folder with the right name can be made by anybody where all may write (`/tmp/rtctl-1000`). Who owns it, and
who may write beside it, decides whether what answers there is the rig."""

from __future__ import annotations

import os
import stat
from pathlib import Path

REMEDY = "set RTCTL_RUNTIME_DIR to a folder of your own"
_WRITE = stat.S_IWGRP | stat.S_IWOTH


def objection(path: Path, owners: set[int] | None, forbidden: int) -> str:
    """What speaks against a folder, with the remedy; empty: nothing.

    Parameters
    ----------
    path
        The folder, which must be there.
    owners
        User ids that may own it; None: anybody.
    forbidden
        Bits of the mode that it must not have.

    Raises
    ------
    OSError
        It cannot be looked at."""
    status = path.lstat()  # of the link itself: who owns that chooses where it leads
    if not stat.S_ISDIR(status.st_mode):
        return f"{path}: must be a folder, not a link or a file; remove it"
    # by the owner first: whoever owns a folder may change its mode at any time
    if owners is not None and status.st_uid not in owners:
        return f"{path}: belongs to user {status.st_uid}, not to {os.geteuid()}; {REMEDY}"
    if status.st_mode & forbidden:
        return f"{path}: mode {stat.S_IMODE(status.st_mode):04o} lets others in; run: chmod go-rwx {path}"
    return ""


def open_to_others(root: Path) -> str:
    """What speaks against the folder that holds those of the rigs. Raises OSError."""
    sticky = root.lstat().st_mode & stat.S_ISVTX  # as /tmp: others cannot rename or remove what is ours
    return objection(root, {0, os.geteuid()}, 0 if sticky else _WRITE)


def foreign(directory: Path) -> str:
    """Why a client must not believe what answers in a rig's folder; empty where it may, or where nothing is.

    The folder must be this user's or root's. Where root alone can make folders (`/run/rtctl`), it has given
    this one to whom it belongs: to the user of the service."""
    try:
        # who may write beside the folder can put another one in its place
        if reason := open_to_others(directory.parent):
            return reason
        status = directory.parent.lstat()
        by_root = status.st_uid == 0 and not status.st_mode & _WRITE
        return objection(directory, None if by_root else {0, os.geteuid()}, _WRITE)
    except FileNotFoundError:
        return ""
    except OSError as error:
        return f"{error.filename}: cannot be looked at: {error.strerror}; {REMEDY}"


def foreign_endpoint(endpoint: str) -> str:
    """Why not to believe the folder of a ZeroMQ address; "" for an address that is no socket in a folder."""
    # @: an abstract socket, of no folder
    kind, _, path = endpoint.partition("://")
    return foreign(Path(path).absolute().parent) if kind == "ipc" and path[:1] != "@" else ""
