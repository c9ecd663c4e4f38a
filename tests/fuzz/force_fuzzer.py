"""Fuzzing of the force sensors' decoders: `python tests/fuzz/force_fuzzer.py 10000000 [SEED]` feeds each so
many inputs.

A stream of intact, mutated, cut and made-up frames goes through the stream cutter, the decoder and the
sample. Never allowed: an exception, a frame whose checksum is wrong by a second, independent reckoning, a
force that is no finite number, more kept back than one frame.
"""

from __future__ import annotations

import math
import os
import random
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from hw.force import optoforce, rdt, rokubi
from hw.force.frames import Frames
from hw.force.sample import ForceSample

UNIT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_TABLE = []
for _byte in range(256):
    for _ in range(8):
        _byte = _byte >> 1 ^ (0x8408 if _byte & 1 else 0)
    _TABLE.append(_byte)


def crc_by_table(data: bytes) -> int:
    crc = 0xFFFF
    for byte in data:
        crc = crc >> 8 ^ _TABLE[(crc ^ byte) & 0xFF]
    return crc ^ 0xFFFF


def rokubi_is_right(frame: bytes) -> bool:
    return frame[:1] == b"\xaa" and crc_by_table(frame[1:35]) == int.from_bytes(frame[35:], "little")


def optoforce_is_right(frame: bytes) -> bool:
    total = 0
    for byte in frame[:-2]:
        total = (total + byte) % 65536
    return total == int.from_bytes(frame[-2:], "big")


LAYOUTS = ("3-axis", "6-axis", "4x3-axis")


def _serial(kind):
    if kind == "rokubi":
        return rokubi.HEADER, rokubi.LENGTH, rokubi.intact, rokubi.decode, rokubi_is_right
    layout = kind.removeprefix("optoforce ")
    return (
        optoforce.header(layout),
        optoforce.length(layout),
        optoforce.intact,
        optoforce.decode,
        optoforce_is_right,
    )


KINDS = ("rokubi", *(f"optoforce {layout}" for layout in LAYOUTS), "rdt")


def _good(kind, draw, k):
    if kind == "rokubi":
        force = [draw.choice((draw.uniform(-500, 500), math.nan, math.inf, 0.0)) for _ in range(3)]
        return rokubi.encode(tuple(force), stamp_us=k, status=draw.choice((0, 0, 0, draw.randrange(1 << 16))))
    if kind == "rdt":
        counts = tuple(draw.randrange(-(1 << 31), 1 << 31) for _ in range(3))
        return rdt.encode(k, k, counts, draw.choice((0, draw.randrange(1 << 32))))
    values = [draw.randrange(-32768, 32768) for _ in range(12)]
    layout = kind.removeprefix("optoforce ")
    return optoforce.encode(layout, values, count=k, status=draw.choice((0, 0, draw.randrange(1 << 16))))


def _bent(good, draw):
    """One input: mostly a frame bent in one way."""
    how = draw.randrange(8)
    out = bytearray(good)
    if how == 0:
        return good
    if how <= 3:
        for _ in range(draw.randrange(1, 9)):
            out[draw.randrange(len(out))] ^= 1 << draw.randrange(8)
    elif how == 4:
        for _ in range(draw.randrange(1, 5)):
            out[draw.randrange(len(out))] = draw.randrange(256)
    elif how == 5:
        del out[draw.randrange(len(out)) :]
    elif how == 6:
        out.insert(draw.randrange(len(out)), draw.randrange(256))
    else:
        return draw.randbytes(draw.randrange(1, 2 * len(good)))
    return bytes(out)


def run(kind: str, seed: int, count: int) -> tuple[int, int]:
    """Inputs fed, and frames or records accepted as intact."""
    draw, sample, accepted = random.Random(f"{kind} {seed}"), ForceSample(UNIT), 0
    if kind == "rdt":
        for k in range(count):
            data = _bent(_good(kind, draw, k), draw)
            if len(data) == rdt.LENGTH:
                accepted += 1
                sample.take(rdt.decode(data)[1])
                _require(sample, kind, data)
        return count, accepted
    header, length, intact, decode, right = _serial(kind)
    frames = Frames(header, length, intact)
    for k in range(count):
        data = _bent(_good(kind, draw, k), draw)
        found = frames.newest(data)
        if found is not None:
            accepted += 1
            assert right(found), f"{kind} accepted {found.hex()}, its checksum is wrong"
            sample.take(decode(found))
            _require(sample, kind, found)
        assert len(frames._rest) < length, f"{kind} keeps {len(frames._rest)} bytes back"
    return count, accepted


def _require(sample, kind, data):
    assert all(map(math.isfinite, sample._force)), f"{kind} shows {sample._force} after {data.hex()}"


def main() -> None:
    total = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000_000
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    part = min(100_000, total)
    with ProcessPoolExecutor(os.cpu_count() or 1, get_context("spawn")) as pool:
        for kind in KINDS:
            began, fed, accepted = time.monotonic(), 0, 0
            seeds = range(seed, seed + total // part)
            for inputs, taken in pool.map(run, [kind] * len(seeds), seeds, [part] * len(seeds)):
                fed, accepted = fed + inputs, accepted + taken
            sys.stdout.write(
                f"{kind}: {fed} inputs, {accepted} accepted, none wrong, {time.monotonic() - began:.0f} s\n"
            )
            sys.stdout.flush()


if __name__ == "__main__":
    main()
