"""`rtctl-frame`: the six packets between the host and a board, numbers to bytes and back. No I/O here.

docs/serial-protocol.md has the byte tables and the board's state diagram. All numbers are integers on the
wire: counts as the encoder counts them, 0.1 counts/s, 1e-6 of A, N m and N, 1e-2 of a degree Celsius.

Every decoder takes a body as `framing.unseal` gives it and answers True only for a body of exactly the
right type, version and length; its record is untouched otherwise."""

from __future__ import annotations

import math
from enum import IntFlag
from functools import cache

import numpy as np

from hw.jit import compiled
from hw.serial.framing import put, signed, unsigned

VERSION = 1
AXES_MAX = 8

TYPE_STATE = 0x01
TYPE_IDENTITY = 0x02
WITH_VELOCITY, WITH_MOMENT = 0x02, 0x04
"""Bits of the type of a state packet: the velocity of each axis is in it; the moment of the hand is at its
end."""
TYPE_COMMAND = 0x81
TYPE_STOP = 0x82
TYPE_IDENTIFY = 0x83

MICRO = 1_000_000
# 2^31 - 1; the most negative number has no positive counterpart, and a sign may be turned
_LARGEST = 2147483647.0

SERIAL_NUMBER_BYTES = 16


class Status(IntFlag):
    """Bits of a state packet's `status`."""

    ENABLED = 1
    """The power stage drives the motor."""
    ESTOP = 2
    """The emergency stop input is open."""
    DRIVE_FAULT = 4
    """Over-current, over-voltage, over-temperature of the drive, encoder failure: latched by the board."""
    TTL_EXPIRED = 8
    """No valid command came within the time to live of the last one."""
    COMMAND_DAMAGED = 16
    """A damaged packet arrived since the last state packet."""
    TEMPERATURE_MISSING = 32
    FORCE_MISSING = 64
    HELD = 128
    """Torque-free until a command with enable 0 comes: after power-up, a stop packet, or expiry."""
    VELOCITY_MISSING = 256
    MOMENT_MISSING = 512


@cache
def state_dtype(n_axes: int) -> np.dtype[np.void]:
    """Numbers of a state packet (board to host), of any of its four types."""
    axis = (n_axes,)
    return np.dtype(
        [
            ("sequence", "<i8"),  # 0..65535
            ("time_us", "<i8"),  # 0..2^32-1, of the sample, on the board's clock
            ("status", "<i8"),
            ("command_sequence", "<i8"),  # of the command in force
            ("command_age", "<i8"),  # board cycles since that command, 255: that or more
            ("force_un", "<i8", (3,)),
            ("position_counts", "<i8", axis),  # wrapped to 32 bits, signed
            ("current_ua", "<i8", axis),
            ("temperature_cdeg", "<i8", axis),
            ("has_velocity", "<i8"),  # 1: type 03 or 07
            ("velocity_dcounts_s", "<i8", axis),  # 0.1 counts/s
            ("has_moment", "<i8"),  # 1: type 05 or 07
            ("moment_unm", "<i8", (3,)),
        ]
    )


@cache
def command_dtype(n_axes: int) -> np.dtype[np.void]:
    """Numbers of a command packet (host to board)."""
    return np.dtype(
        [
            ("sequence", "<i8"),
            ("enable", "<i8"),
            ("torque_mode", "<i8"),  # 0: values are currents, 1e-6 A; 1: torques, 1e-6 N m
            ("time_to_live", "<i8"),  # board cycles, 1..255
            ("value", "<i8", (n_axes,)),
        ]
    )


@cache
def identity_dtype() -> np.dtype[np.void]:
    """Numbers of an identity packet (board to host)."""
    return np.dtype(
        [
            ("sequence", "<i8"),  # of the request
            ("n_axes", "<i8"),
            ("cycle_us", "<i8"),  # period of the board's own loop
            ("firmware", "<i8"),
            ("serial_number", "u1", (SERIAL_NUMBER_BYTES,)),  # ASCII, padded with zeros
        ]
    )


@compiled
def toward_zero(value: float) -> float:
    """Whole part of `value` (finite); a whole number missed only by rounding of the arithmetic counts as met.

    So what was read from the wire goes back to the wire as the same number."""
    # 15 uA times 1e6 is 14.999999999999998: truncated alone, three of ten readings would lose a step
    nearest = np.rint(value)
    # some nine last places of a float64: `value` is a product or two from the wire
    if abs(nearest - value) <= 2e-15 * abs(value):
        return float(nearest)
    return float(math.trunc(value))


@compiled
def micro(value: float) -> int:
    """`value` in millionths, truncated toward zero, saturated at +-(2^31 - 1). NaN gives 0."""
    scaled = value * 1e6
    # in this sense: a comparison with NaN is false, so NaN comes in here, too
    if not abs(scaled) < _LARGEST:
        if math.isnan(scaled):
            return 0
        return 2147483647 if scaled > 0.0 else -2147483647
    return int(toward_zero(scaled))


@compiled
def _header(body: np.ndarray, kind: int, sequence: int) -> int:
    # the version first: a board of another one reads nothing behind it
    body[0], body[1] = VERSION, kind
    return put(body, 2, 2, sequence)


@compiled
def _is(body: np.ndarray, n: int, kind: int, length: int) -> bool:
    # the exact length: what a longer packet of a later version means is not known here
    return n == length and body[0] == VERSION and body[1] == kind


