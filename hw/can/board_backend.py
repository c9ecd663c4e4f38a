"""A board described by its frames: which bits of which identifier are which channel. Kind `can`.

The map is plain data (`hw.can.board_options` makes it, also from a DBC) and is compiled into functions
(`hw.can.board_in`, `hw.can.board_out`)."""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping, Sequence
from itertools import zip_longest
from typing import Any

from hw.can.backend import CanBackend
from hw.can.board_in import MAY_BE_MISSING, ReceivedFrame, handlers
from hw.can.board_map import identifier, make_field
from hw.can.board_out import SentFrame, fixed
from hw.can.bus import Bus, Handler, wait_for
from hw.can.load import Traffic
from hw.can.steady_records import Command, Frame
from hw.channels import READING, places
from hw.interface import BackendError, LinkFault, Options, Rig, Words

__all__ = ["BoardBackend", "ReceivedFrame", "SentFrame", "identifier", "make_field", "traffic"]

CHANNELS = (*READING, "fault", "enabled")
COMMANDS = ("current_command", "torque", "enable", "counter", "constant")

OPEN_S, OPEN_ASKED = 1.0, 10
"""How long `open` waits for a first sample, and how often it asks: one lost frame is no missing board."""

_DEVICE, _LOST = int(LinkFault.DEVICE), int(LinkFault.LOST)


def traffic(options: Options, rate_hz: float) -> list[Traffic]:
    """All frames of the board, both ways, but for those sent only at start and stop."""
    received = [
        (table, length, 1000.0 / table["period_ms"] if table["period_ms"] else rate_hz)
        for table in options["receive"]
        # on the wire each part is a frame with a head of its own
        for length in table.get("parts") or (table["length"],)
    ]
    sent = [(table, table["length"], rate_hz) for table in options["send"]]
    polls = [(table, len(table["data"]), rate_hz) for table in options.get("poll", ())]
    fd = bool(options["bus"]["fd"])
    return [
        Traffic(f"frame 0x{table['id']:x}", length, per_s, extended=table["extended"], fd=fd)
        for table, length, per_s in received + sent + polls
    ]


def _axes_of(tables: Sequence[Options]) -> dict[str, set[int]]:
    """Channels of these frames, and the axes that they have them of."""
    found: dict[str, set[int]] = {}
    for table in tables:
        for field in table["field"]:
            found.setdefault(field["channel"], set()).add(field["axis"])
    return found


def _require_every(channel: str, axes: set[int], every: set[int]) -> None:
    """Refuse a channel of some axes only: the others would be taken for axes at 0 that never move, or be told
    to be driven by nobody."""
    if axes != every:
        raise BackendError(
            f"can: {channel} is given for axes {sorted(axes)}; each of axes 0 to {len(every) - 1} needs it, "
            "or give the device its own axes"
        )


