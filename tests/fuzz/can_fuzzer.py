"""Random and mutated frames into every CAN decoder: `python tests/fuzz/can_fuzzer.py 10000000` (`make fuzz`).

A decoder must not raise, must not accept a frame with a wrong checksum, and must leave finite values.
"""

import math
import random
import struct
import sys
import time

import numpy as np

from hw.can.board import ReceivedFrame
from hw.can.board_options import ReceivedFrameOptions
from hw.can.cia402 import Cia402Axis
from hw.can.health import BusHealth
from hw.can.moteus import MoteusAxis
from hw.can.odrive import OdriveAxis
from hw.can.sample import Sample
from hw.can.sim_drives import BoardSim
from hw.interface import Rig

_RIG = Rig(1, 1e-3, np.ones(1), np.ones(1), np.ones(1), np.full(1, 4096.0), np.eye(3)[:1])
_AXIS = {
    "node": 1, "direction": 1, "shaft": "motor", "offset_rad": 0.0, "current_max_a": 20.0, "counts_per_turn": 4096.0,
    "rated_torque_nm": 1.0, "rated_current_a": 1.0,
}  # fmt: skip
_OPTIONS = {"feedback": "cyclic", "heartbeat_ms": 10.0, "source": 0, "time_to_live_ms": 10.0}
_MOTEUS = bytes.fromhex("21000a2f010000803e00000000cdcccc3d2d040000c03f2d0e00002042210f00")
_LENGTHS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 8, 8, 12, 16, 20, 24, 32, 32, 48, 64)


def decoders():
    return ("odrive", "moteus", "cia402", "board", "health")


def _axis(kind, seed):
    sample = Sample(1)
    handlers = list(kind(_AXIS, _OPTIONS, _RIG, 0, sample).handlers().values())
    return sample, handlers, seed


def _board():
    table = {
        "id": 1, "counter": {"byte": 4, "bits": 8}, "checksum": {"kind": "crc8_j1850", "byte": 7},
        "field": [
            {"channel": "position", "byte": 0, "bits": 16, "wrap": True, "unit": "count"},
            {"channel": "current", "start_bit": 17, "bits": 13, "type": "int", "unit": "mA"},
            {"channel": "force", "byte": 0, "bits": 32, "type": "float", "unit": "N"},
            {"channel": "fault", "start_bit": 40, "bits": 1},
        ],
    }  # fmt: skip
    sample = Sample(1)
    frame = ReceivedFrame(ReceivedFrameOptions.model_validate(table).model_dump(), _RIG, sample)
    return sample, [frame.handler], bytes(8)


def _subject(name):
    if name == "board":
        return _board()
    if name == "health":
        return (
            Sample(1),
            [lambda buffer, offset, length: BusHealth().error_frame(0x1FF, buffer[offset : offset + length])],
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
    """Feed `count` inputs; raises AssertionError or whatever a decoder raises."""
    sample, handlers, seed = _subject(name)
    for _ in range(count):
        data = _mutated(seed, rng) if rng.random() < 0.6 else rng.randbytes(rng.choice(_LENGTHS))
        padded = rng.choice((0, 8))
        buffer = bytes(padded) + data + bytes(72 - len(data))
        sample.fresh = 0
        rng.choice(handlers)(buffer, padded, len(data))
        if name == "board" and sample.fresh:
            assert len(data) == 8
            assert BoardSim.crc(data[:7]) == data[7], "accepted with a wrong checksum"
        assert math.isfinite(sample.position_rad[0])
        assert math.isfinite(sample.current_a[0])


def main():
    total = int(float(sys.argv[1])) if len(sys.argv) > 1 else 10_000_000
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else time.time_ns() & 0xFFFFFFFF
    sys.stdout.write(f"fuzzing the CAN decoders, seed {seed}\n")
    for name in decoders():
        run(name, total, random.Random(seed))
        sys.stdout.write(f"{name}: {total} inputs, 0 exceptions\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
