"""The TCP ports of the gateway: free, or held by whom."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

from hw.device_holders import command_of
from rtctl.host.machine_line import Line, is_rtctl, text

_LISTENS = "0A"  # TCP_LISTEN, as /proc/net/tcp writes it (include/net/tcp_states.h)
PORTS = 3
"""Requests, targets, telemetry: one after the other."""


def gateway(root: Path, bind: str, port: int) -> Iterator[Line]:
    """Whether the three ports of `[gateway]` are free; nothing where no address is given."""
    if not bind:
        return
    listening = _listening(root)
    taken = [number for number in range(port, port + PORTS) if number in listening]
    for number in taken:
        pid = _owner(root, listening[number])
        who = "a process of another user" if pid is None else f"{command_of(root, pid)} (pid {pid})"
        found = f"TCP port {number} is held by {who}"
        # a rig that runs is examined, too
        if pid is not None and is_rtctl(root, pid):
            yield Line("gateway", "warn", found, "nothing, if that is this rig, running; else end it")
        else:
            fix = f"end it (sudo ss -tlnp 'sport = :{number}' names it), or set another gateway.port"
            yield Line("gateway", "fail", found, fix)
    if not taken:
        yield Line("gateway", "ok", f"TCP ports {port} to {port + PORTS - 1} are free")


def _listening(root: Path) -> dict[int, str]:
    """Inode of the socket of each TCP port that is listened on."""
    found = {}
    for name in ("tcp", "tcp6"):
        for line in (text(root / "proc/net" / name) or "").splitlines()[1:]:
            words = line.split()
            # words of proc(5): 1 is local address:port, 3 the state, 9 the inode
            if len(words) > 9 and words[3] == _LISTENS:
                with contextlib.suppress(ValueError):
                    found[int(words[1].rpartition(":")[2], 16)] = words[9]  # the port is hexadecimal
    return found


def _owner(root: Path, inode: str) -> int | None:
    """The process that has the socket open, as far as this user may see."""
    for process in (root / "proc").glob("[0-9]*"):
        # descriptors of another user cannot be read: the owner stays unknown
        with contextlib.suppress(OSError):
            # a descriptor of a socket leads to its inode, in this form (proc(5))
            if any(str(fd.readlink()) == f"socket:[{inode}]" for fd in (process / "fd").iterdir()):
                return int(process.name)
    return None
