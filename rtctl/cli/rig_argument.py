"""The argument CONFIG|RIG: a rig file, or the name of a rig."""

from __future__ import annotations

from pathlib import Path


def rig_name(rig: str) -> str:
    """Name of the rig: read from its file when `rig` is one. Raises ConfigError for an unusable file."""
    from rtctl.config import load

    return load(rig).config.rig.name if rig.endswith(".toml") or Path(rig).is_file() else rig
