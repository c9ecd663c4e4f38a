"""What both ends of the wire agree on: version, topics, bounds, and where a rig's sockets are.

The host (`rtctl.host`) and the client (`rtctl.client`) both import this and nothing of each other.
`docs/protocol.md` says the same for other languages."""

from __future__ import annotations

import hashlib
import json
import os
import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rtctl import tick
from rtctl.errors import ConfigError
from rtctl.wire.private_folder import foreign

PROTOCOL_VERSION = 1

TOPIC_STATE = b"rtctl/state"
TOPIC_TICKS = b"rtctl/ticks"
TOPIC_EVENT = b"rtctl/event"
TOPIC_HEALTH = b"rtctl/health"
TOPIC_COMMAND = b"rtctl/command"
TOPIC_SETUP = b"rtctl/setup"
TOPICS = (TOPIC_STATE, TOPIC_TICKS, TOPIC_EVENT, TOPIC_HEALTH, TOPIC_COMMAND, TOPIC_SETUP)
"""All of them: a subscriber that asks for others is expelled in the end."""

# the largest request, targets of eight axes, has 231 bytes, and some 60 more with the longest id
MAX_REQUEST_BYTES = 4096
MAX_OUTSTANDING_REQUESTS = 8
"""Requests one client may have unanswered; the gateway's receive queue holds as many."""

ROLES = ("observer", "renderer", "operator")
"""What a client may be, each including what the ones before it may do."""

CONNECTIONS = 16
"""Clients that may be connected to one endpoint at a time."""

HANDSHAKE_MS = 2000
"""A connection that has not authenticated itself within this time is closed."""

HEARTBEAT_MS = 500
"""Over TCP each end asks the other so often whether it is there, and takes a connection that is silent for
three of these for broken: 2 s at most, as long as clients wait, so that a request that the network kept for
longer comes to nothing."""

IPC_PATH_BYTES = 107
"""Longest path of a Unix socket on Linux (`sun_path` of 108 bytes, less the closing zero)."""

LOCK_NAME = "lock"
VIEW_NAME = "view"
"""File in a rig's runtime folder: the operator's address of the daemon's own live view."""

_RIG_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,31}")


@dataclass(frozen=True)
class Endpoints:
    """ZeroMQ addresses of one rig: telemetry to hear, requests to ask, targets to send."""

    telemetry: str
    command: str
    targets: str = ""


SERVICE_ROOT = Path("/run/rtctl")
"""Where the rigs that systemd runs have their folders."""


def runtime_root() -> Path:
    """Folder that holds one folder per running rig.

    The first of: RTCTL_RUNTIME_DIR, the folder above RUNTIME_DIRECTORY (systemd makes the rig's own),
    XDG_RUNTIME_DIR/rtctl, and a folder of this user in the temporary directory."""
    if chosen := os.environ.get("RTCTL_RUNTIME_DIR"):
        return Path(chosen).absolute()
    if own := os.environ.get("RUNTIME_DIRECTORY", "").split(":")[0]:
        return Path(own).absolute().parent
    session = os.environ.get("XDG_RUNTIME_DIR")
    # without a session (cron, su) the variable may name a folder that is gone
    if session and Path(session).is_absolute() and Path(session).is_dir():
        return Path(session) / "rtctl"
    return Path(tempfile.gettempdir()).absolute() / f"rtctl-{os.geteuid()}"


def rig_directory(rig: str, root: Path | None = None) -> Path:
    """Folder of the rig called `rig`. Raises ConfigError for a name that is none."""
    if not _RIG_NAME.fullmatch(rig):
        raise ConfigError(f"rig name {rig!r}: a letter, then at most 31 letters, digits, - or _")
    return (root or runtime_root()).absolute() / rig


def client_directory(rig: str, root: Path | None = None) -> Path:
    """Folder in which a client looks for the rig: this user's, else that of the service.

    Raises
    ------
    ConfigError
        A name that is none, or a folder of somebody else who could answer in the rig's place."""
    own = rig_directory(rig, root)
    service = SERVICE_ROOT / rig
    reason = foreign(own)
    if root is None and (reason or not own.exists()) and service.exists():
        own, reason = service, foreign(service)
    if reason:
        raise ConfigError(f"{reason} (whoever owns it could answer in place of the rig)")
    return own


def endpoints_in(directory: Path) -> Endpoints:
    """Addresses of the sockets in a rig's folder. Raises ConfigError when the path is too long for one."""
    longest = directory / "telemetry"
    size = len(os.fsencode(longest))
    if size > IPC_PATH_BYTES:
        raise ConfigError(
            f"{longest}: {size} bytes, a socket's path may have {IPC_PATH_BYTES}; "
            "set RTCTL_RUNTIME_DIR to a folder with a shorter path"
        )
    return Endpoints(
        telemetry=f"ipc://{longest}",
        command=f"ipc://{directory / 'command'}",
        targets=f"ipc://{directory / 'targets'}",
    )


def tcp_endpoints(address: str, port: int) -> Endpoints:
    """Addresses over TCP: requests on `port`, targets on the next, telemetry on the one after it."""
    return Endpoints(
        telemetry=f"tcp://{address}:{port + 2}",
        command=f"tcp://{address}:{port}",
        targets=f"tcp://{address}:{port + 1}",
    )


def running_rigs(root: Path | None = None) -> list[str]:
    """Names of the rigs whose daemons run, by the process ids in their lock files.

    It looks without locking: a look must never make a daemon that starts at that moment believe the rig is
    taken. Folders of other users are passed over."""
    roots = [root] if root else [runtime_root(), SERVICE_ROOT]
    # a set: both roots may be one folder, and each rig is told once
    locks = sorted({lock for folder in roots for lock in folder.glob(f"*/{LOCK_NAME}")})
    return [lock.parent.name for lock in locks if _RIG_NAME.fullmatch(lock.parent.name) and _alive(lock)]


def _alive(lock: Path) -> bool:
    if foreign(lock.parent):
        return False
    try:
        # O_NONBLOCK: a FIFO in its place would wait for a writer
        fd = os.open(lock, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK)
        with os.fdopen(fd, "rb") as file:
            # signal 0 only asks whether there is such a process
            os.kill(int(file.read(64).split()[0]), 0)
    except PermissionError:
        # the rig of another user, whose group this one is in: else its folder could not be looked into
        return True
    except (OSError, ValueError, IndexError, OverflowError):
        return False
    return True


def schema_sha256(n_axes: int, motions: Sequence[str] = ()) -> str:
    """Fingerprint of the tick record: equal fingerprints mean equal columns, units and meanings."""
    text = json.dumps(tick.json_schema(n_axes, motions), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
