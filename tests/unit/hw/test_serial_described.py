"""Frames described in the rig file: checksums, options, plans, resynchronisation, numbers both ways."""

import math
import struct

import numpy as np
import pytest
from described_wire import COUNTS, OPTIONS, Wire, options
from hypothesis import given, settings
from hypothesis import strategies as st

from hw.interface import LinkFault
from hw.jit import compiled
from hw.serial import checksums, link
from hw.serial.layout import seal_frame, sealed_at

DROPPED = LinkFault.DEVICE

CATALOGUED = {
    "sum8": 0xDD,
    "xor8": 0x31,
    "crc8": 0xF4,
    "crc16-ccitt": 0x29B1,
    "crc16-modbus": 0x4B37,
    "crc32": 0xCBF43926,
    "crc16-xmodem": 0x31C3,
}
"""Of the text 123456789."""


@pytest.mark.parametrize("name", checksums.KINDS)
def test_checksums_are_the_catalogued_ones(name):
    data = np.frombuffer(b"..123456789..", np.uint8)
    assert checksums.checksum(checksums.KINDS[name], data, 2, 11) == CATALOGUED[name]


def test_a_part_of_a_cycles_bytes_shows_nothing_yet():
    wire = Wire()
    wire.feed(wire.frame(), link.MORE)
    assert wire.count == 0
    wire.feed(b"")
    assert wire.count == 1


def test_numbers_units_and_signs_of_a_sample():
    wire = Wire()
    wire.counts[:] = -4000
    wire.measured["current_a"], wire.measured["temperature_c"] = -1.25, 31.5
    wire.measured["force_n"] = [1.5, -2.5, 0.005]
    tick = wire.feed(wire.frame())
    assert wire.count == 1
    assert tick["position_rad"][0, 0] == pytest.approx(-4000 * 2 * math.pi / COUNTS)
    assert tick["current_a"][0, 0] == pytest.approx(-1.25)
    assert tick["force_n"][0] == pytest.approx([1.5, -2.5, 0.005])
    assert tick["temperature_c"][0, 0] == pytest.approx(31.5)
    assert (tick["estop"][0], wire.faults) == (0, 0)
    wire.board.estop = wire.board.drive_fault = True
    wire.feed(wire.frame())
    assert (tick["estop"][0], wire.faults) == (1, DROPPED)


UNITS = {
    "counts/s": 2 * math.pi / COUNTS,
    "rad/s": 1.0,
    "deg/s": math.pi / 180,
    "rev/s": 2 * math.pi,
    "rpm": math.pi / 30,
}


@pytest.mark.parametrize("unit", UNITS)
def test_a_velocity_comes_in_its_unit_and_where_there_is_none_the_tick_is_left_alone(unit):
    table = options()
    fields = [field for field in table["sample"]["field"] if field["channel"] != "temperature"]
    (gone,) = (field for field in table["sample"]["field"] if field["channel"] == "temperature")
    speed = {"channel": "velocity", "type": "i16", "offset": gone["offset"], "unit": unit, "scale": -0.5}
    wire = Wire({**table, "sample": {**table["sample"], "field": [*fields, speed]}})
    assert "velocity" in wire.backend.provides
    wire.measured["device_velocity_rad_s"] = 100 * UNITS[unit]
    assert wire.feed(wire.frame())["device_velocity_rad_s"][0, 0] == pytest.approx(100 * UNITS[unit])
    without = Wire()
    without.tick["device_velocity_rad_s"] = 7.0
    assert without.feed(without.frame())["device_velocity_rad_s"][0, 0] == 7.0


@pytest.mark.parametrize("endian", ["little", "big"])
@pytest.mark.parametrize(
    ("kind", "code", "raw"),
    [
        ("u8", "B", 200),
        ("i8", "b", -100),
        ("u16", "H", 60000),
        ("i16", "h", -30000),
        ("u32", "I", 4000000000.0),
        ("i32", "i", -2000000000),
        ("f32", "f", -0.0015),
    ],
)
def test_every_type_is_read_as_struct_writes_it(endian, kind, code, raw):
    field = {"channel": "position", "type": kind, "offset": 2, "unit": "rad", "scale": -0.5, "zero": 10.0}
    sample = {"sync": [1, 2], "length": 10, "endian": endian, "checksum": "crc32", "field": [field]}
    wire = Wire({"port": "/dev/x", "sample": sample, "command": OPTIONS["command"]})
    raw = struct.unpack("f", struct.pack("f", raw))[0] if kind == "f32" else int(raw)
    body = bytes([1, 2]) + struct.pack((">" if endian == "big" else "<") + code, raw)
    body = body.ljust(6, b"\0")
    value = checksums.checksum(checksums.CRC32, np.frombuffer(body, np.uint8), 0, 6)
    wire.feed(body + value.to_bytes(4, endian))
    assert wire.count == 1
    assert wire.tick["position_rad"][0, 0] == pytest.approx((raw - 10.0) * -0.5)


@pytest.mark.parametrize(
    ("kind", "bits", "width"), [("u16", 0, 16), ("i16", 0, 16), ("u16", 14, 14), ("u32", 0, 32)]
)
@pytest.mark.parametrize("step", [100, -100])
def test_a_counter_is_followed_over_its_end(kind, bits, width, step):
    table = options()
    position = next(field for field in table["sample"]["field"] if field["channel"] == "position")
    position |= {"type": kind, "wrap_bits": bits}
    wire, seen = Wire(table), []
    for k in range(1000):
        wire.counts[:] = (k * step) % 2**width
        seen.append(wire.feed(wire.frame())["position_rad"][0, 0])
    assert np.diff(seen) == pytest.approx(np.full(999, step * 2 * math.pi / COUNTS), rel=1e-6)


