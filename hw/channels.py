"""What devices measure and take: one table of channels, from which everything that is said of each of them
follows.

Order lists, the oldest sample that counts, scripted faults, what a slow or lost device still shows, the
fields of the tick and their documents look here. A new measured channel is a row, and a device that provides
it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal


@dataclass(frozen=True)
class Reading:
    """One measured channel."""

    name: str
    """As rig files and backends spell it."""
    field: str
    """The tick field that carries it."""
    shape: Literal["axis", "xyz", "scalar"]
    """A number per axis, three of the rig (sensor axes), or one of the rig (a whole number, no quantity)."""
    unit: str
    meaning: str
    """For docs/tick.md."""
    oldest_s: float
    """Oldest sample that a rig file may declare fresh, s; 0: new in every cycle."""
    rank: int
    """Turn of the device in a cycle: what the law needs most is delayed by nobody."""
    number: int
    """What stands for it in compiled schedules of faults (`hw.fault_kinds.Channel`)."""
    optional: bool = False
    """Whether a rig may do without: the field is then NaN from the start on."""

    def dtype(self, n_axes: int) -> tuple[Any, ...]:
        """NumPy field descriptor for a rig of `n_axes` axes."""
        if self.shape == "scalar":
            return (self.field, "<i8")
        return (self.field, "<f8", (n_axes if self.shape == "axis" else 3,))


READINGS = (
    Reading("estop", "estop", "scalar", "1", "1 while the emergency stop input is pressed", 0.010, 4, 5),
    Reading("position", "position_rad", "axis", "rad", "joint angle, link side, unwrapped", 0.0, 0, 1),
    Reading("current", "current_a", "axis", "A", "motor current from the Hall sensor", 0.002, 1, 2),
    Reading(
        "force", "force_n", "xyz", "N", "force of the hand on the tip, sensor axes, untared", 0.010, 2, 3
    ),
    Reading(
        "moment",
        "moment_nm",
        "xyz",
        "N m",
        "moment of the hand about the sensor's origin, sensor axes, untared; NaN (null in JSON) where no "
        "device gives one",
        oldest_s=0.010,
        rank=3,
        number=10,
        optional=True,
    ),
    Reading(
        "temperature",
        "temperature_c",
        "axis",
        "degC",
        "motor temperature; NaN (null in JSON) where the rig has no sensor",
        oldest_s=10.0,
        rank=6,
        number=4,
        optional=True,
    ),
    Reading(
        "velocity",
        "device_velocity_rad_s",
        "axis",
        "rad/s",
        "joint velocity as a device measures it, link side; NaN (null in JSON) where none does",
        oldest_s=0.002,
        rank=5,
        number=9,
        optional=True,
    ),
)
"""In the order of the tick."""

# tables by name are made of the one above: a channel that is added there is in all of them
READING = {reading.name: reading for reading in READINGS}

COMMAND_FIELDS = {"torque": "torque_applied_nm", "current_command": "current_command_a"}
"""Channels that a device takes -> the tick field that carries them."""

CHANNEL_FIELDS: dict[str, str] = {reading.name: reading.field for reading in READINGS} | COMMAND_FIELDS
"""Channel name -> the tick field that carries it."""

# NaN, not 0: 0 would be a sensor that measures nothing, cold or at rest
OPTIONAL_FIELDS = tuple(reading.field for reading in READINGS if reading.optional)
"""Measured fields that are NaN from the start and stay so in a rig without the sensor."""

WHOLE_RIG_CHANNELS = frozenset(reading.name for reading in READINGS if reading.shape != "axis")
"""Channels with one value for the rig; the others have one per axis."""

# position first: the law needs its motor's place more than anything else (hw.rig)
READ_ORDER = tuple(reading.name for reading in sorted(READINGS, key=lambda reading: reading.rank))
"""Who is read first."""

QUANTITIES = tuple(reading for reading in READINGS if reading.shape != "scalar")
"""Channels that are numbers with a unit: those that can be held, and read wrongly."""


def places(name: str, n_axes: int) -> int:
    """How many places of a channel a fault can name, on a rig of `n_axes` axes: sensor axes, or the rig's."""
    return 3 if name in READING and READING[name].shape == "xyz" else n_axes


def device_fields(n_axes: int) -> list[tuple[Any, ...]]:
    """What a device writes in a tick, as NumPy field descriptors: count of samples, faults of the link, and
    every reading."""
    return [("sample_count", "<i8"), ("link_faults", "<u8"), *(reading.dtype(n_axes) for reading in READINGS)]
