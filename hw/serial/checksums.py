"""Checksums that boards use, compiled.

| kind | polynomial | start | reflected | end inversion | detects every 1- and 2-bit flip |
|---|---|---|---|---|---|
| sum8 | sum of bytes | 0 | | | 1 bit only |
| xor8 | exclusive or of bytes | 0 | | | 1 bit only |
| crc8 (SMBUS) | 07 | 00 | no | no | up to 14 bytes covered |
| crc16-ccitt (IBM-3740, "false") | 1021 | FFFF | no | no | any frame |
| crc16-xmodem | 1021 | 0000 | no | no | any frame |
| crc16-modbus | 8005 | FFFF | yes | no | any frame |
| crc32 (IEEE 802.3, zlib) | 04C11DB7 | FFFFFFFF | yes | yes | any frame |"""

from __future__ import annotations

import numpy as np

from hw.jit import compiled
from hw.serial.framing import crc32

SUM8, XOR8, CRC8, CRC16_CCITT, CRC16_MODBUS, CRC32, CRC16_XMODEM = range(7)

KINDS = {
    "sum8": SUM8,
    "xor8": XOR8,
    "crc8": CRC8,
    "crc16-ccitt": CRC16_CCITT,
    "crc16-modbus": CRC16_MODBUS,
    "crc32": CRC32,
    "crc16-xmodem": CRC16_XMODEM,
}

SIZE = {"sum8": 1, "xor8": 1, "crc8": 1, "crc16-ccitt": 2, "crc16-modbus": 2, "crc32": 4, "crc16-xmodem": 2}
"""Bytes of each on the wire."""


def _forward(polynomial: int, width: int) -> np.ndarray:
    """Remainders of all bytes, highest bit first."""
    table, top, mask = [], 1 << (width - 1), (1 << width) - 1
    for byte in range(256):
        rest = byte << (width - 8)
        for _ in range(8):
            rest = ((rest << 1) ^ (polynomial if rest & top else 0)) & mask
        table.append(rest)
    return np.array(table, np.int64)


def _reflected(polynomial: int) -> np.ndarray:
    """Remainders of all bytes, lowest bit first; `polynomial` is given reflected."""
    table = []
    for byte in range(256):
        rest = byte
        for _ in range(8):
            rest = (rest >> 1) ^ (polynomial if rest & 1 else 0)
        table.append(rest)
    return np.array(table, np.int64)


_CRC8 = _forward(0x07, 8)
_CCITT = _forward(0x1021, 16)
_MODBUS = _reflected(0xA001)  # 8005, its bits reversed


@compiled
def checksum(kind: int, data: np.ndarray, start: int, stop: int) -> int:
    """Checksum `kind` (one of `KINDS`' numbers) of `data[start:stop]` (uint8)."""
    if kind == CRC32:
        return crc32(data, start, stop)
    # a start of ones makes leading zeros count: with 0 a frame that lost its first zero bytes would pass
    rest = np.int64(0xFFFF if kind in (CRC16_CCITT, CRC16_MODBUS) else 0)
    for i in range(start, stop):
        byte = np.int64(data[i])
        if kind == SUM8:
            rest = (rest + byte) & 0xFF
        elif kind == XOR8:
            rest ^= byte
        elif kind == CRC8:
            # eight bits shift out whole: the table holds what is left
            rest = _CRC8[rest ^ byte]
        elif kind in (CRC16_CCITT, CRC16_XMODEM):
            # highest bit first: the byte meets the upper half
            rest = ((rest << 8) & 0xFFFF) ^ _CCITT[(rest >> 8) ^ byte]
        else:
            # lowest bit first: the byte meets the lower half
            rest = (rest >> 8) ^ _MODBUS[(rest ^ byte) & 0xFF]
    return int(rest)