class BoardBackend(CanBackend):
    """The board of a field map."""

    def __init__(self, options: Options, rig: Rig) -> None:
        super().__init__(options, rig)
        for table in (*options["receive"], *options["send"]):
            for field in table["field"]:
                axes = places(field["channel"], rig.n_axes)
                if field["axis"] >= axes:
                    raise BackendError(
                        f"can: {field['channel']} of frame 0x{table['id']:x} names axis {field['axis']}; "
                        f"there are 0 to {axes - 1}"
                    )
        given = _axes_of(options["receive"])
        wanted = _axes_of(options["send"])
        every = set(range(rig.n_axes))
        for channel in ("position", "current"):
            _require_every(channel, given.get(channel, every), every)
        # torque of one axis and current of another is as good as one of them for all
        commanded = {axis for channel in ("current_command", "torque") for axis in wanted.get(channel, ())}
        _require_every("torque or current_command", commanded or every, every)
        self.provides = frozenset(given.keys() - {"fault", "enabled"})
        self.consumes = frozenset(wanted.keys() & {"current_command", "torque"})
        for name in MAY_BE_MISSING:
            # of an axis without this sensor; 0 would be a joint that stands, or a motor that is cold
            for sample in (self.sample, self.taken):
                sample.of[name][:] = array("d", [math.nan] * rig.n_axes)
        # made once: a counter or angle is followed on over a re-plug
        self._received = [ReceivedFrame(table, rig, self.sample) for table in options["receive"]]
        self._sent: list[SentFrame] = []
        self._start: list[Any] = []
        self._poll: list[Any] = []
        self._halt: list[Any] = []
        self._on = False
        self._armed = [armed for frame in self._received for armed in frame.armed]

    def _make_frames(self, bus: Bus) -> None:
        options = self._options
        # none before the first connection
        pairs = zip_longest(options["send"], self._sent)
        self._sent = [SentFrame(table, self._rig, bus, before) for table, before in pairs]
        self._start, self._poll, self._halt = (
            fixed(options.get(name, ()), bus) for name in ("start", "poll", "stop")
        )

    def _set_up(self, bus: Bus) -> Mapping[int, Handler]:
        options = self._options
        # frames of a connection before are no sample of this one
        self.sample.fresh = 0
        for frame in self._received:
            frame.forget()
        self._make_frames(bus)
        # one handler for an identifier: the bus calls one, however many tables want its frames
        found = handlers(options["receive"], self._received)
        bus.subscribe(found)
        if not self._heard(bus):
            ids = ", ".join(f"0x{table['id']:x}" for table in options["receive"] if table["required"])
            raise BackendError(
                f"can board on {options['bus']['channel']}: not all of the frames {ids} came within 1 s: "
                "check power, wiring and termination, the bit rate, the ids, lengths and select of the "
                "frames, and whether the board wants a start or poll frame (candump shows what is on the "
                "bus)"
            )
        return found

    def _heard(self, bus: Bus) -> bool:
        """Whether a whole sample comes within about 1 s; a board that answers commands is asked again and
        again."""
        for _ in range(OPEN_ASKED):
            # each time: which of them was lost is not known, and hearing one twice does no harm
            for frame in self._start:
                bus.send(frame)
            self._prime(bus)
            if wait_for(bus, lambda: self.sample.fresh == self.sample.needed, OPEN_S / OPEN_ASKED):
                return True
        return False

    def _prime(self, bus: Bus) -> None:
        # as a stop: what a counting board saw last is not known, and it may have heard none
        for sent in self._sent:
            sent.stop(bus)
        for frame in self._poll:
            bus.send(frame)

    def send(self, bus: Bus, *, enabled: bool) -> None:
        """See CanBackend."""
        on = enabled
        for received in self._received:
            received.pass_by(1)
        for armed in self._armed:
            # order() counts the cycle: asked of each board, whatever the others say
            on = armed.order(enabled) and on
        self._on = on
        for sent in self._sent:
            sent.send(bus, self._current, self._torque, on)
        for frame in self._poll:
            bus.send(frame)

    def steady_frames(self) -> list[Frame]:
        """See CanBackend."""
        return [frame.steady() for frame in self._received]

    def steady_commands(self) -> list[Command]:
        """See CanBackend."""
        sent = [frame.steady(self.command_words) for frame in self._sent]
        return sent + [Command(frame) for frame in self._poll]

    def _alike(self) -> int:
        if not all(frame.is_alike(self._on) for frame in self._sent):
            return 0
        return min([armed.spare for armed in self._armed] + [frame.spare for frame in self._received])

    def pass_by(self, cycles: int) -> None:
        """See CanBackend."""
        for armed in self._armed:
            armed.ticks += cycles
        for frame in self._received:
            frame.pass_by(cycles)

    def _lasting_faults(self) -> int:
        ill = any(armed.ill for armed in self._armed) or any(frame.lasting_fault for frame in self._received)
        return (_DEVICE if ill else 0) | self._silences()

    def _silences(self) -> int:
        return _LOST if any(frame.is_lost for frame in self._received) else 0

    def _stop(self, bus: Bus) -> None:
        for sent in self._sent:
            sent.stop(bus)
        for frame in self._halt:
            bus.send(frame)

    def _device_faults(self) -> int:
        faults = self._silences()
        for frame in self._received:
            if frame.fault:
                return _DEVICE | faults
        for armed in self._armed:
            if armed.ill:
                return _DEVICE | faults
        return faults

    def words(self) -> list[Words]:
        """See `SpeakingBackend`: which frame carries the fault flag, and which frames have not come."""
        # a frame that comes and one that does not: both may be true of one board
        told = [f"{f.label} sets its fault flag" for f in self._received if f.fault]
        waiting = self.sample.needed & ~self.sample.fresh if self.silent_cycles else 0
        told += [f"{f.label} does not come" for f in self._received if waiting & f.bit or f.is_lost]
        return [Words(", ".join(told), self._device_faults(), bool(waiting))]
