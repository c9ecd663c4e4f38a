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

import numpy as np

from hw import registry
from hw.channels import READ_ORDER
from hw.every_device import reach_all
from hw.interface import Backend, BackendError, CountingBackend, LinkFault, Rig
from hw.member import Member
from hw.refusals import raised_by, words_of
from hw.rig_device import Device, Said, words_of_device
from hw.rig_words import subset

_OVER_BUDGET = int(LinkFault.OVER_BUDGET)


def said(backend: Backend, members: Sequence[Member], tick: np.ndarray, *, stale: bool) -> list[Said]:
    """What the devices of a rig say after a cycle; for a rig of one device `tick` and `stale` are its own.

    Makes strings: not for a cycle that has torque to send."""
    if isinstance(backend, Composite):
        return backend.said()
    first = members[0]
    return [Said(first.label, first.axes, int(tick["link_faults"][0]), stale, words_of_device(backend))]


def compose(members: Sequence[Member], rig: Rig) -> Backend:
    """The backend of a rig. One device that serves it all, fresh in every cycle, is handed out as it is."""
    first = members[0]
    made = [registry.create(member.kind, member.options, subset(rig, member.axes)) for member in members]
    whole = len(first.axes) == rig.n_axes and set(first.channels) == made[0].provides | made[0].consumes
    # no copy of a tick, no clock: a rig of one device pays nothing for composition
    if len(members) == 1 and whole and first.max_age_ticks == 0:
        return made[0]
    return Composite([Device(member, backend) for member, backend in zip(members, made, strict=True)])


class Composite:
    """Several devices as one backend. Made by `compose`."""

    def __init__(self, devices: Sequence[Device]) -> None:
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
        """Open every device; when one cannot be opened, close the others. Raises BackendError naming it, and
        those that could not be closed."""
        try:
            for device in self._devices:
                device.open()
        except Exception as error:  # whatever it was: the others are not left open
            raised = raised_by(self.close)
            if raised is None:
                raise
            raise BackendError(f"{words_of(error)}; closing the others: {words_of(raised)}") from error

    def warm_up(self, tick: np.ndarray) -> None:
        """Have the devices compile (or load) what they call, for their own ticks; changes nothing."""
        self._bind(tick)
        for device in self._devices:
            device.warm_up()

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
        """Stop every device at once, actuators too when a sensor raises or hangs; then raise BackendError
        naming those that raised or have not come back: one of them may not be stopped."""
        # all: a device of which the rig takes the position alone may have a power stage, too
        self._reach([device.backend.stop for device in self._devices])

    def close(self) -> None:
        """Release every device; then as `stop`."""
        self._reach([device.backend.close for device in self._devices])

    def _reach(self, actions: Sequence[Callable[[], None]]) -> None:
        raised = zip(self._devices, reach_all(actions), strict=True)
        failed = [f"{device.member.label}: {words_of(error)}" for device, error in raised if error]
        if failed:
            raise BackendError("; ".join(failed))

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


def _rank(device: Device) -> int:
    ranks = [READ_ORDER.index(channel) for channel in device.provides if channel in READ_ORDER]
    return min(ranks, default=len(READ_ORDER))
