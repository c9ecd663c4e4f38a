"""What a rig file opens to others: ports, keys, groups."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rtctl.wire.unix_group import group_id

if TYPE_CHECKING:
    from rtctl.rig_file.config import LoadedConfig


@dataclass(frozen=True)
class Openings:
    """What a rig file opens besides ipc for the own user: TCP for clients with keys, a port for viewers, ipc
    for a group."""

    bind: str = ""
    port: int = 0
    keys: Path | None = None
    viewer_port: int | None = None
    group: int | None = None

    @classmethod
    def of(cls, loaded: LoadedConfig) -> Openings:
        """As the rig file says. Raises ConfigError for a group that is none."""
        gateway, telemetry = loaded.config.gateway, loaded.config.telemetry
        viewer_port = telemetry.plotjuggler_port if telemetry.plotjuggler else None
        return cls(gateway.bind, gateway.port, loaded.keys_folder(), viewer_port, group_id(gateway.group))


NOTHING_OPENED = Openings()
"""Ipc for the own user, and no more."""
