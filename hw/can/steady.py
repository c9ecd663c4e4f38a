"""A CAN device handed over to compiled cycles (`hw.can.steady_cycle`) and taken back, with all that either
knows.

Python has the device while it is set up, armed or disarmed, and whenever a frame says more than a sample. At
the end of each of its cycles it hands the device over for as many cycles as will be alike: nothing of what
the codec counts (retries, heartbeats, time to arm) comes due in them. Any call of the backend takes it back.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hw.can.batch import STRIDE, Batch
from hw.can.steady_cycle import read_cycle, write_cycle
from hw.can.steady_records import (
    BUS,
    COMMAND,
    COMMANDS_MAX,
    ENDLESS,
    FAULT,
    FIELDS_MAX,
    FRAME,
    FRAMES_MAX,
    NONE,
    NOWHERE,
    NUMBER,
    OFF,
    ON,
    PLAIN,
    TOLD,
    Command,
    Frame,
    Number,
    fill_checksum,
    fill_entry,
    fill_number,
)
from hw.channels import QUANTITIES
from hw.interface import CompiledCycle
from hw.jit import records

if TYPE_CHECKING:
    from hw.can.backend import CanBackend
    from hw.can.bus import SteadyBus

_EXACT_BITS = 53
"""Widest whole number that compiled code writes, or compares with its ends: wider ones are no float64."""
_COUNTED_BITS = 62
_CHUNK = 8192
"""Bytes of a port that are read at once: the kernel's line discipline holds at most 4095."""
_SAME = ("fresh", "needed", "faults", "estop")
_COUNTS = ("damaged", "not_newer", "not_finite")


def is_possible(frames: Sequence[Frame]) -> bool:
    """Whether compiled code can have a device of these frames: none of a whole sample is for Python, and no
    number is too wide."""
    numbers = [one for frame in frames for one in (*frame.numbers, *frame.guards)]
    counters = [frame.counter for frame in frames if frame.counter is not None]
    if len(frames) > FRAMES_MAX or len(numbers) + len(counters) > FIELDS_MAX:
        return False
    # no sample would ever be whole: Python would have each cycle, and handing over would cost it only more
    if any(frame.bit and not frame.numbers for frame in frames):
        return False
    guards = [one.bits for frame in frames for one in frame.guards]
    counted = [one.bits for one in counters + [one for one in numbers if one.way == ENDLESS]]
    inside = [one.bits for one in numbers if one.inside]
    return (
        all(one.bits <= _COUNTED_BITS for one in counted)
        and all(one.kind != "float" and one.bits <= _EXACT_BITS for one in guards)
        and all(one.kind == "float" or one.bits <= _EXACT_BITS for one in inside)
    )


def _is_exact(commands: Sequence[Command]) -> bool:
    """Whether compiled code can write them: there is room, and no number is too wide."""
    entries = [entry for one in commands for entry in one.entries]
    entries += [one.counter.entry for one in commands if one.counter is not None]
    exact = all(one.bits.kind == "float" or one.bits.bits <= _EXACT_BITS for one in entries)
    return exact and len(commands) <= COMMANDS_MAX and len(entries) <= FIELDS_MAX


