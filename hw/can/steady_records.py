"""What compiled cycles of a CAN device work on: one record of the bus, and tables of its frames and of the
numbers in them.

The tables are made from what the codecs say of their frames (`Frame`, `Command`); `hw.can.steady_codec` runs
on them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hw.can.fields import CHECKSUM_BYTES, Field

# more than a bus carries: 64 frames of 8 bytes a cycle fill 1 Mbit/s at 116 Hz
FIELDS_MAX, FRAMES_MAX, COMMANDS_MAX = 256, 64, 64
"""Rows of the tables. A device with more keeps to Python."""

OFF, ON, TOLD = range(3)
"""Who has the device: Python; compiled code; compiled code until Python has looked at what became of the
commands."""

UINT, INT, FLOAT = range(3)
PLAIN, ENDLESS, ROUND = range(3)
"""How a number becomes a value: as it is; a counter followed through its wraps; an angle that starts over."""

NOWHERE, ESTOP, FAULT = -1, -2, -3
"""Places of a number besides those of the sample's values."""

CHOOSES, LEAVES = range(2)
"""What another value of a guarding number says: the frame is not this one; the frame is for Python."""

# above the 53 bits of the widest guard (`hw.can.steady`)
NEVER = 1 << 60
"""No number that a guard may be has this value."""

CHECKSUM_KINDS = ("xor8", "sum8", "sum16", "crc8_j1850", "crc8_autosar")
NONE = -1

_WORDS = (
    # the bus: descriptor; slcan or not; bytes not read yet; bytes of a frame sent
    "fd", "ascii", "messages_at", "begin", "left", "frame_bytes",
    # whether compiled code has the device; cycles it may make, and has made
    "on", "budget", "passed", "enabled", "error",
    "n", "at",  # frames taken from the kernel, and the first of them that Python is to look at
    "fresh", "needed", "faults", "estop", "estop_taken", "damaged", "not_newer", "not_finite",
    "count", "silent", "slot", "standing_faults",  # faults in force that no frame of this cycle brings
    "frames", "commands", "shown",  # rows in use
    # words of the tick
    "slot_at", "count_at", "faults_at", "enabled_at", "estop_at",
)  # fmt: skip
BUS = np.dtype([(name, "<i8") for name in _WORDS])

FRAME = np.dtype(
    [(name, "<i8") for name in (
        "key", "length", "first", "end", "guard_end", "bit", "leaves", "leaves_length",
        "counter", "started", "last", "span", "checksum", "sum_at", "sum_size", "fault",
    )]
)  # fmt: skip
"""Identifier with flags; numbers are rows `first` to `end`, guards those from there to `guard_end`; a counter
is the row `counter`."""

NUMBER = np.dtype(
    [(name, "<i8") for name in ("shift", "bits", "big", "length", "kind", "way", "place", "wanted", "says",
        "inside")]
    + [("mask", "<u8"), ("encoder", "<i8", (2,)), ("angle", "<f8", (2,))]
    + [(name, "<f8") for name in ("scale", "offset", "factor", "period", "limit", "before", "low", "high")]
)  # fmt: skip

COMMAND = np.dtype(
    [(name, "<i8") for name in ("length", "first", "end", "counter", "count", "modulus", "checksum", "sum_at",
        "sum_size", "strict", "outcome")]
)  # fmt: skip
"""One frame of every cycle. `strict`: a command that is not finite is for Python, in place of being 0."""


@dataclass
class Number:
    """One number of a frame: where it is, what becomes of it, and where its state is kept outside compiled
    cycles."""

    bits: Field
    place: int = NOWHERE
    way: int = PLAIN
    inside: bool = False
    """No value where the raw number stands at an end of its range."""
    factor: float = 1.0
    period: float = 0.0
    state: Any = None
    """What follows a counter or an angle: `Unwrap` or `Modulo`."""
    wanted: Callable[[], int] | int = 0
    """Raw value with which a guard lets the frame pass."""
    says: int = CHOOSES
    row: Any = None


@dataclass
class Frame:
    """One kind of frame that is measured in compiled cycles; without numbers it is for Python whenever it
    comes."""

    key: int
    length: int = 0
    numbers: list[Number] = field(default_factory=list)
    guards: list[Number] = field(default_factory=list)
    bit: int = 0
    counter: Number | None = None
    order: Any = None
    checksum: tuple[str, int] | None = None
    flag: Any = None
    """What has the attribute `fault`, where a number is FAULT."""
    leaves_length: bool = False
    row: Any = None


@dataclass
class Entry:
    """One command in a frame that is sent: `raw = (before * factor * cut(command) - offset) / scale`."""

    bits: Field
    place: int = NOWHERE
    """Word of the tick; NOWHERE: the constant 0."""
    factor: float = 1.0
    limit: float = 1.0
    before: float = 1.0


@dataclass
class Counter:
    """A number that counts frames, from 0 to `modulus` - 1."""

    entry: Entry
    modulus: int
    count: int = 0


def counting(bits: Field) -> Counter:
    """The counter that goes into these bits."""
    return Counter(Entry(bits, factor=1.0, limit=float(1 << bits.bits)), 1 << bits.bits)


@dataclass
class Command:
    """One frame of every cycle: its bytes as Python sent them last, and what is written into them."""

    frame: Any
    entries: list[Entry] = field(default_factory=list)
    counter: Counter | None = None
    checksum: tuple[str, int] | None = None
    strict: bool = False


def fill_number(row: np.void, number: Field) -> None:
    """Write place and meaning of a number's bits."""
    row["shift"], row["bits"], row["big"] = number.shift, number.bits, number.order == "big"
    row["length"], row["kind"] = number.length, ("uint", "int", "float").index(number.kind)
    row["scale"], row["offset"], row["mask"] = number.scale, number.offset, (1 << number.bits) - 1
    row["low"], row["high"] = number.raw_range


def fill_checksum(row: np.void, checksum: tuple[str, int] | None) -> None:
    """Write the kind of a checksum, and which bytes of the frame are its own."""
    row["checksum"] = NONE if checksum is None else CHECKSUM_KINDS.index(checksum[0])
    if checksum is not None:
        row["sum_at"], row["sum_size"] = checksum[1], CHECKSUM_BYTES.get(checksum[0], 1)


def fill_entry(row: np.void, entry: Entry) -> None:
    """Write where a command goes, and how a torque or current becomes what stands on the wire."""
    fill_number(row, entry.bits)
    row["place"], row["factor"] = entry.place, entry.factor
    row["limit"], row["before"] = entry.limit, entry.before
