"""The numbers of the newest line, and what became of the lines: fresh, damaged, older, invalid."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from hw.encoder import Modulo
from hw.interface import CHANNEL_FIELDS, LinkFault, Options, Rig
from hw.serial.described_plan import unit_of

_CHECKSUM, _SEQUENCE, _DEVICE = int(LinkFault.CHECKSUM), int(LinkFault.SEQUENCE), int(LinkFault.DEVICE)
_SPAN = 1 << 32
"""A sequence number (a count, or milliseconds) starts over after this, unless its field has a `wrap_at`."""


class LineSample:
    """Values of the channels, and the state of the link.

    Parameters
    ----------
    fields
        `[[device.options.sample.field]]`, dumped; `take` gets numbers in their order.
    rig
        Axes and encoder counts."""

    def __init__(self, fields: Sequence[Options], rig: Rig) -> None:
        n = {"force": 3, "moment": 3}
        self._values: dict[str, Any] = {
            name: array("d", bytes(8 * n.get(name, rig.n_axes)))
            for name in ("position", "velocity", "current", "force", "moment", "temperature")
        }
        for name in ("velocity", "temperature"):
            # of an axis without this sensor; 0 would be a joint that stands, or a motor that is cold
            self._values[name] = array("d", [np.nan] * rig.n_axes)
        self._shown = sorted({field["channel"] for field in fields} & set(self._values))
        self._has_estop = any(field["channel"] == "estop" for field in fields)
        self._rows = [_Row(field, rig) for field in fields]
        self._estop = self.fault = 0
        self._asked = self._driven = self._dropped = False
        self._sequence: int | None = None
        # taken for a wider one, a counter that starts over looks like a board that was powered anew
        spans = [field["wrap_at"] for field in fields if field["channel"] == "sequence"]
        self._span = int(spans[0] or _SPAN) if spans else _SPAN
        self.fresh = False
        self._damaged = self._older = False
        self.count = self.older_in_row = 0
        """Samples shown; lines in a row that were no newer than the last one."""
        self.counts = {"good": 0, "damaged": 0, "older": 0, "invalid": 0, "foreign": 0}

    def forget(self) -> None:
        """A new connection begins. Where the joint stands is kept."""
        self.fresh = self._damaged = self._older = False
        self.fault, self._sequence, self.older_in_row = 0, None, 0
        self._asked = self._driven = self._dropped = False

    def order(self, wanted: bool) -> bool:
        """Whether the board may be enabled if the host wants it: one that has let go only once the host has
        disabled it."""
        if not wanted:
            self._driven = self._dropped = False
        self._asked = wanted and not self._dropped
        return self._asked

    def _saw(self, enabled: bool) -> None:
        if enabled:
            self._driven = self._asked
        elif self._driven:
            self._dropped = True

    def damaged(self) -> None:
        """A line is not what it should be."""
        self.counts["damaged"] += 1
        self._damaged = True

    def invalid(self) -> None:
        """A line has a number that is none: a failure of the device."""
        self.counts["invalid"] += 1
        self.fault = 1

    def take(self, numbers: Sequence[float]) -> None:
        """Make the numbers of a line the newest sample, unless they are older or cannot be."""
        rows = self._rows
        # before any other number is taken: fields stand in any order
        for row, number in zip(rows, numbers, strict=True):
            if row.channel == "sequence" and not self._is_newer(int(number)):
                self.counts["older"] += 1
                self.older_in_row += 1
                self._older = True
                return
        values = [row.value(number) for row, number in zip(rows, numbers, strict=True)]
        # an angle beyond its range comes out as NaN: the whole line is none then, no number of it is taken
        if not all(map(math.isfinite, values)):
            self.invalid()
            return
        self._estop = self.fault = 0
        for row, value in zip(rows, values, strict=True):
            if row.channel == "estop":
                self._estop = int(value)
            # several bits or columns may say so: any one of them counts
            elif row.channel == "fault":
                self.fault |= int(value)
            elif row.channel == "enabled":
                self._saw(value != 0)
            elif row.channel in self._values:
                self._values[row.channel][row.at] = value
        self.counts["good"] += 1
        self.fresh, self.older_in_row = True, 0

    def _is_newer(self, number: int) -> bool:
        if self._sequence is not None and not 0 < (number - self._sequence) % self._span < self._span / 2:
            return False
        # taken over even if a number of this line is none: the next line is compared with what was sent last
        self._sequence = number
        return True

    def judge(self, *, backlogged: bool) -> int:
        """Count a fresh sample, or tell by `LinkFault` bits why there is none; ready for the next cycle."""
        fresh, damaged, older = self.fresh, self._damaged, self._older
        self.fresh = self._damaged = self._older = False
        # in every cycle until a line says otherwise: silence is no repair
        device = _DEVICE if self.fault or self._dropped else 0
        if backlogged:  # anything may be lost behind it, and the order begins anew
            self._sequence, self.older_in_row = None, 0
            return device
        if fresh:
            self.count += 1
            return device
        return device | (_CHECKSUM if damaged else _SEQUENCE if older else 0)

    def bind(self, row: np.ndarray) -> Callable[[], None]:
        """A function that writes the values into the tick `row`."""
        pairs = [(row[CHANNEL_FIELDS[name]][0].data, memoryview(self._values[name])) for name in self._shown]
        estop = row["estop"].data if self._has_estop else None

        def _show() -> None:
            for target, values in pairs:
                target[:] = values
            if estop is not None:
                estop[0] = self._estop

        return _show


class _Row:
    """How a number becomes a value."""

    def __init__(self, field: Options, rig: Rig) -> None:
        self.channel: str = field["channel"]
        self.at = int(field["component"] if self.channel in ("force", "moment") else field["axis"])
        self._mask, self._invert = int(field["mask"]), bool(field["invert"])
        unit = unit_of(field, rig)
        self._scale, self._zero = field["scale"] * unit, field["zero"]
        period = unit * (field["wrap_at"] or 0.0) if self.channel == "position" else 0.0
        self._follow = Modulo(period) if period else None

    def value(self, number: float) -> float:
        """In SI; an angle on its endless axis, NaN when it is beyond its range; a switch is 0 or 1."""
        if self._mask:
            return float((int(number) & self._mask != 0) != self._invert)
        value = (number - self._zero) * self._scale
        return float(value if self._follow is None else self._follow(value))
