"""Frames of the OptoForce (now OnRobot) DAQ on its serial port: pure bytes <-> numbers.

Big endian: header AA 07 08 N, count u16, status u16, forces i16, sum u16 of all bytes before it.

| layout | N | bytes | values |
|---|---|---|---|
| `3-axis` | 0A | 16 | Fx Fy Fz |
| `6-axis` | 10 | 22 | Fx Fy Fz Tx Ty Tz |
| `4x3-axis` | 1C | 34 | Fx Fy Fz of four sensors |

The sum is all the protection the device offers: it shows every single flipped bit, but two flips that cancel
(the same bit, once set and once cleared) pass. The law's range and jump checks are then what is left.

Configuration, 9 bytes: AA 00 32 03, speed (period in ms, 0 stops), filter, zero, sum u16."""

from __future__ import annotations

import struct
from typing import Literal

from hw.force.reading import Reading

Layout = Literal["3-axis", "6-axis", "4x3-axis"]

BAUD = 1_000_000
# the speed byte is a period in whole ms: 333 Hz is 3 ms, 30 Hz is 33 ms
PERIOD_MS: dict[int, int] = {1000: 1, 333: 3, 100: 10, 30: 33, 10: 100}
"""Output rate, Hz -> speed byte."""

FILTER: dict[float, int] = {0: 0, 500: 1, 150: 2, 50: 3, 15: 4, 5: 5, 1.5: 6}
"""Cut-off of the device's filter, Hz (0: none) -> filter byte."""

_VALUES: dict[str, int] = {"3-axis": 3, "6-axis": 6, "4x3-axis": 12}

_SIX = 22
"""Bytes of a frame of the layout that has moments."""

DAQ_ERROR, SENSOR_ERROR, OVERLOAD = 0xE000, 0x1C00, 0x03F0
"""Masks of the status word; below them stands the number of the sensor."""

# the lowest four bits are the number of the sensor, no fault
_UNUSABLE = DAQ_ERROR | SENSOR_ERROR | OVERLOAD


def header(layout: Layout) -> bytes:
    """First four bytes of a frame."""
    # the length byte is part of the header: a frame of another layout is never taken for this one
    return bytes((0xAA, 0x07, 0x08, 2 * _VALUES[layout] + 4))


def length(layout: Layout) -> int:
    """Bytes of a frame."""
    return 2 * _VALUES[layout] + 10


def intact(frame: bytes) -> bool:
    """True when the sum of a whole frame is right."""
    return sum(frame[:-2]) & 0xFFFF == frame[-2] << 8 | frame[-1]


_HEAD = struct.Struct(">4xHH")
_FORCE = struct.Struct(">3h")


def decode(frame: bytes, sensor: int = 0) -> Reading:
    """Counter, unusable status bits, force and moment in counts of an intact frame; `sensor` 0 to 3 of
    `4x3-axis`."""
    count, status = _HEAD.unpack_from(frame)
    fx, fy, fz = _FORCE.unpack_from(frame, 8 + 6 * sensor)
    if len(frame) != _SIX:
        return Reading(count, status & _UNUSABLE, (fx, fy, fz))
    mx, my, mz = _FORCE.unpack_from(frame, 14)
    return Reading(count, status & _UNUSABLE, (fx, fy, fz), (mx, my, mz))


def explain(status: int) -> str:
    """What unusable status bits mean."""
    masks = {"DAQ_ERROR": DAQ_ERROR, "SENSOR_ERROR": SENSOR_ERROR, "OVERLOAD": OVERLOAD}
    return ", ".join(name for name, mask in masks.items() if status & mask) + f" (0x{status:04x})"


def encode(layout: Layout, values: list[int], count: int = 0, status: int = 0) -> bytes:
    """A frame as the device sends it, for simulators and tests. `values` beyond those given are 0."""
    n = _VALUES[layout]
    padded = (values + [0] * n)[:n]
    body = header(layout) + struct.pack(f">HH{n}h", count & 0xFFFF, status, *padded)
    return body + (sum(body) & 0xFFFF).to_bytes(2, "big")


def configure(rate_hz: int, filter_hz: float, *, zero: bool = False) -> bytes:
    """The command that sets output rate (0 stops), filter and hardware zero."""
    speed = PERIOD_MS[rate_hz] if rate_hz else 0
    # no hardware zero: the law tares for itself (docs/safety.md), and a pull that the DAQ had taken for
    # zero would be seen by nobody
    body = bytes((0xAA, 0x00, 0x32, 0x03, speed, FILTER[filter_hz], 0xFF if zero else 0))
    return body + sum(body).to_bytes(2, "big")
