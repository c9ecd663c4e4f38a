"""Frames of Bota Systems' serial force-torque sensors (Rokubi, SensONE, LaxONE): pure bytes <-> numbers.

37 bytes, little endian: 0xAA, status u16, forces 3 x f32 (N), torques 3 x f32 (N m), time stamp u32 (us),
temperature f32 (degC), CRC-16/X-25 of all but the header and itself. Free-running from power-up; `R` returns
to running from the configuration mode, which `C` enters and which is silent."""

from __future__ import annotations

import math
import struct
from enum import IntFlag

from hw.force.checksum import crc16_x25
from hw.force.reading import Reading

HEADER = b"\xaa"
LENGTH = 37
# 37 bytes of 10 bits 1000 times a second are 370 kbit/s: the next usual rate above
BAUD = 460_800
START, STOP = b"R\n", b"C\n"
"""As the maker's driver sends them, with the end of line."""

_FRAME = struct.Struct("<BH6fIfH")
_CRC_OF = slice(1, LENGTH - 2)
# above the 16 bits of the wire: no status of the sensor can say it
_NOT_FINITE = 1 << 16


class Status(IntFlag):
    """Bits of the status word. Any of them makes the sample unusable."""

    LATE = 1  # the sensor's own cycle took too long
    OVERRANGE = 2
    INVALID = 4
    RAW = 8  # not calibrated numbers
    NOT_FINITE = _NOT_FINITE  # ours: a force or moment that is no number, under a right checksum


def intact(frame: bytes) -> bool:
    """True when the checksum of a whole frame is right."""
    return crc16_x25(frame[_CRC_OF]) == frame[-2] | frame[-1] << 8


def decode(frame: bytes) -> Reading:
    """Time stamp in us, status, force in N and moment in N m of an intact frame."""
    _, status, fx, fy, fz, mx, my, mz, stamp, _temperature, _crc = _FRAME.unpack(frame)
    # one sum for six numbers: NaN and infinity survive any sum, and float32 cannot overflow a float64
    if not math.isfinite(fx + fy + fz + mx + my + mz):
        status |= _NOT_FINITE
    return Reading(stamp, status, (fx, fy, fz), (mx, my, mz))


def explain(status: int) -> str:
    """The bits of a status word by name."""
    flags = Status(status & sum(Status))
    return ", ".join(str(flag.name) for flag in Status if flag in flags) or f"0x{status:x}"


def encode(
    force_n: tuple[float, float, float],
    stamp_us: int = 0,
    status: int = 0,
    torque_nm: tuple[float, float, float] = (0.0, 0.0, 0.0),
    temperature_c: float = 25.0,
) -> bytes:
    """A frame as the sensor sends it, for simulators and tests."""
    body = struct.pack("<H6fIf", status, *force_n, *torque_nm, stamp_us & 0xFFFFFFFF, temperature_c)
    return HEADER + body + crc16_x25(body).to_bytes(2, "little")
