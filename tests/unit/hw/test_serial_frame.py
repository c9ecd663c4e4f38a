"""The codec of `rtctl-frame`: numbers to bytes and back, and every damaged packet refused."""

import math
import struct
import types
import zlib

import numpy as np
import pytest
from frame_packets import CODECS, body_of, numbers, packet_of, unpacked
from hypothesis import given, settings
from hypothesis import strategies as st

from hw.jit import records
from hw.serial import frame
from hw.serial.deframer import deframer_dtype, next_packet
from hw.serial.framing import BODY_MAX, crc32, unseal
from hw.simulators.serial_firmware import request_packet


@settings(deadline=None)  # the first call compiles
@given(st.binary(max_size=300))
def test_the_checksum_is_that_of_zlib(data):
    assert crc32(np.frombuffer(data, np.uint8), 0, len(data)) == zlib.crc32(data)


@settings(deadline=None)
@given(st.binary(min_size=1, max_size=BODY_MAX - 4))
def test_a_packet_gives_its_body_back_and_has_no_zero_inside(payload):
    packet = packet_of(payload)
    assert unpacked(packet) == payload
    assert 0 not in packet[1:-1]
    assert len(packet) == len(payload) + 7


def test_cobs_is_the_published_encoding():
    # Cheshire and Baker, section 3: a zero becomes the distance to the next one
    payload = b"\x11\x22\x00\x33"
    crc = zlib.crc32(payload).to_bytes(4, "little")
    assert 0 not in crc
    assert packet_of(payload) == b"\x00\x03\x11\x22" + b"\x06\x33" + crc + b"\x00"


def cobs(raw):
    """The published encoding, byte by byte, for bodies shorter than 254."""
    return b"".join(bytes([len(run) + 1]) + run for run in raw.split(b"\0"))


def sealed_by_hand(payload, flip=0):
    return cobs(payload + (zlib.crc32(payload) ^ flip).to_bytes(4, "little"))


def length_unsealed(data, n=None):
    return unseal(np.frombuffer(data, np.uint8), len(data) if n is None else n, body_of(600))


def test_what_is_no_packet_is_refused():
    payload = b"abc\0def"
    good = sealed_by_hand(payload)
    assert length_unsealed(good) == len(payload)
    for bit in range(32):
        assert length_unsealed(sealed_by_hand(payload, 1 << bit)) == -1
    for n in range(len(good)):
        assert length_unsealed(good, n) == -1, "the bytes beyond n are somebody else's"
    for n in range(6):
        assert length_unsealed(b"\x01" * n) == -1, "the checksum of nothing is 0, and so are these"
    unstuffed = payload + zlib.crc32(payload).to_bytes(4, "little")
    assert length_unsealed(bytes([len(unstuffed) + 1]) + unstuffed) == -1, "a zero inside"
    longest = bytes(range(1, 255))[: BODY_MAX - 4]
    assert length_unsealed(sealed_by_hand(longest)) == BODY_MAX - 4
    assert length_unsealed(sealed_by_hand(longest + b"x")) == -1


def test_stop_and_identify_are_told_apart():
    stop, identify = (
        unpacked(request_packet(frame.TYPE_STOP)),
        unpacked(request_packet(frame.TYPE_IDENTIFY, 7)),
    )
    for kind, yes, no in ((frame.TYPE_STOP, stop, identify), (frame.TYPE_IDENTIFY, identify, stop)):
        assert frame.is_request(kind, np.frombuffer(yes, np.uint8), 4)
        assert not frame.is_request(kind, np.frombuffer(no, np.uint8), 4)
        assert not frame.is_request(kind, np.frombuffer(yes + b"x", np.uint8), 5)


def test_more_bytes_than_a_packet_has_are_dropped_and_the_next_packet_is_found():
    good = packet_of(b"here I am")
    data = np.frombuffer(b"\0" + b"\x05" * 4000 + good, np.uint8)
    stream = records(np.zeros(1, deframer_dtype()))
    at, length = next_packet(stream, data, 0, len(data))
    assert length == BODY_MAX + 2
    assert unseal(stream[0]["pending"], length, body_of()) == -1
    _, length = next_packet(stream, data, at, len(data))
    body = body_of()
    assert body[: unseal(stream[0]["pending"], length, body)].tobytes() == b"here I am"


