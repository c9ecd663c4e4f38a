"""What lies between a force and what the law reads of it: what the device declares and the rig file says.

The worse counts, of either part by itself; what nobody says is told as not proved (`verdicts_of_force`)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hw import registry
from hw.interface import ForceSensor
from hw.rig_words import subset
from rtctl.rig_file.config import LoadedConfig

_SLACK_TICKS = 1e-6
"""A delay that was given in ticks is a whole number again."""


@dataclass(frozen=True)
class ForceWay:
    """Low-pass and delay of a force sensor, and who said so."""

    sensor_hz: float = 0.0
    """Cut-off of its own low-pass; 0: none."""
    ticks: int = 0
    """What it is late besides, whole ticks."""
    said_by: str = ""
    """Empty: nobody."""


def of_axis(loaded: LoadedConfig, axis: int) -> ForceWay:
    """What is declared and configured of the force that moves this axis."""
    table = loaded.config.axis[axis].force
    says = [("rig file", ForceSensor(table.sensor_lowpass_hz, table.sensor_delay_s))]
    says = [(who, one) for who, one in says if one != ForceSensor()]
    age_ticks = 0
    for member in loaded.members():
        if "force" not in member.channels:
            continue
        age_ticks = max(age_ticks, member.max_age_ticks)
        rig = subset(loaded.config.hardware(), member.axes)
        found = registry.force_sensor(member.kind, member.options, rig)
        says += [(member.label, found)] if found is not None else []
    # 0 is none, not the slowest: a device that says a delay alone takes no low-pass of the rig file away
    cuts = [one.lowpass_hz for _, one in says if one.lowpass_hz > 0]
    late_s = max((one.delay_s for _, one in says), default=0.0)
    return ForceWay(
        min(cuts, default=0.0),  # each part at its worst, whoever says it
        # up: a proof for a later force covers an earlier one, tried at quarters of it
        # nor earlier than its samples may be old; where nobody says anything nothing is counted on
        max(math.ceil(late_s / loaded.config.period_s - _SLACK_TICKS), age_ticks if says else 0),
        " and ".join(who for who, _ in says),
    )
