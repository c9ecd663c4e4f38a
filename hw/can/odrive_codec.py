"""ODrive over CAN Simple: identifiers, frames and words as bytes, and bytes as numbers; nothing is sent or
remembered here.

Identifier = node << 5 | command, little endian, 11 bits. Layouts from ODrive's CAN protocol page and DBC
(firmware 0.6; `hw.can.odrive_firmware` has what 0.5 reads otherwise). Angles are turns of the encoder's
shaft, torques N m at it."""

from __future__ import annotations

import math
import struct

from hw.can.fields import Buffer
from hw.can.load import Traffic
from hw.can.odrive_firmware import ERRORS, ERRORS_05, NAMED_ERRORS, Version
from hw.interface import Options

# command numbers of CAN Simple, the lower five bits of an identifier
HEARTBEAT, GET_VERSION, ADDRESS, SET_AXIS_STATE = 0x01, 0x00, 0x06, 0x07
GET_ENCODER, SET_CONTROLLER_MODE, SET_INPUT_TORQUE = 0x09, 0x0B, 0x0E
GET_IQ, GET_TEMPERATURE, CLEAR_ERRORS = 0x14, 0x15, 0x18
IDLE, CLOSED_LOOP = 1, 8
TORQUE_CONTROL, PASS_THROUGH = 1, 1

PAIR = struct.Struct("<ff")
HEARTBEAT_STRUCT = struct.Struct("<IBBB")
TORQUE = struct.Struct("<f")
WORD = struct.Struct("<I")
TWO_WORDS = struct.Struct("<II")


def can_id(node: int, command: int) -> int:
    """Identifier of a command of a node (0 to 63)."""
    # six bits of node above five of command: 11, a standard identifier
    return node << 5 | command


def error_names(error: int, version: Version = NAMED_ERRORS) -> str:
    """The error bits in the words of that firmware; bits it has no word for as a number."""
    words = ERRORS if version >= NAMED_ERRORS else ERRORS_05
    unnamed = error & ~sum(words)
    names = [name for bit, name in words.items() if error & bit]
    return ", ".join(names + [f"0x{unnamed:x}"] * bool(unnamed))


def decode_pair(buffer: Buffer, offset: int, length: int) -> tuple[float, float] | None:
    """Two finite numbers of a frame of 8 bytes: turns and turns/s, wanted and measured A, FET and motor
    degC."""
    if length != 8:
        return None
    first, second = PAIR.unpack_from(buffer, offset)
    return (first, second) if math.isfinite(first) and math.isfinite(second) else None


def decode_heartbeat(buffer: Buffer, offset: int, length: int) -> tuple[int, int] | None:
    """Axis error bits and axis state; None for a frame too short."""
    # 0.5 and 0.6 fill the rest differently; error and state stand alike in both
    if length < 7:
        return None
    error, state, _, _ = HEARTBEAT_STRUCT.unpack_from(buffer, offset)
    return error, state


def traffic(options: Options, rate_hz: float) -> list[Traffic]:
    """All frames of the drives."""
    frames = []
    for table in options["axis"]:
        name = f"node {table['node']}"
        asked = options["feedback"] == "request"
        feedback_hz = rate_hz if asked else 1000.0 / options["feedback_ms"]
        frames += [
            Traffic(f"{name} torque", 4, rate_hz),
            Traffic(f"{name} encoder estimates", 8, feedback_hz),
            Traffic(f"{name} Iq", 8, feedback_hz),
            Traffic(f"{name} heartbeat", 8, 1000.0 / options["heartbeat_ms"]),
        ]
        if options["temperature_ms"]:
            frames.append(Traffic(f"{name} temperature", 8, 1000.0 / options["temperature_ms"]))
        if asked:
            # a remote frame has no data; its answer is counted as feedback
            frames += [Traffic(f"{name} requests", 0, 2 * rate_hz, remote=True)]
    return frames
