"""Every fault with where it comes from: axis, channel, device, and the device's own words."""

from __future__ import annotations

import numpy as np

from hw.interface import LinkFault
from hw.motion import words
from rtctl.control.vocabulary import Fault, State
from rtctl.host.exchange.device_words import DeviceWords, Voice, words_of
from rtctl.host.exchange.fault_origin import NOWHERE, Scene, Where, locate
from rtctl.host.exchange.rig_description import RigDescription
from rtctl.tick import copied
from rtctl.wire.fault_names import cause_bit, fault_entries
from rtctl.wire.fault_words import PLACE, Entry

# ARMING has 80 ms (`control.arming`): 1600 ticks at 20 kHz; more is a loop that does not go on
MOST_ARMING_TICKS = 4000

_LINK_BITS = {
    Fault.CHECKSUM: LinkFault.CHECKSUM,
    Fault.LINK_LOST: LinkFault.LOST,
    Fault.DEVICE: LinkFault.DEVICE,
    # a missed sample becomes STALE, whatever it was missed for
    Fault.STALE: LinkFault.SEQUENCE | LinkFault.LOST | LinkFault.OVER_BUDGET,
}
_MOTOR = (Fault.ACTUATOR_LAG, Fault.ACTUATOR_WRONG, Fault.WIRING, Fault.CURRENT, Fault.DELAY)
"""Faults that the device which drives the motor may say more about."""

_FORCE = (Fault.FORCE_FROZEN, Fault.FORCE_CLIPPED, Fault.FORCE_OFFSET, Fault.OFF_AXIS)
"""Faults that the force sensor may say more about."""

_OF_SAMPLES = (*_LINK_BITS, Fault.SAMPLE_AGE)


