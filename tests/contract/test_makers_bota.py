"""Bota Systems' driver and ours: the same commands, and the same numbers out of the same frames
(`makers/make_bota.py`).
"""

import json
from pathlib import Path

import makers_read
import pytest
from makers import random_frames
from makers.random_frames import DAMAGED, sealed

from hw.force import rokubi
from hw.interface import LinkFault

BOTA = json.loads((Path(__file__).parent / "makers" / "bota.json").read_text())
BODIES = {1000 * (k + 1): body for k, (body, _) in enumerate(random_frames.chunk("rokubi", 0))}


def fed(data):
    backend, port, tick = makers_read.serial_force("rokubi", moments=True)
    port.data = data
    backend.read(tick)
    return backend, tick[0]


def test_the_sensor_is_started_and_silenced_as_by_its_maker():
    settings = BOTA["commands"][1:-2]
    assert [rokubi.STOP.decode(), *settings, rokubi.START.decode(), rokubi.STOP.decode()] == BOTA["commands"]
    assert {line[0] for line in settings} == {"c", "f", "s"}, "filter and layout: kept as the sensor has them"


def test_what_the_makers_driver_read_is_what_is_shown():
    assert len(BOTA["read"]) > 100
    for theirs in BOTA["read"]:
        backend, tick = fed(sealed(BODIES[theirs["stamp_us"]]))
        if theirs["status"]:
            assert (tick["sample_count"], tick["link_faults"]) == (0, LinkFault.DEVICE)
            assert backend._sample.status == theirs["status"]
        else:
            assert tick["sample_count"] == 1
            assert [*tick["force_n"], *tick["moment_nm"]] == theirs["six"]


def test_what_the_makers_driver_dropped_is_dropped():
    assert not any(theirs["stamp_us"] & DAMAGED for theirs in BOTA["read"])
    for bit in range(8, 8 * 37):
        frame = bytearray(sealed(BODIES[1000]))
        frame[bit // 8] ^= 1 << bit % 8
        assert fed(bytes(frame))[1]["sample_count"] == 0


def test_its_statuses_are_ours():
    assert {theirs["status"] for theirs in BOTA["read"]} == {0, 1, 2, 4, 8}


@pytest.mark.parametrize("at", range(6))
def test_a_number_that_is_none_is_passed_on_by_their_driver_and_not_by_ours(at):
    body = bytearray(BODIES[1000])
    body[2 + 4 * at : 6 + 4 * at] = b"\x00\x00\xc0\x7f"
    body[:2] = b"\0\0"
    tick = fed(sealed(bytes(body)))[1]
    assert (tick["sample_count"], tick["link_faults"]) == (0, LinkFault.DEVICE)
