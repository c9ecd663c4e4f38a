"""Where a rig's event log and incidents are kept from one run to the next, and its recordings."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from hw.outside import real, user_folder
from rtctl.wire.protocol import rig_directory

if TYPE_CHECKING:
    from rtctl.rig_file.config import LoadedConfig

SYSTEM_STATE = Path("/var/lib/rtctl")
"""Where systemd puts `StateDirectory=rtctl` of the shipped unit."""


def state_root() -> Path:
    """Folder that holds one folder per rig.

    The first of: RTCTL_STATE_DIR, STATE_DIRECTORY (set by systemd), XDG_STATE_HOME/rtctl, and
    `.local/state/rtctl` in the home folder."""
    # systemd may name several, one behind another; the unit asks for one
    chosen = os.environ.get("RTCTL_STATE_DIR") or os.environ.get("STATE_DIRECTORY", "").split(":")[0]
    if chosen:
        return Path(chosen).absolute()
    return user_folder("XDG_STATE_HOME", ".local", "state") / "rtctl"


def state_folder(rig: str, root: Path | None = None) -> Path:
    """Folder of the rig called `rig`, which need not exist. Raises ConfigError for a name that is none."""
    return rig_directory(rig, root or state_root())


def written_folder(rig: str, root: Path | None = None) -> Path:
    """The folder to read: this user's, or the system service's where only that one has been written."""
    own = state_folder(rig, root)
    system = SYSTEM_STATE / rig
    # own first: a rig that this user runs by hand is not the service's of the same name
    return system if root is None and not own.is_dir() and _may_look_into(system) else own


def _may_look_into(folder: Path) -> bool:
    try:
        return folder.is_dir()
    except PermissionError:  # StateDirectoryMode=0750 of the unit: it is not for this user
        return False


def recording_folder(loaded: LoadedConfig) -> Path:
    """Where the rig file wants recordings; without a word, the rig's state folder."""
    table = loaded.config.record
    if table is not None and table.folder:
        return real(loaded.path.parent / table.folder)
    return state_folder(loaded.config.rig.name) / "recordings"
