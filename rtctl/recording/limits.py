"""How long a file of a recording grows, and what it leaves of the disk."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rtctl.rig_file.host_tables import RecordTable


@dataclass(frozen=True)
class Limits:
    """When a new file begins, and how much of the disk is left alone."""

    # what any file system takes, FAT's 4 GB too, and one copies over a network at one go
    file_bytes: int = 1_000_000_000
    file_s: float = 3600.0
    # what else the machine keeps on that disk, the event log with it, goes on
    free_bytes: int = 200_000_000

    @classmethod
    def of(cls, table: RecordTable) -> Limits:
        """The table of a rig file in bytes and seconds."""
        return cls(
            file_bytes=round(table.file_mb * 1e6),
            file_s=table.file_minutes * 60.0,
            free_bytes=round(table.free_mb * 1e6),
        )
