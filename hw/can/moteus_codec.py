"""moteus over CAN-FD: frames as bytes, and replies as numbers; nothing is sent or remembered here.

Identifier 0x8000 | source << 8 | destination asks for a reply, which has id << 8 | source. A frame is a row
of subframes, padded with 0x50 (mjbots' register protocol). Angles are turns and torques N m of moteus' output
shaft: the motor's own unless rotor_to_output_ratio is set."""

from __future__ import annotations

import math
import struct

from hw.can.bus import EXTENDED
from hw.can.fields import Buffer
from hw.can.load import Traffic, fd_length
from hw.interface import Options

STOPPED, FAULT, POSITION, TIMEOUT = 0, 1, 10, 11
# the first of three registers of 32 bits
SERIAL_NUMBER = 0x120
NOP = 0x50

# read n registers from r on: 11 = one int8, 1F = three float, 1D = one float
QUERY = bytes([0x11, 0x00, 0x1F, 0x01, 0x1D, 0x04, 0x1D, 0x0E, 0x11, 0x0F])
"""Read: mode int8; position, velocity, torque f32; Q current f32; temperature of the power stage (00E; the
motor's, 00A, needs a thermistor and a setting of the drive) f32; fault int8."""

# write: 01 = one int8, 0C = float, its count in the byte behind
COMMAND = bytes([0x01, 0x00, POSITION, 0x0C, 0x08, 0x20])
"""Mode, then eight floats from register 0x20: position, velocity, feed-forward torque, scales of kp and kd,
greatest torque, stop position, watchdog time-out."""
COMMAND_FLOATS = struct.Struct("<8f")

TORQUE_AT = len(COMMAND) + 8
"""Where the feed-forward torque stands among them."""

STOP = bytes([0x01, 0x00, STOPPED])

# by the two bits of type in a subframe's head: int8, int16, int32, float
_SIZES = {0: 1, 1: 2, 2: 4, 3: 4}
_CODES = {0: "b", 1: "<h", 2: "<i", 3: "<f"}

REPLY = struct.Struct("<HbHfffHfHfHb")
REPLY_HEADS = (0x0021, 0x012F, 0x042D, 0x0E2D, 0x0F21)
"""The reply to QUERY as the firmware lays it out, with its subframe heads; another layout is parsed
slowly."""
HEADS_AT, TOLD_AT = (0, 3, 17, 23, 29), (2, 31)
"""Bytes of it: where its heads are; mode and fault."""
_PADDING = bytes([NOP]) * 64
"""What may follow it. Anything else may say something of the same registers, or be damage: that is parsed
slowly, too."""

_REGISTERS = (0x000, 0x001, 0x002, 0x004, 0x00E, 0x00F)


def command_id(node: int, source: int) -> int:
    """Identifier of a frame to `node` (1 to 127) that is to be answered."""
    return (0x8000 | source << 8 | node) | EXTENDED


def reply_ids(node: int, source: int) -> tuple[int, int]:
    """Identifier of the reply, as a standard and as an extended one: firmware may send either."""
    plain = node << 8 | source
    # a standard identifier has 11 bits: from id 8 on it must be an extended one
    return (plain, plain | EXTENDED) if plain <= 0x7FF else (plain | EXTENDED, plain | EXTENDED)


def encode_command(
    buffer: bytearray, offset: int, torque_nm: float, torque_max_nm: float, ttl_s: float
) -> None:
    """Write the floats of a torque command into a frame made from `command_frame`."""
    # moteus reads NaN as "not set": a number for the position would be a place to go to
    nan = math.nan
    # position and stop position "not set"; velocity, kp and kd scale 0
    COMMAND_FLOATS.pack_into(
        buffer, offset + len(COMMAND), nan, 0.0, torque_nm, 0.0, 0.0, torque_max_nm, nan, ttl_s
    )


def command_frame() -> bytes:
    """A torque command of 0 with the query, padded to a CAN-FD length."""
    # command and query in one frame: the answer tells the state of this very command
    whole = COMMAND + bytes(COMMAND_FLOATS.size) + QUERY
    return whole.ljust(fd_length(len(whole)), bytes([NOP]))


def stop_frame() -> bytes:
    """Stop (torque-free, faults cleared) with the query, padded."""
    whole = STOP + QUERY
    return whole.ljust(fd_length(len(whole)), bytes([NOP]))


def parse_reply(data: Buffer) -> dict[int, float] | None:
    """Registers of a reply by number, in native units of their type; None if it is not a whole reply."""
    found: dict[int, float] = {}
    at, end = 0, len(data)
    while at < end:
        head = data[at]
        # FD frames have few lengths: what is left over is filled with these
        if head == NOP:
            at += 1
            continue
        if not 0x20 <= head <= 0x2F or at + 1 >= end:  # replies: two bits of type, two of count
            return None
        at += 1
        kind, count = head >> 2 & 3, head & 3
        if count == 0:  # the count follows in a byte of its own
            count = data[at]
            at += 1
            if count == 0:  # of no registers: nothing follows
                continue
        if at >= end:
            return None
        register, at = data[at], at + 1
        if register & 0x80:  # two bytes of register number
            if at >= end or data[at] & 0x80:
                return None
            register, at = register & 0x7F | data[at] << 7, at + 1
        size = _SIZES[kind]
        if at + size * count > end:
            return None
        for k in range(count):
            found[register + k] = struct.unpack_from(_CODES[kind], data, at + k * size)[0]
        at += size * count
    return found


def decode_reply(
    buffer: Buffer, offset: int, length: int
) -> tuple[int, float, float, float, float, int] | None:
    """Mode, position (turns), velocity (turns/s), Q current (A), temperature (degC), fault; None if any is
    missing.

    A register that reads as integer is taken only where it was asked for as one (mode, fault)."""
    if length >= REPLY.size:
        h0, mode, h1, position, velocity, _, h2, current, h3, temperature, h4, fault = REPLY.unpack_from(
            buffer, offset
        )
        rest = length - REPLY.size
        if (h0, h1, h2, h3, h4) == REPLY_HEADS and (
            buffer[offset + REPLY.size : offset + length] == _PADDING[:rest]
        ):
            return mode, position, velocity, current, temperature, fault
    found = parse_reply(buffer[offset : offset + length])
    if found is None or not all(register in found for register in _REGISTERS):
        return None
    mode, position, velocity, current, temperature, fault = (found[register] for register in _REGISTERS)
    # an integer register is in steps of its own (an int16 turn is 1e-4): taken as a float it would be wrong
    if not all(isinstance(value, float) for value in (position, velocity, current, temperature)):
        return None
    if not (isinstance(mode, int) and isinstance(fault, int)):
        return None
    return mode, position, velocity, current, temperature, fault


def traffic(options: Options, rate_hz: float) -> list[Traffic]:
    """All frames of the drives."""
    frames = []
    for table in options["axis"]:
        name = f"node {table['node']}"
        frames.append(Traffic(f"{name} command", len(command_frame()), rate_hz, extended=True, fd=True))
        frames.append(Traffic(f"{name} reply", fd_length(REPLY.size), rate_hz, extended=True, fd=True))
    return frames
