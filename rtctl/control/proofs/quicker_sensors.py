"""Force sensors that are less late than declared: a proof that counts on a sensor has to hold with these,
too."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from rtctl.control.proofs.drive_in_hand import Drive

L = TypeVar("L", bound="Drive")


def quicker_sensors(loop: L) -> list[L]:
    """The loop with a force sensor that is less late than declared, by quarters, with and without its
    low-pass, but not itself."""
    ticks = {round(share * loop.sensor_ticks) for share in (0.0, 0.25, 0.5, 0.75, 1.0)}
    cuts = {0.0, loop.sensor_hz}
    both = [replace(loop, sensor_ticks=late, sensor_hz=hz) for late in sorted(ticks) for hz in sorted(cuts)]
    return [one for one in both if one != loop]
