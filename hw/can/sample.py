"""The sample being put together from frames: fresh only when every part of it is."""

from __future__ import annotations

import math
from array import array
from itertools import accumulate
from typing import Any

from hw.channels import QUANTITIES, places
from hw.interface import BackendError, LinkFault, Options, Rig

_CHECKSUM, _SEQUENCE = int(LinkFault.CHECKSUM), int(LinkFault.SEQUENCE)


class Sample:
    """Newest values, and bits telling which arrived since the last complete sample.

    Frame handlers write the values and raise their bit in `fresh`; the backend takes the sample when
    `fresh == needed`. A part whose number is not finite raises no bit: it has not arrived."""

    __slots__ = (
        "counts",
        "current_a",
        "estop",
        "faults",
        "force_n",
        "fresh",
        "moment_nm",
        "needed",
        "of",
        "position_rad",
        "start",
        "temperature_c",
        "values",
        "velocity_rad_s",
    )  # fmt: skip

    def __init__(self, n_axes: int) -> None:
        many = [places(reading.name, n_axes) for reading in QUANTITIES]
        # one row: compiled cycles write it by place, Python by name, and taking a sample is one copy
        self.values: Any = memoryview(array("d", bytes(8 * sum(many))))
        """All of the numbers below, one after the other."""
        ends = list(accumulate(many))
        self.of: dict[str, Any] = {
            reading.name: self.values[end - n : end]
            for reading, n, end in zip(QUANTITIES, many, ends, strict=True)
        }
        """The numbers of each channel; those of drives have a name of their own."""
        self.start = {reading.name: end - n for reading, n, end in zip(QUANTITIES, many, ends, strict=True)}
        """Where those begin in `values`."""
        self.position_rad, self.current_a = self.of["position"], self.of["current"]
        self.velocity_rad_s, self.temperature_c = self.of["velocity"], self.of["temperature"]
        self.force_n, self.moment_nm = self.of["force"], self.of["moment"]
        self.estop = 0
        # a bit for each part: a sample of this position and last cycle's current would be of no instant
        self.fresh = self.needed = 0
        self.faults = 0
        """`LinkFault` bits of this cycle's frames."""
        self.counts = {"damaged": 0, "not_newer": 0, "not_finite": 0}

    def need(self) -> int:
        """A new bit that a complete sample must have."""
        # above all that are given: bits are of one whole number, however many drives
        bit = 1 << self.needed.bit_length()
        self.needed |= bit
        return bit

    def damaged(self) -> None:
        """A frame has the wrong length, layout or checksum: dropped."""
        self.counts["damaged"] += 1
        # CAN's own CRC has passed: the length or what is inside is wrong
        self.faults |= _CHECKSUM

    def not_newer(self) -> None:
        """A frame repeats a counter or goes back: dropped."""
        self.counts["not_newer"] += 1
        self.faults |= _SEQUENCE

    def not_finite(self) -> None:
        """A value is NaN or infinite: as if it had not come."""
        self.counts["not_finite"] += 1


class Shaft:
    """From the drive's shaft to the joint and back, for one axis.

    `direction` turns the sign of everything the drive reports and takes. `shaft` is what its angle and
    torque mean: the motor (before the gear) or the link (the drive knows the gear); of a linear axis the link
    is the screw."""

    __slots__ = ("current_max_a", "direction", "offset_rad", "rad_per_turn", "torque_per_ampere")

    def __init__(self, table: Options, rig: Rig, axis: int) -> None:
        ratio = float(rig.gear_ratio[axis])
        at_motor = table["shaft"] == "motor"
        self.direction = float(table["direction"])
        self.offset_rad = float(table["offset_rad"])
        # of the motor, whatever the shaft: it is what its windings bear
        self.current_max_a = float(table["current_max_a"])
        motion, lead_m = rig.moves(axis)
        if motion == "linear" and not lead_m:
            raise BackendError(
                f"axis {axis} of this device is a linear motor (lead_m 0), and a CAN drive speaks of turns: "
                "give the axis as lead_m the travel that the drive counts as one turn, with counts "
                "(encoder_counts_per_rev) and torque constant (N m/A) of that turn (docs/linear-axis.md)"
            )
        # the ratio of a screw is in rad of the motor a m: without its own 2 pi / lead rad a m, a turn would
        # be 6 m, and the torque of 5 mm of lead 1257 times what is meant
        screw = 2 * math.pi / lead_m if lead_m else 1.0
        self.rad_per_turn = self.direction * 2 * math.pi / (ratio if at_motor else screw)
        gear = 1.0 if at_motor else ratio / screw
        self.torque_per_ampere = self.direction * float(rig.torque_constant_nm_a[axis]) * gear

    def limited(self, current_a: float) -> float:
        """The current within +-`current_max_a`; one that is not finite is 0, as a drive would refuse it."""
        # NaN or infinite
        # infinity less itself is NaN, and NaN differs from everything: one comparison for both
        if current_a - current_a != 0.0:
            return 0.0
        limit = self.current_max_a
        return limit if current_a > limit else -limit if current_a < -limit else current_a