class Steady:
    """Compiled cycles of one device, for one tick."""

    def __init__(self, backend: CanBackend, tick: np.ndarray) -> None:
        self._backend, self.tick = backend, tick
        sample, taken = backend.sample, backend.taken
        self.bus = records(np.zeros(1, BUS))
        self._row: Any = self.bus[0]
        self._frame_rows, self._number_rows = (
            records(np.zeros(FRAMES_MAX, FRAME)),
            records(np.zeros(FIELDS_MAX, NUMBER)),
        )
        self._command_rows, self._entry_rows = (
            records(np.zeros(COMMANDS_MAX, COMMAND)),
            records(np.zeros(FIELDS_MAX, NUMBER)),
        )
        self._packets = np.zeros((COMMANDS_MAX, STRIDE), np.uint8)
        self._batch = Batch(-1)
        self._chunk, self._line = np.zeros(_CHUNK, np.uint8), np.zeros(64, np.uint8)
        inbox = np.frombuffer(self._batch.buffer, np.uint8)
        values, shown_of = np.frombuffer(sample.values), np.frombuffer(taken.values)
        plain = tick.view(np.ndarray)
        words, floats = plain.view(np.int64).reshape(-1), plain.view(np.float64).reshape(-1)
        self._shown = _shown_words(backend, tick.dtype)
        self._frames: list[Frame] = []
        self._of: object = None
        self._place(tick.dtype)
        self.parts = CompiledCycle(
            read_cycle,
            (
                self.bus, inbox, self._chunk, self._frame_rows, self._number_rows, values, shown_of,
                np.zeros(FIELDS_MAX), self._shown,
                words, floats,
            ),
            write_cycle,
            (self.bus, self._line, self._command_rows, self._entry_rows, self._packets, words, floats),
        )  # fmt: skip

    def _place(self, dtype: np.dtype[Any]) -> None:
        """Where in the tick stands what both halves look at or write."""
        row, fields = self._row, dtype.fields
        assert fields is not None
        for name, of in (
            ("slot", "tick"),
            ("count", "sample_count"),
            ("faults", "link_faults"),
            ("enabled", "enabled"),
        ):
            row[f"{name}_at"] = fields[of][1] // 8
        row["estop_at"] = fields["estop"][1] // 8 if "estop" in self._backend.provides else NOWHERE
        row["shown"] = len(self._shown)

    # -- over to compiled code -------------------------------------------------------------------------
    def begin(self, bus: SteadyBus, cycles: int, standing_faults: int, *, enabled: bool) -> None:
        """Hand the device over for at most so many cycles: `enabled` and these faults stay in them."""
        row, sample, backend = self._row, self._backend.sample, self._backend
        if self._of is not bus:  # opened anew since: other descriptor, other frames
            self._connect(bus)
        commands = backend.steady_commands()
        if not _is_exact(commands) or not all(_fill_state(frame) for frame in self._frames):
            return
        self._fill_commands(bus, commands)
        for name in _SAME:
            row[name] = getattr(sample, name)
        row["estop_taken"] = backend.taken.estop
        for name in _COUNTS:
            row[name] = sample.counts[name]
        row["count"], row["silent"], row["slot"] = backend.cycles
        row["standing_faults"], row["enabled"] = standing_faults, enabled
        row["budget"], row["passed"], row["error"] = cycles, 0, 0
        row["n"] = row["at"] = row["begin"] = 0
        rest = bus.rest()
        self._chunk[: len(rest)] = np.frombuffer(rest, np.uint8)
        row["left"] = len(rest)
        row["on"] = ON

    def _connect(self, bus: SteadyBus) -> None:
        """A bus was opened: work on its descriptor, and on what its frames say now."""
        row = self._row
        self._of, self._frames = bus, self._backend.steady_frames()
        bus.use(self._batch)
        row["fd"], row["ascii"], row["messages_at"] = bus.fileno(), bus.lines, self._batch.address
        row["frames"] = len(self._frames)
        at = 0
        for k, frame in enumerate(self._frames):
            at = self._fill_frame(self._frame_rows[k], frame, at)

    def _fill_frame(self, row: Any, frame: Frame, at: int) -> int:  # noqa: ANN401
        """Write a frame into its rows; returns the next free row of a number."""
        frame.row = row
        row["key"], row["length"], row["bit"] = frame.key, frame.length, frame.bit
        row["leaves"], row["leaves_length"] = not frame.numbers and not frame.guards, frame.leaves_length
        fill_checksum(row, frame.checksum)
        row["first"], row["counter"], row["fault"] = at, NONE, 0
        for number in frame.numbers:
            at = self._fill_number(number, at)
        row["end"] = at
        for guard in frame.guards:
            at = self._fill_number(guard, at)
        row["guard_end"] = at
        if frame.counter is not None:
            row["counter"], row["span"] = at, 1 << frame.counter.bits.bits
            at = self._fill_number(frame.counter, at)
        return at

    def _fill_number(self, number: Number, at: int) -> int:
        row = number.row = self._number_rows[at]
        fill_number(row, number.bits)
        row["way"], row["inside"], row["place"] = number.way, number.inside, number.place
        row["factor"], row["period"], row["says"] = number.factor, number.period, number.says
        return at + 1

    def _fill_commands(self, bus: SteadyBus, commands: Sequence[Command]) -> None:
        at = 0
        self._row["commands"] = len(commands)
        for row, packet, command in zip(self._command_rows, self._packets, commands, strict=False):
            data = bus.packed(command.frame)
            packet[: len(data)] = np.frombuffer(data, np.uint8)
            self._row["frame_bytes"] = len(data)
            row["length"], row["strict"] = command.frame.length, command.strict
            fill_checksum(row, command.checksum)
            row["first"], row["counter"] = at, NONE
            for entry in command.entries:
                fill_entry(self._entry_rows[at], entry)
                at += 1
            row["end"] = at
            if command.counter is not None:
                row["counter"], row["count"], row["modulus"] = (
                    at,
                    command.counter.count,
                    command.counter.modulus,
                )
                fill_entry(self._entry_rows[at], command.counter.entry)
                at += 1
        self._commands = commands

    # -- and back ----------------------------------------------------------------------------------------
    def end(self) -> int:
        """Take the device back, if compiled code has it; returns `LinkFault` bits of frames of a cycle that
        it has begun."""
        row = self._row
        if row["on"] == OFF:
            return 0
        sample, backend = self._backend.sample, self._backend
        told, row["on"] = row["on"] == TOLD, OFF
        for name in ("fresh", "faults", "estop"):
            setattr(sample, name, int(row[name]))
        backend.taken.estop = int(row["estop_taken"])
        for name in _COUNTS:
            sample.counts[name] = int(row[name])
        backend.cycles = int(row["count"]), int(row["silent"]), int(row["slot"])
        for frame in self._frames:
            _keep_state(frame)
        bus: Any = self._of
        for command, one in zip(self._commands, self._command_rows, strict=False):
            if command.counter is not None:
                command.counter.count = int(one["count"])
            if told:
                (bus.health.taken if one["outcome"] else bus.health.refused)()
        backend.pass_by(int(row["passed"]))
        rest = self._chunk[row["begin"] : row["begin"] + row["left"]].tobytes()
        row["begin"] = row["left"] = 0
        bus.keep(int(row["at"]), int(row["n"]), rest, int(row["error"]))
        return int(row["faults"])


