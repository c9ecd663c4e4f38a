"""A fixed-length frame as data: sync bytes, numbers at offsets, a checksum. Compiled reading, writing,
finding.

A record of `layout_dtype` says where things are, rows of `field_dtype` what the numbers mean. Both are made
once, at start, from the rig file (`hw.serial.described_plan`); in the loop only the functions below run."""

from __future__ import annotations

from functools import cache

import numpy as np

from hw.jit import compiled
from hw.serial.checksums import checksum
from hw.serial.frame import toward_zero

LENGTH_MAX = 250
SYNC_MAX = 8

UNSIGNED, SIGNED, FLOAT = range(3)

_F32_MAX = float(np.finfo(np.float32).max)


@cache
def layout_dtype() -> np.dtype[np.void]:
    """Where sync, checksum and constants of a frame are."""
    return np.dtype(
        [
            ("length", "<i8"),
            ("big_endian", "<i8"),
            ("n_sync", "<i8"),
            ("checksum", "<i8"),  # hw.serial.checksums.KINDS
            ("checksum_size", "<i8"),
            ("checksum_big", "<i8"),
            ("checksum_at", "<i8"),
            ("checksum_from", "<i8"),
            ("n_tail", "<i8"),  # bytes behind the checksum that are always the same
            ("template", "u1", (LENGTH_MAX,)),  # sync, constants and tail, zeros elsewhere
        ]
    )


@cache
def field_dtype() -> np.dtype[np.void]:
    """Where a number is and what it means: value = (raw - zero) * scale."""
    return np.dtype(
        [
            ("target", "<i8"),  # hw.serial.described_plan.Target
            ("index", "<i8"),  # axis, or component of the force
            ("at", "<i8"),
            ("n_bytes", "<i8"),
            ("kind", "<i8"),
            ("scale", "<f8"),
            ("zero", "<f8"),
            ("period", "<f8"),  # after which a position starts over, in the unit of the scale; 0: it does not
            ("bits", "<i8"),  # width of a counter that runs over its end; 0: it does not
            ("mask", "<i8"),  # bits that count, for switches
            ("invert", "<i8"),
        ]
    )


@compiled
def read_bytes(frame: np.ndarray, at: int, size: int, big: int) -> int:
    """Unsigned number of `size` (1 to 4) bytes."""
    value = np.int64(0)
    for k in range(size):
        # highest byte first, from either end
        value = (value << 8) | np.int64(frame[at + (k if big else size - 1 - k)])
    return int(value)


@compiled
def write_bytes(frame: np.ndarray, at: int, size: int, big: int, value: int) -> None:
    """Low `size` bytes of `value`."""
    rest = np.int64(value)
    for k in range(size):
        frame[at + (size - 1 - k if big else k)] = np.uint8(rest & 0xFF)
        rest >>= 8


@compiled
def read_raw(frame: np.ndarray, start: int, f: np.record, big: int) -> float:
    """The number of field `f` of the frame that begins at `start`, as it is on the wire."""
    value = read_bytes(frame, start + f.at, f.n_bytes, big)
    if f.kind == FLOAT:
        # the bits of a float are taken as they are: a conversion would make a number of their pattern
        return float(np.uint32(value).view(np.float32))
    if f.kind == SIGNED and value >> (8 * f.n_bytes - 1):
        value -= 1 << (8 * f.n_bytes)
    return float(value)


@compiled
def write_raw(frame: np.ndarray, f: np.record, big: int, raw: float) -> None:
    """Write `raw` (finite), truncated toward zero and saturated to what the field can hold."""
    if f.kind == FLOAT:
        # cut before: a float64 beyond float32 becomes infinite, which a drive may take for full torque
        single = np.float32(min(max(raw, -_F32_MAX), _F32_MAX))
        write_bytes(frame, f.at, f.n_bytes, big, int(np.int64(single.view(np.uint32))))
        return
    span = 2.0 ** (8 * f.n_bytes)
    low, high = (-span / 2, span / 2 - 1) if f.kind == SIGNED else (0.0, span - 1)
    write_bytes(frame, f.at, f.n_bytes, big, int(min(max(raw, low), high)))


