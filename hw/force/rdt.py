"""ATI's Raw Data Transfer over UDP (Net F/T, Axia, OnRobot HEX, Schunk FT): pure bytes <-> numbers.

Big endian. Request, 8 bytes: 0x1234, command u16, number of samples u32 (0: until stopped). Record, 36 bytes:
sequence of the records u32, sequence inside the sensor u32, status u32, Fx Fy Fz Tx Ty Tz i32 in counts."""

from __future__ import annotations

import struct

from hw.force.reading import Reading

# the port of RDT, the first of the dynamic ones (RFC 6335)
PORT = 49152
LENGTH = 36
START_REALTIME, STOP = 2, 0

# network byte order, no padding: `>` packs without gaps, `@` would align
_REQUEST = struct.Struct(">HHI")
_RECORD = struct.Struct(">3I6i")
# bit 31 sums up all others, the monitor's bit 16 among them
_ERROR = 1 << 31
_MONITOR = 1 << 16


def request(command: int, samples: int = 0) -> bytes:
    """A command to the sensor."""
    return _REQUEST.pack(0x1234, command, samples)


def unusable(status: int) -> int:
    """The status bits that make a sample unusable; 0 for a good one.

    A latched monitor condition (bit 16) is a user's alarm and says nothing about the sample; with it alone,
    the summary bit 31 says nothing either. Everything else counts: saturation, broken gauge, busy, supply,
    temperature."""
    # a threshold that a user has set on the sensor's page latches bit 16 until a person resets it;
    # taken for a fault it would stop the rig for what may be an ordinary push
    rest = status & ~_MONITOR
    return 0 if rest == _ERROR and status & _MONITOR else rest


def decode(record: bytes | bytearray | memoryview) -> tuple[int, Reading]:
    """Record number, and a reading in counts marked by the sensor's own sequence. For exactly `LENGTH`
    bytes."""
    # two counters: of the records sent, and of the samples measured. A record that is sent twice has a new
    # number and the old sample
    number, inside, status, fx, fy, fz, mx, my, mz = _RECORD.unpack(record)
    return number, Reading(inside, unusable(status), (fx, fy, fz), (mx, my, mz))


def encode(
    number: int,
    inside: int,
    force: tuple[int, int, int],
    status: int = 0,
    moment: tuple[int, int, int] = (0, 0, 0),
) -> bytes:
    """A record as the sensor sends it, for simulators and tests."""
    return _RECORD.pack(number & 0xFFFFFFFF, inside & 0xFFFFFFFF, status, *force, *moment)


def command_of(datagram: bytes) -> int | None:
    """The command of a request, None for anything else; for simulators."""
    if len(datagram) != _REQUEST.size:
        return None
    magic, command, _samples = _REQUEST.unpack(datagram)
    return int(command) if magic == 0x1234 else None
