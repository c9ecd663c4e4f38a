"""Whether the devices of a rig file make up a whole rig, and what the loop process is told of each.

Every channel is provided by exactly one device (an emergency stop by any number: one pressed is enough), as
every axis takes its command through one. Nothing is opened to find that out."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from hw import registry
from hw.channels import READINGS
from hw.interface import WHOLE_RIG_CHANNELS, BackendError, Channels, Rig
from hw.member import Member
from hw.rig_words import subset
from rtctl.rig_file.rig_tables import DeviceTable
from rtctl.rig_file.shared_wires import Wire, claimed, shared

MAX_AGE_S: dict[str, float] = {reading.name: reading.oldest_s for reading in READINGS}
"""Oldest sample of each channel that a rig file may declare fresh, s. The position is new in every cycle."""

BUDGET_SHARE = 0.4
"""Share of the period that the real devices may take for reading, together, by default."""
BUDGET_MAX_SHARE = 0.8
COMMANDS = ("torque", "current_command")


@dataclass(frozen=True)
class Composition:
    """The devices of a rig file and the facts they are judged by. `options` are validated, one per table."""

    tables: Sequence[DeviceTable]
    options: Sequence[Mapping[str, Any]]
    axis_names: Sequence[str]
    absent: Sequence[str]
    hardware: Rig
    clock: str = "wall"
    velocity_axes: Sequence[int] = ()
    """Axes whose law looks at the velocity that a device measures."""
    moments: bool = False
    """Whether the law uses the moments of the force sensor."""

    @property
    def simulated(self) -> bool:
        """True when no device has a real actuator."""
        return all(registry.lookup(table.kind).simulated for table in self.tables)

    @cached_property
    def labels(self) -> list[str]:
        """How errors name each device."""
        return [f"device[{i}] {table.name or table.kind!r}" for i, table in enumerate(self.tables)]

    def members(self) -> tuple[Member, ...]:
        """The devices of a valid rig file, as plain data for `hw.rig.compose`. Raises BackendError."""
        return tuple(
            Member(
                kind=table.kind,
                options=dict(self.options[i]),
                label=self.labels[i],
                axes=self.axes(i),
                channels=tuple(sorted(self._used(i))),
                max_age_ticks=self._max_age_ticks(i),
                budget_ns=self._budget_ns(i),
                claims=claimed(table.kind, self.options[i]),
            )
            for i, table in enumerate(self.tables)
        )

    def faults(self) -> list[str]:
        """Everything that keeps the devices from being one whole rig: a line each, naming devices and key."""
        out = self._name_faults()  # first: a wrong name would make a dozen faults of one
        if out:
            return out
        try:
            out = self._channel_faults()
        except BackendError as error:
            return [str(error)]
        if out:
            return out
        out = self._overlaps() + self._gaps() + self._budget_faults() + self._clock_faults()
        for i in range(len(self.tables)):
            out += self._age_faults(i)
        for wire in self.shared_wires():
            out += wire.faults(self._rate_hz)
        return out

    def shared_wires(self) -> list[Wire]:
        """The wires that more than one device is on."""
        return shared([table.kind for table in self.tables], self.options, self.labels)

    def axes(self, i: int) -> tuple[int, ...]:
        """The rig's axes that device `i` serves."""
        names = list(self.axis_names)
        return tuple(names.index(name) for name in self.tables[i].axes) or tuple(range(len(names)))

    @cached_property
    def _has(self) -> list[Channels]:
        """What each device could provide and take."""
        out = []
        for i, (table, label) in enumerate(zip(self.tables, self.labels, strict=True)):
            try:
                rig = subset(self.hardware, self.axes(i))
                out.append(registry.channels(table.kind, self.options[i], rig))
            except BackendError as error:
                raise BackendError(f"{label}: {error}") from error
        return out

    def _used(self, i: int) -> frozenset[str]:
        has, chosen = self._has[i].provides | self._has[i].consumes, self.tables[i].channels
        return has & frozenset(chosen) if chosen else has

    def _provided(self, i: int) -> frozenset[str]:
        return self._has[i].provides & self._used(i)

    def _taken(self, i: int) -> frozenset[str]:
        return self._has[i].consumes & self._used(i)

    def _name_faults(self) -> list[str]:
        out = []
        for i, table in enumerate(self.tables):
            unknown = [name for name in table.axes if name not in self.axis_names]
            if unknown:
                known = ", ".join(self.axis_names)
                out.append(f"device[{i}].axes: no axis is called {unknown[0]!r}; there are {known}")
            if len(set(table.axes)) != len(table.axes):
                out.append(f"device[{i}].axes: {list(table.axes)} names an axis twice")
        names = [table.name for table in self.tables]
        for name in sorted({name for name in names if name and names.count(name) > 1}):
            both = _and(f"device[{i}].name" for i, other in enumerate(names) if other == name)
            out.append(f"{both}: both are {name!r}; give each device a name of its own")
        return out

    def _channel_faults(self) -> list[str]:
        return [
            f"device[{i}].channels: {name!r} is not a channel of {table.kind!r}, which has {_list(has)}"
            for i, table in enumerate(self.tables)
            for has in [self._has[i].provides | self._has[i].consumes]
            for name in table.channels
            if name not in has
        ]

    def _providers(self, channel: str) -> list[list[int]]:
        """The devices that provide a channel: one list per axis, or a single one for the whole rig."""
        whole = channel in WHOLE_RIG_CHANNELS
        return [
            [
                i
                for i in range(len(self.tables))
                if channel in self._provided(i) and (whole or axis in self.axes(i))
            ]
            for axis in range(1 if whole else len(self.axis_names))
        ]

    def _takers(self) -> list[list[int]]:
        """The devices that drive each axis."""
        return [
            [i for i in range(len(self.tables)) if self._taken(i) and axis in self.axes(i)]
            for axis in range(len(self.axis_names))
        ]

    def _what(self, channel: str, axis: int) -> str:
        if channel in WHOLE_RIG_CHANNELS or len(self.axis_names) == 1:
            return channel
        return f"{channel} of axis {self.axis_names[axis]!r}"

    def _overlaps(self) -> list[str]:
        out = []
        every = frozenset().union(*(self._provided(i) for i in range(len(self.tables))))
        for channel in sorted(every - {"estop"}):  # any number: one that is pressed is enough
            for axis, devices in enumerate(self._providers(channel)):
                if len(devices) > 1:
                    last = devices[-1]  # the later one is told to give way: it was added
                    out.append(
                        f"device[{last}].channels: {_and(self.labels[i] for i in devices)} both provide "
                        f"{self._what(channel, axis)}: list here what the rig takes from this one "
                        f"(all but {channel}: {_list(self._used(last) - {channel})})"
                    )
        for axis, devices in enumerate(self._takers()):
            if len(devices) > 1:
                out.append(
                    f"device[{devices[-1]}].channels: {_and(self.labels[i] for i in devices)} both take the "
                    f"command of axis {self.axis_names[axis]!r}: list here all but "
                    f"{_list(self._taken(devices[-1]))}, or give each device its own axes"
                )
        return out

    def _gaps(self) -> list[str]:
        have = "; ".join(f"{label} has {_list(self._used(i))}" for i, label in enumerate(self.labels))
        # what a real rig lacks has to be said: a sensor that was forgotten reads 0 for ever
        needed = {"position"} if self.simulated else {"position", "current", "force"} - set(self.absent)
        out = []
        for channel in sorted(needed):
            remedy = f', or state rig.absent = ["{channel}"]' if channel != "position" else ""
            out += [
                f"device: no device provides {self._what(channel, axis)} ({have}): add a [[device]] that "
                f"does{remedy}"
                for axis, devices in enumerate(self._providers(channel))
                if not devices
            ]
        out += [
            f"axis[{axis}].velocity.device: no device provides {self._what('velocity', axis)} ({have}): "
            'add a [[device]] that does, or set device = "record"'
            for axis, devices in enumerate(self._providers("velocity"))
            if axis in self.velocity_axes and not devices
        ]
        if self.moments and not any(self._providers("moment")):
            out.append(
                f"force_sensor.moments: no device provides moment ({have}): add a [[device]] that does, or "
                "set moments = false"
            )
        out += [
            f"device: no device takes the torque or current of axis {self.axis_names[axis]!r} ({have}): "
            "add a [[device]] that does"
            for axis, devices in enumerate(self._takers())
            if not devices
        ]
        return out + [
            f"rig.absent: {self.labels[i]} provides {channel!r}: remove it from rig.absent"
            for channel in self.absent
            for i in range(len(self.tables))
            if channel in self._provided(i)
        ]

    def _clock_faults(self) -> list[str]:
        """A virtual clock does not wait: nothing real can be run by it."""
        real = [
            label
            for label, table in zip(self.labels, self.tables, strict=True)
            if not registry.lookup(table.kind).simulated
        ]
        if self.clock == "wall" or not real:
            return []
        return [
            f'loop.clock: {self.clock!r} does not wait, and {_and(real)} is not simulated: set clock = "wall"'
        ]

    @property
    def _rate_hz(self) -> float:
        return 1.0 / self.hardware.period_s

    def _max_age_ticks(self, i: int) -> int:
        table = self.tables[i]
        if table.max_age_ticks is not None:
            return table.max_age_ticks
        if table.rate_hz is None or "position" in self._provided(i):
            return 0
        return math.ceil(round(self._rate_hz / table.rate_hz, 6))  # rounding makes no tick

    def _age_faults(self, i: int) -> list[str]:
        """A sensor may be slower than the loop only as far as its channels bear it."""
        table, provided = self.tables[i], self._provided(i)
        if "position" in provided and table.rate_hz is not None and table.rate_hz < self._rate_hz * 0.999:
            return [
                f"device[{i}].rate_hz: {table.rate_hz:g} is below loop.rate_hz {self._rate_hz:g}, but "
                f"{self.labels[i]} provides the position, which must be new in every cycle: lower "
                "loop.rate_hz"
            ]
        out, age = [], self._max_age_ticks(i)
        for channel in sorted(provided & set(MAX_AGE_S)):
            most = int(MAX_AGE_S[channel] * self._rate_hz)
            most = max(most, 1) if channel != "position" else 0
            if age > most:
                key = "max_age_ticks" if table.max_age_ticks is not None else "rate_hz"
                out.append(
                    f"device[{i}].{key}: samples of {self.labels[i]} could be {age} ticks old; {channel} "
                    f"bears {most} at loop.rate_hz {self._rate_hz:g}: use a faster sensor or a slower loop"
                )
        return out

    def _budget_ns(self, i: int) -> int:
        """Reading time of one device; a simulated one has all the time it needs."""
        table = self.tables[i]
        if table.budget_us is not None:
            return round(table.budget_us * 1000)
        if registry.lookup(table.kind).simulated:
            return 0
        real = sum(not registry.lookup(other.kind).simulated for other in self.tables)
        return round(self.hardware.period_s * 1e9 * BUDGET_SHARE / real)

    def _budget_faults(self) -> list[str]:
        total_us = sum(self._budget_ns(i) for i in range(len(self.tables))) / 1000
        most_us = self.hardware.period_s * 1e6 * BUDGET_MAX_SHARE
        if total_us <= most_us:
            return []
        keys = _and(f"device[{i}].budget_us" for i in range(len(self.tables)))
        return [
            f"{keys}: reading may take {total_us:.6g} us together, above {most_us:.6g} us "
            f"({BUDGET_MAX_SHARE:.0%} of the period at loop.rate_hz {self._rate_hz:g}): lower them"
        ]


def _list(names: frozenset[str]) -> str:
    return ", ".join(sorted(names)) or "nothing"


def _and(names: Iterable[str]) -> str:
    return " and ".join(names)
