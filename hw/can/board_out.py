"""Frames to a board of one's own: each cycle's commands, and frames that are always the same."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from hw.can.board_in import checksum_of
from hw.can.board_map import factor, identifier, make_field
from hw.can.bus import REMOTE, Bus, Outgoing
from hw.can.fields import Encode, encoder
from hw.can.steady_records import Command, Counter, Entry, counting
from hw.interface import Options, Rig
from hw.stop_sequence import stop_numbers


def fixed(tables: Sequence[Options], bus: Bus) -> list[Any]:
    """Frames with the bytes that `data` of each table says."""
    return [
        _frame(bus, identifier(table) | (REMOTE if table["remote"] else 0), bytes(table["data"]))
        for table in tables
    ]


def _frame(bus: Bus, can_id: int, data: bytes) -> Outgoing:
    frame: Outgoing = bus.outgoing(can_id, len(data))
    if data:
        frame.buffer[frame.offset : frame.offset + len(data)] = data
    return frame


class SentFrame:
    """One kind of frame to the board: every cycle's commands encoded into it.

    While not enabled `idle` goes out in its place, where there is one, else a command of zeros. The first
    cycle that is enabled sends `enter`, where there is one, and no command. A frame of the connection
    `before` has its count gone on with."""

    def __init__(self, table: Options, rig: Rig, bus: Bus, before: SentFrame | None = None) -> None:
        can_id, length = identifier(table), int(table["length"])
        self._frame = bus.outgoing(can_id, length)
        self._enter = _frame(bus, can_id, bytes(table["enter"])) if table.get("enter") else None
        self._idle = _frame(bus, can_id, bytes(table["idle"])) if table.get("idle") else None
        self._entered = False
        self._fields: list[tuple[Encode, str, int, float, float]] = []
        self._entries: list[tuple[str, Entry]] = []
        self._counter: tuple[Encode, Counter] | None = None
        self._table, self._enabled = table, False
        self._checksum = checksum_of(table["checksum"])
        for entry in table["field"]:
            field = make_field(entry, length)
            encode, channel = encoder(field), entry["channel"]
            if channel == "constant":
                encode(self._frame.buffer, self._frame.offset, entry["value"])
            elif channel == "counter":
                self._counter = encode, counting(field)
                if before is not None and before._counter is not None:
                    self._counter[1].count = before._counter[1].count
            else:
                limit = entry["limit"] if channel != "enable" else 1.0
                axis, to_wire = int(entry["axis"]), 1.0 / factor(entry, rig)
                self._fields.append((encode, channel, axis, to_wire, limit))
                if channel != "enable":
                    self._entries.append((channel, Entry(field, axis, to_wire, limit)))

    def send(self, bus: Bus, currents_a: Sequence[float], torques_nm: Sequence[float], enabled: bool) -> None:
        """Encode and send; a command that is not finite disables the board in this frame."""
        self._enabled = enabled
        if not enabled:
            self._entered = False
            if self._idle is not None:
                bus.send(self._idle)
                return
        elif self._enter is not None and not self._entered:
            # no room: again in the next cycle, and no command before it
            self._entered = bus.send(self._enter)
            return
        frame = self._frame
        buffer, offset = frame.buffer, frame.offset
        for encode, channel, axis, to_wire, limit in self._fields:
            value = 0.0
            if channel == "enable":
                value = 1.0 if enabled else 0.0
            elif enabled:
                wanted = (currents_a if channel == "current_command" else torques_nm)[axis]
                if wanted - wanted != 0.0:  # NaN or infinite
                    self.send(bus, currents_a, torques_nm, False)
                    return
                # cut before it is scaled: `limit` is in SI units
                value = to_wire * (limit if wanted > limit else -limit if wanted < -limit else wanted)
            encode(buffer, offset, value)
        if self._counter is not None:
            encode_count, counter = self._counter
            # after the decision to send: a board that counts would see a gap where `idle` stands
            counter.count = (counter.count + 1) % counter.modulus
            encode_count(buffer, offset, counter.count)
        if self._checksum is not None:
            self._seal(frame)
        bus.send(frame)

    def stop(self, bus: Bus) -> None:
        """Send a command of zeros, disabled: one that a board obeys whatever count it saw last, and after
        which it obeys the commands that follow."""
        self.send(bus, (), (), False)
        if self._counter is None or self._idle is not None:
            return
        counter = self._counter[1]
        for number in stop_numbers(counter.modulus):
            counter.count = number - 1  # `send` counts first
            self.send(bus, (), (), False)

    def is_alike(self, enabled: bool) -> bool:
        """Whether the next frame is as the last one but for commands and counter."""
        return self._enabled == enabled and (not enabled or self._enter is None or self._entered)

    def steady(self, words: Mapping[str, int]) -> Command:
        """The last frame as compiled cycles send it; `words`: where the tick has the command of axis 0 of
        each channel."""
        if not self._enabled and self._idle is not None:
            return Command(self._idle)
        checksum, entries = self._table["checksum"], self._entries if self._enabled else []
        return Command(
            self._frame,
            [replace(entry, place=words[channel] + entry.place) for channel, entry in entries],
            None if self._counter is None else self._counter[1],
            (checksum["kind"], int(checksum["byte"])) if checksum else None,
            strict=True,
        )

    def _seal(self, frame: Outgoing) -> None:
        checksum, byte, size = self._checksum  # type: ignore[misc]
        # a copy: the checksum is of the bytes without its own
        data = bytes(frame.buffer[frame.offset : frame.offset + frame.length])
        at = frame.offset + byte
        frame.buffer[at : at + size] = checksum(data[:byte] + data[byte + size :]).to_bytes(size, "big")
