"""What the last test pulses measured of a rig's timing: a small file in its state folder
(`rtctl.state_file`).

A run writes it after arming, passed or refused; `rtctl check` and `rtctl run` read it beside what the rig
file declares. It is of one set of devices: after any change of a device's kind or options, or of the loop's
rate, it says nothing."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from rtctl import state_file
from rtctl.rig_file.config import LoadedConfig

NAME = "timing.json"
MOST_BYTES = 1 << 20

BOUNDS: dict[str, tuple[float, float]] = {
    # what a test pulse of 80 ms can answer lies far inside: beyond is damage, or another unit
    "delay_s": (0.0, 10.0),
    "lag_s": (0.0, 10.0),
    "gain": (-100.0, 100.0),
    "offset_nm": (-1e4, 1e4),
    "sample_period_s": (1e-6, 10.0),
}
"""Bounds of each number that is read."""


@dataclass(frozen=True)
class AxisTiming:
    """One axis, as its current answered the test pulse.

    Attributes
    ----------
    delay_s
        Least delay of the torque that the answer allows, the current loop's lag included, s.
    lag_s
        Of that the time constant of the current loop, s.
    gain, offset_nm
        Current measured over sent; what it shows beyond that, as torque at the joint, N m.
    sample_period_s
        Mean time between samples that the law took, s.
    date
        When, ISO 8601."""

    delay_s: float
    lag_s: float
    gain: float
    offset_nm: float
    sample_period_s: float
    date: str = ""


def devices_sha256(loaded: LoadedConfig) -> str:
    """What the timing is a property of: rate of the loop, and of every device kind, options but scripted
    faults, and axes: what is kept by the name of an axis is of the drive that serves it."""
    options = [
        # a fault that is played is no other device
        {key: value for key, value in table.items() if key != "faults"}
        for table in (loaded.options, *loaded.more_options)
    ]
    config = loaded.config
    every = [axis.name for axis in config.axis]
    # axes by name: two drives that change places keep their options, and not their delays
    devices = [(device.kind, device.axes or every, device.channels) for device in config.device]
    facts = [config.loop.rate_hz, devices, options]
    # sorted: the order of keys in a file is no property of a device
    return hashlib.sha256(json.dumps(facts, sort_keys=True, default=str).encode()).hexdigest()


def write(folder: Path, devices: str, axes: Mapping[str, AxisTiming]) -> None:
    """Keep these axes' timing, beside what is known of the others of the same devices. Raises OSError."""
    # axes that were not tested this time keep what is known of them
    known = {**read(folder, devices), **axes}
    state_file.write(folder / NAME, devices, {name: asdict(axis) for name, axis in known.items()})


def read(folder: Path, devices: str) -> dict[str, AxisTiming]:
    """Timing of each axis that is known, by its name; none from a file that is missing, damaged or of other
    devices."""
    kept = state_file.read(folder / NAME, devices, MOST_BYTES)
    found = {name: _axis(table) for name, table in kept.items()}
    return {name: axis for name, axis in found.items() if axis is not None}


def _axis(table: object) -> AxisTiming | None:
    """One axis' table, or None unless every number is there and within its bounds."""
    if not isinstance(table, dict):
        return None
    numbers: dict[str, float] = {}
    for name, (low, high) in BOUNDS.items():
        value = table.get(name)
        # to Python true is a number; NaN is within no bounds
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            return None
        numbers[name] = float(value)
    return AxisTiming(**numbers, date=str(table.get("date", "")))


def plausible(axis: AxisTiming) -> bool:
    """True when every number is finite and within the bounds that `read` asks."""
    return all(
        math.isfinite(getattr(axis, name)) and low <= getattr(axis, name) <= high
        for name, (low, high) in BOUNDS.items()
    )
