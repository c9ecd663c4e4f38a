"""Packets on a byte stream: COBS between zero bytes, little endian, CRC-32 at the end.

A packet is `00 COBS(body CRC) 00`. The leading zero ends whatever a broken transfer left behind, so a
packet is readable after any damage before it. Bodies are at most 250 bytes: COBS then adds exactly one byte.

CRC-32 is the one of IEEE 802.3 and of zlib (reflected polynomial EDB88320, start and final inversion).
Over the lengths used here (up to 1024 bits) any 1 to 4 flipped bits of a packet's body change it."""

from __future__ import annotations

import numpy as np

from hw.jit import compiled

# COBS: up to 254 bytes without a zero need one code byte; 250 leave room below that
BODY_MAX = 250
"""Longest body with its CRC, bytes."""

PACKET_MAX = BODY_MAX + 3
"""Longest packet on the wire: COBS adds one byte, the two delimiters are the others."""


def _crc_table() -> np.ndarray:
    """The 256 remainders of the reflected polynomial."""
    table = []
    for byte in range(256):
        rest = byte
        for _ in range(8):
            rest = (rest >> 1) ^ (0xEDB88320 if rest & 1 else 0)
        table.append(rest)
    return np.array(table, np.uint32)


_TABLE = _crc_table()


@compiled
def crc32(data: np.ndarray, start: int, stop: int) -> int:
    """CRC-32 of `data[start:stop]` (uint8), as `zlib.crc32` gives it."""
    rest = np.uint32(0xFFFFFFFF)
    for i in range(start, stop):
        rest = (rest >> np.uint32(8)) ^ _TABLE[(rest ^ data[i]) & np.uint32(0xFF)]
    return int(np.int64(rest ^ np.uint32(0xFFFFFFFF)))


@compiled
def put(data: np.ndarray, at: int, size: int, value: int) -> int:
    """Write the low `size` bytes of `value`, little endian, at `at`. Returns the place after them."""
    rest = np.int64(value)
    for k in range(size):
        # a negative number is two's complement by itself: the mask cuts its endless ones off
        data[at + k] = np.uint8(rest & 0xFF)
        rest >>= 8
    return at + size


@compiled
def unsigned(data: np.ndarray, at: int, size: int) -> int:
    """Read `size` (1 to 4) bytes at `at`, little endian, without sign."""
    value = np.int64(0)
    for k in range(size):
        value |= np.int64(data[at + k]) << np.int64(8 * k)
    return int(value)


@compiled
def signed(data: np.ndarray, at: int, size: int) -> int:
    """Read `size` (1 to 4) bytes at `at`, little endian, two's complement."""
    value = unsigned(data, at, size)
    if value >> (8 * size - 1):
        # the highest bit of two's complement counts negative
        value -= 1 << (8 * size)
    return value


@compiled
def seal(body: np.ndarray, n: int, packet: np.ndarray) -> int:
    """Append the CRC to `body[:n]` and write the packet; returns its length on the wire.

    `body` needs room for four more bytes, `packet` for `n + 7`; `n` is at most `BODY_MAX - 4`."""
    end = put(body, n, 4, crc32(body, 0, n))
    packet[0] = 0
    # the code byte is written when the distance to the next zero is known
    code_at, at, code = 1, 2, 1
    for i in range(end):
        if body[i] == 0:
            packet[code_at] = np.uint8(code)
            code_at, code = at, 1
            at += 1
        else:
            packet[at] = body[i]
            at += 1
            code += 1
    packet[code_at] = np.uint8(code)
    packet[at] = 0
    return at + 1


@compiled
def unseal(data: np.ndarray, n: int, body: np.ndarray) -> int:
    """Decode what stood between two delimiters, `data[:n]`, into `body`.

    Returns
    -------
    int
        Length of the body without its CRC, or -1 for anything that is not a whole and undamaged packet:
        too short, too long, a zero inside, a COBS code that points beyond the end, a wrong CRC."""
    # bounds first: `body` has room for a packet, not for whatever a line may bring
    if n < 6 or n > BODY_MAX + 1:  # a COBS byte, a body of at least one, four of CRC
        return -1
    i, at = 0, 0
    while i < n:
        code = int(np.int64(data[i]))
        # a code of 0 would never go on; one beyond the end would read old bytes of the buffer
        if code == 0 or i + code > n:
            return -1
        for k in range(i + 1, i + code):
            # the deframer cuts at zeros: one inside cannot come from it, and is no COBS
            if data[k] == 0:
                return -1
            body[at] = data[k]
            at += 1
        i += code
        if i < n:  # a code stands for the zero behind its bytes, but for the last one
            body[at] = 0
            at += 1
    if crc32(body, 0, at - 4) != unsigned(body, at - 4, 4):
        return -1
    return at - 4
