"""Random and mutated frames into every CAN decoder: `python tests/fuzz/can_fuzzer.py 10000000 [SEED]`
(`make fuzz`).

A decoder must not raise, must not accept a frame with a wrong checksum (by a second, bit-wise reckoning), and
must leave finite values. `slcan` is the line reader of serial adapters: what it takes for a frame must be one
by a second reading, and every whole line of a frame must be taken. Runs in as many processes as there are
cores.
"""

import math
import os
import random
import re
import struct
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

import numpy as np

from hw.can import slcan
from hw.can.board_backend import ReceivedFrame
from hw.can.board_options import ReceivedFrameOptions
from hw.can.bus import EXTENDED, REMOTE
from hw.can.cia402 import Cia402Axis
from hw.can.health import BusHealth
from hw.can.moteus import MoteusAxis
from hw.can.odrive import OdriveAxis
from hw.can.sample import Sample
from hw.interface import Rig

_RIG = Rig(1, 1e-3, np.ones(1), np.ones(1), np.ones(1), np.full(1, 4096.0), np.eye(3)[:1])
_AXIS = {
    "node": 1, "direction": 1, "shaft": "motor", "offset_rad": 0.0, "current_max_a": 20.0,
    "counts_per_turn": 4096.0,
    "rated_torque_nm": 1.0, "rated_current_a": 1.0, "velocity_units": 4096.0,
}  # fmt: skip
_OPTIONS = {"feedback": "cyclic", "heartbeat_ms": 10.0, "source": 0, "time_to_live_ms": 10.0}
_MOTEUS = bytes.fromhex("21000a2f010000803e00000000cdcccc3d2d040000c03f2d0e00002042210f00")
_LENGTHS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 8, 8, 12, 16, 20, 24, 32, 32, 48, 64)


BOARDS = ("xor8", "sum8", "crc8_j1850", "crc8_autosar")


def decoders():
    return ("odrive", "moteus", "cia402", *(f"board {checksum}" for checksum in BOARDS), "health", "slcan")


def right_checksum(kind, data):
    """The checksums once more, bit by bit."""
    if kind in ("xor8", "sum8"):
        total = 0
        for byte in data:
            total = total ^ byte if kind == "xor8" else (total + byte) % 256
        return total
    polynomial, rest = {"crc8_j1850": 0x1D, "crc8_autosar": 0x2F}[kind], 0xFF
    for bit in (byte >> k & 1 for byte in data for k in range(7, -1, -1)):
        out = rest >> 7 ^ bit
        rest = rest << 1 & 0xFF ^ (polynomial if out else 0)
    return rest ^ 0xFF


def _axis(kind, seed):
    sample = Sample(1)
    handlers = list(kind(_AXIS, _OPTIONS, _RIG, 0, sample).handlers().values())
    return sample, handlers, seed


def _board(checksum):
    table = {
        "id": 1, "counter": {"byte": 4, "bits": 8}, "checksum": {"kind": checksum, "byte": 7},
        "field": [
            {"channel": "position", "byte": 0, "bits": 16, "wrap": True, "unit": "count"},
            {"channel": "current", "start_bit": 17, "bits": 13, "type": "int", "unit": "mA"},
            {"channel": "velocity", "byte": 2, "bits": 16, "type": "int", "unit": "rpm"},
            {"channel": "force", "byte": 0, "bits": 32, "type": "float", "unit": "N"},
            {"channel": "temperature", "start_bit": 40, "bits": 11, "order": "big", "scale": 0.1,
                "unit": "degC"},
            {"channel": "fault", "start_bit": 40, "bits": 1},
        ],
    }  # fmt: skip
    sample = Sample(1)
    frame = ReceivedFrame(ReceivedFrameOptions.model_validate(table).model_dump(), _RIG, sample)
    return sample, [frame.handler], bytes(7) + bytes([right_checksum(checksum, bytes(7))])


def _subject(name):
    if name.startswith("board"):
        return _board(name.split()[1])
    if name == "health":
        health = BusHealth()
        return (
            Sample(1),
            [lambda buffer, offset, length: health.error_frame(0x1FF, buffer[offset : offset + length])],
            b"\0\x30\0\0\0\0\0\0",
        )
    kinds = {
        "odrive": (OdriveAxis, struct.pack("<ff", 1.0, 2.0)),
        "moteus": (MoteusAxis, _MOTEUS),
        "cia402": (Cia402Axis, struct.pack("<Hih", 0x27, 5, 6)),
    }
    return _axis(*kinds[name])


