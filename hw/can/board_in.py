"""Frames from a board of one's own: checked, put together where they come in parts, decoded into the
sample."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from hw.can.armed import UNBOUNDED, Armed
from hw.can.board_map import factor, identifier, make_field, selector
from hw.can.board_parts import Parts
from hw.can.bus import Handler
from hw.can.fields import CHECKSUM_BYTES, CHECKSUMS, Buffer, Field, Unwrap, decoder, raw_decoder, within
from hw.can.fields import Sequence as Order
from hw.can.sample import Sample
from hw.can.silence import Silence
from hw.can.steady_records import CHOOSES, ENDLESS, ESTOP, FAULT, LEAVES, NEVER, NOWHERE, ROUND, Frame, Number
from hw.encoder import Modulo
from hw.interface import Options, Rig

ARM_S = 0.5
"""Longest time from `enable` to `enabled`, where the board tells it."""

MAY_BE_MISSING = ("velocity", "temperature")
"""Channels that are NaN where there is no sensor."""

_PLACES = {"estop": ESTOP, "fault": FAULT}

_Row = tuple[Callable[[Buffer, int], float], Any, int]


def checksum_of(table: Options | None) -> tuple[Callable[[Buffer], int], int, int] | None:
    """Function, first byte and bytes of a frame's checksum; None without one."""
    if table is None:
        return None
    return CHECKSUMS[table["kind"]], int(table["byte"]), CHECKSUM_BYTES.get(table["kind"], 1)