def _shown_words(backend: CanBackend, dtype: np.dtype[Any]) -> np.ndarray:
    """Words of the tick, and places of the sample's values that are shown there; shape (n, 2)."""
    fields, taken = dtype.fields, backend.taken
    assert fields is not None
    shown = [
        (fields[reading.field][1] // 8 + k, taken.start[reading.name] + k)
        for reading in QUANTITIES
        if reading.name in backend.provides
        for k in range(len(taken.of[reading.name]))
    ]
    return np.array(shown, np.int64).reshape(-1, 2)


def _fill_state(frame: Frame) -> bool:
    """What follows counters and angles, and what guards wait for; False where that is beyond what a record
    can hold."""
    row = frame.row
    if frame.counter is not None:
        row["started"], row["last"] = frame.order.state
    for number in frame.numbers:
        if number.way == ENDLESS:
            started, total = number.state.state
            if abs(total) >> _COUNTED_BITS:
                return False
            number.row["encoder"] = started, total
        elif number.way != PLAIN:
            number.row["angle"] = number.state.state
        elif number.place == FAULT:
            row["fault"] = frame.flag.fault
    for guard in frame.guards:
        guard.row["wanted"] = guard.wanted if isinstance(guard.wanted, int) else guard.wanted()
    return True


def _keep_state(frame: Frame) -> None:
    """Counters, angles and fault flags back from the record."""
    row = frame.row
    if frame.counter is not None:
        frame.order.state = int(row["started"]), int(row["last"])
    for number in frame.numbers:
        if number.way == ENDLESS:
            number.state.state = int(number.row["encoder"][0]), int(number.row["encoder"][1])
        elif number.way != PLAIN:
            number.state.state = float(number.row["angle"][0]), int(number.row["angle"][1])
        elif number.place == FAULT:
            frame.flag.fault = bool(row["fault"])