@pytest.mark.parametrize("name", CODECS)
@pytest.mark.parametrize("n_axes", [1, 2, 8])
def test_numbers_come_back_as_they_went(name, n_axes):
    dtype, encode, decode = CODECS[name]
    for seed in range(50):
        sent, body = numbers(dtype(n_axes), n_axes, seed), body_of()
        n = encode(sent, body)
        got = records(np.zeros(1, dtype(n_axes)))
        assert decode(body, n, got)
        assert got.tobytes() == sent.tobytes()
        assert not decode(body, n - 1, got)
        assert not decode(body, n + 1, got)


@pytest.mark.parametrize(("seed", "kind"), [(0, 0x01), (1, 0x03), (2, 0x05), (3, 0x07)])
def test_the_bytes_of_a_state_packet_stand_where_the_document_says(seed, kind):
    record = numbers(frame.state_dtype(2), 2, seed)
    body = body_of()
    n = frame.encode_state(record, body)
    s = types.SimpleNamespace(**{name: record[0][name] for name in record.dtype.names})
    wanted = struct.pack(
        "<BBHIHHBBH3i",
        1,
        kind,
        s.sequence,
        s.time_us,
        s.status,
        s.command_sequence,
        s.command_age,
        2,
        0,
        *s.force_un,
    )
    for axis in range(2):
        wanted += struct.pack("<iih", s.position_counts[axis], s.current_ua[axis], s.temperature_cdeg[axis])
        wanted += struct.pack("<i", s.velocity_dcounts_s[axis]) if kind in (0x03, 0x07) else b""
    wanted += struct.pack("<3i", *s.moment_unm) if kind in (0x05, 0x07) else b""
    assert body[:n].tobytes() == wanted


def test_the_bytes_of_a_command_packet_stand_where_the_document_says():
    record = records(np.zeros(1, frame.command_dtype(1)))
    record["sequence"], record["enable"], record["torque_mode"], record["time_to_live"] = 0x1234, 1, 1, 10
    record["value"] = -1_500_000
    body = body_of()
    n = frame.encode_command(record, body)
    assert body[:n].tobytes() == struct.pack("<BBHBBBBi", 1, 0x81, 0x1234, 3, 10, 1, 0, -1_500_000)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_packets_of_another_version_type_or_number_of_axes_are_not_taken(seed):
    record, body = numbers(frame.state_dtype(2), 2, seed), body_of()
    n = frame.encode_state(record, body)
    one, other = records(np.zeros(1, frame.state_dtype(1))), records(np.zeros(1, frame.state_dtype(2)))
    assert not frame.decode_state(body, n, one)
    for at, change in ((0, 1), (1, 1), (1, 2), (1, 4), (1, 8), (13, 1)):
        wrong = body.copy()
        wrong[at] ^= change
        assert not frame.decode_state(wrong, n, other)
    assert not other.tobytes().strip(b"\0")


@settings(deadline=None)
@given(st.floats())
def test_fixed_point_saturates_and_truncates_toward_zero(value):
    got = frame.micro(value)
    if math.isnan(value):
        assert got == 0
        return
    exact = value * 1e6
    assert abs(got) <= min(abs(exact) * (1 + 2e-15), 2**31 - 1)
    assert abs(got) >= min(abs(exact) - 1, 2**31 - 1)
    assert got * value >= 0


@settings(deadline=None)
@given(st.integers(-(2**31) + 1, 2**31 - 1))
def test_what_was_read_goes_back_as_the_same_number(number):
    assert frame.micro(number * 1e-6) == number


@settings(deadline=None)
@given(st.integers(0, 2**31 - 2), st.floats(0.01, 0.99), st.sampled_from([1, -1]))
def test_what_lies_between_two_numbers_is_the_one_nearer_to_zero(number, beyond, sign):
    assert frame.micro(sign * (number + beyond) * 1e-6) == sign * number
