"""Frames described in the rig file: checksums, options, plans, resynchronisation, numbers both ways."""

import copy
import math
import struct
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hardware import rig
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from hw.interface import BackendError, LinkFault
from hw.jit import compiled
from hw.serial import checksums, link
from hw.serial.described_backend import DescribedBackend
from hw.serial.described_options import DescribedOptions
from hw.serial.layout import sealed_at
from hw.serial.port import usb_identity
from hw.simulators.serial_described_board import DescribedBoard
from rtctl.control.jit import records
from rtctl.tick import new_ticks

CONFIG = Path(__file__).parents[3] / "configs" / "serial-described.toml"
OPTIONS = tomllib.loads(CONFIG.read_text())["device"][0]["options"]
COUNTS = 160_000.0
DROPPED = LinkFault.DEVICE


def options(**changes):
    """The shipped options; `sample__length=5` changes one of the sample table."""
    out = copy.deepcopy(OPTIONS)
    for path, value in changes.items():
        *tables, key = path.split("__")
        here = out
        for table in tables:
            here = here[table]
        here[key] = value
    return out


class Wire:
    """A described backend that gets its bytes from the test, and the board that makes them."""

    def __init__(self, table=None, n_axes=1):
        valid = DescribedOptions.model_validate(table or options()).model_dump(mode="json")
        self.backend = DescribedBackend(valid, rig(n_axes))
        self.board = DescribedBoard(valid, rig(n_axes), 7)
        self.tick, self.measured = records(new_ticks(1, n_axes)), records(new_ticks(1, n_axes))
        self.counts = np.zeros(n_axes, np.int64)
        self.backend.warm_up(self.tick)

    def frame(self):
        return self.board.state_packet(self.measured, self.counts, 0)

    def feed(self, data, end=link.DRAINED):
        self.backend.chunk[: len(data)] = np.frombuffer(data, np.uint8)
        self.backend.meta[:] = len(data), end
        self.backend._receive()
        return self.tick

    def sent(self):
        return self.backend.packet[: self.backend._send()].tobytes()

    @property
    def count(self):
        return int(self.tick["sample_count"][0])

    @property
    def faults(self):
        return LinkFault(int(self.tick["link_faults"][0]))


@pytest.mark.parametrize("name", checksums.KINDS)
def test_checksums_are_the_catalogued_ones(name):
    data = np.frombuffer(b"..123456789..", np.uint8)
    assert checksums.checksum(checksums.KINDS[name], data, 2, 11) == checksums.CHECK[name]


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


@pytest.mark.parametrize(
    ("value", "wanted"),
    [(0.25, 25_000), (-0.2500099, -25_000), (1e6, 2**23 - 1), (-1e6, -(2**23)), (math.nan, 0)],
)
def test_commands_truncate_toward_zero_saturate_and_never_wrap(value, wanted):
    wire = Wire()
    wire.tick["enabled"], wire.tick["current_command_a"] = 1, value
    frame = wire.sent()
    assert int.from_bytes(frame[5:8], "little", signed=True) == wanted
    assert frame[4] == (0 if math.isnan(value) else 1)
    assert wire.board.take(frame).commands == 1
    assert wire.board.output[0] == pytest.approx(wanted * 1e-5)


def test_a_disabled_tick_sends_zero_and_the_enable_bit_off():
    wire = Wire()
    wire.tick["enabled"], wire.tick["current_command_a"] = 0, 0.25
    assert wire.sent()[4:8] == bytes(4)


def test_the_stop_is_a_disabled_command_unless_bytes_are_given():
    wire = Wire()
    packet = wire.backend._stop_packet()
    wire.tick["enabled"], wire.tick["current_command_a"] = 1, 0.25
    wire.board.take(wire.sent())
    assert wire.board.enabled
    wire.board.take(packet)
    assert not wire.board.enabled
    given = Wire(options(command__stop=[0x21, 0x0D]))
    assert given.backend._stop_packet() == b"!\r" * 3


def test_a_board_without_commands_is_a_sensor():
    table = options()
    del table["command"]
    backend = DescribedBackend(DescribedOptions.model_validate(table).model_dump(mode="json"), rig())
    assert backend.consumes == frozenset()
    assert backend.provides == {"position", "current", "force", "temperature", "estop"}
    backend.stop()


