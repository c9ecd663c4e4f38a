"""Frames to numbers and commands to frames by the tables of `hw.can.steady_records`, compiled.

The same numbers, in the same order of operations, as the closures of `hw.can.fields` and `hw.can.board_in`
give, which decode wherever Python has the device; a test holds them to each other bit for bit."""

from __future__ import annotations

import math

import numpy as np

from hw.can.fields import CHECKSUMS
from hw.can.steady_records import (
    CHECKSUM_KINDS,
    ENDLESS,
    ESTOP,
    FAULT,
    FLOAT,
    INT,
    LEAVES,
    NOWHERE,
    ROUND,
    UINT,
)
from hw.encoder import beyond, follow, unwrap
from hw.interface import LinkFault
from hw.jit import compiled

_CHECKSUM, _SEQUENCE = int(LinkFault.CHECKSUM), int(LinkFault.SEQUENCE)
_XOR8, _SUM8, _SUM16, _J1850, _ = range(len(CHECKSUM_KINDS))


def _remainders(kind: str) -> np.ndarray:
    """What each byte makes of a remainder of 0, from the function of one byte."""
    # the 0xFF of begin and end is taken out again
    return np.array([CHECKSUMS[kind](bytes([byte ^ 0xFF])) ^ 0xFF for byte in range(256)], np.int64)


_TABLES = np.stack([_remainders("crc8_j1850"), _remainders("crc8_autosar")])


@compiled
def raw_bits(data: np.ndarray, at: int, f: np.record) -> int:
    """The bits of number `f` in the frame whose data begins at `data[at]` (uint8), as an unsigned integer of
    64 bits."""
    first, skip = f.shift >> 3, f.shift & 7
    found = np.uint64(0)
    # byte by byte: Numba knows no integer of 512 bits, which a frame of CAN FD would be
    for j in range((skip + f.bits + 7) >> 3):
        byte = np.uint64(data[at + (f.length - 1 - first - j if f.big else first + j)])
        found |= byte >> np.uint64(skip) if j == 0 else byte << np.uint64(8 * j - skip)
    return found & np.uint64(f.mask)  # type: ignore[return-value] # NumPy's integer


@compiled
def _whole(found: int, f: np.record) -> int:
    """Signed or unsigned number of these bits, as 64 signed bits."""
    if f.kind == UINT:
        return np.int64(found)  # type: ignore[return-value]
    # not by a mask and a subtraction: the widest number has no bit above its sign
    spare = np.uint64(64 - f.bits)
    # up and down again: the sign fills the bits above
    return np.int64(np.uint64(found) << spare) >> np.int64(spare)  # type: ignore[return-value]


@compiled
def raw_number(data: np.ndarray, at: int, f: np.record) -> float:
    """The raw number `f`."""
    found = raw_bits(data, at, f)
    if f.kind == INT:
        return float(_whole(found, f))
    if f.kind == UINT:
        return float(found)
    if f.bits == 32:
        return float(np.uint32(found).view(np.float32))
    return float(np.uint64(found).view(np.float64))


@compiled
def value_of(data: np.ndarray, at: int, f: np.record) -> float:
    """The number in SI units; NaN where it is none. Follows counters and angles."""
    if f.way == ENDLESS:
        # not factor * (scale * count + offset), which rounds otherwise than the closure in `board_in`
        count = unwrap(_whole(raw_bits(data, at, f), f), f.bits, f.encoder)
        return float(f.factor * f.scale * count + f.factor * f.offset)
    value = raw_number(data, at, f)
    # before the scale: the ends of its range are the device's, in steps
    if f.inside and not f.low < value < f.high:
        return math.nan
    if f.scale != 1.0 or f.offset != 0.0:
        value = f.scale * value + f.offset
    value = f.factor * value
    if f.way != ROUND:
        return float(value)
    # `follow` would keep it as the last angle, and be wrong by turns from then on
    if not math.isfinite(value) or beyond(value, f.period, f.angle):
        return math.nan
    return follow(value, f.period, f.angle)


@compiled
def checksum_of(kind: int, data: np.ndarray, at: int, length: int, skip: int, skipped: int) -> int:
    """Checksum of `data[at:at + length]` without the `skipped` bytes from `skip` on: its own."""
    total = np.int64(0 if kind in (_XOR8, _SUM8, _SUM16) else 0xFF)
    for k in range(length):
        if skip <= k < skip + skipped:
            continue
        byte = np.int64(data[at + k])
        if kind == _XOR8:
            total ^= byte
        elif kind in (_SUM8, _SUM16):
            total += byte
        else:
            total = _TABLES[0 if kind == _J1850 else 1, total ^ byte]
    if kind == _SUM8:
        return int(total & 0xFF)
    if kind == _SUM16:
        return int(total & 0xFFFF)
    return int(total if kind == _XOR8 else total ^ 0xFF)


@compiled
def _intact(data: np.ndarray, at: int, r: np.record) -> bool:
    if r.checksum < 0:
        return True
    found = 0
    for k in range(r.sum_size):
        found = found << 8 | int(data[at + r.sum_at + k])
    return bool(found == checksum_of(r.checksum, data, at, r.length, r.sum_at, r.sum_size))


