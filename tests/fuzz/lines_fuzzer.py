"""Random, cut and bent lines of text into the backend that reads boards which print: `python
tests/fuzz/lines_fuzzer.py 10000000 [SEED]`.

Each goes in whole or in pieces, through the reader that the loop calls. Never allowed: an exception, a number
that is none shown as fresh, a sample out of a line that a second reading does not take, other numbers than it
has.
"""

import math
import random
import re
import sys

import numpy as np

from hw.interface import Rig
from hw.serial import link
from hw.serial.lines_backend import LinesBackend
from hw.serial.lines_options import LinesOptions
from rtctl.control.jit import records
from rtctl.tick import new_ticks

RIG = Rig(1, 1e-3, np.ones(1), np.ones(1), np.ones(1), np.full(1, 4096.0), np.eye(3)[:1])
_FIELDS = [
    {"channel": "position", "column": 0, "unit": "rad", "decimals": 4},
    {"channel": "current", "column": 1, "unit": "mA"},
    *({"channel": "force", "component": k, "column": 2 + k, "unit": "N"} for k in range(3)),
]
KINDS = ("none", "nmea")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)
_WORDS = ("nan", "-inf", "ovf", "1e999", "", "--1", "1_0", "0x1", "1e-320", "12345678901234567890.0")
_LETTERS = b"0123456789.,+-eE*$ \t\x00\xff\x80naif"


def backend(checksum):
    """The backend, and its tick."""
    sample = {"prefix": "$R,", "columns": 5, "checksum": checksum, "field": _FIELDS}
    valid = LinesOptions.model_validate({"port": "/dev/x", "sample": sample}, context={"rate_hz": 1000.0})
    made, tick = LinesBackend(valid.model_dump(mode="json"), RIG), records(new_ticks(1, 1))
    made.warm_up(tick)
    return made, tick


def exclusive_or(text):
    total = 0
    for byte in text:
        total ^= byte
    return total


def second_reading(line, checksum):
    """SI values of a line, by another way; None unless it is one."""
    if checksum == "nmea":
        found = re.fullmatch(rb"\$(.*)\*([0-9A-Fa-f]{2})", line, re.DOTALL)
        if found is None or exclusive_or(found[1]) != int(found[2], 16):
            return None
        line = b"$" + found[1]
    if len(line) > 250 or not line.startswith(b"$R,"):
        return None
    cells = [cell.strip(" \t") for cell in line.decode("latin-1")[3:].split(",")]
    if len(cells) != 5 or not all(map(_NUMBER.fullmatch, cells)):
        return None
    if not re.search(r"\.\d{4}([eE]|$)", cells[0]):
        return None
    numbers = [float(cell) for cell in cells]
    if not all(map(math.isfinite, numbers)):
        return None
    return [numbers[0], 1e-3 * numbers[1], *numbers[2:]]


def _line(draw, checksum):
    cells = [f"{draw.uniform(-9, 9):.4f}", *(repr(draw.uniform(-500, 500)) for _ in range(4))]
    if draw.random() < 0.2:
        cells[draw.randrange(5)] = draw.choice(_WORDS)
    line = b"$R," + ",".join(cells).encode()
    if draw.random() < 0.1:
        line = draw.randbytes(draw.randrange(300))
    if checksum == "nmea":
        line += b"*%02X" % exclusive_or(line[1:])
    if draw.random() < 0.5:
        return line
    bent = bytearray(line or b"1")
    for _ in range(draw.randrange(1, 4)):
        at, how = draw.randrange(len(bent)), draw.randrange(4)
        if how == 0:
            bent[at] ^= 1 << draw.randrange(8)
        elif how == 1:
            bent[at] = draw.choice(_LETTERS)
        elif how == 2 and len(bent) > 1:
            del bent[at]
        else:
            bent.insert(at, draw.choice(_LETTERS))
    return bytes(bent[: draw.randrange(len(bent)) + 1] if draw.random() < 0.2 else bent)


def run(checksum, count, draw):
    """Feed `count` lines; how many were samples."""
    made, tick = backend(checksum)
    row = tick[0]

    def _feed(data):
        made.chunk[: len(data)] = np.frombuffer(data, np.uint8)
        made.meta[:] = len(data), link.DRAINED
        made._receive()

    _feed(b"\n")
    for _ in range(count):
        line = re.sub(rb"[\r\n]", b"", _line(draw, checksum))
        before, cut = int(row["sample_count"]), draw.randrange(len(line) + 1)
        if cut < len(line) and draw.random() < 0.3:
            _feed(line[:cut])
            assert row["sample_count"] == before, line
            _feed(line[cut:] + b"\n")
        else:
            _feed(line + b"\n")
        wanted = second_reading(line, checksum)
        assert int(row["sample_count"]) - before == (wanted is not None), line
        shown = [*row["position_rad"], *row["current_a"], *row["force_n"]]
        assert all(map(math.isfinite, shown)), line
        assert wanted is None or shown == wanted, line
    return int(row["sample_count"])


if __name__ == "__main__":
    total, seed = int(float(sys.argv[1])), sys.argv[2] if len(sys.argv) > 2 else "1"
    for kind in KINDS:
        sys.stdout.write(
            f"lines, checksum {kind}: {total} fed, {run(kind, total, random.Random(seed))} taken, none "
            "wrong\n"
        )
