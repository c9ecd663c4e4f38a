"""A board of another make that misbehaves, judged from outside: late, in pieces, among noise, twice, not at
all.

Nothing here is rtctl's own codec: packets are made and read by docs/serial-protocol.md alone, with zlib and
struct. Only what was whole, intact and newer on the wire may be shown as fresh; and no command that asks for
torque may leave when a torque is no number.
"""

import math
import os
import random
import struct
import zlib

import pytest
from patience import until
from serial_line import SerialLine, waiting

from hw.interface import LinkFault
from tests.bench.device_cycle import DeviceCycle

COUNTS, CYCLES = 4096.0, 400
NO_NUMBERS = (math.nan, math.inf, -math.inf)


def stuffed(body):
    body += struct.pack("<I", zlib.crc32(body))
    return b"\0" + b"".join(bytes([len(run) + 1]) + run for run in body.split(b"\0")) + b"\0"


def unstuffed(packet):
    """Body of what stood between two zeros; None where its sum is wrong or its runs lead nowhere."""
    runs, at = [], 0
    while at < len(packet):
        if at + packet[at] > len(packet):
            return None
        runs.append(packet[at + 1 : at + packet[at]])
        at += packet[at]
    body = b"\0".join(runs)
    whole = len(body) >= 8 and struct.unpack("<I", body[-4:])[0] == zlib.crc32(body[:-4])
    return body[:-4] if whole else None


def sample(k):
    """State packet number `k`: its count says which."""
    head = struct.pack("<BBHIHHBBH3i", 1, 1, k & 0xFFFF, 1000 * k & 0xFFFFFFFF, 0, 0, 0, 1, 0, 0, 0, 0)
    return stuffed(head + struct.pack("<iih", 37 * k, 0, 0))


class Oracle:
    """What a host may know of the bytes that have arrived."""

    def __init__(self):
        self.left, self.synced, self.newest, self.fresh = b"", False, 0, 0

    def hear(self, data):
        """What one read brings; returns (fresh, damaged, older)."""
        *parts, self.left = (self.left + data).split(b"\0")
        if parts and not self.synced:
            self.synced, parts = True, parts[1:]
        fresh = damaged = older = False
        for part in filter(None, parts):
            body = unstuffed(part)
            if body is None:
                damaged = True
            elif (k := struct.unpack_from("<H", body, 2)[0]) > self.newest:
                self.newest, fresh = k, True
            else:
                older = True
        self.fresh += fresh
        return fresh, damaged, older


class Adversary:
    """What is on the wire in each cycle."""

    def __init__(self, seed):
        self.draw, self.k, self.held = random.Random(seed), 0, b""

    def next(self):
        self.k += 1
        packet, draw = sample(self.k), self.draw
        kind = draw.choice(
            ("whole",) * 6 + ("late", "pieces", "noise", "torn", "twice", "old", "two", "silent", "flip")
        )
        held, self.held = self.held, b""
        if kind == "late":
            self.held = packet
            return held
        if kind == "pieces":
            at = draw.randrange(1, len(packet))
            self.held = packet[at:]
            return held + packet[:at]
        if kind == "noise":
            return held + draw.randbytes(draw.randrange(1, 40)) + packet
        if kind == "torn":
            return held + packet[: draw.randrange(1, len(packet) - 1)]
        if kind == "flip":
            at = draw.randrange(len(packet))
            return held + packet[:at] + bytes([packet[at] ^ 1 << draw.randrange(8)]) + packet[at + 1 :]
        old = sample(max(self.k - draw.randrange(1, 5), 1))
        return held + {
            "twice": 2 * packet,
            "old": old,
            "two": sample(self.k - 1) + packet,
            "silent": b"",
        }.get(kind, packet)


class Wire(SerialLine):
    """A line whose other end hears commands."""

    def command(self):
        """What has come to the board since it was last asked: (enable bits, value) of the only packet."""
        until(lambda: waiting(self.far), "a command")
        (packet,) = filter(None, os.read(self.far, 4096).split(b"\0"))
        body = unstuffed(packet)
        assert body[:2] == b"\x01\x81"
        return body[4], struct.unpack_from("<i", body, 8)[0]


@pytest.mark.compiled
@pytest.mark.parametrize("whole", [True, False], ids=["compiled", "Python"])
def test_only_what_was_whole_and_newer_is_fresh_and_no_torque_that_is_no_number_leaves(whole):
    wire, board, oracle, draw = Wire(COUNTS), Adversary(26), Oracle(), random.Random(7)
    tick = wire.tick
    cycle = DeviceCycle(wire.backend, tick)
    try:
        for k in range(1, CYCLES):
            data = board.next()
            if data:
                wire.arrive(data)
            torque = draw.choice(NO_NUMBERS) if k % 9 == 0 else draw.uniform(-1.0, 1.0)
            tick["tick"], tick["enabled"], tick["current_command_a"] = k, 1, torque
            if whole:
                cycle.run()
            else:
                wire.backend.read(tick)
                wire.backend.write(tick)
            fresh, damaged, older = oracle.hear(data)
            assert int(tick["sample_count"][0]) == oracle.fresh, f"cycle {k}"
            wanted = 37 * oracle.newest * 2 * math.pi / COUNTS
            assert float(tick["position_rad"][0, 0]) == pytest.approx(wanted, abs=1e-9)
            faults = 0 if fresh else LinkFault.CHECKSUM if damaged else LinkFault.SEQUENCE if older else 0
            assert int(tick["link_faults"][0]) == faults, f"cycle {k}"
            enable, value = wire.command()
            assert enable & 1 == math.isfinite(torque)
            assert value == (math.trunc(torque * 1e6) if math.isfinite(torque) else 0)
        assert not cycle.left, "ordinary cycles, all of them"
    finally:
        wire.close()
    assert 0.5 * CYCLES < oracle.fresh < 0.95 * CYCLES
