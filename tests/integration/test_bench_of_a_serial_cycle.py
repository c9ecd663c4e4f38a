"""The serial rows of `rtctl bench io`: both loops really decode the packets of one board."""

import math
import zlib

import pytest

from hw.simulators import serial_vectors as vectors
from tests.bench import io_serial


def test_all_loops_see_every_packet_and_the_rows_are_figures():
    rows = io_serial.rows(200)  # raises when a packet was missed by either
    assert [row.unit for row in rows] == ["us", "x", "us", "us"]
    assert all(math.isfinite(row.value) for row in rows)


@pytest.mark.parametrize("packet", [packet for _, packet in vectors.vectors()])
def test_the_hand_written_codec_agrees_with_the_published_packets(packet):
    body = io_serial.unstuffed(packet.strip(b"\0"))
    assert zlib.crc32(body[:-4]) == io_serial.SUM.unpack(body[-4:])[0]
    assert io_serial.stuffed(body) == packet.strip(b"\0")