FIELD = {"channel": "position", "type": "i32", "offset": 4, "unit": "counts"}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"sample__length": 20}, r"field 'estop' ends at byte 18; the checksum begins at byte 18"),
        ({"sample__checksum": "md5"}, "checksum"),
        ({"sample__sync": []}, "sync"),
        ({"sample__sync": [256]}, "sync"),
        ({"sample__endian": "middle"}, "endian"),
        ({"sample__checksum_from": 20}, "checksum_from 20"),
        ({"sample__field": [FIELD, {**FIELD, "offset": 8}]}, "is given twice"),
        (
            {"sample__field": [FIELD, {**FIELD, "axis": 1, "offset": 6}]},
            r"field 'position' of axis 1 overlaps .* at byte 6",
        ),
        ({"sample__field": [{**FIELD, "offset": 1}]}, "overlaps sync at byte 1"),
        ({"sample__field": [{**FIELD, "unit": "A"}]}, "unit 'A' of 'position'"),
        ({"sample__field": [{**FIELD, "scale": 0.0}]}, "scale of 'position' is 0"),
        ({"sample__field": [{**FIELD, "wrap_bits": 33}]}, "wrap_bits"),
        ({"sample__field": [{**FIELD, "mask": 1}]}, "mask 0x1 of 'position'"),
        ({"sample__field": [FIELD, {"channel": "estop", "type": "u8", "offset": 10}]}, "mask 0x0 of 'estop'"),
        (
            {"sample__field": [FIELD, {"channel": "sequence", "type": "f32", "offset": 10}]},
            "whole numbers only",
        ),
        ({"sample__tail": [1, 2, 3, 4]}, "field 'estop' ends at byte 18; the checksum begins at byte 16"),
        ({"sample__constant": [{"offset": 4, "bytes": [1]}]}, "overlaps constant at 4"),
        (
            {"command__field": [{"channel": "enable", "type": "u8", "offset": 4, "mask": 1}]},
            "either torque or current_command",
        ),
        ({"command__stop": [1, -1]}, "stop"),
        ({"sample__colour": 1}, "colour"),
    ],
)
def test_bad_descriptions_are_refused_by_key(changes, said):
    with pytest.raises(ValidationError, match=said):
        DescribedOptions.model_validate(options(**changes))


@pytest.mark.parametrize(
    ("changes", "n_axes", "said"),
    [
        ({}, 2, r"position is given for axes \[0\]; each of axes 0 to 1 needs it once"),
        ({"sample__field": [{**FIELD, "axis": 3}]}, 1, "axis 3, the device has axes 0 to 0"),
        ({"baud": 9600}, 1, "baud 9600 is too slow"),
        ({"identity": 3, "sample__field": [FIELD]}, 1, "no field of that channel"),
    ],
)
def test_descriptions_that_do_not_fit_the_rig_are_refused(changes, n_axes, said):
    valid = DescribedOptions.model_validate(options(**changes)).model_dump(mode="json")
    with pytest.raises(BackendError, match=said):
        DescribedBackend(valid, rig(n_axes))


def test_the_usb_identity_is_that_of_the_device_behind_the_port(tmp_path):
    device = tmp_path / "usb1" / "1-1"
    (device / "1-1:1.0" / "ttyUSB9").mkdir(parents=True)
    for name, text in {"idVendor": "0403\n", "idProduct": "6014\n", "serial": "FT123\n"}.items():
        (device / name).write_text(text)
    port = tmp_path / "class" / "ttyUSB9"
    port.mkdir(parents=True)
    (port / "device").symlink_to(device / "1-1:1.0" / "ttyUSB9")
    assert usb_identity("/dev/ttyUSB9", tmp_path / "class") == "0403:6014:FT123"
    assert usb_identity("/dev/ttyS0", tmp_path / "class") is None


def test_a_board_that_tells_that_it_drives_stays_down_once_it_has_let_go():
    table = options()
    fault = next(field for field in table["sample"]["field"] if field["channel"] == "fault")
    free = next(k for k in range(8) if not any(f.get("mask", 0) >> k & 1 for f in table["sample"]["field"]))
    table["sample"]["field"].append({**fault, "channel": "enabled", "mask": 1 << free})
    wire = Wire(table)

    def exchange(enabled):
        wire.tick["enabled"], wire.tick["current_command_a"] = enabled, 0.1 * enabled
        wire.board.take(wire.sent())
        wire.feed(wire.frame())
        return wire.faults

    assert [exchange(on) for on in (0, 1, 1)] == [0, 0, 0]
    wire.board.hold()
    wire.feed(wire.frame())
    assert wire.faults == DROPPED
    assert [exchange(1) for _ in range(50)] == [DROPPED] * 50
    assert wire.board.output[0] == 0.0
    assert [exchange(on) for on in (0, 1, 1)] == [0, 0, 0]
    assert wire.board.output[0] == pytest.approx(0.1)