class FaultBook:
    """Follows all ticks and keeps of each fault where it came from when it appeared.

    Parameters
    ----------
    rig
        Axes, devices and, where they are known, the law's parameters.
    words
        What the devices say."""

    def __init__(self, rig: RigDescription, words: DeviceWords | None = None) -> None:
        self._rig = rig
        self.words = words or DeviceWords(rig)
        self._places: dict[Fault, Entry] = {}
        self._before: np.void | None = None
        self._good: np.void | None = None
        self._arming: list[np.ndarray] = []
        self._present = 0

    def follow(self, rows: np.ndarray) -> None:
        """Take the next ticks, in order: lay every fault that appears in them at its place."""
        if len(rows) == 0:
            return
        faults = rows["faults"]
        earlier = np.concatenate((np.array([self._present], faults.dtype), faults[:-1]))
        for i in np.flatnonzero(faults & ~earlier):
            self._lay(int(faults[i] & ~earlier[i]), rows, int(i))
        self._remember(rows)

    def glance(self, row: np.void) -> None:
        """Lay faults of a tick that is newer than those followed at the place that this tick shows, until it
        is followed."""
        ahead = int(row["faults"]) & ~self._present
        if ahead:
            # clients ask between two batches: a fault that is there must have a place by then
            self._lay(ahead, np.array([row], row.dtype), 0)

    def _lay(self, appeared: int, rows: np.ndarray, i: int) -> None:
        """Keep where each fault of the bits `appeared` comes from, as the tick `rows[i]` shows it."""
        scene = self._scene(rows, i)
        for number in range(appeared.bit_length()):
            # a bit of another version has no judge
            if appeared >> number & 1 and 1 << number in Fault._value2member_map_:
                fault = Fault(1 << number)
                self._places[fault] = self._place(fault, scene, int(rows["tick"][i]))

    def entries(self, bits: int) -> list[Entry]:
        """`name`, `text`, `axis`, `channel`, `device`, `detail` of every fault in `bits`, lowest bit
        first."""
        empty = dict.fromkeys(PLACE)
        return [
            {**entry, **(self._latest(entry["name"]) or empty)}  # a bit of another version has no place
            for entry in fault_entries(bits)
        ]

    def cause(self, row: np.void) -> Entry | None:
        """What the rig stands still for in this tick: the emergency stop in ESTOP, else the latched first
        cause."""
        bit = cause_bit(int(row["state"]), int(row["fault_first"]))
        return self.entries(bit)[0] if bit else None

    def _latest(self, name: str) -> Entry | None:
        """Where a fault came from. While it is there, its device's words are the newest ones."""
        fault = Fault.__members__.get(name)
        if fault is None or fault not in self._places:
            return None
        if self._present & fault and fault in _OF_SAMPLES:
            self._places[fault] = self._of_samples(fault) or self._places[fault]
        return self._places[fault]

    def _scene(self, rows: np.ndarray, i: int) -> Scene | None:
        if self._rig.params is None:
            return None
        # only what was fresh and sound is a place to have moved from
        good = np.flatnonzero(rows["sample_age_ticks"][:i] == 0)
        arming = rows[: i + 1][rows["state"][: i + 1] == State.ARMING]
        return Scene(
            row=rows[i],
            before=rows[i - 1] if i else self._before,
            good=rows[good[-1]] if len(good) else self._good,
            arming=np.concatenate([*self._arming, arming]) if self._arming else arming,
            params=self._rig.params[0],
        )

    def _remember(self, rows: np.ndarray) -> None:
        # `follow` looks at the tick before: kept as a copy, a view would keep the whole batch
        self._present = int(rows["faults"][-1])
        self._before = copied(rows[-1:])[0]
        good = np.flatnonzero(rows["sample_age_ticks"] == 0)
        if len(good):
            self._good = copied(rows[good[-1] :][:1])[0]
        if rows["state"][-1] != State.ARMING:
            self._arming = []
            return
        self._arming.append(rows[rows["state"] == State.ARMING])
        if sum(map(len, self._arming)) > MOST_ARMING_TICKS:
            self._arming = []

    def _place(self, fault: Fault, scene: Scene | None, tick: int) -> Entry:
        """Where a fault comes from that appeared in `tick`."""
        # by its words first: a device knows of a damaged frame what no tick shows
        if fault in _OF_SAMPLES and (place := self._of_samples(fault, tick) or self._only_device(tick)):
            return place
        found = NOWHERE if scene is None else locate(fault, scene)
        device = self._device(found, motor=fault in _MOTOR)
        axis = None if found.axis is None else self._rig.axes[found.axis].name
        motion = "rotary" if found.axis is None else self._rig.axes[found.axis].motion
        spoke = device is not None and fault in (*_MOTOR, *_FORCE) and self.words.spoke(device, tick)
        said = self.words.of(str(device), axis, tick) if spoke else ""
        detail = "; ".join(part for part in (words(found.detail, motion), said) if part)
        own = {"text": words(found.text, motion)} if found.text else {}
        return {"axis": axis, "channel": found.channel, "device": device, "detail": detail or None, **own}

    def _of_samples(self, fault: Fault, tick: int | None = None) -> Entry | None:
        """The device that says by itself that something is wrong with its samples (None: now); None when none
        does."""
        bits = int(_LINK_BITS.get(fault, 0))
        voice = self.words.blame(bits, tick) if bits else None
        if fault in (Fault.STALE, Fault.SAMPLE_AGE):
            voice = self.words.silent(tick) or voice
        if voice is None:
            return None
        return {
            "axis": voice.axis,
            "channel": self._only_channel(voice),
            "device": voice.device,
            "detail": words_of(voice) or None,
        }

    def _only_device(self, tick: int | None) -> Entry | None:
        """The one device of a rig of one; what it says stands beside it."""
        if len(self._rig.devices) != 1:
            return None
        device = self._rig.devices[0]
        axis = self._rig.axes[0].name if len(self._rig.axes) == 1 else None
        said = self.words.of(device.label, axis, tick)
        return {"axis": axis, "channel": None, "device": device.label, "detail": said or None}

    def _only_channel(self, voice: Voice) -> str | None:
        """The channel of a device that has one."""
        found = [device.channels for device in self._rig.devices if device.label == voice.device]
        return found[0][0] if found and len(found[0]) == 1 else None

    def _device(self, where: Where, *, motor: bool) -> str | None:
        """The device that drives the motor of this axis, or the one that gives this channel of it."""
        wanted = ("current_command", "torque") if motor else (where.channel,)
        for device in self._rig.devices:
            if set(wanted) & set(device.channels) and (where.axis is None or where.axis in device.axes):
                return device.label
        return None