class ReceivedFrame:
    """One kind of frame from the board: checks it, decodes its fields into the sample."""

    def __init__(self, table: Options, rig: Rig, sample: Sample) -> None:
        self._sample, self._length = sample, int(table["length"])
        self.bit = sample.need() if table["required"] else 0
        counter, checksum = table["counter"], table["checksum"]
        self._count = raw_decoder(make_field(counter, self._length)) if counter else None
        self._counter_bits = int(counter["bits"]) if counter else 0
        self._checksum = checksum_of(checksum)
        parts = table.get("parts") or (self._length,)
        select = table.get("select") or ()
        self._selected = selector(select, parts[0]) if select else None
        which = ", ".join(str(entry["value"]) for entry in select)
        self.label = f"frame 0x{table['id']:x}" + (f" (select {which})" if which else "")
        self._parts = Parts(parts, self._selected) if len(parts) > 1 else None
        told = [field for field in table["field"] if field["channel"] == "enabled"]
        self.armed = [Armed(round(ARM_S / rig.period_s)) for _ in told]
        self._tells = iter(self.armed)
        self._words: list[tuple[Callable[[Buffer, int], float], Field]] = []
        self._told: list[float] = [NEVER] * len(told)
        self._silence: Silence | None = None
        if table["period_ms"] and not table["required"]:
            self._silence = Silence.of(1e-3 * table["period_ms"], rig.period_s)
        # a sensor that is not there is known to everybody as NaN; nothing else can be said of the others
        self._tells_more = any(field["channel"] not in MAY_BE_MISSING for field in table["field"])
        self._key, self._table = identifier(table), table
        self._numbers: list[Number] = []
        self.forget()
        self._fields = [self._compile(field, rig) for field in table["field"]]
        self._values = [0.0] * len(self._fields)

    def forget(self) -> None:
        """A new connection begins: the order of frames, and parts. Where the joint stands is kept."""
        self._order = Order(self._counter_bits) if self._counter_bits else None
        self.fault = False
        if self._silence is not None:
            self._silence.cycles = 0
        for armed in self.armed:
            armed.order(False)
        if self._parts is not None:
            self._parts.forget()

    def _compile(self, table: Options, rig: Rig) -> _Row:
        field, to_si = make_field(table, self._length), factor(table, rig)
        channel, axis = table["channel"], int(table["axis"])
        target: Any = self._sample.of.get(channel, channel)
        if channel == "enabled":
            target = next(self._tells)
            self._words.append((raw_decoder(field), field))
        number = Number(
            field, _PLACES.get(channel, NOWHERE), factor=to_si, inside=bool(table.get("saturates"))
        )
        self._numbers.append(number)
        if channel in self._sample.start:
            number.place = self._sample.start[channel] + axis
        if table["wrap"]:
            raw, unwrap = raw_decoder(field), Unwrap(field.bits)
            scale, offset = to_si * field.scale, to_si * field.offset
            number.way, number.state = ENDLESS, unwrap
            # followed as a raw number: a scaled one would lose the last bits of a long way
            return (lambda buffer, at: scale * unwrap(int(raw(buffer, at))) + offset), target, axis
        decode = within(field) if table.get("saturates") else decoder(field)
        if table.get("wrap_at"):
            modulo, physical = Modulo(to_si * table["wrap_at"]), decode
            number.way, number.state, number.period = ROUND, modulo, abs(to_si * table["wrap_at"])
            return (lambda buffer, at: modulo(to_si * physical(buffer, at))), target, axis
        if to_si == 1.0:
            return decode, target, axis
        return (lambda buffer, at: to_si * decode(buffer, at)), target, axis

    @property
    def _is_for_python(self) -> bool:
        """Whether compiled cycles leave it to Python whenever it comes."""
        return self._parts is not None or self._silence is not None

    def steady(self) -> Frame:
        """As compiled cycles read it; one that comes in parts, or whose silence counts, is for Python."""
        if self._is_for_python:
            return Frame(self._key, bit=self.bit)
        table = self._table
        guards = [
            _chosen(make_field(entry, self._length), entry["value"]) for entry in table.get("select") or ()
        ]
        for k, (_, bits) in enumerate(self._words):
            # a word of the board that is new is Python's: whether it drives decides what is sent (`Armed`)
            guards.append(Number(bits, wanted=lambda k=k: self._last_word(k), says=LEAVES))  # type: ignore[misc]
        counter, checksum = table["counter"], table["checksum"]
        return Frame(
            self._key,
            self._length,
            self._numbers,
            guards,
            self.bit,
            counter=Number(make_field(counter, self._length)) if counter else None,
            order=self._order,
            checksum=(checksum["kind"], int(checksum["byte"])) if checksum else None,
            flag=self,
        )

    def _last_word(self, k: int) -> int:
        """What the board has said last of whether it drives, as it is in the frame."""
        return NEVER if self.armed[k].said is None else int(self._told[k])

    @property
    def handler(self) -> Handler:
        """What takes the frames of its identifier."""
        if self._parts is not None:
            return self._part
        return self._whole if self._selected is None else self._if_selected

    def _if_selected(self, buffer: Buffer, offset: int, length: int) -> None:
        """Take a frame if it is this one, and pass over the others of the identifier."""
        if length != self._length:
            self._sample.damaged()
        elif self._selected(buffer, offset):  # type: ignore[misc]
            self._whole(buffer, offset, length)

    def _part(self, buffer: Buffer, offset: int, length: int) -> None:
        """Take the next part of a frame. One that does not fit together is dropped, and its last part looked
        at anew."""
        parts = self._parts
        assert parts is not None
        # told here, since `add` cannot: for it such a part is only out of turn
        if length not in parts.lengths:
            self._sample.damaged()
        whole = parts.add(buffer, offset, length)
        # not yet, or never: which of the two, the next part tells
        if whole is None:
            return
        if self._intact(whole, 0):
            self._whole(whole, 0, self._length)
        else:  # a part was lost: this one may begin the next frame
            self._sample.damaged()
            parts.add(buffer, offset, length)

    def _whole(self, buffer: Buffer, offset: int, length: int) -> None:
        """Decode one frame; a damaged, repeated or not finite one changes nothing but counters."""
        sample = self._sample
        # before the counter: a damaged frame must not move it on
        if length != self._length or not self._intact(buffer, offset):
            sample.damaged()
            return
        if self._order is not None and not self._order.newer(int(self._count(buffer, offset))):  # type: ignore[misc]
            sample.not_newer()
            return
        values = self._values
        # all numbers before any is kept: a frame counts as a whole
        for i, (decode, _, _) in enumerate(self._fields):
            value = decode(buffer, offset)
            if value - value != 0.0:  # NaN or infinite
                sample.not_finite()
                return
            values[i] = value
        for value, (_, target, axis) in zip(values, self._fields, strict=True):
            if isinstance(target, str):
                self._flag(target, value)
            elif isinstance(target, Armed):
                target.saw(value != 0)
            else:
                target[axis] = value
        if self._silence is not None:
            self._silence.cycles = 0
        if self._words:
            # raw, as compiled cycles compare them: a scaled number need not be the same bit for bit
            self._told = [word(buffer, offset) for word, _ in self._words]
        sample.fresh |= self.bit

    def pass_by(self, cycles: int) -> None:
        """So many cycles more since it came: numbers of a frame that comes no more are not known."""
        if self._silence is None:
            return
        self._silence.cycles += cycles
        if self._silence.is_over_long:
            for _, target, axis in self._fields:
                if any(target is self._sample.of[channel] for channel in MAY_BE_MISSING):
                    target[axis] = math.nan

    @property
    def is_lost(self) -> bool:
        """True while it is silent for too long and tells what may not be missing."""
        return self._silence is not None and self._silence.is_over_long and self._tells_more

    @property
    def spare(self) -> int:
        """Cycles that may pass before its silence changes anything."""
        return UNBOUNDED if self._silence is None else self._silence.spare

    @property
    def lasting_fault(self) -> bool:
        """The fault flag of the frame, where compiled cycles do not know it."""
        return self._is_for_python and self.fault

    def _intact(self, buffer: Buffer, offset: int) -> bool:
        if self._checksum is None:
            return True
        checksum, byte, size = self._checksum
        data = bytes(buffer[offset : offset + self._length])
        found = int.from_bytes(data[byte : byte + size], "big")
        # boards differ in where their checksum stands, and none sums up its own
        return bool(checksum(data[:byte] + data[byte + size :]) == found)

    def _flag(self, channel: str, value: float) -> None:
        if channel == "estop":
            self._sample.estop = int(value != 0)
        else:
            self.fault = value != 0


def _chosen(bits: Field, value: int) -> Number:
    """The guard of frames in which a number has this value."""
    low, high = bits.raw_range
    return Number(bits, wanted=value if low <= value <= high else NEVER, says=CHOOSES)


def handlers(tables: Sequence[Options], frames: Sequence[ReceivedFrame]) -> Mapping[int, Handler]:
    """One handler per identifier, which hands a frame to all that wait for it."""
    by_id: dict[int, list[Handler]] = {}
    for table, frame in zip(tables, frames, strict=True):
        by_id.setdefault(identifier(table), []).append(frame.handler)
    return {can_id: found[0] if len(found) == 1 else _all_of(found) for can_id, found in by_id.items()}


def _all_of(found: Sequence[Handler]) -> Handler:
    def _each(buffer: Buffer, offset: int, length: int) -> None:
        for handler in found:
            handler(buffer, offset, length)

    return _each
