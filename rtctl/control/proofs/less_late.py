"""Rigs that are less late than declared: a proof that counts on a force that is late, or on a torque that is,
has to hold with these, too."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from rtctl.control.proofs.drive_in_hand import Drive

L = TypeVar("L", bound="Drive")

LATENESS = ("delay", "lag_hz", "sample_ticks", "sensor_hz", "sensor_ticks")
"""Fields of a drive that say how late it is."""


def quicker_sensors(loop: L) -> list[L]:
    """The loop with a force sensor that is less late than declared, by quarters, with and without its
    low-pass, but not itself."""
    ticks = {round(share * loop.sensor_ticks) for share in (0.0, 0.25, 0.5, 0.75, 1.0)}
    # its low-pass is there or not: an early force that is slow turns by no more than one of the two ends
    cuts = {0.0, loop.sensor_hz}
    both = [replace(loop, sensor_ticks=late, sensor_hz=hz) for late in sorted(ticks) for hz in sorted(cuts)]
    return [one for one in both if one != loop]


def less_late(loop: L) -> list[L]:
    """The loop with `quicker_sensors`, and with less between law and joint: no delay and no lag with samples
    as old as declared and with fresh ones, and fresh ones alone, with and without the lag; each behind the
    sensor as declared and behind one that is immediate; but not itself.

    What rings is force and torque that do not belong to the same time, so the ends decide
    (docs/theory.md 6.4)."""
    age = loop.sample_ticks
    # the ends alone: every delay, lag and age in between would be forty loops, and found nothing more in 115
    # tuned ones (decision 0143)
    drives = ((0.0, 0.0, age), (0.0, 0.0, 1), (loop.delay, loop.lag_hz, 1), (loop.delay, 0.0, 1))
    behind = (loop, replace(loop, sensor_ticks=0, sensor_hz=0.0))
    others = [
        replace(one, delay=delay, lag_hz=lag_hz, sample_ticks=ticks)
        for one in behind
        for delay, lag_hz, ticks in drives
    ]
    return [one for one in dict.fromkeys([*quicker_sensors(loop), *others]) if one != loop]
