"""Wires that several devices of a rig file share: the frames of all of them must fit.

A device's options model takes part by having `wire` (interface and channel), `bus`, `frames(rate_hz)` and
`identifiers()`, as the CAN models do (`hw.can.options.BusUser`). The identifiers are the device's alone on
this machine, too: a second process that wants to drive them is refused (`hw.claims`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hw import registry
from hw.claims import claims_on
from hw.interface import BackendError

if TYPE_CHECKING:
    from hw.can.load import Load

SHAREABLE = frozenset({"socketcan", "virtual", "udp_multicast", "socketcand"})
"""Interfaces that more than one program or device can open at a time."""

_SAME = ("bitrate", "fd", "data_bitrate")


@dataclass(frozen=True)
class Wire:
    """One wire and the devices on it: their numbers in the rig file, how errors name them, their options."""

    interface: str
    channel: str
    numbers: tuple[int, ...]
    labels: tuple[str, ...]
    users: tuple[Any, ...]

    @property
    def _keys(self) -> str:
        return " and ".join(f"device[{i}].options.bus" for i in self.numbers)

    @property
    def _who(self) -> str:
        return f"{' and '.join(self.labels)} share {self.interface} {self.channel}"

    def load(self, rate_hz: float) -> Load:
        """Load of the wire by all of them."""
        from hw.can.load import Traffic, bus_load

        frames = [
            Traffic(**{**vars(frame), "name": f"{label} {frame.name}"})
            for label, user in zip(self.labels, self.users, strict=True)
            for frame in user.frames(rate_hz)
        ]
        # of any of them: `faults` refuses wires whose users differ in what is asked here
        bus = self.users[0].bus
        return bus_load(frames, bus.bitrate, bus.data_bitrate, 1.0 / rate_hz)

    def faults(self, rate_hz: float) -> list[str]:
        """Why the devices cannot share it, naming them; nothing if they can."""
        from hw.can import load

        if self.interface not in SHAREABLE:
            return [
                f"{self._keys}: {self._who}, which only one device can open: put drives of one kind into "
                "one [[device]], or attach the adapter as a network interface (slcand, interface = "
                "'socketcan')"
            ]
        buses = [user.bus for user in self.users]
        for key in _SAME:
            values = [getattr(bus, key) for bus in buses]
            # without CAN FD there is no data phase whose rate could differ
            if len(set(values)) > 1 and (key != "data_bitrate" or buses[0].fd):
                given = ", ".join(f"{value!r}" for value in values)
                return [f"{self._keys}: {self._who}, but their {key} differs ({given}): a wire has one"]
        # two devices that send as one node answer for each other, and neither sees it
        twice = self._claimed_twice()
        if twice:
            return [f"{self._keys}: {self._who}, and both use {twice}: put these drives into one [[device]]"]
        limit = min(bus.load_limit for bus in buses)  # the most careful of them
        fault = load.fault(self.load(rate_hz), buses[0].bitrate, 1.0 / rate_hz, limit)
        return [f"{self._keys}: {self._who}: {fault}"] if fault else []

    def _claimed_twice(self) -> str:
        claimed: set[int] = set()
        for user in self.users:
            both = claimed & user.identifiers()
            if both:
                # without the bit that says it is an extended one
                return f"identifier 0x{min(both) & 0x1FFF_FFFF:x}"
            claimed |= user.identifiers()
        return ""

    def report(self, rate_hz: float) -> list[tuple[str, str, str]]:
        """Label, figure and note for `rtctl check`."""
        found = self.load(rate_hz)
        limit = min(user.bus.load_limit for user in self.users)
        return [
            ("bus load at worst, together", f"{100 * found.share:.0f} %", f"limit {100 * limit:.0f} %"),
            ("frames of one period, together", f"{1e6 * found.cycle_s:.0f} us", f"of {1e6 / rate_hz:.0f} us"),
        ]


def claimed(kind: str, options: Mapping[str, Any]) -> tuple[str, ...]:
    """What of a wire a device of this kind has to itself, as names for `hw.claims`; nothing for one that has
    no wire."""
    try:
        model = registry.options_model(kind)
    except BackendError:
        return ()
    if not hasattr(model, "wire"):
        return ()
    user: Any = model.model_validate(options)
    interface, channel = user.wire
    return claims_on(interface, channel, user.identifiers())


def shared(kinds: Sequence[str], options: Sequence[Mapping[str, Any]], labels: Sequence[str]) -> list[Wire]:
    """The wires that more than one device is on, in the order of their first device.

    Parameters
    ----------
    kinds, options, labels
        Of each device: backend, validated options, how errors name it."""
    found: dict[tuple[str, str], list[tuple[int, Any]]] = {}
    for number, (kind, given) in enumerate(zip(kinds, options, strict=True)):
        try:
            model = registry.options_model(kind)
        except BackendError:
            continue
        if hasattr(model, "wire"):
            user = model.model_validate(given)
            found.setdefault(user.wire, []).append((number, user))
    return [
        Wire(
            *wire, *(tuple(column) for column in zip(*((n, labels[n], user) for n, user in on), strict=True))
        )
        for wire, on in found.items()
        if len(on) > 1
    ]
