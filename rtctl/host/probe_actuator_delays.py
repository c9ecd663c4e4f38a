"""How late each axis's motor is: as its devices declare, and as the last test pulse measured."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from rtctl.check import lateness
from rtctl.rig_file import measured_timing as timing
from rtctl.rig_file.config import LoadedConfig


def actuators(loaded: LoadedConfig, folder: Path) -> list[dict[str, Any]]:
    """Declared delay of each axis beside what the last test pulse measured, which needs an armed rig.

    `folder` is the rig's state folder; `measured` is None where nothing is known of these devices."""
    # by the devices: of others, or with other options, it was measured on another rig
    known = timing.read(folder, timing.devices_sha256(loaded))
    found = []
    for a, axis in enumerate(loaded.config.axis):
        late = lateness.of_axis(loaded, a)
        found.append({
            "axis": axis.name,
            "motion": axis.motion,
            "declared_delay_ms": round(late.declared_s(loaded.config.period_s) * 1e3, 4),
            "declared_by": late.delay_from,
            "measured": asdict(known[axis.name]) if axis.name in known else None,
        })  # fmt: skip
    return found