@compiled
def wire_value(f: np.record, value: float) -> float:
    """What stands on the wire for `value`: in steps of the scale, never beyond `value`, around the zero."""
    # toward 0: rounding up would be more torque than the law has allowed
    steps = value / f.scale
    if f.kind == FLOAT:
        return float(steps + f.zero)
    # more than any field holds, and still exact: an infinite value has no whole part
    steps = min(max(steps, -(2.0**40)), 2.0**40)
    return toward_zero(steps) + float(f.zero)


@compiled
def sealed_at(data: np.ndarray, at: int, layout: np.ndarray) -> bool:
    """True when the bytes from `at` on are a frame: its sync bytes, its tail and a right checksum."""
    x = layout[0]
    for k in range(x.n_sync):
        if data[at + k] != x.template[k]:
            return False
    for k in range(x.length - x.n_tail, x.length):
        if data[at + k] != x.template[k]:
            return False
    # last: sync and tail are a few comparisons, the checksum is a loop over the frame
    found = read_bytes(data, at + x.checksum_at, x.checksum_size, x.checksum_big)
    return found == checksum(x.checksum, data, at + x.checksum_from, at + x.checksum_at)


@compiled
def seal_frame(frame: np.ndarray, layout: np.ndarray) -> None:
    """Write the checksum of a frame at the start of `frame`."""
    x = layout[0]
    value = checksum(x.checksum, frame, x.checksum_from, x.checksum_at)
    write_bytes(frame, x.checksum_at, x.checksum_size, x.checksum_big, value)


@cache
def stream_dtype() -> np.dtype[np.void]:
    """Bytes that are not yet a whole frame."""
    return np.dtype(
        [("synced", "<i8"), ("n", "<i8"), ("skipped", "<i8"), ("pending", "u1", (2 * LENGTH_MAX,))]
    )


@compiled
def next_frame(
    stream: np.ndarray, chunk: np.ndarray, at: int, stop: int, layout: np.ndarray
) -> tuple[int, bool, int]:
    """Look for a frame in what is pending and `chunk[at:stop]`.

    Returns
    -------
    at : int
        Where to go on.
    found : bool
        A whole frame with a right checksum now begins `stream[0].pending`; it is dropped at the next call.
    broken : int
        How often a frame was due and something else stood there.

    Notes
    -----
    A frame that fails is searched byte by byte for the next beginning: sync bytes may occur in data, and
    a lost byte must not cost more than the frame it was in."""
    s, length, broken = stream[0], layout[0].length, 0
    if s.skipped:
        # now and not when it was found: until here the caller reads the frame where it lies
        _drop(s, s.skipped)
        s.skipped = 0
    while True:
        while s.n < length and at < stop:
            s.pending[s.n] = chunk[at]
            s.n += 1
            at += 1
        # what has come so far may be the beginning of a frame: judged when the rest is here
        if s.n < length:
            return at, False, broken
        if sealed_at(s.pending, 0, layout):
            s.synced = 1
            s.skipped = length
            return at, True, broken
        if s.synced:
            broken += 1
            # counted once: the bytes that follow are part of the same damage
            s.synced = 0
        # not by the whole length: the frame that was due may begin within what stood in its place
        _drop(s, _next_beginning(s, layout[0]))


@compiled
def _next_beginning(s: np.record, x: np.record) -> int:
    """How many bytes to forget until sync bytes may begin."""
    for at in range(1, s.n):
        fits = True
        for k in range(min(x.n_sync, s.n - at)):
            if s.pending[at + k] != x.template[k]:
                fits = False
                break
        if fits:
            return at
    return int(s.n)


@compiled
def _drop(s: np.record, count: int) -> None:
    """Forget the first `count` pending bytes."""
    for k in range(s.n - count):
        s.pending[k] = s.pending[k + count]
    s.n -= count
