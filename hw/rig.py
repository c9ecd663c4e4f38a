"""Several devices as one backend: each provides some channels of the rig, together they provide every one.

Each device reads and writes a tick of its own, so it sees exactly what it would see alone, and nothing it
writes beyond its channels reaches the rig. The rig's `sample_count` advances only in a cycle in which every
device that provides a channel is fresh: its own count rose in this cycle or, where the rig file allows that
for a sensor slower than the loop, at most `max_age_ticks` cycles ago.

No device may hold up another for longer than its budget: the devices of the position are read first, and
after one that overran its budget the rest of this cycle's reads are left out and the slow device rests for
up to two cycles. What was left out ages. A device that overran three times in a row rests so long that its
sample goes stale, which stops the rig."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hw import registry
from hw.channels import READ_ORDER
from hw.every_device import reach_all
from hw.interface import (
    CHANNEL_FIELDS,
    OPTIONAL_FIELDS,
    Backend,
    BackendError,
    CompiledBackend,
    CountingBackend,
    LinkFault,
    LinkLost,
    Rig,
    SpeakingBackend,
    Words,
)
from hw.member import Member
from hw.rig_words import Exchange, device_dtype, subset

REST_TICKS = 2
"""Most cycles a device rests after it overran its budget: one more and a lone hiccup would be a stale
sample."""

# one and two may be the machine: three in a row are the device
SLOW_READS = 3
SLOW_REST_TICKS = 10
"""After this many overruns in a row a device rests so long: its sample goes stale."""

_OVER_BUDGET, _LOST = int(LinkFault.OVER_BUDGET), int(LinkFault.LOST)
# older than any sample may be, and far from the end of 64 bits however long it ages
_NEVER = 1 << 40


@dataclass(frozen=True)
class Said:
    """What one device of a rig says: its words, bits of `LinkFault` it shows, and whether its sample is too
    old."""

    label: str
    axes: tuple[int, ...]
    faults: int
    stale: bool
    words: tuple[Words, ...] = ()


def said(backend: Backend, members: Sequence[Member], tick: np.ndarray, *, stale: bool) -> list[Said]:
    """What the devices of a rig say after a cycle; for a rig of one device `tick` and `stale` are its own.

    Makes strings: not for a cycle that has torque to send."""
    if isinstance(backend, Composite):
        return backend.said()
    first = members[0]
    return [Said(first.label, first.axes, int(tick["link_faults"][0]), stale, _words(backend))]


def _words(backend: Backend) -> tuple[Words, ...]:
    return tuple(backend.words()) if isinstance(backend, SpeakingBackend) else ()


def compose(members: Sequence[Member], rig: Rig) -> Backend:
    """The backend of a rig. One device that serves it all, fresh in every cycle, is handed out as it is."""
    first = members[0]
    made = [registry.create(member.kind, member.options, subset(rig, member.axes)) for member in members]
    whole = len(first.axes) == rig.n_axes and set(first.channels) == made[0].provides | made[0].consumes
    # no copy of a tick, no clock: a rig of one device pays nothing for composition
    if len(members) == 1 and whole and first.max_age_ticks == 0:
        return made[0]
    return Composite([_Device(member, backend) for member, backend in zip(members, made, strict=True)])


class _Device:
    """One member at work: its backend, its own tick, its freshness."""

    def __init__(self, member: Member, backend: Backend) -> None:
        self.member, self.backend = member, backend
        self.budget_ns, self.max_age_ticks = member.budget_ns, member.max_age_ticks
        self._read: Callable[..., None] = backend.read
        self._write: Callable[..., None] = backend.write
        self.provides = frozenset(member.channels) & backend.provides
        self.consumes = frozenset(member.channels) & backend.consumes
        # nothing has come: it must not look like a sample of this cycle
        self.age = _NEVER
        self.rest = self.overruns = self.overruns_in_a_row = 0
        self.tick: np.ndarray | None = None

    def bind(self, tick: np.ndarray) -> None:
        """Prepare the exchange with `tick`; the device's own tick stays the same one."""
        if self.tick is None:
            self.tick = np.zeros(1, device_dtype(tick.dtype, len(self.member.axes)))
            for name in OPTIONAL_FIELDS:
                self.tick[name] = np.nan
        fields = [CHANNEL_FIELDS[channel] for channel in sorted(self.provides)]
        exchange = Exchange(tick, self.tick, self.member.axes, fields, commanded=bool(self.consumes))
        self.deliver, self._lead_in, self._command = exchange.deliver, exchange.lead_in, exchange.command
        self._words, self._sample_count = exchange.words, exchange.sample_count
        self._link_faults, self._estop = exchange.link_faults, exchange.estop

    def read(self, elapsed: int) -> int:
        """Read the device and see whether there is a new sample. Returns bits of `LinkFault`.

        Raises
        ------
        BackendError
            Naming the device."""
        words, count = self._words, self._sample_count
        # its own tick keeps the count: a device that is opened anew may begin at any number
        before = words[count]
        self._lead_in()
        try:
            self._read(self.tick)
        except (BackendError, OSError) as error:
            raise self._named(error) from error
        # more, not other: a count that falls is a device that was powered anew, and no new sample
        self.age = 0 if words[count] > before else self.age + elapsed
        return int(words[self._link_faults])

    def over(self, spent_ns: int) -> bool:
        """True when the reading took longer than its budget; the device then rests."""
        if spent_ns <= self.budget_ns:
            self.overruns_in_a_row = 0
            return False
        self.overruns += 1
        self.overruns_in_a_row += 1
        slow = self.overruns_in_a_row >= SLOW_READS
        # as long as the overrun lasted, at most two cycles: the others get back what it took
        self.rest = SLOW_REST_TICKS if slow else min(spent_ns // self.budget_ns, REST_TICKS)
        return True

    def write(self) -> None:
        """Send the device its part of the command. Raises BackendError naming it."""
        self._command()
        try:
            self._write(self.tick)
        except (BackendError, OSError) as error:
            raise self._named(error) from error

    def open(self) -> None:
        """Acquire the device; nothing from before is fresh any more. Raises BackendError naming it."""
        self.age, self.rest, self.overruns_in_a_row = _NEVER, 0, 0
        try:
            self.backend.open()
        except (BackendError, OSError) as error:
            raise self._named(error) from error

    def _named(self, error: BackendError | OSError) -> BackendError:
        if self.tick is not None:
            self._words[self._link_faults] = _LOST  # until it is read again: `said` then names it
        # OSError: of a driver that has no words of its own
        kind = type(error) if isinstance(error, BackendError) else LinkLost
        return kind(f"{self.member.label}: {error}")

    def said(self) -> Said:
        """What it says after this cycle."""
        faults = 0 if self.tick is None else int(self._words[self._link_faults])
        stale = bool(self.provides) and self.age > max(self.max_age_ticks, REST_TICKS)
        return Said(self.member.label, self.member.axes, faults, stale, _words(self.backend))

    @property
    def stopped(self) -> bool:
        """Whether its emergency stop input is pressed."""
        return bool(self._words[self._estop])


class Composite:
    """Several devices as one backend. Made by `compose`."""

    def __init__(self, devices: Sequence[_Device]) -> None:
        # stable: devices of one rank keep the order of the rig file
        self._devices = sorted(devices, key=_rank)
        self._sensors = [device for device in self._devices if device.provides]
        self._stops = [device for device in self._devices if "estop" in device.provides]
        # by what it could be sent: one whose command the rig does not use is told zero, and disabled
        self._writers = [device for device in self._devices if device.backend.consumes]
        self.provides = frozenset().union(*(device.provides for device in devices))
        self.consumes = frozenset().union(*(device.consumes for device in devices))
        self._tick: np.ndarray | None = None
        self._count = self._slot = 0

    def open(self) -> None:
        """Open every device; when one cannot be opened, close the others. Raises BackendError naming it."""
        try:
            for device in self._devices:
                device.open()
        except Exception:  # whatever it was: the others are not left open
            self.close()
            raise

    def warm_up(self, tick: np.ndarray) -> None:
        """Have the devices compile (or load) what they call, for their own ticks; changes nothing."""
        self._bind(tick)
        for device in self._devices:
            if isinstance(device.backend, CompiledBackend) and device.tick is not None:
                device.backend.warm_up(device.tick)

    def _bind(self, tick: np.ndarray) -> None:
        for device in self._devices:
            device.bind(tick)
        row = tick.view(np.ndarray)
        self._sample_count = row["sample_count"].data
        self._link_faults = row["link_faults"].data
        self._estop = row["estop"].data
        self._slots = row["tick"].data
        self._tick = tick

    def read(self, tick: np.ndarray) -> None:
        """Read the devices within their budgets and merge what they show. Raises LinkLost naming the
        device."""
        if tick is not self._tick:
            self._bind(tick)
        # slots, not calls: cycles that the loop missed have aged every sample
        before, self._slot = self._slot, self._slots[0]
        faults = self._read_all(max(self._slot - before, 1))  # the first cycle is number 0
        due, new = True, False
        for device in self._sensors:
            # old values too: a tick never mixes a fresh sample with what was before the start
            device.deliver()
            if device.age > device.max_age_ticks:
                due = False
            elif device.age == 0:
                new = True
        # new: with every device within its age but none new the law would count one sample twice
        if due and new:
            self._count += 1
        self._sample_count[0], self._link_faults[0] = self._count, faults
        if self._stops:
            # one that is pressed is enough, and a device that rests keeps what it showed
            self._estop[0] = any(device.stopped for device in self._stops)

    def _read_all(self, elapsed: int) -> int:
        """Read the devices in turn; `elapsed` is cycles since the last time. Returns bits of `LinkFault`."""
        faults, late, now = 0, False, time.monotonic_ns
        for device in self._devices:
            # the rest of the cycle belongs to the law: what is read late is worth less than a command on time
            if late or device.rest:
                device.rest = max(device.rest - 1, 0)
                device.age += elapsed
            elif not device.budget_ns:
                faults |= device.read(elapsed)
            else:
                began = now()
                faults |= device.read(elapsed)
                if device.over(now() - began):
                    late = True
                    faults |= _OVER_BUDGET
        return faults

    def write(self, tick: np.ndarray) -> None:
        """Send every actuator its part. Raises LinkLost naming the device."""
        if tick is not self._tick:
            self._bind(tick)
        for device in self._writers:
            device.write()

    def stop(self) -> None:
        """Stop every device at once, actuators too when a sensor raises or hangs. Never raises."""
        # all: a device of which the rig takes the position alone may have a power stage, too
        reach_all([device.backend.stop for device in self._devices])

    def close(self) -> None:
        """Release every device. Never raises."""
        reach_all([device.backend.close for device in self._devices])

    def said(self) -> list[Said]:
        """What every device says after this cycle."""
        return [device.said() for device in self._devices]

    def counts(self) -> dict[str, int]:
        """What the links have seen, each name after its device's, and how often a budget was overrun."""
        out: dict[str, int] = {}
        for device in self._devices:
            counted = device.backend.counts() if isinstance(device.backend, CountingBackend) else {}
            for name, value in {**counted, "over_budget": device.overruns}.items():
                out[f"{device.member.label} {name}"] = value
        return out


def _rank(device: _Device) -> int:
    ranks = [READ_ORDER.index(channel) for channel in device.provides if channel in READ_ORDER]
    return min(ranks, default=len(READ_ORDER))