@compiled
def encode_state(record: np.ndarray, body: np.ndarray) -> int:
    """Write a state packet's body; returns its length: 28, 10 per axis or 14 with velocities, 12 with a
    moment."""
    s = record[0]
    kind = TYPE_STATE | (WITH_VELOCITY if s.has_velocity else 0) | (WITH_MOMENT if s.has_moment else 0)
    at = _header(body, kind, s.sequence)
    at = put(body, at, 4, s.time_us)
    at = put(body, at, 2, s.status)
    at = put(body, at, 2, s.command_sequence)
    at = put(body, at, 1, s.command_age)
    at = put(body, at, 1, len(s.position_counts))
    at = put(body, at, 2, 0)  # reserved (docs/serial-protocol.md)
    for k in range(3):
        at = put(body, at, 4, s.force_un[k])
    for axis in range(len(s.position_counts)):
        at = put(body, at, 4, s.position_counts[axis])
        at = put(body, at, 4, s.current_ua[axis])
        at = put(body, at, 2, s.temperature_cdeg[axis])
        if s.has_velocity:
            at = put(body, at, 4, s.velocity_dcounts_s[axis])
    if s.has_moment:
        for k in range(3):
            at = put(body, at, 4, s.moment_unm[k])
    return at


@compiled
def decode_state(body: np.ndarray, n: int, record: np.ndarray) -> bool:
    """Read a state packet's body, of any type, of as many axes as `record` has; velocities and moments not in
    it are 0."""
    s = record[0]
    # the axes of the rig, not of the packet: another number is another board, and is refused
    n_axes, kind = len(s.position_counts), int(body[1])
    velocity, moment = kind & WITH_VELOCITY != 0, kind & WITH_MOMENT != 0
    # the type tells the length: one byte says which numbers follow, and nothing has to be guessed
    if kind & ~(WITH_VELOCITY | WITH_MOMENT) != TYPE_STATE:
        return False
    end = 28 + (14 if velocity else 10) * n_axes
    if not _is(body, n, kind, end + (12 if moment else 0)) or body[13] != n_axes:
        return False
    s.has_velocity, s.has_moment = 1 if velocity else 0, 1 if moment else 0
    s.sequence, s.time_us, s.status = unsigned(body, 2, 2), unsigned(body, 4, 4), unsigned(body, 8, 2)
    s.command_sequence, s.command_age = unsigned(body, 10, 2), unsigned(body, 12, 1)
    for k in range(3):
        s.force_un[k] = signed(body, 16 + 4 * k, 4)
        s.moment_unm[k] = signed(body, end + 4 * k, 4) if moment else 0
    for axis in range(n_axes):
        at = 28 + (14 if velocity else 10) * axis
        s.position_counts[axis] = signed(body, at, 4)
        s.current_ua[axis] = signed(body, at + 4, 4)
        s.temperature_cdeg[axis] = signed(body, at + 8, 2)
        s.velocity_dcounts_s[axis] = signed(body, at + 10, 4) if velocity else 0
    return True


@compiled
def encode_command(record: np.ndarray, body: np.ndarray) -> int:
    """Write a command packet's body; returns its length, 8 + 4 per axis."""
    c = record[0]
    at = _header(body, TYPE_COMMAND, c.sequence)
    at = put(body, at, 1, (1 if c.enable else 0) | (2 if c.torque_mode else 0))
    at = put(body, at, 1, c.time_to_live)
    at = put(body, at, 1, len(c.value))
    at = put(body, at, 1, 0)
    for axis in range(len(c.value)):
        at = put(body, at, 4, c.value[axis])
    return at


@compiled
def decode_command(body: np.ndarray, n: int, record: np.ndarray) -> bool:
    """Read a command packet's body of as many axes as `record` has."""
    c = record[0]
    n_axes = len(c.value)
    # a time to live of 0 would let go before the next command could come
    if not _is(body, n, TYPE_COMMAND, 8 + 4 * n_axes) or body[6] != n_axes or body[5] == 0:
        return False
    c.sequence, c.time_to_live = unsigned(body, 2, 2), unsigned(body, 5, 1)
    c.enable, c.torque_mode = unsigned(body, 4, 1) & 1, (unsigned(body, 4, 1) >> 1) & 1
    for axis in range(n_axes):
        c.value[axis] = signed(body, 8 + 4 * axis, 4)
    return True


@compiled
def encode_request(kind: int, sequence: int, body: np.ndarray) -> int:
    """Write the body of a stop or identify packet (`kind`); returns its length, 4."""
    return _header(body, kind, sequence)


@compiled
def is_request(kind: int, body: np.ndarray, n: int) -> bool:
    """True for the body of a stop or identify packet (`kind`)."""
    return _is(body, n, kind, 4)


@compiled
def encode_identity(record: np.ndarray, body: np.ndarray) -> int:
    """Write an identity packet's body; returns its length, 28."""
    d = record[0]
    at = _header(body, TYPE_IDENTITY, d.sequence)
    at = put(body, at, 1, d.n_axes)
    at = put(body, at, 1, 0)
    at = put(body, at, 2, d.firmware)
    at = put(body, at, 4, d.cycle_us)
    for k in range(SERIAL_NUMBER_BYTES):
        body[at + k] = d.serial_number[k]
    return at + SERIAL_NUMBER_BYTES


@compiled
def decode_identity(body: np.ndarray, n: int, record: np.ndarray) -> bool:
    """Read an identity packet's body."""
    d = record[0]
    if not _is(body, n, TYPE_IDENTITY, 12 + SERIAL_NUMBER_BYTES):
        return False
    d.sequence, d.n_axes = unsigned(body, 2, 2), unsigned(body, 4, 1)
    d.firmware, d.cycle_us = unsigned(body, 6, 2), unsigned(body, 8, 4)
    for k in range(SERIAL_NUMBER_BYTES):
        d.serial_number[k] = body[12 + k]
    return True
