"""The argument CONFIG|RIG: a rig file, or the name of a rig."""

from __future__ import annotations

from pathlib import Path

from hw.outside import read_toml, shown
from rtctl.errors import ConfigError


def rig_name(rig: str) -> str:
    """Name of the rig: read from its file when `rig` is one, without judging the rest. Raises ConfigError."""
    path = Path(rig)
    if not (rig.endswith(".toml") or path.is_file()):
        return rig
    try:
        table = read_toml(path).get("rig")
    except OSError as error:
        raise ConfigError(f"{rig}: {error.strerror}") from error
    except ValueError as error:
        raise ConfigError(f"{rig}: not TOML: {shown(error)}") from error
    name = table.get("name") if isinstance(table, dict) else None
    if not isinstance(name, str):
        raise ConfigError(f"{rig}: [rig] name is missing; it names the rig to ask")
    return name
