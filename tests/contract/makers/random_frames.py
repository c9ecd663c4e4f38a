"""Random replies of each maker's devices, the same ones wherever they are made: valid, flipped, cut, with NaN
and infinities.

`make_readings.py` lets the makers' libraries read them; `test_makers_random.py` lets ours. Needs nothing but
Python.
"""

from __future__ import annotations

import math
import random
import struct

CHUNK = 1000
"""Frames of one digest."""
CHUNKS = 200
"""Of each maker: 200,000 frames in all."""

_FLOATS = (math.nan, math.inf, -math.inf, 0.0, -0.0, 1e-45, 3.4e38, 1.0)


def number(draw: random.Random) -> bytes:
    """A float of four bytes: mostly an ordinary one, else one that is none, or any bits."""
    how = draw.random()
    if how < 0.85:
        return struct.pack("<f", draw.uniform(-100.0, 100.0))
    return struct.pack("<f", draw.choice(_FLOATS)) if how < 0.95 else draw.randbytes(4)


def bent(draw: random.Random, good: bytes, *, resize: bool = True) -> bytes:
    """The frame as it is (one in three), with flipped bits, other bytes, cut, longer, or any bytes in its
    place.
    """
    how, out = draw.randrange(9), bytearray(good)
    if how in (3, 4):
        for _ in range(draw.randrange(1, 5)):
            out[draw.randrange(len(out))] ^= 1 << draw.randrange(8)
    elif how == 5:
        for _ in range(draw.randrange(1, 5)):
            out[draw.randrange(len(out))] = draw.randrange(256)
    elif how == 6 and resize:
        del out[draw.randrange(len(out)) :]
    elif how == 7 and resize:
        out += draw.randbytes(draw.randrange(1, 9))
    elif how == 8:
        return draw.randbytes(draw.randrange(2 * len(good)) if resize else len(good))
    return bytes(out)


def moteus(draw: random.Random, k: int) -> bytes:
    """A reply of at most 64 bytes: registers mode, position, velocity, torque, Q current, temperature, fault
    in some cut.
    """
    mode, fault = (bytes([draw.choice((0, 1, 10, 11, draw.randrange(256)))]) for _ in range(2))
    parts = [
        b"\x21\x00" + mode,
        b"\x2f\x01" + number(draw) + number(draw) + number(draw),
        b"\x2d\x04" + number(draw),
        b"\x2d\x0e" + number(draw),
        b"\x21\x0f" + fault,
    ]
    how = draw.randrange(12)
    if how == 0:
        draw.shuffle(parts)
    elif how == 1:
        parts[1] = b"\x2c\x03\x01" + parts[1][2:]  # their number in a byte of its own
    elif how == 2:
        parts[draw.randrange(5)] = b"\x25\x01" + draw.randbytes(2)  # one as an integer, in place of something
    elif how == 3:
        parts.append(draw.choice(parts[1:4]))  # said twice: the last one counts
    elif how == 4:
        parts.insert(
            draw.randrange(6), draw.choice((b"\x31\x01\x04", b"\x20\x00", b"\x2a\x90\x02" + bytes(8)))
        )
    data = b"".join(parts) + b"\x50" * draw.choice((0, 0, 5))
    return bent(draw, data[:64])[:64]


ODRIVE = ("Get_Encoder_Estimates", "Get_Iq", "Get_Temperature", "Heartbeat")


def odrive(draw: random.Random, k: int) -> tuple[str, bytes]:
    """Which message, and its data of at most 8 bytes."""
    name = draw.choice(ODRIVE)
    data = draw.randbytes(8) if name == "Heartbeat" else number(draw) + number(draw)
    return name, bent(draw, data)[:8]


OPTOFORCE = {"3-axis": 3, "6-axis": 6, "4x3-axis": 12}


def optoforce(draw: random.Random, k: int) -> tuple[str, bytes]:
    """Layout, and a frame of its length; most are not random bytes, which would have no header."""
    layout = draw.choice(tuple(OPTOFORCE))
    n = OPTOFORCE[layout]
    status = draw.choice((0, 0, 0, 1, 0x0200, 0x2000, draw.randrange(1 << 16)))
    values = [draw.randrange(-32768, 32768) for _ in range(n)]
    body = bytes((0xAA, 0x07, 0x08, 2 * n + 4)) + struct.pack(f">HH{n}h", k, status, *values)
    return layout, bent(draw, body + sum(body).to_bytes(2, "big"), resize=False)


def rdt(draw: random.Random, k: int) -> bytes:
    """A record, or a datagram of another length."""
    status = draw.choice((0, 0, 0, 0x10000, 0x8001_0000, 0x8002_0000, draw.randrange(1 << 32)))
    counts = [draw.randrange(-(1 << 31), 1 << 31) for _ in range(6)]
    return bent(draw, struct.pack(">3I6i", k, 7 * k, status, *counts))


DAMAGED = 1 << 31
"""Bit of the time stamp of a rokubi's frames that are sent damaged."""


def sealed(body: bytes) -> bytes:
    """A rokubi's frame: header, body, CRC-16/X-25 by its definition."""
    crc = 0xFFFF
    for byte in body:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
    return b"\xaa" + body + (crc ^ 0xFFFF).to_bytes(2, "little")


def rokubi(draw: random.Random, k: int) -> tuple[bytes, tuple[float, ...]]:
    """The body of an intact frame without header and checksum, and the six numbers in it; all of them
    finite.
    """
    six = tuple(struct.unpack("<f", struct.pack("<f", draw.uniform(-500, 500)))[0] for _ in range(6))
    status = draw.choice((0, 0, 0, 1, 2, 4, 8))
    return struct.pack("<H6fIf", status, *six, 1000 * (k + 1), 25.0), six


def chunk(kind: str, number_of_chunk: int) -> list:
    """The frames of one chunk."""
    draw = random.Random(f"{kind} {number_of_chunk}")  # seeds and draws are the same in every Python
    make = globals()[kind]
    return [make(draw, k) for k in range(CHUNK)]
