"""Device I/O, each beside what a person would write by hand: `rtctl bench io`. One file per kind of link."""

from __future__ import annotations

from collections.abc import Iterator

from tests.bench import io_can, io_composed, io_serial, io_slcan
from tests.bench.row import Row


def rows(short: float, composed_s: float = 10.0) -> Iterator[Row]:
    """All rows; `short` scales how long is measured (1 is the real thing), the composed rig is watched for
    `composed_s` s.
    """
    yield from io_serial.rows(round(10_000 * short))
    yield from io_can.rows(round(20_000 * short))
    yield from io_slcan.rows(round(10_000 * short))
    yield from io_composed.rows(composed_s)