@compiled
def _guarded(data: np.ndarray, at: int, r: np.record, numbers: np.ndarray, says: int) -> bool:
    """Whether a guard of this kind holds the frame back."""
    for k in range(r.end, r.guard_end):
        f = numbers[k]
        if f.says == says and _whole(raw_bits(data, at, f), f) != f.wanted:
            return True
    return False


@compiled
def is_for_python(data: np.ndarray, at: int, length: int, r: np.record, numbers: np.ndarray) -> bool:
    """Whether a frame of this identifier says what only Python deals with."""
    if r.leaves:
        return True
    if length != r.length:
        return bool(r.leaves_length)
    return _guarded(data, at, r, numbers, LEAVES)


@compiled
def take(
    data: np.ndarray,
    at: int,
    length: int,
    r: np.record,
    numbers: np.ndarray,
    bus: np.record,
    values: np.ndarray,
    scratch: np.ndarray,
) -> None:
    """Decode one frame; a damaged, repeated or not finite one changes nothing but counters."""
    # another frame of this identifier: neither damage nor news. 0 is CHOOSES
    if length == r.length and _guarded(data, at, r, numbers, 0):
        return
    if length != r.length or not _intact(data, at, r):
        bus.damaged += 1
        bus.faults |= _CHECKSUM
        return
    if r.counter >= 0 and not _newer(r, raw_bits(data, at, numbers[r.counter])):
        bus.not_newer += 1
        bus.faults |= _SEQUENCE
        return
    for k in range(r.first, r.end):
        scratch[k] = value_of(data, at, numbers[k])
        # none of the frame's numbers is kept: what came with one that is none is not trusted either
        if not math.isfinite(scratch[k]):
            bus.not_finite += 1
            return
    for k in range(r.first, r.end):
        place = numbers[k].place
        if place >= 0:
            values[place] = scratch[k]
        elif place == ESTOP:
            bus.estop = 1 if scratch[k] != 0.0 else 0
        elif place == FAULT:
            r.fault = 1 if scratch[k] != 0.0 else 0
    bus.fresh |= r.bit


@compiled
def _newer(r: np.record, count: int) -> bool:
    """Whether a counter is ahead of the last one by no more than half its range; the first one is."""
    now = np.int64(count)
    ahead = (now - r.last) & (r.span - 1) if r.started else np.int64(1)
    if not 0 < ahead <= r.span // 2:
        return False
    r.started, r.last = 1, now
    return True


@compiled
def _put_bits(data: np.ndarray, at: int, f: np.record, bits: int) -> None:
    """Write the low bits of `bits` where number `f` is."""
    value = np.uint64(bits) & np.uint64(f.mask)
    first, skip = f.shift >> 3, f.shift & 7
    for j in range((skip + f.bits + 7) >> 3):
        k = at + (f.length - 1 - first - j if f.big else first + j)
        if j == 0:
            part, mask = value << np.uint64(skip), np.uint64(f.mask) << np.uint64(skip)
        else:
            back = np.uint64(8 * j - skip)
            part, mask = value >> back, np.uint64(f.mask) >> back
        # of the number's own bits only: the byte may be shared with a constant or another command
        kept = np.uint64(data[k]) & ~mask
        data[k] = np.uint8((kept | part) & np.uint64(0xFF))


@compiled
def put_number(data: np.ndarray, at: int, f: np.record, value: float) -> None:
    """Write a command: cut, turned into what stands on the wire, saturated. One that is not finite is 0."""
    # cut in SI before any scale, as Python does: the limit is of the motor, not of the wire
    wanted = min(max(value, -f.limit), f.limit) if math.isfinite(value) else 0.0
    raw = (f.before * (f.factor * wanted) - f.offset) / f.scale
    raw = min(max(raw, f.low), f.high)
    if f.kind != FLOAT:
        # rint: half to even, as Python's `round`
        _put_bits(data, at, f, np.uint64(np.int64(np.rint(raw))))  # type: ignore[arg-type]
    elif f.bits == 32:
        _put_bits(data, at, f, np.uint64(np.float32(raw).view(np.uint32)))  # type: ignore[arg-type]
    else:
        _put_bits(data, at, f, np.float64(raw).view(np.uint64))  # type: ignore[arg-type]


@compiled
def is_writable(r: np.record, numbers: np.ndarray, words: np.ndarray) -> bool:
    """Whether all commands of the frame are finite, where it takes no others. `words` are those of the tick
    as numbers."""
    if r.strict:
        for k in range(r.first, r.end):
            place = numbers[k].place
            if place != NOWHERE and not math.isfinite(words[place]):
                return False
    return True


@compiled
def put(data: np.ndarray, at: int, r: np.record, numbers: np.ndarray, words: np.ndarray) -> None:
    """Write the commands, the counter and the checksum of one frame into its bytes, `data[at:]`."""
    for k in range(r.first, r.end):
        f = numbers[k]
        put_number(data, at, f, words[int(f.place)] if f.place >= 0 else 0.0)
    if r.counter >= 0:
        # with the frame that has it: `idle` bytes, which may go out in its place, have no count
        count = (r.count + 1) % r.modulus
        r.count = count
        put_number(data, at, numbers[r.counter], float(count))
    if r.checksum >= 0:
        total = checksum_of(r.checksum, data, at, r.length, r.sum_at, r.sum_size)
        for k in range(r.sum_size):
            data[at + r.sum_at + k] = np.uint8((total >> (8 * (r.sum_size - 1 - k))) & 0xFF)