def _mutated(seed, rng):
    data = bytearray(seed)
    for _ in range(rng.randint(1, 4)):
        if data:
            data[rng.randrange(len(data))] = rng.randrange(256)
    return bytes(data[: rng.randint(0, len(data))] if rng.random() < 0.2 else data)


def run(name, count, rng):
    """Feed `count` inputs; raises AssertionError or whatever a decoder raises. Returns how many were
    taken.
    """
    if name == "slcan":
        return run_lines(count, rng)
    sample, handlers, seed = _subject(name)
    checksum, taken = name.removeprefix("board ") if name.startswith("board") else "", 0
    for k in range(count):
        if checksum and rng.random() < 0.3:  # intact but for the bits that follow
            body = rng.randbytes(4) + bytes([k & 0xFF]) + rng.randbytes(2)
            seed = body + bytes([right_checksum(checksum, body)])
        how = rng.random()
        data = (
            seed if how < 0.1 else _mutated(seed, rng) if how < 0.6 else rng.randbytes(rng.choice(_LENGTHS))
        )
        padded = rng.choice((0, 8))
        buffer = bytes(padded) + data + bytes(72 - len(data))
        sample.fresh = 0
        rng.choice(handlers)(buffer, padded, len(data))
        taken += sample.fresh != 0
        if checksum and sample.fresh:
            assert len(data) == 8
            assert right_checksum(checksum, data[:7]) == data[7], "accepted with a wrong checksum"
        assert math.isfinite(sum(sample.values)), list(sample.values)
    return taken


_LINE = re.compile(rb"(?:[tr]([0-7][0-9A-Fa-f]{2})|[TR]([01][0-9A-Fa-f]{7}))([0-8])((?:[0-9A-Fa-f]{2})*)")


def second_reading(line):
    """Identifier with flags and data of a line, by a pattern; None unless it is a frame."""
    for whole in (line, line[:-4]):  # with and without a time stamp, which may be any four letters or digits
        found = _LINE.fullmatch(whole)
        if found is None or not re.fullmatch(rb"[0-9A-Za-z]*", line):
            continue
        remote, length = whole[:1] in b"rR", int(found[3])
        data = bytes.fromhex(found[4].decode())
        if len(data) == (0 if remote else length):
            extended = EXTENDED if found[2] else 0
            return int(found[1] or found[2], 16) | extended | (REMOTE if remote else 0), data
    return None


def run_lines(count, rng):
    """Feed `count` lines, whole and bent, to the slcan reader in pieces of any length."""
    bus = slcan.SlcanBus.__new__(slcan.SlcanBus)
    bus.health, bus._left, taken = BusHealth(), b"", 0
    letters = b"tTrRzZ0123456789abcdefABCDEFxX_ +\x07\xff\r"
    for _ in range(count):
        line = b"%c%03X%d" % (rng.choice(b"ttttr"), rng.randrange(0x800), rng.randrange(9))
        line += rng.randbytes(rng.choice((int(line[-1:]),) * 9 + (3,))).hex().encode()
        if rng.random() < 0.2:
            line = b"T" + b"%08X" % rng.randrange(1 << 29) + line[4:]
        if rng.random() < 0.5:
            line = bytearray(line)
            for _ in range(rng.randint(1, 3)):
                line[rng.randrange(len(line))] = rng.choice(letters)
            line = bytes(line[: rng.randint(0, len(line))] if rng.random() < 0.2 else line)
        found = slcan.parse(line)
        assert found == second_reading(line), line
        taken += found is not None
        bus._handlers = {found[0]: lambda buffer, offset, length: None} if found else {}
        cut = rng.randint(0, len(line))
        bus._take(line[:cut])
        bus._take(line[cut:] + b"\r")
        assert len(bus._left) <= slcan._LONGEST, len(bus._left)
    return taken


def _part(name, count, seed):
    return run(name, count, random.Random(f"{name} {seed}"))


def main():
    total = int(float(sys.argv[1])) if len(sys.argv) > 1 else 10_000_000
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else time.time_ns() & 0xFFFFFFFF
    part = min(100_000, total)
    sys.stdout.write(f"fuzzing the CAN decoders, seed {seed}\n")
    with ProcessPoolExecutor(os.cpu_count() or 1, get_context("spawn")) as pool:
        for name in decoders():
            began, parts = time.monotonic(), total // part
            taken = sum(pool.map(partial(_part, name, part), range(seed, seed + parts)))
            sys.stdout.write(
                f"{name}: {parts * part} inputs, {taken} taken, none wrong, {time.monotonic() - began:.0f} "
                "s\n"
            )
            sys.stdout.flush()


if __name__ == "__main__":
    main()
