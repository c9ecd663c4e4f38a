"""What the devices of a rig say of themselves, as the loop has told it, and whom a fault is to be laid at.

The loop speaks while the rig is disabled (`rtctl.rt.speech`): before it records the tick that shows a fault,
so whoever looks here after reading that tick finds the words that belong to it."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hw.interface import LinkFault
from rtctl.host.exchange.rig_description import RigDescription

KEPT = 16
"""Utterances of one device that are kept: a fault that lasts one tick is laid at what was said in that
one."""

_SILENT_TEXT = "parts of its sample do not come"


@dataclass(frozen=True)
class Voice:
    """One device, or one axis of it.

    Attributes
    ----------
    device
        Its label, such as `device[1] 'finger'`.
    axis
        Name of the axis, None for the whole device.
    text
        Its words; may be empty.
    faults
        Bits of `LinkFault` it shows.
    silent
        Its sample is too old, or parts of it are missing."""

    device: str
    axis: str | None
    text: str
    faults: int
    silent: bool

    @property
    def complains(self) -> bool:
        """Whether something is wrong with it."""
        return self.silent or self.faults != 0

    def as_dict(self) -> dict[str, Any]:
        """For `status` and `health`."""
        names = [str(fault.name) for fault in LinkFault if self.faults & fault]
        return {
            "device": self.device,
            "axis": self.axis,
            "text": self.text,
            "faults": names,
            "silent": self.silent,
        }


@dataclass(frozen=True)
class Utterance:
    """What one device said in one tick: its number among all utterances, the tick, and its voices."""

    number: int
    tick: int
    device: str
    voices: tuple[Voice, ...]


class DeviceWords:
    """The words of every device of one rig: the newest, and those of the last few changes."""

    def __init__(self, rig: RigDescription) -> None:
        self._axes = [axis.name for axis in rig.axes]
        self._said: dict[str, deque[Utterance]] = {}
        self._number = 0

    def hear(self, message: Mapping[str, Any]) -> None:
        """Take in what the loop says of one device."""
        label, axes = str(message["device"]), [self._axes[a] for a in message["axes"]]
        # as many words as axes: one each; else one voice for the whole device
        single = len(message["words"]) != len(axes)
        voices = [
            Voice(label, None if single else axes[i], text, faults, bool(silent))
            for i, (text, faults, silent) in enumerate(message["words"])
        ]
        covered = 0
        for voice in voices:
            covered |= voice.faults
        # what the device shows beyond its voices' own: laid at the whole device
        rest, stale = message["faults"] & ~covered, message["stale"] and not any(v.silent for v in voices)
        if rest or stale or not voices:
            text = voices[0].text if single and voices else ""
            whole = Voice(label, axes[0] if len(axes) == 1 else None, text, rest, bool(stale))
            voices = [whole] if single else [whole, *voices]
        # over all devices: a listener asks for what came after the newest that it knows
        self._number += 1
        said = self._said.setdefault(label, deque(maxlen=KEPT))
        said.append(Utterance(self._number, int(message["tick"]), label, tuple(voices)))

    def since(self, number: int) -> list[Utterance]:
        """What was said after utterance `number` (0: all), in order."""
        found = [one for said in self._said.values() for one in said if one.number > number]
        return sorted(found, key=lambda one: one.number)

    def voices(self, tick: int | None = None) -> list[Voice]:
        """What all devices had last said in `tick` (None: now), those with axes of their own by axis."""
        found: list[Voice] = []
        for said in self._said.values():
            until = [one for one in said if tick is None or one.tick <= tick]
            # a device that had said nothing by then is silent here: a later word may be of another fault
            found += until[-1].voices if until else ()
        return found

    def spoke(self, device: str, tick: int) -> bool:
        """Whether a device said something in this very tick; what it said before it was powered may be long
        over."""
        return any(one.tick == tick for one in self._said.get(device, ()))

    def blame(self, bits: int, tick: int | None = None) -> Voice | None:
        """Who shows one of these bits of `LinkFault`; one that names its axis and has words before one that
        does not."""
        return _best([voice for voice in self.voices(tick) if voice.faults & bits])

    def silent(self, tick: int | None = None) -> Voice | None:
        """Whose sample is missing."""
        return _best([voice for voice in self.voices(tick) if voice.silent])

    def of(self, device: str, axis: str | None, tick: int | None = None) -> str:
        """The words of a device (of its axis, if it has words by axis); empty when it has none."""
        found = [
            voice.text
            for voice in self.voices(tick)
            # None: what it says of the whole device holds for each of its axes
            if voice.device == device and voice.axis in (axis, None) and voice.text
        ]
        return found[0] if found else ""


def _best(found: list[Voice]) -> Voice | None:
    # who names its axis leads a person to the wire, who has words to the remedy
    return max(found, key=lambda voice: (voice.axis is not None, bool(voice.text)), default=None)


def words_of(voice: Voice) -> str:
    """What a voice says, and that it is silent where that is all."""
    parts = [voice.text] if voice.text else []
    return ", ".join(parts + ([_SILENT_TEXT] if voice.silent and voice.axis is not None else []))
