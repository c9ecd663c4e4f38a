"""Drives on one CAN bus, one per axis, all of one protocol: ODrive, moteus, CiA 402."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from hw.can.backend import CanBackend
from hw.can.bus import Bus, Handler
from hw.can.cia402 import HEARTBEAT, OPERATIONAL, SYNC, Cia402Axis
from hw.can.moteus import MoteusAxis
from hw.can.odrive import OdriveAxis
from hw.can.steady_records import Command, Frame
from hw.interface import BackendError, Options, Rig, Words


class Drive(Protocol):
    """One axis of a known protocol."""

    identity: bytes

    @staticmethod
    def measures(options: Options) -> set[str]:
        """Channels beside position and current; those of every drive on the bus."""

    def handlers(self) -> Mapping[int, Handler]:
        """Handler of each frame that the drive sends, by identifier."""

    def make_frames(self, bus: Bus) -> None:
        """Make what is sent to it, for this bus."""

    def set_up(self, bus: Bus) -> None:
        """Make it ready, disarmed, and hear it. May block. Raises BackendError."""

    def prime(self, bus: Bus) -> None:
        """Ask for a sample where none comes unasked."""

    def write(self, bus: Bus, current_a: float, enabled: bool) -> None:
        """One cycle's command."""

    def link_faults(self) -> int:
        """`LinkFault` bits of the drive."""

    def steady_frames(self) -> list[Frame]:
        """Frames of the drive as compiled cycles read them; those for Python have no numbers."""

    def steady_commands(self, current_at: int) -> list[Command]:
        """What `write` has sent last, and would again; the current is word `current_at` of the tick."""

    def alike(self) -> int:
        """In how many cycles from now on `write` sends the same, and `link_faults` does not change, if only
        samples come."""

    def pass_by(self, cycles: int) -> None:
        """So many of those are over."""

    def status(self) -> str:
        """What it says about itself, for people."""

    def stop(self, bus: Bus) -> None:
        """Torque-free now."""


class DriveBackend(CanBackend):
    """One drive per axis, all of one protocol."""

    kind: type[Any]
    name = ""
    stops_unset = True
    """Whether a drive obeys a stop before it is set up."""

    def __init__(self, options: Options, rig: Rig) -> None:
        super().__init__(options, rig)
        if len(options["axis"]) != rig.n_axes:
            raise BackendError(
                f"{self.name}: {len(options['axis'])} [[device.options.axis]] tables for {rig.n_axes} axes; "
                "give one per axis, in order"
            )
        self.drives: list[Drive] = []
        self._parts: list[int] = []
        for axis, table in enumerate(options["axis"]):
            before = self.sample.needed
            self.drives.append(self.kind(table, options, rig, axis, self.sample))
            self._parts.append(self.sample.needed & ~before)  # of a whole sample
        # what no frame has told yet is shown as not known before the first sample, too
        self.taken.values[:] = self.sample.values
        self.provides = frozenset({"position", "current", *self.kind.measures(options)})
        self.consumes = frozenset({"current_command"})
        # bound once: no cycle looks a method up
        self._writers = [drive.write for drive in self.drives]

    def _set_up(self, bus: Bus) -> Mapping[int, Handler]:
        everything: dict[int, Handler] = {}
        for drive in self.drives:
            everything |= drive.handlers()
        # all before the first is set up: one may be driven still, as somebody left it, and to learn those
        # before it takes a second each
        if self.stops_unset:
            self._make_frames(bus)
            self._stop(bus)
        for drive in self.drives:
            bus.subscribe(everything)  # each time: the set-up of a CiA 402 drive hears that one alone
            drive.set_up(bus)
        return everything

    def _make_frames(self, bus: Bus) -> None:
        for drive in self.drives:
            drive.make_frames(bus)

    def _prime(self, bus: Bus) -> None:
        for drive in self.drives:
            drive.prime(bus)

    def send(self, bus: Bus, *, enabled: bool) -> None:
        """See CanBackend."""
        for write, current_a in zip(self._writers, self._current, strict=True):
            write(bus, current_a, enabled)

    def steady_frames(self) -> list[Frame]:
        """See CanBackend."""
        return [frame for drive in self.drives for frame in drive.steady_frames()]

    def steady_commands(self) -> list[Command]:
        """See CanBackend."""
        at = self.command_words["current_command"]
        return [one for axis, drive in enumerate(self.drives) for one in drive.steady_commands(at + axis)]

    def _alike(self) -> int:
        # the drive that needs Python first has the whole bus go back to it
        return min(drive.alike() for drive in self.drives)

    def pass_by(self, cycles: int) -> None:
        """See CanBackend."""
        for drive in self.drives:
            drive.pass_by(cycles)

    def _stop(self, bus: Bus) -> None:
        for drive in self.drives:
            drive.stop(bus)

    def _device_faults(self) -> int:
        faults = 0
        for drive in self.drives:
            faults |= drive.link_faults()
        return faults

    def _identities(self) -> tuple[bytes, ...]:
        return tuple(drive.identity for drive in self.drives)

    def status(self) -> list[str]:
        """What the drives say about themselves."""
        return [drive.status() for drive in self.drives]

    def words(self) -> list[Words]:
        """See `SpeakingBackend`: one per drive. A drive is silent while parts of its sample are missing."""
        waiting = self.sample.needed & ~self.sample.fresh if self.silent_cycles else 0
        return [
            Words(drive.status(), drive.link_faults(), bool(waiting & part))
            for drive, part in zip(self.drives, self._parts, strict=True)
        ]


class OdriveBackend(DriveBackend):
    """ODrives over CAN Simple."""

    kind, name = OdriveAxis, "odrive"


class MoteusBackend(DriveBackend):
    """moteus controllers over CAN-FD."""

    kind, name = MoteusAxis, "moteus"


class Cia402Backend(DriveBackend):
    """CiA 402 drives in cyclic synchronous torque; the SYNC and the host's heartbeat are the backend's."""

    kind, name = Cia402Axis, "cia402"
    stops_unset = False  # it may take our RPDO for another object: by SDO its power stage goes off first

    def _set_up(self, bus: Bus) -> Mapping[int, Handler]:
        everything = super()._set_up(bus)
        self._sync = bus.outgoing(SYNC, 0)
        self._heartbeat = bus.outgoing(HEARTBEAT + int(self._options["source"]), 1)
        self._heartbeat.buffer[self._heartbeat.offset] = OPERATIONAL
        # rounded down: never later than the drives were told
        self._every = max(1, int(1e-3 * self._options["heartbeat_ms"] / self._rig.period_s))
        self._since = self._every  # the first cycle sends one: the drives watch from then on
        return everything

    def _prime(self, bus: Bus) -> None:
        super()._prime(bus)
        bus.send(self._sync)

    def send(self, bus: Bus, *, enabled: bool) -> None:
        """See CanBackend."""
        super().send(bus, enabled=enabled)
        bus.send(self._sync)  # after all RPDOs: the drives obey them at this SYNC
        self._since += 1
        if self._since >= self._every:
            self._since = 0
            bus.send(self._heartbeat)

    def steady_commands(self) -> list[Command]:
        """See CanBackend."""
        return [*super().steady_commands(), Command(self._sync)]

    def _alike(self) -> int:
        # - 1: the cycle that sends the heartbeat is Python's
        return min(super()._alike(), self._every - self._since - 1)

    def pass_by(self, cycles: int) -> None:
        """See CanBackend."""
        super().pass_by(cycles)
        self._since += cycles