def test_a_number_that_is_not_finite_is_a_device_fault_and_never_a_sample():
    table = options()
    force = next(field for field in table["sample"]["field"] if field["channel"] == "force")
    table["sample"] |= {"length": 26}
    force |= {"type": "f32", "offset": 20, "scale": 1.0, "unit": "N"}
    wire = Wire(table)
    wire.feed(wire.frame())
    frame = bytearray(wire.frame())
    frame[20:24] = struct.pack("<f", math.nan)
    crc = checksums.checksum(checksums.CRC16_CCITT, np.frombuffer(frame, np.uint8), 2, 24)
    frame[24:26] = crc.to_bytes(2, "little")
    wire.feed(bytes(frame))
    assert (wire.count, wire.faults) == (1, DROPPED)
    assert np.isfinite(wire.tick["force_n"]).all()
    wire.feed(wire.frame())
    assert (wire.count, wire.faults) == (2, 0)


def test_duplicates_and_older_frames_are_refused_by_their_sequence_number():
    wire = Wire()
    older, newest = wire.frame(), wire.frame()
    wire.feed(newest)
    for again in (newest, older):
        wire.feed(again)
        assert (wire.count, wire.faults) == (1, LinkFault.SEQUENCE)


def test_the_sequence_number_may_run_over_its_end():
    wire = Wire()
    wire.board.sequence = 2**16 - 3
    for k in range(6):
        wire.feed(wire.frame())
        assert wire.count == k + 1


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=100), st.integers(1, 40), st.data())
def test_a_frame_is_found_behind_anything_and_in_any_pieces(noise, step, data):
    wire = Wire()
    cut = data.draw(st.integers(0, 21))
    stream = noise + wire.frame()[:cut] + wire.frame() + wire.frame()
    for start in range(0, len(stream), step):
        wire.feed(stream[start : start + step])
    # what precedes may swallow the first frame when its bytes begin like one; never the second
    assert wire.backend.link["sequence"][0] == wire.board.sequence


def test_damage_is_a_checksum_fault_once_per_frame():
    wire = Wire()
    wire.feed(wire.frame())
    bad = bytearray(wire.frame())
    bad[5] ^= 4
    wire.feed(bytes(bad) + wire.frame()[:3])
    assert (wire.count, wire.faults) == (1, LinkFault.CHECKSUM)
    assert wire.backend.counts()["damaged"] == 1


@compiled
def _accepted_with_flips(frame, layout):
    bits, accepted = 8 * len(frame), 0
    for first in range(bits):
        for second in range(first, bits):
            frame[first // 8] ^= np.uint8(1 << (first % 8))
            if second != first:
                frame[second // 8] ^= np.uint8(1 << (second % 8))
            accepted += sealed_at(frame, 0, layout)
            frame[first // 8] ^= np.uint8(1 << (first % 8))
            if second != first:
                frame[second // 8] ^= np.uint8(1 << (second % 8))
    return accepted


@pytest.mark.parametrize("name", ["crc8", "crc16-ccitt", "crc16-modbus", "crc32"])
@pytest.mark.parametrize("which", ["sample", "command"])
def test_every_one_and_two_bit_flip_is_refused(name, which):
    table = options()
    changed = table[which]
    changed["checksum"] = name
    changed["length"] += checksums.SIZE[name] - 2
    if name == "crc8" and which == "sample":  # up to 14 bytes covered
        changed |= {"length": 16, "field": [f for f in changed["field"] if f["offset"] < 14]}
    wire = Wire(table)
    if which == "sample":
        frame, layout = wire.frame(), wire.backend.layout
    else:
        frame, layout = wire.sent(), wire.backend.command_layout
    assert _accepted_with_flips(np.frombuffer(frame, np.uint8).copy(), layout) == 0


@pytest.mark.parametrize(("kind", "first", "counts"), [("u16", 0x8064, 100), ("i16", -0x4001 + 1, 0)])
def test_flags_above_a_narrow_counter_are_no_turns_at_its_first_reading(kind, first, counts):
    field = {"channel": "position", "type": kind, "offset": 4, "unit": "counts", "wrap_bits": 14}
    wire = Wire(options(command=None, sample__field=[field], sample__constant=[]))
    frame = np.frombuffer(wire.frame(), np.uint8).copy()
    frame[4:6] = first & 0xFF, first >> 8 & 0xFF
    seal_frame(frame, wire.backend.layout)
    wire.feed(frame.tobytes())
    assert wire.count == 1
    assert wire.tick["position_rad"][0, 0] == pytest.approx(2 * math.pi * counts / COUNTS)


def test_an_axis_whose_motor_has_no_thermometer_is_not_told_to_be_cold():
    axis = {"channel": "position", "type": "i16", "unit": "counts"}
    fields = [
        {**axis, "offset": 4},
        {**axis, "axis": 1, "offset": 6},
        {"channel": "temperature", "axis": 1, "type": "u8", "offset": 8, "unit": "degC"},
        {"channel": "velocity", "axis": 0, "type": "i16", "offset": 9, "unit": "rad/s"},
    ]
    wire = Wire(options(command=None, sample__field=fields, sample__constant=[]), 2)
    wire.measured["temperature_c"], wire.measured["device_velocity_rad_s"] = 40.0, 2.0
    wire.feed(wire.frame())
    np.testing.assert_array_equal(wire.tick["temperature_c"][0], [np.nan, 40.0])
    np.testing.assert_array_equal(wire.tick["device_velocity_rad_s"][0], [2.0, np.nan])
