"""The unix group whose members may reach a rig by its sockets, besides the daemon's own user and root."""

from __future__ import annotations

import grp
import os

from rtctl.errors import ConfigError

KEY = "gateway.group"


def group_id(name: str) -> int | None:
    """Number of the group that `[gateway] group` names; None for an empty name.

    Raises
    ------
    ConfigError
        There is no such group, or this process is not in it and so cannot give it anything."""
    if not name:
        return None
    try:
        number = grp.getgrnam(name).gr_gid
    except KeyError:
        raise ConfigError(
            f"{KEY} {name!r}: there is no such group; make it (sudo groupadd --system {name}), put its "
            f"people into it (sudo usermod -aG {name} USER) and let the daemon be in it, or remove the key"
        ) from None
    # chown(2) to a group lets only its members and root; told here, before the sockets are there
    if os.geteuid() != 0 and number not in {os.getegid(), *os.getgroups()}:
        raise ConfigError(
            f"{KEY} {name!r}: this process is not in that group; in a unit: SupplementaryGroups={name}; for "
            f"a user: sudo usermod -aG {name} USER, then log in again"
        )
    return number


def give(path: str | bytes | os.PathLike[str], number: int, mode: int) -> None:
    """Let the group have a file or folder, with these bits. Raises OSError."""
    # -1: the owner stays
    os.chown(path, -1, number, follow_symlinks=False)
    os.chmod(path, mode)  # noqa: PTH101 - beside its chown
